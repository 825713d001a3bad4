# SPDX-License-Identifier: MIT
"""How the exact solution of a scenario moves with its parameters and start values, and what the checks gain from it.

The sensitivities S = dx/dp obey the variational equation S' = J S + df/dp. Polynomials for x and S are found in doubles
and bounded as in `deviation`: the columns of S - S~ obey the same linear equation as x - x~, with other defects. J and
df/dp are enclosed over all states within CLOSE of x~. The gains are enclosed over all states within TUBE of it, so that
by the mean value theorem they hold for differences up to TUBE, and not only to first order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly

from conformance.theory.scenario import PARAMETERS, Scenario
from conformance.truth.certificate import straight_line
from conformance.truth.deviation import (
    Floats,
    Line,
    NotProven,
    Objects,
    Spread,
    about,
    abs_upper,
    advance,
    at,
    exactly,
    frame,
    middles,
    objects,
    polynomial,
    rates,
    rational,
    rows,
    series,
)
from conformance.truth.enclosure import ProofEnded
from conformance.truth.exact import COLUMNS, Gains, Sensitivity
from conformance.truth.experiment import SYMBOLS, derived_loop, parameters, problem
from conformance.truth.taylor import coefficients, compile_program

ORDER = 20  # of the polynomials and of all expansions
TOLERANCE = 1e-16  # of the last term of a polynomial, per step
CLOSE = 1e-10  # of x~ to x
TUBE = 1e-6  # of each state: the largest tolerance of the contract
GAIN_ORDER = 10  # of the expansions of the gains
BITS = 80
SAMPLES = 64  # per step, between which a gain may rise by its curvature
GROWTH = Fraction(5, 4)  # of the width from step to step, at most
SHORTEST = Fraction(1, 2**20)  # s
ABOVE = 1 + 1e-9  # rounds a double up
ROUNDING = 1e-14  # relative, of the samples: more than ORDER operations in doubles make


class Piece(NamedTuple):
    """One step: its start and width (s), S~ as (ORDER, 3, columns) and its radii, and the slopes of the outputs."""

    start: Fraction
    width: Fraction
    polynomial: Floats
    radius: Floats
    slopes: Objects  # (2, outputs, 3): field, z, V and dissipation, with respect to the states


@dataclass
class Walk:
    """Where the steps have come to: time (s), x, S~, and how far the exact x and S are from these, side by side."""

    time: Fraction
    x: list[arb]
    S: Floats
    e: Spread


class Field(NamedTuple):
    """A scenario's x' = f(t, x; p) as straight-line programs: with its parameters free, and with their values."""

    free: list[Line]  # whose states are x and p
    rhs: list[int]
    values: list[arb]  # of p
    known: list[Line]
    outputs: list[int]  # field, z, V and dissipation

    @classmethod
    def of(cls, scenario: Scenario) -> Field:
        """Derived from the design."""
        loop, numbers = derived_loop(scenario.wave), parameters(scenario)
        free = compile_program(loop.time, (*loop.states, *SYMBOLS), loop.rhs, loop.definitions)
        outputs = [e.xreplace(numbers) for e in (*loop.rhs, *loop.z, loop.V, loop.dissipation)]
        named = [(name, e.xreplace(numbers)) for name, e in loop.definitions]
        known = compile_program(loop.time, loop.states, outputs, named)
        values = [rational(getattr(scenario, name)) for name in PARAMETERS]
        return cls(*straight_line(free), values, *straight_line(known))


def pieces(scenario: Scenario) -> Iterator[Piece]:
    """The sensitivities step by step; raises ProofEnded where a step would have to be too short."""
    flow = problem(scenario)
    point = compile_program(flow.time, flow.states, flow.rhs, flow.definitions)
    n = len(flow.states)
    with series(BITS, ORDER):
        field = Field.of(scenario)
        starts = flow.start_balls()
        S = np.hstack([np.zeros((n, len(PARAMETERS))), np.eye(n)])
        jumps = np.zeros((n, 1 + len(COLUMNS))).astype(object)
        jumps[:, 0] = [abs_upper(v - v.mid()) for v in starts]
        e = Spread(np.zeros((n, 1)).astype(object), 0 * jumps[0], jumps)
        walk = Walk(Fraction(0), [v.mid() for v in starts], S, e)
        width = Fraction(1)
        while walk.time < flow.end:
            taylor = coefficients(point, rational(walk.time), walk.x, ORDER)
            path = [[c.mid() for c in taylor[state][:ORDER]] for state in point.states]
            width = min(width * GROWTH, _width(path))
            while (piece := _piece(field, path, walk, width)) is None:
                width = width / 2
                if width < SHORTEST:
                    raise ProofEnded(float(walk.time), "the sensitivities would need steps that are too short")
            yield piece


def _width(path: list[list[arb]]) -> Fraction:
    """The width at which the last terms are within the tolerance, of three bits."""
    last = max(max(abs(float(row[-1])), abs(float(row[-2]))) for row in path)
    h = min((TOLERANCE / last) ** (1 / (ORDER - 1)) if last > 0 else 1.0, 1.0)
    grain = Fraction(2) ** (math.frexp(h)[1] - 3)
    return math.floor(h / grain) * grain


def _piece(field: Field, path: list[list[arb]], walk: Walk, width: Fraction) -> Piece | None:
    """One step of this width, and the walk at its end; None, and the walk as before, where it is too wide."""
    n, h = len(path), rational(width)
    s = about(arb(0), h)
    t, x = polynomial([rational(walk.time), arb(1)], s), [polynomial(p, s) for p in path]
    f = rows(field.known, field.outputs[:n], t, x)
    values = [polynomial([value], s) for value in field.values]
    G = rows(field.free, field.rhs, t, [*_within(path, CLOSE, s), *values], derive=True)[:, :, 1:]
    J = G[:, :, :n]
    f_p = np.concatenate([G[:, :, n:], 0 * J], axis=2)
    S = _taylor(J, f_p, walk.S)
    rising = exactly(S)
    d_x = np.stack([polynomial(rates(p), s) for p in path], axis=1)[:, :, None] - f
    d = np.concatenate([d_x, polynomial(rates(rising), s) - J @ polynomial(rising, s) - f_p], axis=2)
    try:
        bound, e = advance(h, J, d, frame(walk.e, np.ones(n)))
    except NotProven:
        return None
    if not all(close < CLOSE for close in bound[:, 0]):
        return None
    end, S_end = objects(at(p, h) for p in path), at(rising, h)
    x_kept, S_kept = objects(v.mid() for v in end), S_end.astype(float)
    jumps = np.column_stack([end - x_kept, S_end - exactly(S_kept)])
    with series(BITS, GAIN_ORDER):
        s = about(arb(0), h)
        t = polynomial([rational(walk.time), arb(1)], s)
        gains = rows(field.known, field.outputs, t, _within(path, TUBE, s), derive=True)[:, :, 1:]
    piece = Piece(walk.time, width, S, bound[:, 1:].astype(float) * ABOVE, gains)
    walk.time, walk.x, walk.S = walk.time + width, list(x_kept), S_kept
    walk.e = e._replace(jumps=np.asarray(np.frompyfunc(abs_upper, 1, 1)(jumps)))
    return piece


def _within(path: list[list[arb]], radius: float, s: tuple[arb_poly, arb_poly]) -> list[Objects]:
    """The functions within a radius of the polynomials."""
    return [polynomial([p[0] + arb(0, radius), *p[1:]], s) for p in path]


def _taylor(J: Objects, f_p: Objects, start: Floats) -> Floats:
    """Taylor coefficients of S, (ORDER, rows, columns), in doubles."""
    A, b = (middles(part, ORDER) for part in (J, f_p))
    S = [start]
    for k in range(1, ORDER):
        S.append((sum(A[i] @ S[k - 1 - i] for i in range(k)) + b[k - 1]) / k)
    return np.array(S)


# ---- As arrays, and the gains ----


def sensitivity(scenario: Scenario) -> tuple[Sensitivity, Gains]:
    """The sensitivities of a scenario, and the gains of its checks, both proven.

    Raises ProofEnded where they cannot be.
    """
    found = list(pieces(scenario))
    largest, integral = np.zeros((7, 3)), np.zeros((7, 3))
    for piece in found:
        largest_here, integral_here = _extent(piece)
        largest, integral = np.maximum(largest, largest_here), integral + integral_here
    return (
        Sensitivity(
            starts=np.array([float(piece.start) for piece in found]),
            polynomial=np.array([piece.polynomial for piece in found]),
            radius=np.max([piece.radius for piece in found], axis=0),
            end=float(found[-1].start + found[-1].width),
        ),
        Gains(field=largest[:3], z=largest[3:5], V=largest[5], dissipated=integral[6]),
    )


def _extent(piece: Piece) -> tuple[Floats, Floats]:
    """Of each slope, on one step: a bound of its absolute value, and of the integral of that; each (7, 3).

    Between samples a distance D apart, a function rises above the line through them by at most D^2/8 sup|f''|.
    """
    h, k = float(piece.width), np.arange(GAIN_ORDER)
    middle = middles(piece.slopes, GAIN_ORDER) * h ** k[:, None, None]
    s = np.linspace(0, 1, SAMPLES + 1)
    sampled = np.abs(np.einsum("ks,kij->sij", s ** k[:, None], middle))
    above = np.einsum("k,kij->ij", k * (k - 1) / (8 * SAMPLES**2) + ROUNDING, np.abs(middle))
    above += np.frompyfunc(lambda first, over: _spread(first, over, h), 2, 1)(*piece.slopes).astype(float)
    trapezoid = (sampled[:-1] + sampled[1:]).mean(axis=0) / 2
    return (sampled.max(axis=0) + above) * ABOVE, h * (trapezoid + above) * ABOVE


def _spread(first: Any, over: Any, h: float) -> float:
    """How far a function may be from the polynomial of its middles: their radii, and Lagrange's remainder."""
    with series(BITS, GAIN_ORDER):
        radii = sum((first[k].rad() * arb(h) ** k for k in range(GAIN_ORDER)), arb(0))
        return float((radii + over[GAIN_ORDER] * arb(h) ** GAIN_ORDER).abs_upper()) * ABOVE
