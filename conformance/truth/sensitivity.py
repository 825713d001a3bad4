# SPDX-License-Identifier: MIT
"""How an exact solution moves with its parameters and start values, and what the checks gain from it.

From a time t_j on, the enclosed x moves with x(t_j) and with the parameters p as Y = [Y_x, Y_p] does, which solves
Y' = (df/dx) Y + [0, df/dp] from [I, 0]. Its Taylor coefficients and tails are found as in a step of an enclosure. The
sensitivities S follow from piece to piece, from [0, I] at the start:

    S(t_j + s) = Y_x(s) S(t_j) + [Y_p(s), 0],    S(t_j) in middle + A R,

A an exact matrix, R a matrix of balls around 0. As with the sets of an enclosure, an orthogonal A, from a QR
decomposition, keeps the wrapping effect small (Lohner 1987). The gains are enclosed for all states near the solution,
so that by the mean value theorem they hold for differences up to there, and not only to first order.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import sympy as sp
from flint import arb, arb_mat, arb_poly, arb_series, fmpq

from conformance.theory.design import ClosedLoop
from conformance.truth.certificate import straight_line
from conformance.truth.certify import Matrix, at, run, series
from conformance.truth.enclosure import ProofEnded, orthogonal_factor
from conformance.truth.exact import Gains, Sensitivity
from conformance.truth.piecewise import Floats
from conformance.truth.tails import NoEnclosure, Tails
from conformance.truth.taylor import coefficients, compile_program, variational, with_rates
from conformance.truth.truth import ONE_AT_A_TIME, Enclosure

ORDER = 24  # of the polynomials
SHARP = 1e-10  # by which they may miss Y
SHORTEST = 2.0**-20  # s
GAIN_ORDER = 10  # of the expansions of the gains
SAMPLES = 64  # per piece, between which a gain may rise by its curvature
BITS = 80
ABOVE = 1 + 1e-9  # rounds a double up
UNIT = 2.0**-53
Numbers = Mapping[sp.Symbol, sp.Rational]


class Piece(NamedTuple):
    """Start and width (s); x as polynomials in the time since the start, with their radii; coefficients of polynomials
    near Y, (ORDER, n, n + p), and by how much they miss it at most, (n, n + p)."""

    start: float
    width: arb
    x: list[arb_poly]
    radius: list[float]
    Y: Floats
    rest: Floats


def sensitivity(loop: ClosedLoop, numbers: Numbers, enclosed: Enclosure, tube: Floats) -> tuple[Sensitivity, Gains]:
    """The sensitivities to the parameters with these numbers and to the start values, and the gains, proven.

    tube: by how much each state may be off where the gains hold. Raises ProofEnded where there are none.
    """
    with ONE_AT_A_TIME, series(BITS):
        found = list(pieces(loop, numbers, enclosed))
        names = [*(symbol.name for symbol in numbers), *(f"{name}_start" for name in enclosed.names)]
        return joined(found, names), gains(loop, numbers, found, tube)


# ---- The variational equation, piece by piece ----


def pieces(loop: ClosedLoop, numbers: Numbers, enclosed: Enclosure) -> Iterator[Piece]:
    """All pieces, two in a step of the enclosure, or more where they have to be short."""
    base = compile_program(loop.time, loop.states, loop.rhs, loop.definitions, numbers)
    program, entries = variational(with_rates(base))
    tails, n, m = Tails(program), len(loop.states), len(loop.states) + len(numbers)
    identity = [arb(i == j) for i, j in entries]

    def piece(start: float, end: float) -> Piece:
        width = difference(end, start)
        h = float(width) * ABOVE
        found = coefficients(program, arb(start), [*enclosed.at(start), *identity], ORDER - 1)
        if not all(c.is_finite() for x in program.states for c in found[x]):
            raise NoEnclosure("a coefficient is not finite")
        radii = dict(zip(program.rates, tails.radii(tails.norms(found, ORDER, h), h)[0], strict=True))
        Y, off, rest = np.zeros((ORDER, n, m)), np.zeros((ORDER, n, m)), np.zeros((n, m))
        for (i, j), y in zip(entries, program.states[n:], strict=True):
            rest[i, j], known = radii[y], found[y][:ORDER]
            Y[: len(known), i, j] = [float(c.mid()) for c in known]
            off[: len(known), i, j] = [float((c - float(c.mid())).abs_upper()) for c in known]
        rest += np.einsum("kij,k->ij", off, h ** np.arange(ORDER)) * ABOVE
        if not rest.max() <= SHARP:
            raise NoEnclosure("polynomials of this order miss it by too much")
        x = program.states[:n]
        return Piece(start, arb(width), [arb_poly(found[i][:ORDER]) for i in x], [radii[i] for i in x], Y, rest)

    def parts(start: float, end: float) -> Iterator[Piece]:
        try:
            yield piece(start, end)
        except NoEnclosure as reason:
            if end - start < SHORTEST:
                raise ProofEnded(start, f"the sensitivities would need shorter steps: {reason}") from None
            yield from halves(start, end)

    def halves(start: float, end: float) -> Iterator[Piece]:
        middle = start + (end - start) / 2
        yield from parts(start, middle)
        yield from parts(middle, end)

    for start, end in pairwise(enclosed.edges.tolist()):
        yield from halves(start, end)


# ---- The sensitivities, from start to end ----


def joined(found: Sequence[Piece], names: list[str]) -> Sensitivity:
    """S on all pieces; its columns are the parameters, and behind them the start values."""
    n, m = found[0].Y.shape[1:]
    order = [*range(n, m), *range(n)]  # of the columns of Y, as those of S
    forced = np.array([j >= n for j in order])
    S, basis, box = np.eye(n, m)[:, order], exactly(np.eye(n)), exactly(np.zeros((n, m)))
    polynomials, radii = [], []
    for piece in found:
        h, Y_x, Y_p = piece.width, piece.Y[:, :, :n], piece.Y[:, :, order] * forced
        sizes_x, sizes_p = (np.einsum("kij,k->ij", abs(part), float(h) ** np.arange(ORDER)) for part in (Y_x, Y_p))
        rest_x, rest_p, e = piece.rest[:, :n], piece.rest[:, order] * forced, bound(basis * box)
        polynomials.append(Y_x @ S + Y_p)
        rounding = 2 * (n + 2) * UNIT * (sizes_x @ abs(S) + sizes_p)
        radii.append((rounding + rest_x @ abs(S) + rest_p + (sizes_x + rest_x) @ e) * ABOVE)
        ends = [
            [arb_poly(c)(h) + arb(0, r) for c, r in zip(*rows, strict=True)]
            for rows in zip(piece.Y.transpose(1, 2, 0).tolist(), piece.rest.tolist(), strict=True)
        ]
        flow, force = (
            arb_mat([row[:n] for row in ends]),
            arb_mat([[row[j] if j >= n else 0 for j in order] for row in ends]),
        )
        end = flow * exactly(S) + force
        S = middles(end)
        spread = flow * basis
        basis = orthogonal_factor(spread, arb_mat(n, 1, [reduce(arb.union, row) for row in box.tolist()]))
        inverse = basis.inv()
        moved = (inverse * spread) * box + inverse * (end - exactly(S))
        box = arb_mat(n, m, [arb(0, c.abs_upper()) for c in moved.entries()])
    starts = np.array([piece.start for piece in found])
    return Sensitivity(
        np.array(names), starts, np.array(polynomials), np.max(radii, axis=0), found[-1].start + float(found[-1].width)
    )


def difference(end: float, start: float) -> fmpq:
    """The exact difference of two doubles."""
    return fmpq(*end.as_integer_ratio()) - fmpq(*start.as_integer_ratio())


def exactly(matrix: Floats) -> arb_mat:
    """Doubles as balls."""
    return arb_mat(matrix.tolist())


def middles(matrix: arb_mat) -> Floats:
    """The doubles next to the middles."""
    return np.array([[float(c.mid()) for c in row] for row in matrix.tolist()])


def bound(matrix: arb_mat) -> Floats:
    """Doubles that are not below the absolute values."""
    return np.array([[float(c.abs_upper()) for c in row] for row in matrix.tolist()]) * ABOVE


# ---- The gains ----


def gains(loop: ClosedLoop, numbers: Numbers, found: Sequence[Piece], tube: Floats) -> Gains:
    """The largest slopes of field, z and V, and the integral of that of the dissipation, along the pieces."""
    m, outputs = len(loop.states), (*loop.rhs, *loop.z, loop.V, loop.dissipation)
    program, rows = straight_line(compile_program(loop.time, loop.states, outputs, loop.definitions, numbers))
    largest, integral = np.zeros((len(outputs), m)), np.zeros((len(outputs), m))

    def slopes(piece: Piece, s: arb_poly) -> Matrix:
        radius = np.array(piece.radius) * ABOVE + tube
        x = at([[p + arb(0, r)] for p, r in zip(piece.x, radius.tolist(), strict=True)], s)
        x = [[*value, *(arb_series([int(i == j)]) for j in range(m))] for i, value in enumerate(x)]
        return [row[1:] for row in run(program, rows, arb_series(s + arb(piece.start)), x)]

    with series(BITS, GAIN_ORDER + 1):
        for piece in found:
            half = piece.width / 2
            near, over = (slopes(piece, arb_poly([half + arb(0, r), 1])) for r in (0, half.abs_upper()))
            most, mean = extent(near, over, half)
            largest, integral = np.maximum(largest, most), integral + mean * float(piece.width) * ABOVE
    return Gains(largest[:m], largest[m:-2], largest[-2], integral[-1])


def extent(near: Matrix, over: Matrix, half: arb) -> tuple[Floats, Floats]:
    """Bounds of the absolute value and of its mean, of functions given by their series about the middle and all over.

    Between samples a distance D apart, a function rises above the line through them by at most D^2/8 sup|f''|.
    """
    if min(one.prec for rows in (near, over) for row in rows for one in row) <= GAIN_ORDER:
        raise AssertionError("a power series is not known far enough")
    k, powers = np.arange(GAIN_ORDER), [half**i for i in range(GAIN_ORDER + 1)]
    terms = np.array([[[one[i] * powers[i] for i in k.tolist()] for one in row] for row in near], dtype=object)
    last = np.array([[one[GAIN_ORDER] * powers[GAIN_ORDER] for one in row] for row in over], dtype=object)
    middle, radius = (
        np.vectorize(part, otypes=[float])(terms) for part in (lambda c: float(c.mid()), lambda c: float(c.rad()))
    )
    spread = (radius.sum(axis=2) + np.vectorize(lambda c: float(c.abs_upper()), otypes=[float])(last)) * ABOVE
    sampled = abs(np.einsum("ijk,sk->sij", middle, np.linspace(-1, 1, SAMPLES + 1)[:, None] ** k))
    above = spread + abs(middle) @ (k * (k - 1) / (2 * SAMPLES**2) + 64 * UNIT)
    mean = (sampled[:-1] + sampled[1:]).mean(axis=0) / 2
    return (sampled.max(axis=0) + above) * ABOVE, (mean + above) * ABOVE
