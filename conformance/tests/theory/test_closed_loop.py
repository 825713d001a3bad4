# SPDX-License-Identifier: MIT
"""The derived closed loop is exact, closed, and reproduces the lesson's solution; (7), (10), (15)."""

import pytest
import sympy as sp

from conformance.theory.design import closed_loop
from conformance.theory.strict_feedback import DesignError

from .lesson import (
    EXPERIMENT,
    REFERENCE,
    START,
    gamma,
    integrate,
    k1,
    k2,
    lesson_design,
    lesson_loop,
    random_design,
    t,
    theta,
    theta_hat,
    x1,
    x2,
)

RUNGE_KUTTA_ERROR = 2e-9  # order 4, h = 0.002: halving h changes these values by less

SOLUTION = {
    0.1: (1.17342048378473, -2.96869266344466, 1.87081572148824),
    2: (0.448120205499685, -0.355976931611338, 1.14692101257012),
    20: (0.495303675161773, -0.546506377914894, 1.1999999977729),
}


@pytest.mark.parametrize("time", SOLUTION)
def test_closed_loop_of_the_experiment_reproduces_the_exact_solution(time):
    assert integrate(lesson_loop(), START, time) == pytest.approx(SOLUTION[time], abs=RUNGE_KUTTA_ERROR)


def test_closed_loop_is_exact_and_in_time_and_states_alone():
    loop = lesson_loop()
    known = {loop.time, *loop.states}
    for name, e in loop.definitions:
        assert e.free_symbols <= known
        known.add(name)
    for e in (*loop.rhs, *loop.z, loop.u, loop.reference, loop.V, loop.V_dot, loop.dissipation):
        assert e.free_symbols <= known
        assert not e.atoms(sp.Float)


def test_closed_loop_carries_reference_errors_and_lyapunov_function():
    loop = lesson_loop()
    start = {t: 0, **dict(zip(loop.states, map(sp.Rational, ("1.2", "-0.5", "0")), strict=True))}
    assert loop.states == (x1, x2, theta_hat)
    assert sp.simplify(loop.explicit(loop.reference) - REFERENCE) == 0
    assert loop.explicit(loop.V).subs(start) == sp.Rational("2.16125")  # (10)
    assert sp.simplify(loop.explicit(loop.V_dot + loop.dissipation)) == 0
    assert sp.simplify(loop.explicit(loop.z[0]) - (x1 - REFERENCE)) == 0


def test_family_of_closed_loops_has_each_loop_as_a_member():
    amplitude = sp.Symbol("amplitude")
    family = closed_loop(
        lesson_design(), [theta], amplitude * sp.sin(sp.Rational(7, 10) * t), free=(theta, k1, k2, gamma, amplitude)
    )
    numbers = {theta: "1.2", amplitude: "0.5", **EXPERIMENT}
    exact = {symbol: sp.Rational(str(value)) for symbol, value in numbers.items()}
    for member, alone in zip(family.rhs, lesson_loop().rhs, strict=True):
        assert sp.expand(family.explicit(member).xreplace(exact) - lesson_loop().explicit(alone)) == 0


def test_symbol_that_is_not_free_needs_a_value():
    with pytest.raises(DesignError, match="k2 has no value"):
        closed_loop(lesson_design(), [theta], REFERENCE, free=(theta, k1, gamma))


@pytest.mark.beyond
def test_closed_loop_of_four_states_and_three_parameters_stays_small():
    loop = closed_loop(random_design(4, 3), ["1.2", -1, "1/3"], REFERENCE)
    operations = sum(e.count_ops() for _, e in loop.definitions) + sum(e.count_ops() for e in loop.rhs)
    assert len(loop.rhs) == 7
    assert operations < 20_000


BAD_LOOPS = {
    "too many parameters": (["1.2", 1], REFERENCE, EXPERIMENT, "theta: 2 values given, 1 needed"),
    "a double for theta": ([1.2], REFERENCE, EXPERIMENT, "theta: the double 1.2 is not exact; write '1.2'"),
    "a gain without value": (["1.2"], REFERENCE, {k1: 2, gamma: 3}, "k2 has no value"),
    "a gain made negative": (["1.2"], REFERENCE, {k1: 2, k2: -1, gamma: 3}, "row 2: k_2 = -1 is not positive"),
    "gamma made zero": (["1.2"], REFERENCE, {k1: 2, k2: 1, gamma: 0}, "Gamma is not positive definite"),
    "a value for nothing": (["1.2"], REFERENCE, {**EXPERIMENT, x1: 1}, "x1 is neither a constant of the plant"),
    "a reference of the state": (["1.2"], x1, EXPERIMENT, "the reference: x1 may use t alone"),
    "a reference with a double": (["1.2"], 0.5 * t, EXPERIMENT, "the reference: .* is not exact"),
    "a reference with a kink": (["1.2"], sp.Abs(t - 1), EXPERIMENT, "the reference: .* is not smooth"),
    "an imaginary reference": (["1.2"], sp.I * sp.sin(t), EXPERIMENT, "the reference: .* is not real"),
    "a reference that grows": (["1.2"], sp.exp(t), EXPERIMENT, r"the reference: exp\(t\) is not bounded, or not known"),
    "a cubic reference": (["1.2"], t**3, EXPERIMENT, r"the reference: t\*\*3 is not bounded"),
    "a swing that grows": (["1.2"], t * sp.sin(t), EXPERIMENT, "the reference: .* is not bounded"),
    "a derivative that grows": (["1.2"], sp.sin(t**2), EXPERIMENT, "the reference: .* is not bounded"),
}


@pytest.mark.parametrize(
    "reference",
    [3, sp.sin(t) * sp.cos(2 * t) ** 2, sp.tanh(t), sp.exp(-t), t * sp.exp(-t), 1 / (1 + t**2), sp.exp(sp.sin(t))],
    ids=str,
)
def test_bounded_reference_is_accepted(reference):
    assert lesson_loop(reference).explicit(lesson_loop(reference).reference) == reference


@pytest.mark.parametrize(("theta", "reference", "values", "message"), BAD_LOOPS.values(), ids=BAD_LOOPS)
def test_bad_closed_loop_is_a_one_line_error(theta, reference, values, message):
    with pytest.raises(DesignError, match=message) as error:
        closed_loop(lesson_design(), theta, reference, values)
    assert "\n" not in str(error.value)
