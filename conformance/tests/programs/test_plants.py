# SPDX-License-Identifier: MIT
"""make all and make check with PLANT=FILE.toml: programs are written, run and judged in build/<name>, or refused."""

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from conformance.programs.ports import ROOT, read_ports, selected_ports
from conformance.programs.writer import stems_taken, write
from conformance.tests.under_test import ONE_STATE, make, write_awk
from conformance.theory.experiment_file import read_experiment

pytestmark = pytest.mark.beyond

CopyOfTheTree = Callable[..., Path]


@pytest.fixture
def tree(copy_of_the_tree: CopyOfTheTree) -> Path:
    """A copy of the tree in which a plant lies at the top."""
    return copy_of_the_tree(lambda root: (root / "one.toml").write_text(ONE_STATE))


def test_a_plants_programs_are_written_run_and_judged(tree: Path) -> None:
    write_awk(tree)
    answer = make(tree, "check", PLANT="one.toml", PORTS="cpp awk")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "1 of 1 conform; 6 left out" in answer.stdout
    lines = [" ".join(line.split()) for line in answer.stdout.splitlines()]
    assert "awk has no template, and takes part in the lesson alone" in lines
    assert "awk: it has no template, and takes part in the lesson alone" in lines
    assert not (tree / "build/cpp").exists()  # the lesson's
    result = json.loads((tree / "build/one/result.json").read_text())
    assert {v["name"]: v["status"] for v in result["verdicts"]}["cpp"] == "pass"
    cases = ElementTree.parse(tree / "build/one/junit.xml").getroot()
    assert cases.get("failures") == "0" and int(cases.get("tests") or 0) > 10

    assert make(tree, "cpp", PLANT="one.toml").stdout.strip() == ""  # nothing to do

    program = tree / "build/one/programs/cpp/one.cpp"
    text = program.read_text()
    assert text.count("-k1 * z1") == 1
    program.write_text(text.replace("-k1 * z1", "-1.01 * k1 * z1"))
    assert make(tree, "cpp", PLANT="one.toml").returncode == 0
    command = [tree / ".venv/bin/python", "-m", "conformance", "check", "--plant", "one.toml", "--ports", "cpp"]
    answer = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    assert answer.returncode == 1 and "level-obeys-its-differential-equation (7) FAILS" in answer.stdout
    cases = ElementTree.parse(tree / "build/one/junit.xml").getroot()
    assert int(cases.get("failures") or 0) > 0

    (tree / "one.toml").write_text(ONE_STATE.replace('"0.2"', '"0.3"'))  # after which the program is written anew
    assert make(tree, "cpp", PLANT="one.toml").returncode == 0
    assert program.read_text() == text.replace("0.2;", "0.3;")


REFUSED = {
    "a file that is not there": ("none.toml", "", "none.toml: no such file"),
    "a plant that is not in the form": (
        "one.toml",
        ONE_STATE.replace("u - c", "sin(u) - c"),
        "one.toml:5:10: row 1: u ",
    ),
    "no name": ("one.toml", ONE_STATE.replace('name = "one"\n', ""), "one.toml:1:1: "),
    "a name that build/ has": ("one.toml", ONE_STATE.replace('"one"', '"cpp"'), "a plant cannot be called cpp"),
    "a path with a space": ("a plant.toml", ONE_STATE, "found a path with a space"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_written_is_refused_in_a_line(case: str, tree: Path) -> None:
    name, text, reason = REFUSED[case]
    (tree / "one.toml").unlink()
    if text:
        (tree / name).write_text(text)
    answer = make(tree, "all", PLANT=name)
    assert answer.returncode != 0 and answer.stderr.count(reason) == 1, answer.stderr
    assert "Traceback" not in answer.stderr and "port  " not in answer.stdout  # no table of what did not run
    assert not list((tree / "build").glob("*/programs/*/*"))


TAKEN = {"record": "Java", "json": "Python", "ode45": "MATLAB", "sim": "Simulink", "String": "Java", "x1": "Java"}


@pytest.mark.parametrize("name", TAKEN)
def test_a_name_that_a_language_has_for_something_else_is_refused(name: str) -> None:
    e = replace(read_experiment(ROOT / "plants" / "khalil.toml"), name=name)
    ports = [port for port in read_ports().values() if port.language == TAKEN[name]]
    with pytest.raises(ValueError, match=f'name: found "{name}", which {TAKEN[name]}, or the program itself'):
        write(e, *ports)
    assert name == "x1" or name in stems_taken(*ports)


def test_no_program_has_the_name_of_a_module_of_pythons() -> None:
    assert {name for name in sys.stdlib_module_names if not name.startswith("_")} <= stems_taken(read_ports()["python"])


def test_the_ports_of_a_plant_are_those_with_a_template() -> None:
    ports = read_ports(plant="one")
    assert set(ports) == {name for name, port in read_ports().items() if port.template}
    assert ports["cpp"].in_place(["{root}/a", "{folder}/b"]) == ["../../../a", "../programs/cpp/b"]
    assert ports["simulink"].source_path == ROOT / "build/one/programs/matlab/one_Simulink.m"
    assert ports["simulink"].csv == ROOT / "build/one/simulink/one_simulink.csv"
    with pytest.raises(ValueError, match="PORTS: awk; the ports are"):
        selected_ports(["awk"], plant="one")
