# SPDX-License-Identifier: MIT
"""Bounds of how far polynomials are from the solution of x' = f(t, x): a differential inequality in moving frames.

On one step let p be the polynomials, d = p' - f(t, p) their defect, e = x - p, and J the Jacobian of f, averaged from p
to x. Then e' = J e - d. Any regular Psi(t) gives coordinates w = Psi e, in which, with any Phi near Psi^-1 and with
H = Psi Phi - I,

    w' = (Psi' + Psi J) Phi (I + H)^-1 w - Psi d,    |w|' <= E |w| + delta,    component by component.

Hence |w| <= W on the step if |w(0)| + h (E W + delta) <= W. As long as |e| <= |Phi| |(I + H)^-1| W is below the stated
radius, J stays where E was bounded, so no solution is the first to leave. Psi and Phi are Taylor polynomials of the
adjoint and the variational equation, found in doubles: then E is small, whatever the flow does, and nothing depends on
their being accurate. Sources: Dahlquist 1958 and Lozinskii 1958 for the inequality, Lohner 1987 for the frames. Every
bound is in ball arithmetic, and nothing here comes from the modules that find the enclosure.

A function of s in [0, h] is a pair, an array (.., 2) of its Taylor series at 0 and over all of [0, h].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_poly, arb_series, ctx, fmpq
from numpy.typing import NDArray

FRAME = 10  # order of the polynomials Psi and Phi, and of J
BEYOND = 4  # orders to which the defect is expanded beyond the degree of the polynomials
PARTS = (1, 2, 4, 8, 16, 32)  # into which a step is cut, one after the other
ROUNDS = 20  # in which W is widened until it closes
TINY = 1e-300
Objects = NDArray[Any]  # of balls, or of series
Floats = NDArray[np.float64]


class NotProven(ArithmeticError):
    """The claim does not hold, or this way cannot show that it does."""


@contextmanager
def series(bits: int, order: int) -> Iterator[None]:
    """Sets the precision and the length of series, which are global to python-flint, and restores them."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = bits, order
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


# ---- Functions on a step ----


def objects(shape: tuple[int, ...], entry: Callable[..., Any]) -> Objects:
    """An array of what `entry` gives for its indices."""
    made = np.empty(shape, dtype=object)
    for index in np.ndindex(*shape):
        made[index] = entry(*index)
    return made


def polynomial(coefficients: Sequence[arb] | Objects, first: arb, h: arb, radius: arb | float = 0) -> Objects:
    """A polynomial in first + s, and with it all functions within a radius; of constants, the pair of a constant."""
    p = arb_poly(list(coefficients)) + arb(0, radius)
    pair = np.empty(2, dtype=object)
    pair[0] = arb_series((p if first == 0 else p(arb_poly([first, 1]))).coeffs())
    pair[1] = arb_series(p(arb_poly([first + h / 2 + arb(0, (h / 2).abs_upper()), 1])).coeffs())
    return pair


def constant(value: arb) -> Objects:
    """The same value at all times."""
    pair = np.empty(2, dtype=object)
    pair[0] = pair[1] = arb_series([value])
    return pair


def each(function: Callable[[arb_series], arb_series]) -> Callable[[Objects], Objects]:
    """A function of series as a function of pairs."""
    return np.frompyfunc(function, 1, 1)


def bounds(pairs: Objects, h: arb, order: int) -> Objects:
    """Bounds of the absolute values on [0, h], by Taylor's theorem with the remainder of this order; shape (..)."""
    powers = [h**k for k in range(order + 1)]

    def bound(*index: int) -> arb:
        at, over = (known(one, order) for one in pairs[index])
        terms = [*at[:order], *[arb(0)] * (order - len(at)), *over[order : order + 1]]
        return abs_upper(sum((c.abs_upper() * p for c, p in zip(terms, powers, strict=False)), arb(0)))

    return objects(pairs.shape[:-1], bound)


