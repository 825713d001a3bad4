# SPDX-License-Identifier: MIT
"""Bounds of how far polynomials are from the solution of x' = f(t, x): a differential inequality in moving frames.

On one step of width h let p be the polynomials, d = p' - f(t, p) their defect, e = x - p, and J the Jacobian of f,
averaged from p to x: e' = J e - d. With polynomial matrices Phi and Psi, H = Psi Phi - I, and w = Phi^-1 e,

    w' = Phi^-1 (J Phi - Phi') w - Phi^-1 d,    Phi^-1 = (I + H)^-1 Psi,    so with eta = |H| < 1
    |w| <= (|w(0)| + delta) / (1 - epsilon),    epsilon = h |Psi (J Phi - Phi')| / (1 - eta) < 1,
                                                delta = h |Psi d| / (1 - eta)

in the maximum norm, the largest over the step. As long as |e| <= |Phi| |w| is below the stated radius, J stays where it
was bounded, so no solution is the first to leave. Phi and Psi are Taylor polynomials of the variational equation and of
its inverse, found in doubles: then epsilon is small, whatever the flow does, and nothing depends on their being right.
Sources: Dahlquist 1958 and Lozinskii 1958 for the inequality, Lohner 1987 for the frames. Every bound is in ball
arithmetic, and nothing here comes from the modules that find the enclosure.

A function of s is kept as two power series, about 0 and about all of [0, h]: the first axis of every array of objects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, arb_poly, arb_series, ctx, fmpq
from numpy.typing import NDArray

FRAME = 10  # order of Phi, Psi and J
BEYOND = 4  # orders to which the defect is expanded beyond the degree of the polynomials
PARTS = 32  # into which a step is cut at most
FLATTEST = 2.0**-5  # of the longest axis of a frame: its shortest
TINY = 1e-300
Objects = NDArray[Any]  # of balls, or of series
Floats = NDArray[np.float64]


class NotProven(ArithmeticError):
    """The claim does not hold, or this way cannot show that it does."""


@contextmanager
def series(bits: int, order: int) -> Iterator[None]:
    """Sets the precision of balls and the order of series, which are global to python-flint, and restores them."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = bits, order + 1
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


# ---- Functions on a step ----


def about(first: arb, h: arb) -> tuple[arb_poly, arb_poly]:
    """The function first + s, for s about 0 and about all of [0, h]."""
    return arb_poly([first, 1]), arb_poly([first + h / 2 + arb(0, (h / 2).abs_upper()), 1])


def objects(entries: Iterable[Any]) -> Objects:
    """An array of one axis."""
    return np.fromiter(entries, dtype=object)


exactly: Any = np.frompyfunc(arb, 1, 1)  # of doubles


def polynomial(coefficients: Any, s: tuple[arb_poly, arb_poly]) -> Objects:
    """The polynomial of these coefficients, numbers or matrices along the first axis, in s: shape (2, ..)."""

    def composed(c: Objects) -> Objects:
        return objects(arb_series(arb_poly(list(c))(one).coeffs()) for one in s)

    return np.asarray(np.apply_along_axis(composed, 0, np.array(coefficients, dtype=object)))


def rates(coefficients: Any) -> list[Any]:
    """The coefficients of a polynomial's derivative."""
    return [k * c for k, c in enumerate(coefficients)][1:] or [arb(0)]


def at(coefficients: Any, s: arb) -> Any:
    """The value of a polynomial, of numbers or matrices."""
    return sum((c * s**k for k, c in enumerate(coefficients)), arb(0))


def bounds(functions: Objects, h: arb) -> Objects:
    """Bounds of the absolute values on [0, h], by Taylor's theorem with the remainder of the highest order known."""

    def bound(at: Any, whole: Any) -> arb:
        order = min(at.prec, whole.prec) - 1
        terms = [*(at[k] for k in range(order)), whole[order]]
        return abs_upper(sum((c.abs_upper() * h**k for k, c in enumerate(terms)), arb(0)))

    return np.array(np.frompyfunc(bound, 2, 1)(*functions), dtype=object)


