# SPDX-License-Identifier: MIT
"""The parts of the README that come from the results: the table between two marks, and the picture."""

import shutil
from collections.abc import Mapping, Sequence
from decimal import ROUND_UP, Context

from conformance.atomic import write_atomically
from conformance.judging.checks import Result
from conformance.judging.verdict import Judgement, Verdict
from conformance.programs.ports import ROOT, SIX, Port
from conformance.theory.lesson import LESSON

README = ROOT / "README.md"
PICTURE = ROOT / "docs" / "tracking.png"
DRAWN_BY = "python"  # whose figure is the picture
BEGIN, END = "<!-- results, written by make readme -->", "<!-- end of results -->"
HEAD = ("port", "engine that ran", "verdict", *(f"error of {state}, at most" for state in LESSON.names))


def write_readme(judgement: Judgement, ports: Mapping[str, Port]) -> None:
    """Bring table and picture up to date; raises ValueError where a mark is missing, OSError without the figure."""
    text = README.read_text(encoding="utf-8")
    write_atomically(README, with_table(text, table(judgement.verdicts)))
    shutil.copyfile(figure(ports), PICTURE)


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
    errors = [rounded_up(result) for result in verdict.errors.values()]
    return (verdict.name, verdict.engine, verdict.status, *(errors or [""] * len(LESSON.names)))


def rounded_up(result: Result) -> str:
    """A figure to one significant digit, not below what it is."""
    return f"{Context(prec=1, rounding=ROUND_UP).create_decimal(repr(float(result.figure))):.0e}"


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
