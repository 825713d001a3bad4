# SPDX-License-Identifier: MIT
"""An edit finds its text exactly once; constants, names and functions are changed as each port spells them."""

from dataclasses import replace
from fractions import Fraction

import pytest

from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.sources import source, statement
from conformance.programs.spelling import spelled
from conformance.programs.writer import write
from conformance.tests.under_test import PORTS, PROBLEM_6
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import values_of, with_values
from conformance.theory.lesson import LESSON
from conformance.trials.edits import (
    Edit,
    constant_edit,
    constant_value,
    decimal,
    edited,
    experiment_edits,
    without_drawing,
)

ALL = read_ports()
every_port = pytest.mark.parametrize("any_port", PORTS.values(), ids=PORTS)
NUMBERS = {name: Fraction(n + 3, 4) for n, name in enumerate(values_of(LESSON))}
OTHER = with_values(replace(LESSON, reference=PROBLEM_6.reference), NUMBERS)


@pytest.mark.parametrize(("text", "count"), [("y = 1", 0), ("x = 1; x = 1", 2)])
def test_a_text_that_is_not_found_once_is_refused(text: str, count: int) -> None:
    with pytest.raises(ValueError, match=f"found 'x = 1' {count} times, expected once"):
        edited(text, [Edit("x = 1", "x = 2")])


def test_edits_come_one_after_another() -> None:
    assert edited("a b", [Edit("a", "c"), Edit("c b", "d")]) == "d"


@every_port
def test_every_constant_of_a_scenario_can_be_set_in_every_port(any_port: Port) -> None:
    text = edited(source(any_port), experiment_edits(any_port, source(any_port), OTHER))
    for name, number in NUMBERS.items():
        constant = constant_value(any_port, text, {"theta": "theta_true", "horizon": "final_time"}.get(name, name))
        assert Fraction(constant or 0) == number, name


@every_port
def test_the_lessons_own_experiment_edits_nothing(any_port: Port) -> None:
    assert experiment_edits(any_port, source(any_port), LESSON) == []


@every_port
def test_problem_6_changes_the_reference_and_both_derivatives(any_port: Port) -> None:
    text = edited(source(any_port), experiment_edits(any_port, source(any_port), PROBLEM_6))
    for line in (
        "r = amplitude * cos(omega * t)",
        "r_dot = -amplitude * omega * sin(omega * t)",
        "r_ddot = -amplitude * omega * omega * cos(omega * t)",
    ):
        assert text.count(spelled(any_port, line)) == 1


@every_port
def test_a_constant_that_is_not_there_is_refused(any_port: Port) -> None:
    with pytest.raises(ValueError, match="no constant 'k3'"):
        constant_edit(any_port, source(any_port), "k3", "1")


def test_names_and_functions_are_spelled_as_the_port_spells_them() -> None:
    wanted = {
        "python": "u = K1 * alpha1_x1 + GAMMA * np.sin(r_ddot)",
        "cpp": "u = k1 * alpha1_x1 + gamma_gain * std::sin(r_ddot)",
        "java": "u = K1 * alpha1X1 + GAMMA * Math.sin(rDDot)",
        "matlab": "u = k1 * alpha1X1 + gamma * sin(rDDot)",
        "simulink": "u = k1 * alpha1X1 + gamma * sin(rDDot)",
        "mathematica": "control[t_] := k1 * alpha1X1[t] + gamma * Sin[rDDot[t]]",
    }
    common = "u = k1 * alpha1_x1 + gamma * sin(r_ddot)"
    assert {name: spelled(ALL[name], common) for name in wanted} == wanted
    assert {name: statement(ALL[name], text) for name, text in wanted.items()} == dict.fromkeys(
        wanted, common.replace(" ", "")
    )


@pytest.mark.parametrize("value", ["20", "-0.5", "1e-5", "1/3", "123456789012"])
def test_a_decimal_has_a_point_and_no_exponent(value: str) -> None:
    text = decimal(Fraction(value))
    assert "." in text and "e" not in text and float(text) == float(Fraction(value))


def test_what_is_left_out_with_the_figure_stands_in_its_section() -> None:
    hidden = replace(PORTS["python"], drawing=("z1 = x1 - r",))
    with pytest.raises(ValueError, match="begins no statement of the section Figures"):
        without_drawing(hidden, source(hidden))
    for port in PORTS.values():
        assert len(without_drawing(port, source(port))) == len(port.drawing)


def test_statements_that_draw_are_left_out_whole_where_they_are_long() -> None:
    wing = read_experiment(ROOT / "plants" / "wing_rock.toml")
    for port in (port for port in ALL.values() if port.drawing):
        text = write(wing, port)
        left_out = [edit.old.rstrip() for edit in without_drawing(port, text)]
        assert all(statement.endswith((")", ");", "as plt")) for statement in left_out), left_out
        assert any("theta5" in statement or port.name == "simulink" for statement in left_out)
