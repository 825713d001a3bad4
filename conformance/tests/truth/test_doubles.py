# SPDX-License-Identifier: MIT
"""No double is farther from the exact solution than the bound says: any horizon, any scale, the last step included."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp
from flint import arb, fmpq

from conformance.tests.truth.problems import CLOSED, Closed, R, t, x, y
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, InitialValueProblem, enclose

pytestmark = pytest.mark.beyond

TIMES = 10_000


def ball(number: sp.Rational) -> arb:
    return arb(fmpq(int(number.p), int(number.q)))


def fast(T: sp.Rational) -> Closed:
    return Closed(InitialValueProblem(t, (x,), (1000 * sp.cos(1000 * t),), (R(0),), T), lambda s: ((1000 * s).sin(),))


def oscillator(T: sp.Rational) -> Closed:
    problem = InitialValueProblem(t, (x, y), (1000 * y, -1000 * x), (R(1), R(0)), T)
    return Closed(problem, lambda s: ((1000 * s).cos(), -(1000 * s).sin()))


def pole(T: sp.Rational) -> Closed:
    return Closed(InitialValueProblem(t, (x,), (x**2,), (R(1),), T), lambda s: (1 / (1 - s),))


def slow(T: sp.Rational) -> Closed:
    return Closed(InitialValueProblem(t, (x,), (-x / 1000,), (R(1),), T), lambda s: ((-s / 1000).exp(),))


def of_size(size: sp.Rational) -> Callable[[sp.Rational], Closed]:
    """A non-autonomous problem whose state is of this size, or size / e^(t^2), which is its target's scale too."""

    def problem(T: sp.Rational) -> Closed:
        return Closed(
            InitialValueProblem(t, (x,), (-2 * t * x,), (size,), T), lambda s: (ball(size) * (-(s * s)).exp(),)
        )

    return problem


KINDS: dict[str, tuple[Callable[[sp.Rational], Closed], tuple[float, float], float]] = {  # horizons (s), target
    "1000 rad/s, forced": (fast, (0.1, 0.6), 1e-18),
    "oscillator of 1000 rad/s": (oscillator, (0.1, 0.5), 1e-18),
    "near a pole": (pole, (0.99, 0.9999), 1e-18),
    "slow": (slow, (10.0, 1000.0), 1e-18),
    "of size 1e30": (of_size(R(10) ** 30), (0.5, 2.0), 1e12),
    "of size 1e-40": (of_size(R(10) ** -40), (0.5, 2.0), 1e-58),
}


def horizons(kind: str) -> list[sp.Rational]:
    """Rationals of up to nine digits: hardly ever doubles, and never short ones."""
    source, (least, most) = random.Random(kind), KINDS[kind][1]
    return [R(source.randint(int(least * 10**9), int(most * 10**9)), 10**9 - 2 * i) for i in range(2)]


def worst(closed: Closed, enclosed: Enclosure) -> float:
    """The largest ratio of error and bound at random times, a fifth of them in the last step and at its edges."""
    source = np.random.default_rng(1)
    last = float(enclosed.starts[-1])
    edges = enclosed.table.edges
    edge_times = source.choice(np.concatenate([edges, np.nextafter(edges[1:], 0)]), TIMES // 10)
    times = np.concatenate([source.uniform(0, enclosed.end, TIMES), source.uniform(last, enclosed.end, TIMES // 10)])
    times = np.minimum(np.concatenate([times, edge_times]), enclosed.end)
    bounds = enclosed.bound.tolist()
    with precision(300):
        return max(
            float(abs(exact - value) / bound)
            for time, values in zip(times.tolist(), enclosed.evaluate(times).T.tolist(), strict=True)
            for exact, value, bound in zip(closed.solution(arb(time)), values, bounds, strict=True)
        )


@pytest.mark.parametrize("kind", KINDS)
def test_no_double_is_farther_off_than_its_bound(kind: str) -> None:
    make, _, target = KINDS[kind]
    for T in horizons(kind):
        closed = make(T)
        enclosed = enclose(closed.problem, target)
        assert worst(closed, enclosed) <= 1, T
        assert np.all(enclosed.bound <= 4e-15 * enclosed.scale), T


@pytest.mark.parametrize("name", ["logistic equation", "sine of the state", "quotient and logarithm"])
def test_no_double_of_other_closed_problems_is_farther_off(name: str) -> None:
    assert worst(CLOSED[name], enclose(CLOSED[name].problem)) <= 1
