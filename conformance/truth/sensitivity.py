# SPDX-License-Identifier: MIT
"""How the exact solution of an experiment moves with its parameters and start values, and what the checks gain from it.

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
from flint import arb, arb_poly, arb_series

from conformance.theory.experiments import Experiment, numbers_of_loop, starts_of
from conformance.truth.certificate import straight_line
from conformance.truth.deviation import (
    Deviation,
    Floats,
    Line,
    NotProven,
    Objects,
    abs_upper,
    advance,
    constant,
    exactly,
    jumped,
    objects,
    polynomial,
    polynomials,
    product,
    rates,
    rational,
    rows,
    series,
    unit,
)
from conformance.truth.enclosure import ProofEnded
from conformance.truth.exact import Gains, Sensitivity
from conformance.truth.experiment import family, loop_of, problem
from conformance.truth.taylor import coefficients, compile_program

ORDER = 22  # of the polynomials and of all expansions
TOLERANCE = 1e-20  # of the last term of a polynomial, per step
CLOSE = 1e-10  # of x~ to x
TUBE = 1e-6  # of each state: the largest tolerance of the contract
GAIN_ORDER = 10  # of the expansions of the gains
BITS = 100
SAMPLES = 64  # per step, between which a gain may rise by its curvature
GROWTH = Fraction(5, 4)  # of the width from step to step, at most
SHORTEST = Fraction(1, 2**20)  # s
ABOVE = 1 + 1e-9  # rounds a double up
ROUNDING = 1e-14  # relative, of the samples: more than ORDER operations in doubles make


class Piece(NamedTuple):
    """One step: its start and width (s), S~ (ORDER, states, columns) and its radii, and the slopes of outputs."""

    start: Fraction
    width: Fraction
    polynomial: Floats
    radius: Floats
    slopes: Objects  # pairs (outputs, states, 2): field, z, V and dissipation, with respect to the states


@dataclass
class Walk:
    """Where the steps have come to: time (s), x, S~, and how far the exact x and S are from these, side by side."""

    time: Fraction
    x: list[arb]
    S: Floats
    e: Deviation


class Field(NamedTuple):
    """An experiment's x' = f(t, x; p) as straight-line programs: with its parameters free, and with their values."""

    free: list[Line]  # whose states are x and p
    rhs: list[int]
    values: list[Objects]  # of p
    known: list[Line]
    outputs: list[int]  # field, z, V and dissipation

    @classmethod
    def of(cls, experiment: Experiment) -> Field:
        """Derived from the design."""
        open_loop, parameters = family(experiment)
        loop, numbers = loop_of(experiment), numbers_of_loop(experiment)
        states = (*open_loop.states, *parameters)
        free = compile_program(open_loop.time, states, open_loop.rhs, open_loop.definitions)
        outputs = (*loop.rhs, *loop.z, loop.V, loop.dissipation)
        known = compile_program(loop.time, loop.states, outputs, loop.definitions)
        values = [constant(rational(numbers[s.name])) for s in parameters]
        return cls(*straight_line(free), values, *straight_line(known))


def pieces(experiment: Experiment) -> Iterator[Piece]:
    """The sensitivities step by step; raises ProofEnded where a step would have to be too short."""
    flow = problem(experiment)
    point = compile_program(flow.time, flow.states, flow.rhs, flow.definitions)
    n = len(flow.states)
    with series(BITS, ORDER + 1):
        field = Field.of(experiment)
        starts = flow.start_balls()
        S = np.hstack([np.zeros((n, len(field.values))), np.eye(n)])
        off = objects((n, 1 + S.shape[1]), lambda i, j: arb(0) if j else abs_upper(starts[i] - starts[i].mid()))
        walk = Walk(Fraction(0), [v.mid() for v in starts], S, Deviation(unit(n), off))
        width = Fraction(1)
        while walk.time < flow.end:
            taylor = coefficients(point, rational(walk.time), walk.x, ORDER)
            path = [[c.mid() for c in taylor[state][:ORDER]] for state in point.states]
            width = min(width * GROWTH, _width(path), Fraction(flow.end) - walk.time)
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
    n, h, zero = len(path), rational(width), arb(0)
    t = polynomial([rational(walk.time), arb(1)], zero, h)
    f = rows(field.known, field.outputs[:n], t, [polynomial(p, zero, h) for p in path])
    tube = [*(polynomial(p, zero, h, CLOSE) for p in path), *field.values]
    G = _slopes(rows(field.free, field.rhs, t, tube, derive=True), len(tube))
    J, f_p = G[:, :n], np.concatenate([G[:, n:], _zeros(n, n)], axis=1)
    S = _taylor(J, f_p, walk.S)
    rising = exactly(S.transpose(1, 2, 0))
    values, slopes = (polynomials(c, h) for c in (rising, rates(rising)))
    exact = [polynomial(rates(np.array(p, dtype=object)), zero, h) for p in path]
    d_x = np.stack([[p - value] for p, (value, _) in zip(exact, f, strict=True)])
    d = np.concatenate([d_x, slopes - product(J, values) - f_p], axis=1)
    try:
        off, e = advance(h, J, d, (ORDER, ORDER), walk.e, np.ones(n))
    except NotProven:
        return None
    if not all(bound < CLOSE for bound in off[:, 0]):
        return None
    ends: Any = objects((n, 1 + S.shape[2]), lambda i, j: arb_poly(list(rising[i, j - 1]) if j else path[i])(h))
    kept: Any = objects(ends.shape, lambda i, j: arb(float(ends[i, j].mid())) if j else ends[i, j].mid())
    radius = np.array([[float(c) * ABOVE for c in row[1:]] for row in off])
    with series(BITS, GAIN_ORDER + 1):
        tube = [polynomial(p, zero, h, TUBE) for p in path]
        gains = _slopes(rows(field.known, field.outputs, t, tube, derive=True), n)
    piece = Piece(walk.time, width, S, radius, gains)
    walk.time, walk.x = walk.time + width, list(kept[:, 0])
    walk.S, walk.e = (
        kept[:, 1:].astype(float),
        jumped(e, objects(ends.shape, lambda i, j: abs_upper(ends[i, j] - kept[i, j]))),
    )
    return piece


def _zeros(*shape: int) -> Objects:
    return objects((*shape, 2), lambda *_: arb_series([0]))


def _slopes(found: list[tuple[Objects, dict[int, Objects]]], states: int) -> Objects:
    """The derivatives as a matrix of functions."""
    matrix = _zeros(len(found), states)
    for i, (_, slope) in enumerate(found):
        for j, value in slope.items():
            matrix[i, j] = value
    return matrix


def _taylor(J: Objects, f_p: Objects, start: Floats) -> Floats:
    """Taylor coefficients of S, (ORDER, rows, columns), in doubles."""
    A, b = (_middles(part, ORDER) for part in (J, f_p))
    S = [start]
    for k in range(1, ORDER):
        S.append((sum(A[i] @ S[k - 1 - i] for i in range(k)) + b[k - 1]) / k)
    return np.array(S)


def _middles(pairs: Objects, order: int) -> Floats:
    """The coefficients at the start of the step, as doubles, (order, ..)."""
    found = np.zeros((order, *pairs.shape[:-1]))
    for index in np.ndindex(*pairs.shape[:-1]):
        known = pairs[index][0].coeffs()[:order]
        found[(slice(len(known)), *index)] = [float(c.mid()) for c in known]
    return found


# ---- As arrays, and the gains ----


def sensitivity(experiment: Experiment) -> tuple[Sensitivity, Gains]:
    """The sensitivities of an experiment, and the gains of its checks, both proven.

    Raises ProofEnded where they cannot be.
    """
    found = list(pieces(experiment))
    n, m = len(experiment.states), len(experiment.states) + len(experiment.unknown)
    largest, integral = np.zeros((2, m + n + 2, m))
    for piece in found:
        largest_here, integral_here = _extent(piece)
        largest, integral = np.maximum(largest, largest_here), integral + integral_here
    return (
        Sensitivity(
            columns=np.array([*family(experiment).names, *starts_of(experiment)]),
            starts=np.array([float(piece.start) for piece in found]),
            polynomial=np.array([piece.polynomial for piece in found]),
            radius=np.max([piece.radius for piece in found], axis=0),
            end=float(found[-1].start + found[-1].width),
        ),
        Gains(field=largest[:m], z=largest[m : m + n], V=largest[-2], dissipated=integral[-1]),
    )


def _extent(piece: Piece) -> tuple[Floats, Floats]:
    """Of each slope, on one step: a bound of its absolute value, and of the integral of that; each (outputs, states).

    Between samples a distance D apart, a function rises above the line through them by at most D^2/8 sup|f''|.
    """
    h, k = float(piece.width), np.arange(GAIN_ORDER)
    middle = _middles(piece.slopes, GAIN_ORDER) * h ** k[:, None, None]
    s = np.linspace(0, 1, SAMPLES + 1)
    sampled = np.abs(np.einsum("ks,kij->sij", s ** k[:, None], middle))
    above = np.einsum("k,kij->ij", k * (k - 1) / (8 * SAMPLES**2) + ROUNDING, np.abs(middle))
    with series(BITS, GAIN_ORDER + 1):
        above += np.array([[_spread(pair, h) for pair in row] for row in piece.slopes])
    trapezoid = (sampled[:-1] + sampled[1:]).mean(axis=0) / 2
    return (sampled.max(axis=0) + above) * ABOVE, h * (trapezoid + above) * ABOVE


def _spread(pair: Objects, h: float) -> float:
    """How far a function may be from the polynomial of its middles: their radii, and Lagrange's remainder."""
    at, over = (list(one.coeffs()) for one in pair)
    radii = sum((c.rad() * arb(h) ** k for k, c in enumerate(at[:GAIN_ORDER])), arb(0))
    last = over[GAIN_ORDER] * arb(h) ** GAIN_ORDER if len(over) > GAIN_ORDER else arb(0)
    return float((radii + last).abs_upper()) * ABOVE