def abs_upper(ball: arb) -> arb:
    """A bound of the absolute value, exact."""
    return arb(ball.abs_upper())


# ---- The differential equation, as a straight-line program ----

Elementary = tuple[Callable[[arb_series], arb_series], Callable[[arb_series, arb_series], arb_series]]
ELEMENTARY: dict[str, Elementary] = {  # F(u), and F'(u) from u and v = F(u)
    "exp": (arb_series.exp, lambda u, v: v),
    "log": (arb_series.log, lambda u, v: 1 / u),
    "sin": (arb_series.sin, lambda u, v: u.cos()),
    "cos": (arb_series.cos, lambda u, v: -u.sin()),
    "tan": (arb_series.tan, lambda u, v: 1 + v * v),
    "atan": (arb_series.atan, lambda u, v: 1 / (1 + u * u)),
    "sinh": (lambda u: (u.exp() - (-u).exp()) / 2, lambda u, v: (u.exp() + (-u).exp()) / 2),
    "cosh": (lambda u: (u.exp() + (-u).exp()) / 2, lambda u, v: (u.exp() - (-u).exp()) / 2),
    "tanh": (lambda u: 1 - 2 / ((2 * u).exp() + 1), lambda u, v: 1 - v * v),
}
READS = {"time": 0, "state": 0, "constant": 0, "add": 2, "mul": 2, "div": 2, "power": 1} | dict.fromkeys(ELEMENTARY, 1)
NAMED = {"pi": arb.pi, "E": arb.const_e}


class Line(NamedTuple):
    """One operation of a straight-line program: the lines it reads, and the number or state that completes it."""

    op: str
    reads: tuple[int, ...] = ()
    value: str = ""


def rows(
    program: Sequence[Line], outputs: Sequence[int], t: Objects, x: Sequence[Objects], derive: bool = False
) -> Objects:
    """The outputs, shape (2, outputs, 1), and where asked for behind each its derivatives by the states."""
    unit = np.eye(len(x), len(x) if derive else 0, dtype=int).astype(object)
    found: list[Objects] = []
    for line in program:
        try:
            found.append(_operate(line, [found[i] for i in line.reads], t, x, unit))
        except (ValueError, ZeroDivisionError):
            raise NotProven("there may be a division by 0") from None
    return np.asarray(np.frompyfunc(arb_series([0]).__add__, 1, 1)(np.stack([found[i] for i in outputs], axis=1)))


def _operate(line: Line, read: list[Objects], t: Objects, x: Sequence[Objects], unit: Objects) -> Objects:
    """A line's value and derivatives, by the chain rule."""
    match line.op, [(a[:, :1], a[:, 1:]) for a in read]:
        case "time", _:
            v, slopes = t[:, None], 0 * unit[:1]
        case "state", _:
            v, slopes = x[int(line.value)][:, None], unit[[int(line.value)]]
        case "constant", _:
            v, slopes = objects([arb_series([number(line.value)])] * 2)[:, None], 0 * unit[:1]
        case "add", _:
            return read[0] + read[1]
        case "mul", ((a, da), (b, db)):
            v, slopes = a * b, a * db + b * da
        case "div", ((a, da), (b, db)):
            v, slopes = a / b, (da - a / b * db) / b
        case _, ((u, du),):
            value, slope = _power(number(line.value)) if line.op == "power" else ELEMENTARY[line.op]
            v = np.array(np.frompyfunc(value, 1, 1)(u))
            slopes = np.frompyfunc(slope, 2, 1)(u, v) * du if du.size else du
    return np.hstack([v, np.broadcast_to(slopes, (2, unit.shape[1]))])


def _power(r: arb) -> Elementary:
    return lambda u: (r * u.log()).exp(), lambda u, v: r * v / u


