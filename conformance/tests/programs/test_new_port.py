# SPDX-License-Identifier: MIT
"""docs/porting.md, followed: from the skeleton of a port to green, with a small port in AWK."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.programs.new_port import taken, write_skeleton
from conformance.programs.ports import ROOT
from conformance.tests.under_test import make, write_awk


def check(root: Path, name: str) -> subprocess.CompletedProcess[str]:
    """What make check does for one port, on the tests that every port has."""
    tests = [
        f"conformance/tests/{what}.py"
        for what in (
            "judging/test_conformance",
            "judging/test_csv_format",
            "programs/test_results",
            "programs/test_sources",
        )
    ]
    return subprocess.run(
        [root / ".venv/bin/python", "-m", "pytest", *tests, "-k", name],
        cwd=root, env={**os.environ, "PORTS": name}, capture_output=True, text=True,
    )  # fmt: skip


def test_skeleton_says_that_its_program_is_not_written(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree()
    write_skeleton("awk", root)
    answer = make(root, "awk")
    assert answer.returncode != 0 and "the program of awk is not written yet" in answer.stderr
    verdict = check(root, "awk")
    assert verdict.returncode == 1 and "0 of 1 conform; 1 error: awk; 6 left out" in verdict.stdout


def test_a_new_port_goes_from_skeleton_to_green(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    made = make(root, "awk")
    assert made.returncode == 0, made.stderr
    verdict = check(root, "awk")
    assert verdict.returncode == 0 and "1 of 1 conform; 6 left out" in verdict.stdout, verdict.stdout


@pytest.mark.parametrize(
    "name", ["python", "docs", "license", "all", "build", "truth", "Fortran", "c++", "a b", "../x", ""]
)
def test_a_name_that_is_taken_or_no_identifier_is_refused(name: str) -> None:
    before = sorted(ROOT.iterdir())
    answer = subprocess.run(
        [sys.executable, "-m", "conformance", "new-port", name], cwd=ROOT, capture_output=True, text=True
    )
    assert answer.returncode == 2 and len(answer.stderr.splitlines()) == 1
    assert sorted(ROOT.iterdir()) == before


def test_every_target_of_the_makefile_is_taken() -> None:
    rules = re.findall(r"^([a-z]+):(?!=)", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    assert len(rules) > 10 and set(rules) <= taken()


def test_every_folder_that_the_harness_makes_in_build_is_taken() -> None:
    sources = [path.read_text() for path in (ROOT / "conformance").rglob("*.py") if "tests" not in path.parts]
    folders = {name for text in sources for name in re.findall(r'ROOT / "build" / "([a-z]+)"', text)}
    assert len(folders) > 3 and folders <= taken()


def test_a_port_that_has_taken_the_name_of_a_target_stops_make(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    text = (root / "awk/port.mk").read_text()
    (root / "awk/port.mk").write_text(text.replace("KNOWN_PORTS += awk", "KNOWN_PORTS += all"))
    answer = make(root, "help")
    assert answer.returncode != 0 and "a port cannot be called all" in answer.stderr
