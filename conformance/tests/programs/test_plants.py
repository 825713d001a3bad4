# SPDX-License-Identifier: MIT
"""make all and make check with PLANT=FILE.toml: programs are written, run and judged in build/<name>, or refused."""

import json
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from conformance.programs.ports import ROOT, read_ports, selected_ports
from conformance.tests.under_test import make, write_awk

CopyOfTheTree = Callable[..., Path]

PLANT = """title = "One state, by itself"
name = "one"
source = "ours"
[plant]
level = "u - c*level^3"
[unknown]
c = ["0.5", "0"]
[design]
k = ["1"]
Gamma = "1"
[experiment]
reference = "0.5*sin(t)"
start = ["0.2"]
horizon = "2"
"""


@pytest.fixture
def tree(copy_of_the_tree: CopyOfTheTree) -> Path:
    """A copy of the tree in which a plant lies at the top."""
    return copy_of_the_tree(lambda root: (root / "one.toml").write_text(PLANT))


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
    answer = make(tree, "check", PLANT="one.toml", PORTS="cpp")
    assert answer.returncode != 0 and "level-obeys-its-differential-equation (7) FAILS" in answer.stdout
    cases = ElementTree.parse(tree / "build/one/junit.xml").getroot()
    assert int(cases.get("failures") or 0) > 0

    (tree / "one.toml").write_text(PLANT.replace('"0.2"', '"0.3"'))  # after which the program is written anew
    answer = make(tree, "check", PLANT="one.toml", PORTS="cpp")
    assert answer.returncode == 0 and program.read_text() == text.replace("0.2;", "0.3;"), answer.stdout


REFUSED = {
    "a file that is not there": ("none.toml", "", "none.toml: no such file"),
    "a plant that is not in the form": ("one.toml", PLANT.replace("u - c", "sin(u) - c"), "one.toml:5:10: row 1: u "),
    "no name": ("one.toml", PLANT.replace('name = "one"\n', ""), "one.toml:1:1: "),
    "a name that build/ has": ("one.toml", PLANT.replace('"one"', '"cpp"'), "a plant cannot be called cpp"),
    "a name that Java reserves": ("one.toml", PLANT.replace('"one"', '"record"'), 'found "record", which Java'),
    "a name of Python's library": ("one.toml", PLANT.replace('"one"', '"random"'), 'found "random", which Python'),
    "a name of a state": ("one.toml", PLANT.replace('"one"', '"level"'), 'found "level", which Java'),
    "a name of MATLAB's": ("one.toml", PLANT.replace('"one"', '"ode45"'), 'found "ode45", which MATLAB'),
    "a name that is no file's": ("one.toml", PLANT.replace('"one"', '"2nd one"'), "2nd one is no stem of files"),
    "a path with a space": ("a plant.toml", PLANT, "found a path with a space"),
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


def test_the_ports_of_a_plant_are_those_with_a_template() -> None:
    ports = read_ports(plant="one")
    assert set(ports) == {name for name, port in read_ports().items() if port.template}
    assert ports["cpp"].in_place(["{root}/a", "{folder}/b"]) == ["../../../a", "../programs/cpp/b"]
    assert ports["simulink"].source_path == ROOT / "build/one/programs/matlab/one_Simulink.m"
    assert ports["simulink"].csv == ROOT / "build/one/simulink/one_simulink.csv"
    with pytest.raises(ValueError, match="PORTS: awk; the ports are"):
        selected_ports(["awk"], plant="one")
