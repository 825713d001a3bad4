# SPDX-License-Identifier: MIT
"""The parts of the README that come from the results: the table between two marks, and the pictures."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from conformance.atomic import write_atomically
from conformance.judging.verdict import Judgement, Verdict
from conformance.pages.report import chromium
from conformance.pages.report.evidence import rounded_up
from conformance.pages.report.gallery import publish
from conformance.pages.report.page import PAGE
from conformance.programs.ports import ROOT, SIX, Port
from conformance.theory.lesson import LESSON

README = ROOT / "README.md"
PICTURE = ROOT / "docs" / "tracking.png"
OF_THE_PAGE = ROOT / "docs" / "page.png"
SCREEN, DENSITY = (1200, 900), 1.5  # px of the page's picture, and of the picture's points per pixel
STEADY = (
    "--no-sandbox",
    "--hide-scrollbars",
    "--font-render-hinting=none",
    "--disable-lcd-text",
    "--force-color-profile=srgb",
)
DRAWN_BY = "python"  # whose figure is the picture
BEGIN, END = "<!-- results, written by make readme -->", "<!-- end of results -->"
HEAD = ("port", "engine that ran", "verdict", *(f"error of {state}, at most" for state in LESSON.names))


def write_readme(judgement: Judgement, ports: Mapping[str, Port]) -> bool:
    """Bring table and pictures up to date; whether there is a Chromium, without which the page's picture stays.

    Raises ValueError where a mark is missing, or what the page embeds is not installed, OSError without the figure.
    """
    text, browser = README.read_text(encoding="utf-8"), chromium()
    write_atomically(README, with_table(text, table(judgement.verdicts)))
    shutil.copyfile(figure(ports), PICTURE)
    if browser:
        publish(ports, judgement)
        write_atomically(OF_THE_PAGE, photograph(PAGE, browser))
    return browser is not None


def photograph(page: Path, browser: str) -> bytes:
    """The first screen of a page as PNG, light and without motion; fonts are the page's own."""
    from playwright.sync_api import sync_playwright

    width, height = SCREEN
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=browser, args=[*STEADY])
        context = launched.new_context(
            viewport={"width": width, "height": height},
            device_scale_factor=DENSITY,
            color_scheme="light",
            reduced_motion="reduce",
        )
        shown = context.new_page()
        shown.goto(page.as_uri())
        shown.evaluate("document.fonts.ready")
        end = shown.locator("body > header").evaluate("(header) => header.getBoundingClientRect().bottom + 24")
        taken: bytes = shown.screenshot(clip={"x": 0, "y": 0, "width": width, "height": end})
        launched.close()
    return taken


def figure(ports: Mapping[str, Port]) -> str:
    """The figure that the picture is a copy of."""
    port = ports[DRAWN_BY]
    return str(port.build / port.products[0])


def between_marks(text: str) -> str:
    """The part of the README that the table stands in; raises ValueError unless each mark stands once."""
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise ValueError(f"{README.name}: expected the marks {BEGIN} and {END}, once each")
    return text.partition(BEGIN)[2].partition(END)[0]


def with_table(text: str, results: str) -> str:
    """The README with another table."""
    old = between_marks(text)
    return text.replace(f"{BEGIN}{old}{END}", f"{BEGIN}{results}{END}")


def table(verdicts: Sequence[Verdict]) -> str:
    """The results of the six in Markdown; errors are rounded up to one digit."""
    rows = [HEAD, ("---",) * len(HEAD), *(row(verdict) for verdict in verdicts if verdict.name in SIX)]
    return "".join(["\n", *(f"| {' | '.join(cells)} |\n" for cells in rows)])


def row(verdict: Verdict) -> tuple[str, ...]:
    """The table's cells for one port."""
    errors = [rounded_up(result.figure) for result in verdict.errors.values()]
    return (verdict.name, verdict.engine, verdict.status, *(errors or [""] * len(LESSON.names)))


def outdated(written: str, now: str) -> list[str]:
    """The rows of a table that are no longer so; another engine or version than is named may well differ."""
    rows, new = ({cells[0]: cells for cells in map(_cells, part.strip().splitlines())} for part in (written, now))
    if rows.keys() != new.keys() or rows[HEAD[0]] != new[HEAD[0]]:
        return [f"found the rows {' '.join(rows)}, expected {' '.join(new)}"]
    return [
        f"found {' | '.join(rows[name])}, expected {' | '.join(cells)}"
        for name, cells in new.items()
        if cells[1] == rows[name][1] and cells != rows[name]
    ]


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("| ").split("|")]
