# SPDX-License-Identifier: MIT
"""What does not conform begins with its first cause: the statement, the method, or the log itself."""

import re
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest

from conformance.judging.checks import checks_of_anyone, judge
from conformance.judging.diagnosis import METHODS, code, diagnosis, loop_of, one_step, rates
from conformance.judging.measured import Measured
from conformance.judging.trajectory import Array, Trajectory
from conformance.tests.under_test import NO_EXCITATION, PROBLEM_6
from conformance.theory.experiments import Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact

pytestmark = pytest.mark.beyond

SHORT = with_values(LESSON, {"horizon": Fraction(3)})
EXACT = exact(SHORT)
CONTRACT = tuple(EXACT.tolerance)
START = np.array([[1.2], [-0.5], [0.0]])
UNIFORM = 0.01 * np.arange(301)
RK4 = "classical Runge-Kutta"
Field = Callable[[Array, Array], Array]


def said(t: Array, states: Array, reference: Array | None = None) -> str:
    """The diagnosis of a log of the short lesson."""
    r = EXACT.reference(t) if reference is None else reference
    log = Measured(Trajectory(t, states, r, states[0] - r, LESSON.names), EXACT)
    return diagnosis(log, CONTRACT, [r.claim for _, r in judge(log, CONTRACT, checks_of_anyone(SHORT)) if not r.passed])


def integrated(
    f: Field, h: float = 0.01, method: str = RK4, parts: int = 2, start: Array = START
) -> tuple[Array, Array]:
    """Times and states by a method with the step h / parts, logged every h."""
    t, states = h * np.arange(round(3 / h) + 1), [start]
    with np.errstate(all="ignore"):
        for time in t[:-1]:
            states.append(one_step(METHODS[method], f, np.array([time]), states[-1], np.array([h]), parts))
    return t, np.hstack(states)


def field(changes: dict[str, str], experiment: Experiment = SHORT, **numbers: float) -> Field:
    """The closed loop with statements changed."""
    loop = loop_of(experiment)
    program = code(tuple((name, changes.get(name, text)) for name, text in loop.statements))
    return lambda t, y: rates(loop, program, {**loop.numbers, **numbers}, t, y)


def test_statements_are_the_derived_closed_loop() -> None:
    states = np.random.default_rng(1).normal(size=(3, 50))
    t = np.linspace(0, 20, 50)
    for experiment in (LESSON, PROBLEM_6, NO_EXCITATION):
        derived = exact(experiment).first(t, states)
        assert np.allclose(field({}, experiment)(t, states), derived, rtol=1e-12, atol=1e-12), experiment.name


TERMS = {
    "the derivative of the estimate": (
        {"u": "alpha1_dot_known - z1 - k2 * z2"},
        r"row 2 is off by \+1 phi \* theta_hat': that term is missing from u \(7\)",
    ),
    "a sign in tau2": ({"tau2": "phi * z1 + alpha1_x1 * phi * z2"}, r"row 3 is off by \+2 .*wrong sign in tau2"),
    "r' in alpha1": ({"alpha1": "-k1 * z1 - theta_hat * phi"}, r"the term \+ r_dot is missing from alpha1 \(7\)"),
    "theta in u": (
        {"alpha1_dot_known": "alpha1_x1 * (x2 + theta_true * phi) + k1 * r_dot + r_ddot"},
        "obeys alpha1_dot_known = .*theta_true",
    ),
    "theta everywhere": (
        {"alpha1": "-k1 * z1 - theta_true * phi + r_dot", "alpha1_x1": "-k1 - theta_true",
         "alpha1_dot_known": "alpha1_x1 * (x2 + theta_true * phi) + k1 * r_dot + r_ddot"},
        "theta_true, which is unknown, stands in the control for theta_hat",
    ),
    "a quotient": ({"tau2": "phi * z1 - alpha1_x1 * phi * (z2 / 2)"}, r"row 3 is off by .*stands 0\.5 times in tau2"),
    "z1 in u": ({"u": "alpha1_dot_known - k2 * z2 - phi * theta_hat_dot"}, r"row 2 is off by \+1 z1: .*missing from u"),
    "r'' of another wave": ({"r_dot": "0.5 * 0.7 * sin(0.7 * t)"}, "r_dot"),
    "no update": ({"theta_hat_dot": "0 * tau2"}, r"missing from theta_hat'|gamma is 0"),
}  # fmt: skip