def number(text: str) -> arb:
    """The ball of pi, of E, or of a rational number."""
    return NAMED[text]() if text in NAMED else rational(Fraction(text))


def rational(value: Fraction) -> arb:
    """The ball of a rational number."""
    return arb(fmpq(value.numerator, value.denominator))


# ---- One step ----


class Spread(NamedTuple):
    """Columns of e: each is edges w + v, with |w| <= its size, and |v| <= its jumps entry by entry."""

    edges: Objects
    size: Objects
    jumps: Objects


class Frame(NamedTuple):
    """Columns of e: each is matrix w, with |w| <= its size; the inverse is in balls."""

    matrix: Floats
    inverse: Objects
    size: Objects


def frame(e: Spread, scale: Floats) -> Frame:
    """A frame for these columns: any regular matrix would do.

    This one has orthogonal axes, in units of the scale of the rows, along the longest edges (Lohner 1987).
    """
    with np.errstate(all="ignore"):  # what is not finite passes no test below
        leaps, sizes = e.jumps.astype(float) / scale[:, None], e.size.astype(float)
        weight = np.maximum(sizes, leaps.max(axis=0)) + TINY
        sides = e.edges.astype(float) / scale[:, None] * (sizes / weight).max()
        sides = np.hstack([sides, np.diag((leaps / weight).max(axis=1))])
        axes = np.linalg.qr(sides[:, np.argsort(-np.linalg.norm(sides, axis=0))])[0]
        lengths = abs(axes.T @ sides).sum(axis=1)
        matrix = axes * np.maximum(lengths, (lengths.max() or 1) * FLATTEST) * scale[:, None]
    try:
        inverse = np.array(arb_mat(exactly(matrix).tolist()).inv().tolist(), dtype=object)
    except ZeroDivisionError:
        raise NotProven("no frame was found") from None
    within = norm(abs(inverse @ e.edges)) * e.size + largest(abs(inverse) @ e.jumps)
    return Frame(matrix, inverse, objects(map(abs_upper, within)))


def advance(h: arb, J: Objects, d: Objects, e: Frame) -> tuple[Objects, Spread]:
    """On a step on which e' = J e - d, a column of e for every column of d: bounds of |e|, and e at the end.

    Raises NotProven where the step is too wide.
    """
    s = about(arb(0), h)
    flow, inverse = guess(J, e)
    Phi, Psi = polynomial(flow, s), polynomial(inverse, s)
    eta = norm(bounds(Psi @ Phi - np.eye(len(e.matrix), dtype=int), h))
    epsilon = norm(bounds(Psi @ (J @ Phi - polynomial(rates(flow), s)), h)) * h / (1 - eta)
    if not (eta < 0.5 and epsilon < 0.5):
        raise NotProven("the step is too wide")
    w = (e.size + largest(bounds(Psi @ d, h)) * h / (1 - eta)) / (1 - epsilon)
    return bounds(Phi, h).sum(axis=1)[:, None] * w, Spread(at(flow, h), w, np.full(d[0].shape, arb(0)))


def guess(J: Objects, e: Frame) -> tuple[list[Objects], list[Objects]]:
    """Taylor coefficients of Phi and of Psi, in doubles taken exactly."""
    order = J[0, 0, 0].prec - 1
    A = middles(J, order)
    flow, inverse = [e.matrix], [e.inverse.astype(float)]
    for k in range(1, order):
        flow.append(sum(A[i] @ flow[k - 1 - i] for i in range(k)) / k)
        inverse.append(-sum(inverse[k - 1 - i] @ A[i] for i in range(k)) / k)
    return list(map(exactly, flow)), list(map(exactly, inverse))


def middles(functions: Objects, order: int) -> Floats:
    """The first Taylor coefficients about 0, rounded, along the first axis."""
    found = (np.frompyfunc(lambda one, k=k: float(one[k]), 1, 1)(functions[0]) for k in range(order))
    return np.array(list(found), dtype=float)


