# SPDX-License-Identifier: MIT
"""The truth: a proven enclosure of the solution of an initial-value problem.

`enclose` gives an Enclosure. `at` evaluates it as balls at exact times, `evaluate` as doubles at many times.
docs/truth.md tells why the enclosure is one.
"""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import inf, nextafter
from typing import NamedTuple

import numpy as np
import sympy as sp
from flint import arb, fmpq
from numpy.typing import ArrayLike

from conformance.truth import enclosure
from conformance.truth.dense import tabulate
from conformance.truth.enclosure import BUDGET, Budget, Progress, ProofEnded
from conformance.truth.piecewise import Floats, Table
from conformance.truth.taylor import Definition, Program, coefficients, compile_program, exact, precision

__all__ = ["Ball", "Enclosure", "ExactStep", "InitialValueProblem", "ProofEnded", "enclose"]

SMALLEST, LARGEST = 1e-100, 1e100  # of targets and numbers: bounds are doubles
ONE_AT_A_TIME = threading.Lock()  # proofs: the precision of ball arithmetic is the process's, not a thread's


class ExactStep(NamedTuple):
    """|x_i(start + s) - sum_k polynomials[i][k] s^k| <= radii[i] for 0 <= s <= end - start, times in s; all exact.

    Steps join: one starts where the last ended. Their polynomials do not: each is about its own midpoint.
    """

    start: Fraction
    end: Fraction
    polynomials: tuple[tuple[Fraction, ...], ...]
    radii: tuple[Fraction, ...]


class Ball(NamedTuple):
    """All numbers within `radius` of `middle`, both exact."""

    middle: sp.Rational
    radius: sp.Rational


@dataclass(frozen=True)
class InitialValueProblem:
    """states' = rhs(time, states), states(0) = start, on [0, horizon] (s).

    `definitions`: names for what rhs uses, in terms of time, states and earlier names. Numbers are exact: 6/5, not 1.2.
    A start may be a Ball. Raises ValueError for what does not fit together.
    """

    time: sp.Symbol
    states: tuple[sp.Symbol, ...]
    rhs: tuple[sp.Expr, ...]
    start: tuple[sp.Rational | Ball, ...]
    horizon: sp.Rational
    definitions: tuple[Definition, ...] = ()

    def __post_init__(self) -> None:
        if not self.states or not len(self.states) == len(self.rhs) == len(self.start):
            raise ValueError("give one right-hand side and one start value per state, and at least one state")
        names = [s.name for s in (self.time, *self.states, *(name for name, _ in self.definitions))]
        repeated = [name for i, name in enumerate(names) if name in names[:i]]
        if repeated:
            raise ValueError(f"time, states and definitions need names of their own: {repeated[0]} stands for two")
        if not all(isinstance(sp.sympify(v), sp.Rational) for v in (*self._start_numbers(), self.horizon)):
            raise ValueError("start values and horizon must be exact rationals, such as 6/5 for 1.2")
        if not SMALLEST <= self.horizon <= LARGEST:
            raise ValueError(f"the horizon must lie between {SMALLEST:g} and {LARGEST:g} s, not {self.horizon}")
        for number in self._start_numbers():
            if abs(number) > LARGEST:
                raise ValueError(f"a start value must not exceed {LARGEST:g}, and one is {sp.N(number, 3)}")

    def _start_numbers(self) -> list[sp.Rational]:
        return [part for v in self.start for part in (v if isinstance(v, Ball) else (v,))]

    @property
    def names(self) -> tuple[str, ...]:
        """The rows of its enclosure."""
        return tuple(s.name for s in self.states)

    @property
    def end(self) -> float:
        """The smallest double that is not below the horizon (s): the proof runs up to there."""
        nearest = float(self.horizon)
        return nearest if Fraction(nearest) >= _fraction(self.horizon) else nextafter(nearest, inf)

    def start_balls(self) -> list[arb]:
        """The start values as balls at the current precision."""
        return [
            exact(v.middle) + arb(0, exact(v.radius).upper()) if isinstance(v, Ball) else exact(sp.sympify(v))
            for v in self.start
        ]


def _fraction(value: sp.Rational) -> Fraction:
    value = sp.sympify(value)
    return Fraction(int(value.p), int(value.q))


def _ball(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))


