# SPDX-License-Identifier: MIT
"""What the tests share; a test that asks for `port` runs once per program under test."""

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conformance.judging.checks import Tolerance
from conformance.judging.trajectory import Trajectory
from conformance.judging.verdict import judge_all, summary, write_result
from conformance.pages.report.gallery import publish
from conformance.pages.report.page import PAGE
from conformance.places import PLANTS
from conformance.programs.ports import Port
from conformance.programs.table import boxes
from conformance.tests.under_test import PORTS, engine_of, not_run, trajectory_of
from conformance.theory.lesson import LESSON
from conformance.trials.kill_matrix import prepare
from conformance.trials.variant import copy_tree, read_variants, runnable
from conformance.truth.exact import KEPT

STARTED = time.time()
OTHERS = {path.stem for path in PLANTS.glob("*.toml")} - {LESSON.name}
SLOWEST_FIRST = (
    "test_new_port", "test_campaign", "test_browser", "test_plants", "test_variants", "test_diagnosis",
    "test_any_plant", "test_coverage", "test_corruptions", "test_experiment", "test_bad_luck", "test_verdict",
    "test_command_line", "test_truth_proof", "test_makefile",
)  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test on another plant lies beyond the lesson. The slow ones first, so that all cores are busy to the end."""
    for item in items:
        if OTHERS.intersection(re.split(r"\W+", item.name)):
            item.add_marker("beyond")
    rank = {name: place for place, name in enumerate(SLOWEST_FIRST)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(rank)))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "port" in metafunc.fixturenames and not any(
        "port" in mark.args[:1] for mark in metafunc.definition.iter_markers()
    ):
        metafunc.parametrize("port", PORTS.values(), ids=PORTS)


@pytest.fixture
def trajectory(port: Port) -> Trajectory:
    return trajectory_of(port)


@pytest.fixture
def tolerance(port: Port) -> Tolerance:
    return engine_of(port).tolerance


@pytest.fixture(scope="session")
def variants_have_run() -> None:
    """All that is not up to date is run, in parallel; who comes second waits, and finds it done."""
    prepare(read_variants().values(), runnable(PORTS.values()))


@pytest.fixture(scope="session")
def report(variants_have_run: None) -> Path:
    """The page on the programs under test, the exercises with what their variants led to."""
    if not page_is_new():
        publish(PORTS, judge_all(PORTS, LESSON))
    return PAGE


def page_is_new() -> bool:
    """Whether it has been written in this run, be it by another worker."""
    return PAGE.exists() and PAGE.stat().st_mtime > STARTED


@pytest.fixture
def copy_of_the_tree(tmp_path: Path) -> Callable[..., Path]:
    """A function that copies the tree, changed by edits, to a folder whose name has a space.

    The copy shares .venv and the proofs in build/truth.
    """

    def copy(*edits: Callable[[Path], None]) -> Path:
        root = tmp_path / "a copy"
        copy_tree(root)
        KEPT.mkdir(parents=True, exist_ok=True)
        (root / "build").mkdir()
        (root / "build" / "truth").symlink_to(KEPT)
        for edit in edits:
            edit(root)
        return root

    return copy


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Show the verdicts before pytest's own last line, and leave them as JSON and as the page, if no test has just."""
    if terminalreporter.config.option.collectonly or hasattr(terminalreporter.config, "workerinput"):  # of xdist
        return
    judgement = judge_all(PORTS, LESSON)
    write_result(judgement)
    terminalreporter.section("programs")
    terminalreporter.write_line(f"{boxes(PORTS.values())}\n{summary(judgement)}")
    try:
        if not page_is_new():
            publish(PORTS, judgement)
        terminalreporter.write_line(f"the page: {PAGE}")
    except ValueError as obstacle:
        terminalreporter.write_line(f"no page: {obstacle}")
    skipped = [report.longrepr for report in terminalreporter.stats.get("skipped", ())]
    for line in not_run(where[2] for where in skipped if isinstance(where, tuple)):
        terminalreporter.write_line(line)