def known(one: arb_series, order: int) -> list[arb]:
    """The coefficients of a series, which must be known beyond this order."""
    if one.prec <= order:
        raise AssertionError(f"a series known to order {one.prec} is asked for order {order}")
    return list(one.coeffs())


def product(a: Objects, b: Objects) -> Objects:
    """The product of matrices of functions."""
    found: Objects = (a[:, :, None] * b[None]).sum(axis=1)
    return found


# ---- The differential equation, as a straight-line program ----

ELEMENTARY = {
    "exp": each(lambda u: u.exp()),
    "log": each(lambda u: u.log()),
    "sin": each(lambda u: u.sin()),
    "cos": each(lambda u: u.cos()),
    "tan": each(lambda u: u.tan()),
    "atan": each(lambda u: u.atan()),
    "sinh": each(lambda u: (u.exp() - (-u).exp()) / 2),
    "cosh": each(lambda u: (u.exp() + (-u).exp()) / 2),
    "tanh": each(lambda u: 1 - 2 / ((2 * u).exp() + 1)),
}
SLOPE: dict[str, Callable[[Objects, Objects], Objects]] = {  # F'(u), from u and v = F(u)
    "exp": lambda u, v: v,
    "log": lambda u, v: 1 / u,
    "sin": lambda u, v: ELEMENTARY["cos"](u),
    "cos": lambda u, v: -ELEMENTARY["sin"](u),
    "tan": lambda u, v: 1 + v * v,
    "atan": lambda u, v: 1 / (1 + u * u),
    "sinh": lambda u, v: ELEMENTARY["cosh"](u),
    "cosh": lambda u, v: ELEMENTARY["sinh"](u),
    "tanh": lambda u, v: 1 - v * v,
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
) -> list[tuple[Objects, dict[int, Objects]]]:
    """The outputs, and where asked for their derivatives that are not 0, by state."""
    value: list[Objects] = []
    slope: list[dict[int, Objects]] = []
    for line in program:
        v, partials = _operate(line, [value[i] for i in line.reads], t, x)
        gradient = {int(line.value): constant(arb(1))} if line.op == "state" else {}
        for i, partial in zip(line.reads, partials() if derive else (), strict=False):
            for state, inner in slope[i].items():
                term = partial * inner
                gradient[state] = gradient[state] + term if state in gradient else term
        value.append(v)
        slope.append(gradient)
    return [(value[i], slope[i]) for i in outputs]


def _operate(
    line: Line, read: list[Objects], t: Objects, x: Sequence[Objects]
) -> tuple[Objects, Callable[[], tuple[Any, ...]]]:
    """A line's value, and its partial derivatives with respect to what it reads."""
    match line.op, read:
        case "time", _:
            return t, tuple
        case "state", _:
            return x[int(line.value)], tuple
        case "constant", _:
            return constant(number(line.value)), tuple
        case "add", (a, b):
            return a + b, lambda: (1, 1)
        case "mul", (a, b):
            return a * b, lambda: (b, a)
        case "div", (a, b):
            v = a / b
            return v, lambda: (1 / b, -(v / b))
        case "power", (u,):
            r = constant(number(line.value))
            v = ELEMENTARY["exp"](r * ELEMENTARY["log"](u))
            return v, lambda: (r * v / u,)
        case _, (u,):
            v = ELEMENTARY[line.op](u)
            return v, lambda: (SLOPE[line.op](u, v),)
    raise AssertionError(line)


def number(text: str) -> arb:
    """The ball of pi, of E, or of a rational number."""
    return NAMED[text]() if text in NAMED else rational(Fraction(text))


def rational(value: Fraction) -> arb:
    """The ball of a rational number."""
    return arb(fmpq(value.numerator, value.denominator))


# ---- One step ----


class Deviation(NamedTuple):
    """The columns of e are basis w, |w_ij| <= box_ij."""

    basis: Objects
    box: Objects


