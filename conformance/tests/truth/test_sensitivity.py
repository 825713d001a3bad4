# SPDX-License-Identifier: MIT
"""Sensitivities and gains are enclosed along the whole solution, and V' + k1 z1^2 + k2 z2^2 contains 0 there."""

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from flint import arb, arb_poly, arb_series

from conformance.theory.experiments import values_of, with_values
from conformance.theory.lesson import LESSON
from conformance.trials.campaign import draw
from conformance.truth import sensitivity, tails
from conformance.truth.certificate import steps, straight_line
from conformance.truth.certify import at, run, series
from conformance.truth.exact import CONTRACT, exact
from conformance.truth.experiment import family, loop_of, problem, truth
from conformance.truth.taylor import compile_program
from conformance.truth.truth import enclose

pytestmark = pytest.mark.beyond

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
    for off in (CONTRACT, -CONTRACT):
        slopes = np.abs(_gradients(t, off)).reshape(7, 3, -1).max(axis=2)
        assert (EXACT.gains.field >= slopes[:3]).all() and (slopes[5] <= EXACT.gains.V).all()


@pytest.mark.parametrize(("k2", "holds"), [("2.5", True), ("2.500000001", False)])
def test_lyapunov_identity_holds_in_balls_along_the_whole_solution(k2: str, holds: bool) -> None:
    """All Taylor coefficients of V' + k1 z1^2 + k2 z2^2 on every step contain 0, and so does Lagrange's remainder."""
    loop = loop_of(LESSON)
    z1, z2 = loop.z
    defect = loop.V_dot + 2 * z1**2 + sp.Rational(Fraction(k2)) * z2**2
    program, outputs = straight_line(compile_program(loop.time, loop.states, [defect], loop.definitions))
    zeros = []
    with series(128, ORDER + 1):
        for step in steps(truth(LESSON)):
            half = arb(step.width) / 2
            x = [[p + arb(0, r)] for p, r in zip(step.polynomial, step.radius, strict=True)]
            near, over = (
                run(program, outputs, arb_series(s + arb(step.start)), at(x, s))[0][0]
                for s in (arb_poly([half + arb(0, radius), 1]) for radius in (0, half.abs_upper()))
            )
            assert all(near[k].rad() < 1e-12 for k in range(2))
            zeros.append(all(c.contains(0) for c in (*(near[k] for k in range(ORDER)), over[ORDER])))
    assert all(zeros) if holds else not any(zeros[:10])


def test_scenario_of_whose_sensitivities_the_norm_of_a_frame_says_too_little_is_proven() -> None:
    found = exact(draw(7, 13)).sensitivity
    assert (found.radius <= 1e-9 * (1 + np.abs(found.polynomial[:, 0]).max(axis=0))).all()


def test_half_the_tail_of_the_variational_equation_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The radius holds the error of polynomials of a low order, and does not if tails are left out."""
    of, enclosed = family(SHORT), enclose(problem(SHORT))
    monkeypatch.setattr(sensitivity, "ORDER", 6)
    monkeypatch.setattr(sensitivity, "SHARP", 1e-3)
    rough, _ = sensitivity.sensitivity(of.loop, of.numbers(SHORT), enclosed, np.full(3, CONTRACT))
    t = np.linspace(0, 1, 1001)
    off = np.abs(rough(t) - EXACT.sensitivity(t)).max(axis=2)
    assert (off <= rough.radius + 1e-9).all() and off.max() > 1e-6
    monkeypatch.setattr(tails.Tails, "radii", lambda self, norms, h: ([0.0] * len(self.program.rates), None))
    bare, _ = sensitivity.sensitivity(of.loop, of.numbers(SHORT), enclosed, np.full(3, CONTRACT))
    assert not (off <= bare.radius + 1e-9).all()