# --- Enclosure -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Enclosure:
    """Polynomials and radii which enclose every row, one per state, at every time of [0, end] (s).

    names: the rows. bits: the precision of the proof. starts: (steps,) s. radius: (steps, rows), absolute.
    polynomials: per step and row "m e m e ...", the exact coefficients m 2^e about the step's start, m in hex.
    table: the same as doubles.
    """

    names: tuple[str, ...]
    bits: int
    starts: Floats
    radius: Floats
    polynomials: tuple[tuple[str, ...], ...]
    table: Table

    @property
    def end(self) -> float:
        """The last time (s) of the enclosure."""
        return float(self.table.edges[-1])

    @property
    def edges(self) -> Floats:
        """Where the steps start, and where the last one ends (s): doubles, taken exactly."""
        return np.append(self.starts, self.end)

    def steps(self) -> Iterator[ExactStep]:
        """What was proven, step by step, in exact numbers: all else follows from it."""
        for j, (start, end) in enumerate(pairwise(self.edges.tolist())):
            polynomials = tuple(tuple(_numbers(text)) for text in self.polynomials[j])
            radii = tuple(map(Fraction, self.radius[j].tolist()))
            yield ExactStep(Fraction(start), Fraction(end), polynomials, radii)

    @property
    def bound(self) -> Floats:
        """Per row: a bound of |evaluate - solution| over all times, absolute."""
        return self.table.bound

    @property
    def scale(self) -> Floats:
        """Per row: a number not above max |row| over the horizon, and close to it."""
        return self.table.scale

    @cached_property
    def largest_radius(self) -> float:
        """The largest radius of any row at any time."""
        return float(self.radius.max())

    def at(self, time: sp.Rational | Fraction | float | str) -> tuple[arb, ...]:
        """One ball per row at an exact time (s): a rational, a decimal string, or a double taken exactly.

        Raises ValueError for a time outside of [0, end].
        """
        t = _fraction(time) if isinstance(time, sp.Basic) else Fraction(time)
        if not 0 <= t <= self.end:
            raise ValueError(f"time {time} is outside of [0, {self.end!r}]")
        j = bisect_right(self.starts, t) - 1
        with precision(self.bits):
            ball = _ball(t - Fraction(float(self.starts[j])))
            return tuple(
                _horner(text, ball) + arb(0, radius)
                for text, radius in zip(self.polynomials[j], self.radius[j].tolist(), strict=True)
            )

    def evaluate(self, times: ArrayLike, names: Sequence[str] | None = None) -> Floats:
        """The rows as doubles, shape (rows, *times.shape), each within `bound` of the solution; times in any order (s).

        Raises ValueError for a time outside of [0, end] or an unknown name.
        """
        return self.table(times, [self.names.index(name) for name in (self.names if names is None else names)])


def _horner(text: str, s: arb) -> arb:
    total, words = arb(0), text.split()
    for mantissa, exponent in zip(words[-2::-2], words[::-2], strict=True):
        total = total * s + arb((int(mantissa, 16), int(exponent)))
    return total


def _numbers(text: str) -> Iterator[Fraction]:
    words = text.split()
    for mantissa, exponent in zip(words[::2], words[1::2], strict=True):
        yield int(mantissa, 16) * Fraction(2) ** int(exponent)


def _text(polynomial: Sequence[arb]) -> str:
    return " ".join(f"{int(m):x} {int(e)}" for m, e in (c.man_exp() for c in polynomial))


def compiled(problem: InitialValueProblem) -> Program:
    """The right-hand sides of a problem, as what Taylor coefficients are computed by."""
    return compile_program(problem.time, problem.states, problem.rhs, problem.definitions)


def ball_function(
    problem: InitialValueProblem, expressions: Sequence[sp.Expr]
) -> Callable[[Fraction, Sequence[arb]], list[arb]]:
    """Expressions in the problem's time, states and definitions, as a function of an exact time and of balls."""
    program = compile_program(problem.time, problem.states, expressions, problem.definitions)

    def values(time: Fraction, states: Sequence[arb]) -> list[arb]:
        nodes = coefficients(program, _ball(time), states, 0)
        return [nodes[node][0] for node in program.rhs]

    return values


# --- Enclose -------------------------------------------------------------------------------------


def enclose(
    problem: InitialValueProblem, target: float = 1e-18, budget: float = BUDGET, progress: Progress | None = None
) -> Enclosure:
    """The proven enclosure of the problem, with a radius of at most `target` for every row at every time.

    target: absolute, in the units of the rows. budget: CPU time (s). progress: told the time reached (s), four times a
    second at most; it falls back where an attempt begins anew. One at a time, since the precision of ball arithmetic is
    global. Raises ProofEnded where the proof cannot be continued to the horizon, or not within the budget, with the
    time reached; ValueError for a right-hand side without a Taylor rule.
    """
    if not SMALLEST <= target <= LARGEST:
        raise ValueError(f"the target radius must lie between {SMALLEST:g} and {LARGEST:g}, not {target}")
    program = compiled(problem)
    with ONE_AT_A_TIME:
        steps = enclosure.prove(program, problem.start_balls, problem.end, target, Budget(budget, progress))
        bits = max(step.bits for step in steps)
        with precision(bits):
            table = tabulate(steps, bits)
    return Enclosure(
        problem.names,
        bits,
        np.array([step.start for step in steps]),
        np.array([step.radius for step in steps]),
        tuple(tuple(map(_text, step.polynomial)) for step in steps),
        table,
    )
