# SPDX-License-Identifier: MIT
"""The writer: the lesson's programs are what it writes, byte for byte; those of other plants are proven as written."""

import functools
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest

from conformance.programs import writer
from conformance.programs.layout import HANGING, WIDTH
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.sources import first_line
from conformance.programs.step import SHARE, closed_loop, initial_state, missed, trajectory
from conformance.programs.writer import Program, file_name, read_back, write, write_programs
from conformance.theory import expressions
from conformance.theory.design import DesignError
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment, without_accents
from conformance.theory.statements import Statement, statements_of
from conformance.theory.symbolic import to_sympy

PORTS = {name: port for name, port in read_ports().items() if port.template}
PLANTS = sorted(path.stem for path in (ROOT / "plants").glob("*.toml"))

every_port = pytest.mark.parametrize("any_port", PORTS.values(), ids=PORTS)
every_plant = pytest.mark.parametrize("plant", PLANTS)


def experiment(plant: str) -> Experiment:
    return read_experiment(ROOT / "plants" / f"{plant}.toml")


@functools.cache
def written(plant: str, name: str) -> str:
    return write(experiment(plant), PORTS[name])


def program(of: Experiment, port: Port) -> Program:
    return Program(of, port, statements_of(of))


@every_port
def test_the_lessons_program_is_what_the_writer_writes(any_port: Port) -> None:
    assert write(experiment("Chapter17_Lesson1"), any_port).encode() == any_port.source_path.read_bytes()


@pytest.mark.parametrize(("plant", "locale"), [("problem_1c", "C"), ("Chapter17_Lesson1", "de_DE.UTF-8")])
def test_written_twice_programs_are_the_same_bytes_in_any_locale(plant: str, locale: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "conformance", "write", f"plants/{plant}.toml", "--to", tmp_path]
    subprocess.run(command, cwd=ROOT, env={**os.environ, "LC_ALL": locale, "PYTHONUTF8": "0"}, check=True)
    for name, port in PORTS.items():
        there = tmp_path / port.folder.name / file_name(port, plant)
        assert there.read_bytes() == written(plant, name).encode()


@every_port
@pytest.mark.beyond
@every_plant
def test_lines_are_short_enough_to_be_read(plant: str, any_port: Port) -> None:
    ends = ('", "Input"],', '", "Text"],', '", "Title"],')  # of the notebook's file, which its reader does not see
    for line in written(plant, any_port.name).splitlines():
        shown = line.replace('\\"', '"').removeprefix('Cell["')
        assert len(next((shown.removesuffix(end) for end in ends if shown.endswith(end)), shown)) <= WIDTH, line


@every_port
@pytest.mark.beyond
@every_plant
def test_a_long_statement_goes_on_with_an_operator_below_an_operand(plant: str, any_port: Port) -> None:
    assert misplaced(any_port, written(plant, any_port.name)) == []


def test_a_line_that_goes_on_elsewhere_is_noticed() -> None:
    text = written("problem_1c", "cpp")
    assert text.count("\n" + " " * 21 + "- gamma_gain * phi1_1 * w3_1") == 1
    assert (
        len(misplaced(PORTS["cpp"], text.replace("- gamma_gain * phi1_1 * w3_1", " - gamma_gain * phi1_1 * w3_1"))) == 1
    )


def misplaced(port: Port, text: str) -> list[str]:
    """The lines of statements that go on elsewhere than below an operand, in a bracket, or eight columns further in."""
    lines, found = text.splitlines(), []
    for number, line in enumerate(lines):
        if re.search(rf"\S.*{re.escape(port.comment[0])}\(\d+\) ", line):
            whole = lines[first_line(lines, number) : number + 1]
            columns = {len(whole[0]) - len(whole[0].lstrip(" '")) + HANGING, whole[0].index("= ") + 2}
            for before, after in pairwise(whole):
                columns |= {i + 1 for i, c in enumerate(before) if c in "(["}
                if len(after) - len(after.lstrip(" '")) not in columns:
                    found.append(after)
    return found


RESERVED = """title = "States whose names are words of languages"
name = "reserved"
source = "ours"
[plant]
class = "end + lambda*class^2"
end = "I/beta"
I = "u + pi*end"
[constants]
beta = "2"
[unknown]
lambda = ["0.5", "0"]
pi = ["0.5", "0"]
[design]
k = ["1", "1", "1"]
Gamma = "1"
[experiment]
reference = "0.5*sin(t)"
start = ["0.2", "0", "0"]
horizon = "2"
"""
RESPELLED = {name: ("class", "class_value") for name in ("cpp", "python")} | {"java": ("class", "classValue")}
RESPELLED |= {name: ("end", "endValue") for name in ("matlab", "simulink")} | {"mathematica": ("I", "IValue")}


@every_port
def test_names_that_a_language_reserves_are_respelled_and_read_back(any_port: Port, tmp_path: Path) -> None:
    path = tmp_path / "reserved.toml"
    path.write_text(RESERVED)
    of = read_experiment(path)
    text, (name, own) = write(of, any_port), RESPELLED[any_port.name]
    code = re.sub(rf"{re.escape(any_port.comment[0])}.*", "", text[text.index(any_port.section.format("Controller")) :])
    assert program(of, any_port).spelling.name(name) == own and re.search(rf"\b{own}\b", code)
    there = {s.name: set(expressions.names_in(s.expression)) for s in read_back(program(of, any_port), text)}
    assert there["end_dot"] == {"I", "beta"} and there["z1"] == {"class", "r"} and there["z3"] == {"I", "alpha2"}


