# SPDX-License-Identifier: MIT
"""Evaluation of proven steps as doubles, with a proven bound of its error.

Every step is cut into equal pieces; on each, the step's polynomial is written about the piece's centre in
v = (t - centre) / half, |v| <= 1, its terms of degree above DEGREE are dropped, and the rest is rounded to
doubles b_0 .. b_d and evaluated by Horner's rule. With u = 2^-53 and rho the radius of the step,

    |double - solution| <= rho + sum_{k>d} |b_k| + sum_{k<=d} (5 k + 3) u |b_k|

per piece: 2 u |b_k| for rounding b_k, (2 k + 1) u |b_k| for Horner's rule (Higham 2002, section 5.1), and
2 k u |b_k| for rounding v, which is within 2 u of its exact value; the last k u |b_k| and a factor 1 + 1e-9
cover products of these errors and the rounding of the bound itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from flint import arb, arb_mat

from conformance.truth.enclosure import Step
from conformance.truth.piecewise import DEGREE, Floats, Table

PARTS = (1, 2, 4, 8, 16, 32, 64)  # pieces per step: the first that meets GOAL
GOAL = 8e-16  # bound of the error, relative to the scale of a row
UNIT = 2.0**-53
SLACK = 1 + 1e-9
UNDERFLOW = 1e-300  # more than all products lose that leave the range of doubles


@cache
def shift(order: int, parts: int) -> Floats:
    """[p, i, k]: the coefficient of v^i in (centre_p + half v)^k, for the pieces p of [0, 1]."""
    half = 0.5 / parts
    matrix = np.zeros((parts, order, order))
    for p in range(parts):
        for k in range(order):
            for i in range(k + 1):
                matrix[p, i, k] = math.comb(k, i) * ((2 * p + 1) * half) ** (k - i) * half**i
    return matrix


@cache
def exact_shift(order: int, parts: int, bits: int) -> arb_mat:
    """The rows i <= DEGREE of `shift`, for all pieces, as balls at the current precision, which is `bits`."""
    half = arb(0.5) / parts
    rows = [
        [math.comb(k, i) * ((2 * p + 1) * half) ** (k - i) * half**i if i <= k else arb(0) for k in range(order)]
        for p in range(parts)
        for i in range(min(DEGREE, order - 1) + 1)
    ]
    return arb_mat(rows)


WEIGHT = UNIT * (5.0 * np.arange(DEGREE + 1) + 3)


def error(coefficients: Floats, sizes: Floats, parts: int) -> Floats:
    """Truncation and rounding error, (rows, parts): see the head of this module.

    coefficients: (rows, DEGREE + 1, parts). sizes: (rows, order), |c_k| h^k of the step's polynomials.
    """
    tail = np.einsum("pik,rk->rp", shift(sizes.shape[1], parts)[:, DEGREE + 1 :], sizes)
    bound: Floats = SLACK * (tail + np.einsum("i,rip->rp", WEIGHT, np.abs(coefficients)))
    return bound


def fitting_parts(sizes: Floats, scale: Floats) -> int:
    """The fewest pieces for which a crude estimate of the error meets the goal."""
    for parts in PARTS:
        estimate = np.einsum("pik,rk->rip", shift(sizes.shape[1], parts)[:, : DEGREE + 1], sizes)
        if np.all(error(estimate, sizes, parts) <= GOAL * scale[:, None]):
            return parts
    return PARTS[-1]


def tabulate(steps: Sequence[Step], bits: int) -> Table:
    """The table of these steps; `bits` is the current precision."""
    radius = np.array([step.radius for step in steps])
    heads = np.array([[abs(float(p[0])) for p in step.polynomial] for step in steps])
    scale = np.maximum((heads * (1 - 4 * UNIT) - radius).max(axis=0), 0)
    pieces, bounds, edges, halves = [], [], [], []
    for step in steps:
        scaled = [[c * arb(step.width) ** k for k, c in enumerate(p)] for p in step.polynomial]
        sizes = np.array([[abs(float(c)) for c in row] for row in scaled])
        parts = fitting_parts(sizes, scale)
        doubles, rounding = _pieces(scaled, parts, bits)
        pieces.append(doubles)
        bounds.append((error(doubles, sizes, parts) + rounding).max(axis=1) + np.array(step.radius))
        edges.append(step.start + step.width * np.arange(parts) / parts)
        halves.append(np.full(parts, step.width / (2 * parts)))
    left, half = np.concatenate(edges), np.concatenate(halves)
    return Table(
        edges=np.append(left, steps[-1].start + steps[-1].width),
        centre=left + half,
        half=half,
        polynomial=np.ascontiguousarray(np.concatenate(pieces, axis=2)),
        bound=SLACK * np.max(bounds, axis=0) + UNDERFLOW,
        scale=scale,
    )


def _pieces(scaled: list[list[arb]], parts: int, bits: int) -> tuple[Floats, float]:
    """Coefficients of the pieces, (rows, DEGREE + 1, parts), and a bound of their radii, summed over a piece."""
    order, rows = len(scaled[0]), len(scaled)
    kept = min(DEGREE, order - 1) + 1
    product = (exact_shift(order, parts, bits) * arb_mat(scaled).transpose()).entries()
    doubles = np.zeros((rows, DEGREE + 1, parts))
    doubles[:, :kept] = np.array([float(b) for b in product]).reshape(parts, kept, rows).transpose(2, 1, 0)
    return doubles, SLACK * kept * max(float(b.rad()) for b in product)
