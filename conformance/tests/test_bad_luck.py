# SPDX-License-Identifier: MIT
"""A program that cannot finish says so in one line, ends with a non-zero status, and leaves no CSV that looks whole."""

import functools
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.edits import constant_edit, edited
from conformance.ports import Port, read_ports
from conformance.run import choose_engine, in_place
from conformance.scenario import LESSON
from conformance.tests.programs import make, record
from conformance.trajectory import load
from conformance.variant import copy_tree
from conformance.verdict import report_problems

ENGINE_REMARK = "error: ignoring const execution_exception& while preparing to exit\n"  # GNU Octave 7.3, at every end


def set_constant(port: Port, name: str, value: str) -> None:
    """Change a constant in the Parameters section of a copied program."""
    text = port.source_path.read_text()
    port.source_path.write_text(edited(text, [constant_edit(port, text, name, value)]))


def compile_program(port: Port) -> None:
    """Bring a copied program's compiled form up to date, where it has one."""
    if port.target:
        built = make(port.folder.parent, f"build/{port.name}/{port.target}")
        assert built.returncode == 0, built.stderr


def start(port: Port) -> subprocess.CompletedProcess[str]:
    """Run a copied program bare, in its build folder."""
    port.build.mkdir(parents=True, exist_ok=True)
    compile_program(port)
    command = in_place(choose_engine(port).command)
    return subprocess.run(command, cwd=port.build, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def short_trees(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A function that gives a tree in which the program of that name, over 0.1 s instead of 20 s, is compiled once."""

    @functools.cache
    def tree(name: str) -> Path:
        root = tmp_path_factory.mktemp(name)
        copy_tree(root)
        port = read_ports(root)[name]
        set_constant(port, "t_final", "0.1")
        compile_program(port)
        return root

    return tree


@pytest.fixture
def short_program(port: Port, short_trees: Callable[[str], Path], tmp_path: Path) -> Port:
    """The program in a copy of that tree."""
    record(port)
    root = Path(shutil.copytree(short_trees(port.name), tmp_path / "a copy", symlinks=True))
    return read_ports(root)[port.name]


def assert_refused(port: Port, answer: subprocess.CompletedProcess[str], reason: str) -> None:
    assert answer.returncode != 0, f"{port.name} ended with status 0: {answer.stdout}"
    message = answer.stderr.replace(ENGINE_REMARK, "")
    assert reason in message and len(message.strip().splitlines()) == 1, f"{port.name} said: {message}"
    assert not port.csv.is_file()


def test_csv_name_that_is_a_folder(short_program: Port) -> None:
    (short_program.csv / "in the way").mkdir(parents=True)
    assert_refused(short_program, start(short_program), "Chapter17_Lesson1")


def test_full_disk(short_program: Port) -> None:
    short_program.build.mkdir(parents=True, exist_ok=True)
    Path(f"{short_program.csv}.part").symlink_to("/dev/full")
    assert_refused(short_program, start(short_program), "")


@pytest.mark.parametrize("constant", ["x1_start", "x2_start"])
def test_integration_that_blows_up(short_program: Port, constant: str) -> None:
    set_constant(short_program, constant, "1" + 200 * "0" + ".0")
    assert_refused(short_program, start(short_program), "integration failed")


def test_short_program_ends_well_and_replaces_an_old_csv(short_program: Port) -> None:
    short_program.build.mkdir(parents=True, exist_ok=True)
    short_program.csv.write_text("of an earlier run\n")
    answer = start(short_program)
    assert answer.returncode == 0, answer.stderr
    assert not list(short_program.build.glob("*.part"))
    trajectory = load(short_program.csv, 0.1)  # in the transient, where every row differs from the one before it
    assert report_problems(answer.stdout, trajectory, LESSON, short_program.csv.name) == []
