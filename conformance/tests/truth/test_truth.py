# SPDX-License-Identifier: MIT
"""The truth of the lesson's experiment: reference points and doubles."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from flint import arb, fmpq

from conformance.tests.truth.problems import CLOSED, R, lesson
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, ball_function, enclose

TARGET = 1e-18

REFERENCE_POINTS = {  # x1, x2, theta_hat to 15 significant digits: the lesson's experiment, (10)
    "0.1": ("1.17342048378473", "-2.96869266344466", "1.87081572148824"),
    "0.5": ("0.291281352221132", "-1.38405852420840", "2.12499724390726"),
    "2": ("0.448120205499685", "-0.355976931611338", "1.14692101257012"),
    "10": ("0.328478949459429", "-0.130333573188115", "1.20008581890017"),
    "20": ("0.495303675161773", "-0.546506377914894", "1.19999999777290"),
}


@pytest.fixture(autouse=True)
def arithmetic_of_the_tests() -> Iterator[None]:
    """Ball arithmetic rounds to the global precision, whatever the precision of its arguments."""
    with precision(200):
        yield


@pytest.fixture(scope="module")
def experiment() -> Enclosure:
    return enclose(lesson(), TARGET)


def balls(enclosed: Enclosure, time: str) -> dict[str, arb]:
    """The states, and z1 and V as functions of them."""
    named = ball_function(lesson(), sp.symbols("z1 V"))
    states = enclosed.at(time)
    errors = named(Fraction(time), states)
    return dict(zip((*enclosed.names, "z1", "V"), (*states, *errors), strict=True))


def test_radius_meets_the_target_at_every_time(experiment: Enclosure) -> None:
    assert experiment.end == 20
    assert experiment.largest_radius <= TARGET


@pytest.mark.parametrize("time", REFERENCE_POINTS)
def test_reference_points_agree_to_one_unit_of_their_last_digit(experiment: Enclosure, time: str) -> None:
    for digits, ball in zip(REFERENCE_POINTS[time], experiment.at(time), strict=True):
        unit = arb(10) ** -len(digits.partition(".")[2])
        assert abs(ball - arb(digits)) < unit, (time, digits, ball)


def test_functions_of_the_enclosed_states_agree_with_their_formulas(experiment: Enclosure) -> None:
    row = balls(experiment, "12.34")
    z1 = row["x1"] - (arb("0.7") * arb("12.34")).sin() / 2
    assert z1.overlaps(row["z1"])
    assert balls(experiment, "0")["V"].contains(arb("2.16125"))
    assert abs(balls(experiment, "20")["z1"] + arb("2.686e-9")) < 1e-12


def test_dop853_agrees_to_its_own_accuracy(experiment: Enclosure) -> None:
    from scipy.integrate import solve_ivp  # which takes a second

    problem = lesson()
    field = sp.lambdify((problem.time, problem.states), problem.rhs)
    times = np.linspace(0, 20, 401)
    start = [1.2, -0.5, 0.0]
    solver = solve_ivp(lambda t, x: field(t, x), (0, 20), start, method="DOP853", rtol=3e-14, atol=1e-16, t_eval=times)
    assert np.abs(solver.y - experiment.evaluate(times)).max() < 2e-12


# --- Doubles -------------------------------------------------------------------------------------


def check_doubles(enclosed: Enclosure, times: np.ndarray) -> None:
    for time, values in zip(times.tolist(), enclosed.evaluate(times).T.tolist(), strict=True):
        for ball, value, bound in zip(enclosed.at(time), values, enclosed.bound.tolist(), strict=True):
            assert abs(ball - value) <= arb(bound), (time, ball, value)


def test_doubles_are_within_their_bound_at_unsorted_times(experiment: Enclosure) -> None:
    check_doubles(experiment, np.random.default_rng(1).uniform(0, 20, 2000))


def test_doubles_are_within_their_bound_at_edges_of_pieces(experiment: Enclosure) -> None:
    edges = experiment.table.edges
    check_doubles(experiment, np.concatenate([edges, np.nextafter(edges[1:], 0), [1e-300, 5e-324]]))


@pytest.mark.beyond
@pytest.mark.parametrize("name", CLOSED)
def test_doubles_of_closed_problems_are_within_their_bound(name: str) -> None:
    enclosed = enclose(CLOSED[name].problem)
    check_doubles(enclosed, np.random.default_rng(2).uniform(0, enclosed.end, 300))


def test_bound_is_at_most_1e_15_of_the_scale_of_each_state(experiment: Enclosure) -> None:
    assert np.all(experiment.bound <= 1e-15 * experiment.scale)


def test_scale_is_close_to_the_largest_value(experiment: Enclosure) -> None:
    largest = np.abs(experiment.evaluate(np.linspace(0, 20, 20001))).max(axis=1)
    assert np.all(experiment.scale <= largest + experiment.bound)
    assert np.all(experiment.scale > 0.9 * largest)


def test_shape_of_the_times_is_kept_and_rows_can_be_chosen(experiment: Enclosure) -> None:
    assert experiment.evaluate(3.0).shape == (3,)
    assert experiment.evaluate(np.zeros((4, 5)), ["theta_hat", "x1"]).shape == (2, 4, 5)
    assert experiment.evaluate([]).shape == (3, 0)


@pytest.mark.parametrize("time", [-1e-9, 20.000001, float("nan")])
def test_times_outside_of_the_horizon_are_refused(experiment: Enclosure, time: float) -> None:
    with pytest.raises(ValueError):
        experiment.evaluate([1.0, time])
    with pytest.raises(ValueError):
        experiment.at(time)


def test_steps_are_exact_join_and_are_what_is_evaluated(experiment: Enclosure) -> None:
    steps = list(experiment.steps())
    assert steps[0].start == 0 and steps[-1].end == 20
    assert all(before.end == after.start for before, after in pairwise(steps))
    for step in steps[::7]:
        s = (step.end - step.start) / 3
        for ball, p, radius in zip(experiment.at(step.start + s), step.polynomials, step.radii, strict=True):
            value = sum(c * s**k for k, c in enumerate(p))
            assert abs(ball - arb(fmpq(value.numerator, value.denominator))) < 1.001 * arb(float(radius))


def test_horizon_that_is_no_double_is_reached_by_the_double_above_it() -> None:
    enclosed = enclose(lesson(R("0.1")), 1e-12)
    assert enclosed.end == 0.1 > R("0.1")
    enclosed.at("0.1")
    enclosed.evaluate(0.1)