@every_port
@pytest.mark.beyond
@every_plant
def test_every_statement_is_written_once_and_means_what_it_says(plant: str, any_port: Port) -> None:
    of = experiment(plant)
    there = read_back(program(of, any_port), written(plant, any_port.name))
    for found, said in zip(there, statements_of(of), strict=True):
        values = {name: complex(i + 2) / 7 for i, name in enumerate(sorted({*expressions.names_in(said.expression)}))}
        assert worth(found, values) == pytest.approx(worth(said, values), rel=1e-13), said.name


def worth(s: Statement, values: dict[str, complex]) -> complex:
    return complex(to_sympy(s.expression, lambda name: values[name]))


@every_port
@pytest.mark.beyond
@every_plant
def test_the_head_says_where_the_numbers_are_from(plant: str, any_port: Port) -> None:
    """Tags are sections of the lesson; numbers that stand in none have (0), which the head explains by the source.

    It stands without its accents: not every compiler reads them, and a notebook spells them otherwise.
    """
    of = experiment(plant)
    text = written(plant, any_port.name)
    head, _, code = text.partition(any_port.section.format("Parameters"))
    said = " ".join(head.replace(any_port.comment[0].strip(), " ").split())
    assert text.isascii()
    assert ("(15)" in code) is (of.section == "(15)") and ("(0)" in code) is (of.section == "")
    assert bool(re.search(rf"\(0\):? {re.escape(without_accents(of.source))}", said)) is (of.section == "")


@every_port
def test_a_sign_that_is_written_wrong_is_refuted(any_port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written is read back and proven: a writer that turns a sign writes nothing."""
    of = experiment("problem_1c")
    sign = program(of, any_port).spelling.signal("r_dot")
    text = write(of, any_port)
    assert text.count(f"+ {sign}") == 1
    monkeypatch.setattr(writer, "rendered", lambda _: text.replace(f"+ {sign}", f"- {sign}"))
    with pytest.raises(DesignError):
        write(of, any_port)


@every_port
def test_a_statement_that_is_not_written_is_missed(any_port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    of = experiment("khalil")
    text = write(of, any_port)
    (line,) = (line for line in text.splitlines(keepends=True) if "(5) tracking error" in line)
    monkeypatch.setattr(writer, "rendered", lambda _: text.replace(line, ""))
    with pytest.raises(ValueError, match=f"{any_port.name}: found alpha1, expected the statement of z1"):
        write(of, any_port)


def test_what_is_missed_between_rows_is_that_of_a_quintic() -> None:
    """Of sin(w t), whose sixth derivative is -w^6 sin(w t)."""
    w, h = 20, 0.01
    rows = [(math.sin(w * h * i),) for i in range(200)]
    assert missed(rows) == pytest.approx((w * h) ** 6 / 46080, rel=0.05)
    assert missed([*rows, (math.nan,)]) == math.inf


def test_rows_of_a_fast_plant_are_closer() -> None:
    fast = replace(experiment("khalil"), k=(Fraction(32),) * 3, horizon=Fraction(2))
    slow = replace(fast, k=experiment("khalil").k)
    for of, count in ((slow, 200), (fast, 400)):
        assert re.search(rf"^intervals = {count};", write(of, PORTS["mathematica"]), re.MULTILINE)
    assert missed(trajectory(closed_loop(fast), initial_state(fast), fast.horizon, Fraction(1, 100))) > SHARE


def test_programs_to_take_away_have_what_they_need(tmp_path: Path) -> None:
    write_programs(experiment("wing_rock"), PORTS.values(), tmp_path)
    found = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    assert found >= {
        "python/wing_rock.py", "cpp/wing_rock.cpp", "java/wing_rock.java", "matlab/wing_rock.m",
        "matlab/wing_rock_Simulink.m", "matlab/octave/yline.m", "mathematica/wing_rock.nb",
        "mathematica/run_notebook.wls", "mathematica/woxi.wl",
    }  # fmt: skip
    assert all("Chapter17_Lesson1" not in (tmp_path / name).read_text() for name in found)


def test_an_edited_program_is_kept_unless_it_is_forced(tmp_path: Path) -> None:
    of, port = experiment("khalil"), PORTS["python"]
    (path,) = write_programs(of, [port], tmp_path)
    assert write_programs(of, [port], tmp_path) == [path]
    path.write_text("edited")
    with pytest.raises(ValueError, match="says another thing, nothing is written"):
        write_programs(of, PORTS.values(), tmp_path)
    assert path.read_text() == "edited" and not (tmp_path / "cpp").exists()
    write_programs(of, [port], tmp_path, force=True)
    assert path.read_text() == write(of, port)


def test_a_programs_file_has_the_name_of_its_experiment() -> None:
    assert {file_name(port, "Chapter17_Lesson1") for port in PORTS.values()} == {p.source for p in PORTS.values()}
