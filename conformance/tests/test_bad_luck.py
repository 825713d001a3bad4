# SPDX-License-Identifier: MIT
"""A program that cannot finish says so in one line, ends with a non-zero status, and leaves no CSV that looks whole."""

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
from conformance.verdict import report_problems

ENGINE_REMARK = "error: ignoring const execution_exception& while preparing to exit\n"  # GNU Octave 7.3, at every end


def set_constant(port: Port, name: str, value: str) -> None:
    """Change a constant in the Parameters section of a copied program."""
    text = port.source_path.read_text()
    port.source_path.write_text(edited(text, [constant_edit(port, text, name, value)]))


def start(port: Port) -> subprocess.CompletedProcess[str]:
    """Run a copied program bare, in its build folder."""
    root = port.folder.parent
    port.build.mkdir(parents=True, exist_ok=True)
    if port.target:
        built = make(root, f"build/{port.name}/{port.target}")
        assert built.returncode == 0, built.stderr
    command = in_place(choose_engine(port).command)
    return subprocess.run(command, cwd=port.build, capture_output=True, text=True, timeout=120)


@pytest.fixture
def short_program(port: Port, copy_of_the_tree: Callable[..., Path]) -> Port:
    """The program in a copy of the tree, over 0.1 s instead of 20 s."""
    record(port)
    copied = read_ports(copy_of_the_tree())[port.name]
    set_constant(copied, "t_final", "0.1")
    return copied


def assert_refused(port: Port, answer: subprocess.CompletedProcess[str], reason: str) -> None:
    assert answer.returncode != 0, f"{port.name} ended with status 0: {answer.stdout}"
    message = answer.stderr.replace(ENGINE_REMARK, "")
    assert reason in message and len(message.strip().splitlines()) == 1, f"{port.name} said: {message}"
    assert not port.csv.is_file()


def test_csv_name_that_is_a_folder(short_program: Port) -> None:
    (short_program.csv / "in the way").mkdir(parents=True)
    assert_refused(short_program, start(short_program), "Chapter17_Lesson1")


def test_full_disk(short_program: Port) -> None:
    short_program.build.mkdir(parents=True)
    Path(f"{short_program.csv}.part").symlink_to("/dev/full")
    assert_refused(short_program, start(short_program), "")


@pytest.mark.parametrize("constant", ["x1_start", "x2_start"])
def test_integration_that_blows_up(short_program: Port, constant: str) -> None:
    set_constant(short_program, constant, "1" + 200 * "0" + ".0")
    assert_refused(short_program, start(short_program), "integration failed")


def test_short_program_ends_well_and_replaces_an_old_csv(short_program: Port) -> None:
    short_program.build.mkdir(parents=True)
    short_program.csv.write_text("of an earlier run\n")
    answer = start(short_program)
    assert answer.returncode == 0, answer.stderr
    assert not list(short_program.build.glob("*.part"))
    trajectory = load(short_program.csv, 0.1)  # in the transient, where every row differs from the one before it
    assert report_problems(answer.stdout, trajectory, LESSON, short_program.csv.name) == []