@pytest.mark.parametrize("name", TERMS)
def test_wrong_statement_is_named(name: str) -> None:
    changes, words = TERMS[name]
    found = said(*integrated(field(changes), parts=8))
    assert re.search(words, found), found


NUMBERS = {"theta_true": 1.21, "k1": 2.002, "k2": 2.4, "gamma": 3.001}


@pytest.mark.parametrize("name", NUMBERS)
def test_wrong_constant_is_named_with_its_value(name: str) -> None:
    found = said(*integrated(field({}, **{name: NUMBERS[name]})))
    assert re.match(rf"{name} is {NUMBERS[name]:.4g}, where the experiment has", found), found


def test_gains_that_are_exchanged_are_named() -> None:
    assert said(*integrated(field({}, k1=2.5, k2=2.0))).startswith("k1 and k2 are exchanged")


def test_other_references_are_named() -> None:
    t, states = integrated(field({}, PROBLEM_6))
    for r in (None, exact(with_values(PROBLEM_6, {"horizon": Fraction(3)})).reference(t)):
        assert "of the experiment problem_6" in said(t, states, r)
    halved = {name: text for name, text in loop_of(LESSON).statements if name == "r"}
    t, states = integrated(field(halved, PROBLEM_6, amplitude=0.5, omega=0.7))
    assert "r_dot, r_ddot are those of a cos of this size" in said(t, states)


METHOD = {
    "Euler": ((0.01, "Euler's method", 1), "by Euler's method with the step 0.01 s"),
    "Euler, logged now and then": ((0.01, "Euler's method", 5), "by Euler's method with the step 0.002 s"),
    "Euler, much finer than the log": (
        (0.01, "Euler's method", 37),
        "order 1, as Euler's, with a step of about 0.00027 s",
    ),
    "Heun": ((0.01, "Heun's method", 1), "by Heun's method with the step 0.01 s"),
    "a midpoint rule": ((0.02, "the midpoint rule", 2), "by the midpoint rule with the step 0.01 s"),
    "a coarse step": ((0.05, RK4, 1), "by classical Runge-Kutta with the step 0.05 s, which is too long for it"),
}


@pytest.mark.parametrize("name", METHOD)
def test_method_is_told_from_a_wrong_term(name: str) -> None:
    (h, method, parts), words = METHOD[name]
    found = said(*integrated(EXACT.first, h, method, parts))
    assert words in found, found


@pytest.mark.parametrize("options", [{}, {"rtol": 1e-5, "atol": 1e-8}, {"method": "Radau"}, {"method": "LSODA"}])
def test_loose_tolerance_is_told_from_a_wrong_term(options: dict[str, object]) -> None:
    from scipy.integrate import solve_ivp

    states = solve_ivp(
        lambda t, y: EXACT.first(np.array([t]), y[:, None])[:, 0], (0, 3), START[:, 0], t_eval=UNIFORM, **options
    ).y
    found = said(UNIFORM, states)
    assert found.startswith("the method, its step or its tolerance (11)"), found


def test_wrong_step_of_runge_kutta_is_named() -> None:
    wrong = (*METHODS[RK4][:2], ("s4", "f(t + h, y - h * s3)"), METHODS[RK4][-1])
    t, states = UNIFORM, [START]
    for time in t[:-1]:
        states.append(one_step(wrong, EXACT.first, np.array([time]), states[-1], np.array([0.01])))
    found = said(t, np.hstack(states))
    assert found.startswith("the Runge-Kutta step is wrong: the log obeys s4 = f(t + h, y - h * s3)"), found


