# SPDX-License-Identifier: MIT
"""A log tells which parameters it was made with: those of the scenario, or another one, by name and value."""

import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from conformance.judging.checks import contract, parameters_are_the_scenarios
from conformance.judging.identification import NEARER, explanation, implied, neighbour, solutions, value
from conformance.judging.layout import columns_of
from conformance.judging.measured import Measured
from conformance.judging.trajectory import Array, Trajectory
from conformance.programs.ports import ROOT
from conformance.tests.under_test import NO_EXCITATION
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact

pytestmark = pytest.mark.beyond

EXACT = exact(LESSON)
CONTRACT = contract(EXACT)
T = np.linspace(0, 20, 1001)
COLUMNS = EXACT.sensitivity.columns.tolist()
CHANGES = [(name, 10.0**-k) for name in COLUMNS for k in range(2, 7)]  # relative, of 1 where the value is 0
SIZES = np.array([change * (value(EXACT, name) or 1.0) for name, change in CHANGES])


def measured(states: Array) -> Measured:
    reference = EXACT.reference(T)
    return Measured(Trajectory(T, states, reference, states[0] - reference, LESSON.names), EXACT)


@pytest.fixture(scope="module")
def logs() -> Array:
    """The solutions of all changed scenarios, by a good solver: (3, changes, rows)."""
    return solutions(EXACT, [name for name, _ in CHANGES], SIZES, T)


@pytest.mark.parametrize("number", range(len(CHANGES)), ids=[f"{name} by {change:.0e}" for name, change in CHANGES])
def test_scenario_that_differs_in_one_parameter_is_named_and_refused(number: int, logs: Array) -> None:
    name, relative = CHANGES[number]
    log = measured(logs[:, number])
    found = neighbour(log)
    assert found.name == name and found.change == pytest.approx(SIZES[number], rel=2 * relative + 1e-5)
    (result,) = parameters_are_the_scenarios(log, CONTRACT)
    assert not result.passed and f"for {name} = " in result.where


@pytest.mark.parametrize("name", ["gamma", "omega"])
def test_change_of_1_percent_is_named_with_its_value(name: str, logs: Array) -> None:
    number = CHANGES.index((name, 0.01))
    found = explanation(measured(logs[:, number]))
    assert found is not None and found.name == name and found.bound < 1e-8
    assert abs(found.value - value(EXACT, name) - SIZES[number]) <= found.bound


def test_exact_solution_implies_the_scenarios_parameters() -> None:
    for one in implied(measured(EXACT.evaluate(T))):
        assert abs(one.value - value(EXACT, one.name)) <= one.bound < 1e-11, str(one)


def test_bound_of_an_implied_parameter_covers_it_in_noise(logs: Array) -> None:
    noise = 1e-9 * np.random.default_rng(0).uniform(-1, 1, (3, T.size))
    log = measured(logs[:, CHANGES.index(("gamma", 1e-6))] + noise)
    found = {one.name: one for one in implied(log)}
    assert abs(found["gamma"].value - 3.000003) <= found["gamma"].bound < 1e-6


def test_what_cannot_be_told_is_said_to_be_so() -> None:
    """Without a reference signal its frequency leaves no trace."""
    still = exact(NO_EXCITATION)
    log = Measured(Trajectory(T, still.evaluate(T), 0 * T, still.evaluate(T)[0], LESSON.names), still)
    assert "omega: the log cannot tell" in map(str, implied(log))


def test_errors_of_a_solver_are_no_other_scenario(trajectory: Trajectory) -> None:
    assert neighbour(Measured(trajectory, EXACT)).nearer < NEARER / 2


@pytest.fixture
def told(tmp_path: Path) -> Callable[[Array], str]:
    """A function that gives the lines which validate prints for these states."""

    def say(states: Array) -> str:
        log = measured(states).trajectory
        columns = [T, *states, log.reference, log.tracking_error]
        path = tmp_path / "log.csv"
        header = ",".join(columns_of(LESSON.names))
        np.savetxt(path, np.column_stack(columns), fmt="%.17g", delimiter=",", header=header, comments="")
        command = [sys.executable, "-m", "conformance", "validate", str(path)]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout

    return say


def test_validate_prints_what_the_log_implies_or_names_what_it_is(told: Callable[[Array], str], logs: Array) -> None:
    assert "note: implied by the log: gamma = 3.0000000000" in told(EXACT.evaluate(T))
    assert "note: this is the solution for gamma = 3.0300000" in told(logs[:, CHANGES.index(("gamma", 0.01))])


def test_log_within_tolerance_for_another_gamma_is_refused(told: Callable[[Array], str], logs: Array) -> None:
    other = solutions(EXACT, ["gamma"], np.array([3e-7]), T)[:, 0]
    assert np.abs(measured(other).deviation).max() < min(CONTRACT)
    assert "parameters-are-those-of-the-experiment (10) FAILS" in told(other)


def test_other_experiment_is_judged_by_its_own_parameters() -> None:
    other = with_values(LESSON, {"gamma": Fraction(6)})
    log = Measured(Trajectory(T, exact(other).evaluate(T), EXACT.reference(T), 0 * T, LESSON.names), exact(other))
    (result,) = parameters_are_the_scenarios(log, CONTRACT)
    assert result.passed
