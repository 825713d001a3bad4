# SPDX-License-Identifier: MIT
"""The README's table and picture are those of the results; its commands, and those of CONTRIBUTING, can be typed."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from conformance.__main__ import parser
from conformance.judging.verdict import Verdict, judge_all
from conformance.pages.readme import (
    BEGIN,
    DRAWN_BY,
    END,
    OF_THE_PAGE,
    PICTURE,
    README,
    between_marks,
    figure,
    outdated,
    photograph,
    table,
    with_table,
)
from conformance.pages.report import chromium
from conformance.pages.report.evidence import rounded_up
from conformance.programs.ports import ROOT, SIX
from conformance.tests.under_test import PORTS
from conformance.theory.lesson import LESSON

BLOCK = 4  # points, of a browser's picture
SAME = 0.005  # mean difference of two pictures, of 1, that another rendering of the same text may make


def difference(one: Path | str, other: Path | str, block: int = 1) -> float:
    """The mean difference of two pictures' points, 1 where their sizes differ by a block of so many points or more.

    Blocks are compared by their means, to which it makes little how a machine smooths its letters.
    """
    from matplotlib.image import imread

    a, b = (imread(path)[..., :3] for path in (one, other))
    if np.abs(np.subtract(a.shape, b.shape)).max() >= block:
        return 1.0
    rows, columns = (min(sizes) // block for sizes in zip(a.shape[:2], b.shape[:2], strict=True))
    means = [
        x[: rows * block, : columns * block].reshape(rows, block, columns, block, 3).mean(axis=(1, 3)) for x in (a, b)
    ]
    return float(np.abs(means[0] - means[1]).mean())


def test_table_is_up_to_date() -> None:
    verdicts = judge_all(PORTS, LESSON).verdicts
    left_out = {verdict.name for verdict in verdicts if verdict.status == "left out"}
    found = outdated(between_marks(README.read_text()), table(verdicts))
    assert [row for row in found if row.split()[1] not in left_out] == [], "type: make readme"


@pytest.mark.skipif(DRAWN_BY not in PORTS, reason=f"PORTS leaves out {DRAWN_BY}")
def test_picture_is_up_to_date() -> None:
    assert difference(PICTURE, figure(PORTS)) < SAME, "type: make readme"


@pytest.mark.beyond
@pytest.mark.skipif(chromium() is None, reason="there is no Chromium here; Debian's package is chromium")
@pytest.mark.skipif(len(PORTS) < len(SIX), reason="PORTS leaves out some")
def test_picture_of_the_page_is_up_to_date(report: Path, tmp_path: Path) -> None:
    (tmp_path / "page.png").write_bytes(photograph(report, chromium() or ""))
    assert difference(OF_THE_PAGE, tmp_path / "page.png", BLOCK) < SAME, "type: make readme"


def test_another_picture_is_refused(tmp_path: Path) -> None:
    from matplotlib.image import imread, imsave

    shifted = np.roll(imread(PICTURE), 3, axis=0)
    imsave(tmp_path / "shifted.png", shifted)
    assert difference(PICTURE, tmp_path / "shifted.png") > SAME


@pytest.mark.parametrize(
    ("now", "count"),
    [
        ("| a | e1 | pass | 1e-09 |", 0),
        ("| a | e2 | pass | 2e-09 |", 0),
        ("| a | e1 | pass | 2e-09 |", 1),
        ("| a | e1 | fail | 1e-09 |", 1),
        ("| b | e1 | pass | 1e-09 |", 1),
    ],
)
def test_row_that_is_no_longer_so_is_told(now: str, count: int) -> None:
    head = "| port | engine |\n"
    assert len(outdated(head + "| a | e1 | pass | 1e-09 |\n", head + now + "\n")) == count


def test_table_replaces_the_one_before_and_nothing_else() -> None:
    once = with_table(f"a\n\n{BEGIN}\n{END}\nb\n", "\ntable\n")
    assert once == with_table(once, "\ntable\n") == f"a\n\n{BEGIN}\ntable\n{END}\nb\n"


@pytest.mark.parametrize("text", ["", BEGIN, END + BEGIN, BEGIN + BEGIN + END])
def test_readme_without_its_marks_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected the marks"):
        between_marks(text)


@pytest.mark.parametrize(("figure", "text"), [(3.01e-9, "4e-9"), (3e-9, "3e-9"), (9.5e-10, "1e-9")])
def test_errors_are_rounded_up(figure: float, text: str) -> None:
    assert rounded_up(figure) == text


def test_table_is_of_the_six_whatever_ports_there_are() -> None:
    assert table([Verdict("awk", "pass"), Verdict("cpp", "pass")]) == table([Verdict("cpp", "pass")])


def test_port_that_did_not_run_has_empty_cells() -> None:
    assert table([Verdict("cpp", "missing")]).splitlines()[-1] == "| cpp |  | missing |  |  |  |"


# ---- Commands and links ----

TEXTS = ("README.md", "CONTRIBUTING.md")


def commands(text: str, start: str) -> list[list[str]]:
    """The commands of the blocks of code that begin so, as words, without remarks."""
    found = re.findall(rf"^    {re.escape(start)} (.*)$", text, flags=re.MULTILINE)
    return [shlex.split(words, comments=True) for words in found]


@pytest.mark.parametrize("name", TEXTS)
def test_commands_of_the_harness_are_accepted(name: str) -> None:
    found = commands((ROOT / name).read_text(), ".venv/bin/conformance")
    assert found
    for words in found:
        if words != ["--help"]:
            parser().parse_args(words)


def test_command_that_there_is_not_would_be_refused() -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(commands("    .venv/bin/conformance judge FILE.csv  # no\n", ".venv/bin/conformance")[0])


@pytest.mark.parametrize("name", TEXTS)
def test_targets_of_make_are_there(name: str) -> None:
    text = (ROOT / name).read_text()
    asked = {words[0] for words in commands(text, "make")} | set(re.findall(r"`make (?:-\S+ )?([a-z]+)", text))
    assert asked and asked <= set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))


@pytest.mark.parametrize("name", TEXTS)
def test_links_lead_to_files(name: str) -> None:
    links = re.findall(r"\]\((?!\.\./\.\./|#|https?:)([^)#]+)", (ROOT / name).read_text())
    assert links and [link for link in links if not (ROOT / link).exists()] == []


def test_tests_that_contributors_may_run_are_there() -> None:
    found = re.findall(r"conformance/tests/\S+", (ROOT / "CONTRIBUTING.md").read_text())
    assert found and all((ROOT / path).exists() for path in found)


def test_container_copies_nothing_that_was_made() -> None:
    kept = (ROOT / ".gitignore").read_text().split()
    left_out = (ROOT / ".dockerignore").read_text().split()
    assert {f"/{name}" for name in left_out} == {name for name in kept if name.startswith("/")}
    assert len((ROOT / "Dockerfile").read_text().splitlines()) <= 10