def unit(n: int) -> Objects:
    """The unit matrix."""
    return objects((n, n), lambda i, j: arb(int(i == j)))


def jumped(e: Deviation, jumps: Objects) -> Deviation:
    """e after jumps of its entries that are no larger than these."""
    return Deviation(np.hstack([e.basis, unit(len(jumps))]), np.vstack([e.box, jumps]))


def advance(
    h: arb, J: Objects, d: Objects, orders: tuple[int, int], before: Deviation, scale: Floats
) -> tuple[Objects, Deviation]:
    """Bounds of |e_ij| on a step of width h on which e' = J e - d, and e at its end; a column of e per column of d.

    orders: of the expansions of J, Psi and Phi, and of d. scale: (rows,), what the rows of e are measured in, for the
    choice of the frame alone. Raises NotProven where the step is too wide.
    """
    short, long = orders
    with np.errstate(all="ignore"):  # what is not finite passes no test below
        flow, adjoint = frames(J, before, scale, short)
    with series(ctx.prec, short + 1):
        Phi, Psi, Psi_rate = (polynomials(c, h) for c in (flow, adjoint, rates(adjoint)))
        one = objects(J.shape, lambda i, j, k: arb_series([int(i == j)]))
        near = _inverse(bounds(product(Psi, Phi) - one, h, short))
        E = bounds(product(Psi_rate + product(Psi, J), Phi), h, short) @ near
        everywhere = bounds(Phi, h, short) @ near
    delta = bounds(product(polynomials(adjoint, h), d), h, long) * h
    start = abs(adjoint[:, :, 0] @ before.basis) @ before.box
    found = start + delta
    for _ in range(ROUNDS):
        W = found * arb(1 + 2.0**-20)
        found = start + E @ W * h + delta
        if all((found <= W).flat):
            end = objects(J.shape[:2], lambda i, j: arb_poly(list(flow[i, j]))(h))
            return everywhere @ W, Deviation(end, near @ W)
    raise NotProven("the bound of the deviation does not close")


def frames(J: Objects, before: Deviation, scale: Floats, order: int) -> tuple[Objects, Objects]:
    """Taylor coefficients of Phi and of Psi, (rows, rows, order), from doubles: any would do, these make E small.

    Phi(0) is orthogonal in the units of the scale, its columns along the longest edges of e at the start (Lohner 1987).
    """
    slopes = np.zeros((order, *J.shape[:2]))
    for i, j in np.ndindex(*J.shape[:2]):
        known = [float(c.mid()) for c in J[i, j, 0].coeffs()[:order]]
        slopes[: len(known), i, j] = known
    basis, box = (np.vectorize(lambda c: float(c.mid()), otypes=[float])(part) for part in before)
    edges = basis / scale[:, None]
    lengths = np.linalg.norm(edges, axis=0)[:, None] * box
    edges = edges * (box / np.maximum(lengths.max(axis=0), TINY)).max(axis=1)
    axes = np.linalg.qr(edges[:, np.argsort(-np.linalg.norm(edges, axis=0))])[0]
    flow, adjoint = [axes * scale[:, None]], [axes.T / scale]
    for k in range(1, order):
        flow.append(sum(slopes[i] @ flow[k - 1 - i] for i in range(k)) / k)
        adjoint.append(-sum(adjoint[k - 1 - i] @ slopes[i] for i in range(k)) / k)
    return exactly(np.stack(flow, axis=2)), exactly(np.stack(adjoint, axis=2))


def exactly(doubles: Floats) -> Objects:
    """Doubles as exact balls."""
    return np.asarray(np.frompyfunc(arb, 1, 1)(doubles), dtype=object)


def rates(coefficients: Objects) -> Objects:
    """The coefficients of a polynomial's derivative, along the last axis."""
    found: Objects = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    return found


