# SPDX-License-Identifier: MIT
"""docs/porting.md, followed: from the skeleton of a port to green, in AWK and in a compiled language."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.places import proofs
from conformance.programs.new_port import taken, write_skeleton
from conformance.programs.ports import ROOT, read_ports
from conformance.programs.run import as_a_user
from conformance.tests.under_test import AWK, GUESTS, make, write_awk
from conformance.trials.variant import copy_tree

pytestmark = pytest.mark.beyond

KEPT = ROOT / "build" / "guests"  # what the edited programs of a guest led to, from one check to the next
CONCERNED = ("judging/test_conformance", "judging/test_csv_format", "programs/test_results", "programs/test_sources")


def check(root: Path, name: str, *more: str) -> subprocess.CompletedProcess[str]:
    """What make check does for one port, on the tests that every port has."""
    tests = [f"conformance/tests/{what}.py" for what in (*CONCERNED, *more)]
    return subprocess.run(
        [root / ".venv/bin/python", "-m", "pytest", *tests, "-k", name],
        cwd=root, env={**os.environ, "PORTS": name}, capture_output=True, text=True,
    )  # fmt: skip


def guided(root: Path, name: str) -> subprocess.CompletedProcess[str]:
    """What conformance port says of it."""
    command = [root / ".venv/bin/python", "-m", "conformance", "port", name]
    return subprocess.run(command, cwd=root, env=as_a_user(), capture_output=True, text=True)


def test_the_skeleton_runs_and_conforms(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    made = make(root, "awk")
    assert made.returncode == 0, made.stderr
    verdict = check(root, "awk", "programs/test_bad_luck")
    count = f"1 of 1 conform; {len(read_ports(root)) - 1} left out"
    assert verdict.returncode == 0 and count in verdict.stdout, verdict.stdout


@pytest.mark.skipif(
    not (shutil.which("go") and shutil.which("gofmt")), reason="there is no Go here; its package is golang-go"
)
def test_a_seventh_language_goes_from_the_skeleton_to_green_in_its_folder_alone(
    copy_of_the_tree: Callable[..., Path],
) -> None:
    root = copy_of_the_tree()
    for name in ("variants", "campaign", "bad-luck"):
        (KEPT / name).mkdir(parents=True, exist_ok=True)
        (root / "build" / name).symlink_to(KEPT / name)
    write_skeleton("go", root)
    said = guided(root, "go")
    assert said.returncode == 1 and "go/Chapter17_Lesson1.awk is still the skeleton's" in said.stdout, said.stderr
    for path in (root / "go").iterdir():
        path.unlink()
    shutil.copytree(GUESTS / "go", root / "go", dirs_exist_ok=True)
    source = root / "go/Chapter17_Lesson1.go"
    assert subprocess.run(["gofmt", "-l", source], capture_output=True, text=True).stdout == ""
    said = guided(root, "go")
    assert said.returncode == 0 and "every stage holds" in said.stdout, said.stdout + said.stderr
    verdict = check(root, "go", "programs/test_bad_luck")
    assert verdict.returncode == 0 and "1 of 1 conform" in verdict.stdout, verdict.stdout


ONE_REASON = '[awk.tight-tolerance]\nwithout = "has a fixed step"'
STUMBLES = {  # what is wrong with a port, and what it is told to do
    "a statement": ("Chapter17_Lesson1.awk", "tau2 = phi * z1 -", "tau2 = z1 * phi -",
                    "tau2 = phi * z1 - alpha1_x1 * phi * z2  # (7) tuning function"),
    "a section": ("Chapter17_Lesson1.awk", "# ---- Controller ----", "", "paste the line\n# ---- Controller ----"),
    "the engine": ("port.toml", 'program = "awk"', 'program = "awkward"', "no engine found"),
    "the tolerance": ("port.toml", "{x1 = 2e-9,", "{x1 = 2e-7,", "tolerance = {x1 = 2e-09, x2 = 2e-08"),
    "a variant": ("variants.toml", ONE_REASON, "", "[[awk.tight-tolerance.edits]]"),
}  # fmt: skip


@pytest.fixture(scope="module")
def awk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree with a port in AWK."""
    root = tmp_path_factory.mktemp("stumbles") / "a copy"
    copy_tree(root)
    (root / "build").mkdir()
    (root / "build/truth").symlink_to(proofs())
    write_awk(root)
    return root


@pytest.mark.parametrize("stumble", STUMBLES)
def test_what_to_do_next_is_said_with_the_text_to_paste(stumble: str, awk: Path) -> None:
    file, old, new, wanted = STUMBLES[stumble]
    path = awk / "awk" / file
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    said = guided(awk, "awk")
    path.write_text(text)
    assert said.returncode == 1 and said.stderr == "" and wanted in said.stdout, said.stdout + said.stderr


def test_an_unfinished_port_does_not_take_others_down(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    write_skeleton("fortran", root)
    (root / "fortran" / AWK).write_text("nothing\n")
    (root / "fortran/variants.toml").unlink()
    assert make(root, "awk").returncode == 0
    verdict = check(root, "awk")
    assert verdict.returncode == 0 and "the page: " in verdict.stdout, verdict.stdout
    both = subprocess.run(
        [root / ".venv/bin/python", "-m", "conformance", "report"], cwd=root,
        env=as_a_user() | {"PORTS": "awk fortran"}, capture_output=True, text=True,
    )  # fmt: skip
    assert both.returncode == 0 and "the page is" in both.stdout, both.stderr


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