@pytest.mark.parametrize(("period", "late"), [(1, 0), (5, 0), (5, 1)])
def test_control_that_is_sampled_and_held_is_named(period: int, late: int) -> None:
    """The plant is integrated exactly enough between samples, by RK4 in 4 parts."""
    states = [START]
    for i, time in enumerate(UNIFORM[:-1]):
        of = max(i // period - late, 0) * period
        u = EXACT.control(UNIFORM[of : of + 1], states[of])[0]

        def held(t: Array, y: Array, u: float = u) -> Array:
            rate = EXACT.first(t, y)
            rate[1] = u
            return rate

        states.append(one_step(METHODS[RK4], held, np.array([time]), states[-1], np.array([0.01]), 4))
    found = said(UNIFORM, np.hstack(states))
    assert f"x2' is constant over {0.01 * period:.4g} s: u is sampled and held" in found, found


TRUE = EXACT.evaluate(UNIFORM)
OF_THE_LOG = {
    "columns exchanged": (TRUE[[1, 0, 2]], "the columns are exchanged: x2, x1, theta_hat stand for x1, x2, theta_hat"),
    "rows late": (np.hstack([TRUE[:, :1], TRUE[:, :-1]]), "each state stands 1 row too late"),
    "rows early": (np.hstack([TRUE[:, 2:], TRUE[:, -2:] + 1]), "each state stands 2 rows too early"),
    "a spike": (TRUE + 0.1 * ((UNIFORM > 1) & (UNIFORM < 1.05)), "the rows from t = 1.01 to 1.04 alone are off"),
    "an offset": (TRUE + np.array([[0], [0.001], [0]]), "x2 is off by 0.001 in every row"),
    "another unit": (TRUE * np.array([[1], [1], [57.3]]), "theta_hat is 57.3 times what it should be"),
    "another start": (None, "x2 starts at -0.4, where x2_start is -0.5"),
    "late by a time": (EXACT.evaluate(np.maximum(UNIFORM - 1e-3, 0)), ""),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_THE_LOG)
def test_fault_of_the_log_is_told_from_one_of_the_loop(name: str) -> None:
    states, words = OF_THE_LOG[name]
    if states is None:
        _, states = integrated(EXACT.first, start=START + np.array([[0], [0.1], [0]]))
    assert words in said(UNIFORM, states), said(UNIFORM, states)


def test_state_of_another_experiment_is_named() -> None:
    whole = exact(LESSON)
    t = np.arange(4001) / 200
    states = whole.evaluate(t)
    states[2] = exact(NO_EXCITATION).evaluate(t)[2]
    r = whole.reference(t)
    log = Measured(Trajectory(t, states, r, states[0] - r, LESSON.names), whole)
    assert diagnosis(log, CONTRACT, ["x2"]).startswith("theta_hat is that of another experiment, no_excitation")


def test_right_log_has_no_diagnosis() -> None:
    assert said(UNIFORM, TRUE) == ""


DEGENERATE = {
    "two rows": (np.array([0.0, 3.0]), np.ones((3, 2))),
    "three rows": (np.array([0.0, 1e-300, 3.0]), np.ones((3, 3))),
    "zeros": (UNIFORM, np.zeros((3, 301))),
    "huge": (UNIFORM, np.full((3, 301), 1e300)),
    "beyond what is looked at from the start": (UNIFORM, 1e7 * (1 + UNIFORM) * np.ones((3, 1))),
    "noise": (UNIFORM, np.random.default_rng(3).normal(size=(3, 301))),
    "signs": (UNIFORM, -TRUE),
    "one row too many": (np.r_[UNIFORM, 3.001], EXACT.evaluate(np.r_[UNIFORM, 3.001]) * (1 + 1e-3)),
}


@pytest.mark.parametrize("name", DEGENERATE)
def test_log_without_sense_breaks_nothing(name: str) -> None:
    t, states = DEGENERATE[name]
    assert "\n" not in said(t, states)