def polynomials(coefficients: Objects, h: arb) -> Objects:
    """Polynomials of the coefficients along the last axis, from s = 0."""
    return np.stack([[polynomial(list(c), arb(0), h) for c in row] for row in coefficients])


def _inverse(H: Objects) -> Objects:
    """Bounds of |(I + H)^-1| by Neumann's series: |H|^k has no entry above the k-th power of its sum."""
    norm = H.sum()
    if not norm < 0.5:
        raise NotProven("the frames are not inverse to each other")
    return np.eye(len(H), dtype=int) + objects(H.shape, lambda i, j: norm / (1 - norm))


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
    n = len(claim.rhs)
    with series(bits, 2):
        balls = [rational(middle) + arb(0, abs_upper(rational(radius))) for middle, radius in claim.start]
        jump = [abs_upper(x - p[0]) for x, p in zip(balls, claim.steps[0].polynomial, strict=True)]
        e = Deviation(unit(n), objects((n, 1), lambda i, j: jump[i]))
    for step, after in zip(claim.steps, (*claim.steps[1:], None), strict=True):
        with series(bits, 2):
            found, e = _whole_step(claim, step, e)
            if after is not None:
                pairs = zip(step.polynomial, after.polynomial, strict=True)
                jump = [abs_upper(arb_poly(list(p))(rational(step.width)) - q[0]) for p, q in pairs]
                e = jumped(e, objects((n, 1), lambda i, j, jump=jump: jump[i]))
        yield found


def _whole_step(claim: Claim, step: Step, before: Deviation) -> tuple[list[arb], Deviation]:
    """The bounds on one step, and e at its end, by as few parts as will do."""
    obstacle = NotProven()
    for parts in PARTS:
        try:
            found, e = [arb(0)] * len(claim.rhs), before
            for part in range(parts):
                everywhere, e = _part_of_step(claim, step, step.width * Fraction(part, parts), step.width / parts, e)
                found = [a.max(b) for a, b in zip(found, everywhere, strict=True)]
            return found, e
        except NotProven as reason:
            obstacle = reason
    raise NotProven(f"in the step from t = {float(step.start):.9g} {obstacle}")


def _part_of_step(
    claim: Claim, step: Step, first: Fraction, width: Fraction, before: Deviation
) -> tuple[list[arb], Deviation]:
    h, begin, n = rational(width), rational(first), len(claim.rhs)
    order = max(map(len, step.polynomial)) + BEYOND
    time = [rational(step.start), arb(1)]
    with series(ctx.prec, order + 1):
        x = [polynomial(p, begin, h) for p in step.polynomial]
        f = rows(claim.program, claim.rhs, polynomial(time, begin, h), x)
        rate = [polynomial(rates(np.array([*p, arb(0)], dtype=object)), begin, h) for p in step.polynomial]
        d = np.stack([[a - b] for a, (b, _) in zip(rate, f, strict=True)])
    with series(ctx.prec, FRAME + 1):
        x = [polynomial(p, begin, h, r) for p, r in zip(step.polynomial, step.radius, strict=True)]
        f = rows(claim.program, claim.rhs, polynomial(time, begin, h), x, derive=True)
        J = np.stack([[slopes.get(j, constant(arb(0))) for j in range(n)] for _, slopes in f])
    with series(ctx.prec, order + 1):
        everywhere, after = advance(h, J, d, (FRAME, order), before, np.array([float(r) for r in step.radius]))
    if not all(bound < radius for bound, radius in zip(everywhere[:, 0], step.radius, strict=True)):
        i = next(i for i in range(n) if not everywhere[i, 0] < step.radius[i])
        raise NotProven(f"row {i + 1} may be {float(everywhere[i, 0]):.2e} away, stated is {float(step.radius[i]):.2e}")
    return list(everywhere[:, 0]), after


def abs_upper(ball: arb) -> arb:
    """A bound of the absolute value, exact."""
    return arb(ball.abs_upper())