def largest(matrix: Objects) -> Objects:
    """The largest entry of every column; what is not a number stays."""
    return objects(reduce(arb.max, column) for column in matrix.T)


def norm(matrix: Objects) -> arb:
    """The matrix norm that belongs to the maximum norm, from absolute values."""
    return arb(reduce(arb.max, matrix.sum(axis=1)))


# ---- All steps ----


class Step(NamedTuple):
    """|x_i(start + s) - p_i(s)| <= radius[i] for 0 <= s <= width; p_i has the exact coefficients polynomial[i]."""

    start: Fraction
    width: Fraction
    polynomial: Sequence[Sequence[arb]]
    radius: Sequence[arb]


class Claim(NamedTuple):
    """That the solution of x' = f(t, x) from the start is near the steps; f is the lines `rhs` of the program."""

    program: tuple[Line, ...]
    rhs: tuple[int, ...]
    start: tuple[tuple[Fraction, Fraction], ...]  # of each state: middle and radius
    steps: tuple[Step, ...]


def deviations(claim: Claim, bits: int) -> Iterator[list[arb]]:
    """Per step: proven bounds of |x_i - p_i| on it, each below its stated radius; bits: to compute with.

    Raises NotProven where one is not.
    """
    with series(bits, 1):
        end = [rational(middle) + arb(0, abs_upper(rational(radius))) for middle, radius in claim.start]
        e = Spread(np.full((len(end), 1), arb(0)), np.full(1, arb(0)), np.full((len(end), 1), arb(0)))
    for step in claim.steps:
        with series(bits, 1):
            jumps = objects(abs_upper(x - p[0]) for x, p in zip(end, step.polynomial, strict=True))[:, None]
            found, e = _advanced(claim, step, Fraction(0), step.width, e._replace(jumps=jumps))
            end = [at(p, rational(step.width)) for p in step.polynomial]
        yield list(found[:, 0])


def _advanced(claim: Claim, step: Step, first: Fraction, width: Fraction, e: Spread) -> tuple[Objects, Spread]:
    """What `advance` gives for a part of a step; of its halves, one after the other, where it is too wide."""
    try:
        return _part_of_step(claim, step, first, width, e)
    except NotProven as reason:
        if width * PARTS <= step.width:
            raise NotProven(f"in the step from t = {float(step.start):.9g} {reason}") from None
    earlier, e = _advanced(claim, step, first, width / 2, e)
    later, e = _advanced(claim, step, first + width / 2, width / 2, e)
    return largest(np.hstack([earlier, later]).T)[:, None], e


def _part_of_step(claim: Claim, step: Step, first: Fraction, width: Fraction, e: Spread) -> tuple[Objects, Spread]:
    h, time = rational(width), [rational(step.start), arb(1)]
    start = frame(e, np.array([float(r) for r in step.radius]))
    with series(ctx.prec, FRAME):
        s = about(rational(first), h)
        tube = [polynomial([p[0] + arb(0, r), *p[1:]], s) for p, r in zip(step.polynomial, step.radius, strict=True)]
        J = rows(claim.program, claim.rhs, polynomial(time, s), tube, derive=True)[:, :, 1:]
    with series(ctx.prec, max(map(len, step.polynomial)) + BEYOND):
        s = about(rational(first), h)
        f = rows(claim.program, claim.rhs, polynomial(time, s), [polynomial(p, s) for p in step.polynomial])
        d = np.stack([polynomial(rates(p), s) for p in step.polynomial], axis=1)[:, :, None] - f
        found, end = advance(h, J, d, start)
    for i, (bound, radius) in enumerate(zip(found[:, 0], step.radius, strict=True), 1):
        if not bound < radius:
            raise NotProven(f"row {i} may be {float(bound):.2e} away, stated is {float(radius):.2e}")
    return found, end
