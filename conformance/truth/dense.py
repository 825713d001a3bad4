# SPDX-License-Identifier: MIT
"""Evaluation of proven steps as doubles, with a proven bound of its error.

Every step is cut into equal pieces, up to the rounding of their edges; on each, the step's polynomial is written in
v = (t - centre) / half, |v| <= 1, about the centre, a double taken exactly. Its terms of degree above DEGREE are
dropped, the rest is rounded to doubles b_0 .. b_d and evaluated by Horner's rule. With u = 2^-53 and rho the radius of
the step,

    |double - solution| <= rho + sum_{k>d} |b_k| + sum_{k<=d} (5 k + 3) u |b_k|

per piece: 2 u |b_k| for rounding b_k, (2 k + 1) u |b_k| for Horner's rule (Higham 2002, section 5.1), and
2 k u |b_k| for rounding v, a difference of doubles divided by a double, hence within 2 u |v| of its exact value; the
last k u |b_k| and a factor 1 + 1e-9 cover products of these errors and the rounding of the bound itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat, fmpq

from conformance.truth.enclosure import Step
from conformance.truth.piecewise import DEGREE, Floats, Table

PARTS = (1, 2, 4, 8, 16, 32, 64)  # pieces per step: the first that meets GOAL
GOAL = 8e-16  # bound of the error, relative to the scale of a row
UNIT = 2.0**-53
SLACK = 1 + 1e-9
UNDERFLOW = 1e-300  # more than all products lose that leave the range of doubles
WEIGHT = UNIT * (5.0 * np.arange(DEGREE + 1) + 3)


class Cut(NamedTuple):
    """Pieces of [0, 1], the step in units of its width: where their centres lie, and their half widths, exactly."""

    centres: tuple[Fraction, ...]
    halves: tuple[Fraction, ...]


def even(parts: int) -> Cut:
    """The cut into equal pieces."""
    return Cut(tuple(Fraction(2 * p + 1, 2 * parts) for p in range(parts)), (Fraction(1, 2 * parts),) * parts)


@lru_cache(maxsize=256)
def shift(order: int, cut: Cut) -> Floats:
    """[p, i, k]: the coefficient of v^i in (centre_p + half_p v)^k."""
    binomial = np.array([[math.comb(k, i) for k in range(order)] for i in range(order)], dtype=float)
    i, k = np.indices((order, order))
    centres, halves = (np.array(list(map(float, part)))[:, None, None] for part in cut)
    matrix: Floats = binomial * centres ** np.maximum(k - i, 0) * halves**i
    return matrix


@lru_cache(maxsize=256)
def exact_shift(order: int, cut: Cut, bits: int) -> arb_mat:
    """The rows i <= DEGREE of `shift`, for all pieces, as balls at the current precision, which is `bits`."""
    rows = []
    for centre, half in zip(*cut, strict=True):
        c, h = (arb(fmpq(part.numerator, part.denominator)) for part in (centre, half))
        powers = [c**k for k in range(order)]
        for i in range(min(DEGREE, order - 1) + 1):
            rows.append([math.comb(k, i) * powers[k - i] * h**i if i <= k else arb(0) for k in range(order)])
    return arb_mat(rows)


def error(coefficients: Floats, sizes: Floats, cut: Cut) -> Floats:
    """Truncation and rounding error, (rows, parts): see the head of this module.

    coefficients: (rows, DEGREE + 1, parts). sizes: (rows, order), |c_k| h^k of the step's polynomials.
    """
    tail = np.einsum("pik,rk->rp", shift(sizes.shape[1], cut)[:, DEGREE + 1 :], sizes)
    bound: Floats = SLACK * (tail + np.einsum("i,rip->rp", WEIGHT, np.abs(coefficients)))
    return bound


def fitting_parts(sizes: Floats, scale: Floats) -> int:
    """The fewest pieces for which a crude estimate of the error meets the goal."""
    for parts in PARTS:
        estimate = np.einsum("pik,rk->rip", shift(sizes.shape[1], even(parts))[:, : DEGREE + 1], sizes)
        if np.all(error(estimate, sizes, even(parts)) <= GOAL * scale[:, None]):
            return parts
    return PARTS[-1]


def needed_order(sizes: Floats, scale: Floats) -> tuple[int, Floats]:
    """How many terms matter to a double, in eights, and by row a bound of the sum of the others."""
    rest = np.zeros((sizes.shape[0], sizes.shape[1] + 1))
    rest[:, :-1] = np.cumsum(sizes[:, ::-1], axis=1)[:, ::-1] * SLACK
    matter = int(np.argmax(np.all(rest <= UNIT / 1000 * scale[:, None], axis=0)))
    order = min(sizes.shape[1], 8 * max(2, math.ceil(matter / 8)))
    return order, rest[:, order]


class Pieces(NamedTuple):
    """The pieces of a step in doubles, each within its half width of its centre, and the same in units of the step."""

    left: list[float]
    centre: list[float]
    half: list[float]
    cut: Cut


def pieces(step: Step, parts: int) -> Pieces:
    """Cuts a step; what is rounded is where the pieces lie, not what is said of them."""
    start, width = Fraction(step.start), Fraction(step.width)
    edges = [float(start + width * p / parts) for p in range(parts + 1)]
    centre = [left + (right - left) / 2 for left, right in pairwise(edges)]
    half = [
        rounded_up(max(Fraction(c) - Fraction(left), Fraction(right) - Fraction(c)))
        for (left, right), c in zip(pairwise(edges), centre, strict=True)
    ]
    cut = Cut(tuple((Fraction(c) - start) / width for c in centre), tuple(Fraction(h) / width for h in half))
    return Pieces(edges[:-1], centre, half, cut)


def rounded_up(value: Fraction) -> float:
    """The smallest positive double that is not below a value >= 0."""
    nearest = float(value)
    return nearest if nearest > 0 and Fraction(nearest) >= value else math.nextafter(nearest, math.inf)


def tabulate(steps: Sequence[Step], bits: int) -> Table:
    """The table of these steps; `bits` is the current precision."""
    radius = np.array([step.radius for step in steps])
    heads = np.array([[abs(float(p[0])) for p in step.polynomial] for step in steps])
    scale = np.maximum((heads * (1 - 4 * UNIT) - radius).max(axis=0), 0)
    polynomials, bounds, lefts, centres, halves = [], [], [], [], []
    for step in steps:
        scaled = [[c * arb(step.width) ** k for k, c in enumerate(p)] for p in step.polynomial]
        sizes = np.array([[abs(float(c)) for c in row] for row in scaled])
        order, beyond = needed_order(sizes, scale)
        scaled, sizes = [row[:order] for row in scaled], sizes[:, :order]
        left, centre, half, cut = pieces(step, fitting_parts(sizes, scale))
        doubles, rounding = _polynomials(scaled, cut, bits)
        polynomials.append(doubles)
        bounds.append((error(doubles, sizes, cut) + rounding).max(axis=1) + beyond + np.array(step.radius))
        lefts += left
        centres += centre
        halves += half
    return Table(
        edges=np.array([*lefts, steps[-1].start + steps[-1].width]),
        centre=np.array(centres),
        half=np.array(halves),
        polynomial=np.ascontiguousarray(np.concatenate(polynomials, axis=2)),
        bound=SLACK * np.max(bounds, axis=0) + UNDERFLOW,
        scale=scale,
    )


def _polynomials(scaled: list[list[arb]], cut: Cut, bits: int) -> tuple[Floats, float]:
    """Coefficients of the pieces, (rows, DEGREE + 1, parts), and a bound of their radii, summed over a piece."""
    order, rows, parts = len(scaled[0]), len(scaled), len(cut.centres)
    kept = min(DEGREE, order - 1) + 1
    product = (exact_shift(order, cut, bits) * arb_mat(scaled).transpose()).entries()
    doubles = np.zeros((rows, DEGREE + 1, parts))
    doubles[:, :kept] = np.array([float(b) for b in product]).reshape(parts, kept, rows).transpose(2, 1, 0)
    return doubles, SLACK * kept * max(float(b.rad()) for b in product)
