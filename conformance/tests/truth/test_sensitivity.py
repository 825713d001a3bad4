# SPDX-License-Identifier: MIT
"""Sensitivities and gains are enclosed along the whole solution, and V' + k1 z1^2 + k2 z2^2 contains 0 there."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from flint import arb

from conformance.theory.experiments import values_of, with_values
from conformance.theory.lesson import LESSON
from conformance.truth.certificate import content, straight_line
from conformance.truth.certify import parse, written
from conformance.truth.deviation import polynomial, rational, rows, series
from conformance.truth.exact import exact
from conformance.truth.experiment import loop_of, problem, truth
from conformance.truth.sensitivity import TUBE
from conformance.truth.taylor import compile_program

EXACT = exact(LESSON)
COLUMNS = EXACT.sensitivity.columns.tolist()
SHORT = with_values(LESSON, {"horizon": Fraction(1)})
ORDER = 6


@pytest.mark.parametrize("name", ["gamma", "omega", "x2_start"])
def test_sensitivity_is_the_slope_between_two_proven_solutions(name: str) -> None:
    """Half the difference of the solutions for p + d and p - d misses d dx/dp by O(d^3)."""
    t, d = np.linspace(0, 1, 101), Fraction(1, 10**5)
    above, below = (exact(with_values(SHORT, {name: values_of(SHORT)[name] + change})) for change in (d, -d))
    slope = (above.evaluate(t) - below.evaluate(t)) / (2 * float(d))
    off = np.abs(slope - EXACT.sensitivity(t)[:, COLUMNS.index(name)])
    assert (off <= EXACT.sensitivity.radius[:, COLUMNS.index(name), None] + 1e-7).all()


def test_radius_of_the_sensitivities_is_small() -> None:
    largest = np.abs(EXACT.sensitivity(np.linspace(0, 20, 2001))).max(axis=2)
    assert (EXACT.sensitivity.radius <= 1e-5 * (1 + largest)).all()


def test_gains_bound_the_slopes_at_every_sample_and_are_near_the_largest() -> None:
    t = np.linspace(0, 20, 20001)
    slopes = np.abs(_gradients(t)).reshape(7, 3, -1)
    largest, gains = slopes.max(axis=2), EXACT.gains
    for enclosed, seen in ((gains.field, largest[:3]), (gains.z, largest[3:5]), (gains.V, largest[5])):
        assert (enclosed >= seen).all() and (enclosed <= 1.001 * seen).all()
    dissipated = np.trapezoid(slopes[6], t, axis=1)
    assert (gains.dissipated >= dissipated * (1 - 1e-6)).all() and (gains.dissipated <= 1.001 * dissipated).all()


def _gradients(t: np.ndarray, off: float = 0.0) -> np.ndarray:
    return EXACT.functions("gradients", EXACT.values, t, EXACT.evaluate(t) + off)


def test_gains_hold_for_all_states_within_the_contract() -> None:
    t = np.linspace(0, 20, 20001)
    for off in (TUBE, -TUBE):
        slopes = np.abs(_gradients(t, off)).reshape(7, 3, -1).max(axis=2)
        assert (EXACT.gains.field >= slopes[:3]).all() and (slopes[5] <= EXACT.gains.V).all()


@pytest.mark.parametrize(("k2", "holds"), [("2.5", True), ("2.500000001", False)])
def test_lyapunov_identity_holds_in_balls_along_the_whole_solution(k2: str, holds: bool) -> None:
    """All Taylor coefficients of V' + k1 z1^2 + k2 z2^2 on every step contain 0, and so does Lagrange's remainder."""
    loop = loop_of(LESSON)
    z1, z2 = loop.z
    defect = loop.V_dot + 2 * z1**2 + sp.Rational(Fraction(k2)) * z2**2
    program, outputs = straight_line(compile_program(loop.time, loop.states, [defect], loop.definitions))
    steps = parse(written(content(problem(LESSON), truth(LESSON)))).claim.steps
    zeros = []
    with series(128, ORDER + 1):
        for step in steps:
            h = rational(step.width)
            x = [polynomial(p, arb(0), h, r) for p, r in zip(step.polynomial, step.radius, strict=True)]
            t = polynomial([rational(step.start), arb(1)], arb(0), h)
            ((value, _),) = rows(program, outputs, t, x)
            at, over = (list(one.coeffs()) for one in value)
            assert all(c.rad() < 1e-12 for c in at[:2])
            zeros.append(all(c.contains(0) for c in (*at[:ORDER], *over[ORDER:])))
    assert all(zeros) if holds else not any(zeros[:10])
