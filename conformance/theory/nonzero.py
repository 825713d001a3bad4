# SPDX-License-Identifier: MIT
"""Is a function of the state bounded away from 0, and is it smooth? Yes with a proof, no with a point, or undecided.

Limits of the method. A proof comes from interval arithmetic over the whole state space, from the assumptions of the
declared constants, or, for a polynomial in one state, from its real roots. A zero is looked for exactly at the points
of a small lattice and on lines parallel to the axes through a few of them, and then by a change of sign on a grid. A
zero that touches without a change of sign, off those points and lines, is not found: the answer is then "undecided",
never "proven".
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import sympy as sp
from sympy.core.function import AppliedUndef

SMOOTH = (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh, sp.tanh, sp.atan, sp.asinh, sp.erf)
LATTICE = (0, 1, -1, 2, -2, 3, -3, sp.pi / 2, -sp.pi / 2, sp.pi, -sp.pi)  # where each state is put
LINES = (0, 1, -1, 2)  # the other states are held at these while one is solved for
GRID = (-10, -3, -1, 0, 1, 3, 10)  # corners of the search for a change of sign
GRID_POINTS = 2500  # largest number of points looked at, of the lattice and of the grid

Point = Mapping[sp.Symbol, sp.Expr]


class Sign(Enum):
    """What is known about the values of a function on the whole state space."""

    POSITIVE = "positive and bounded away from 0"
    NEGATIVE = "negative and bounded away from 0"
    VANISHES = "0 at the point"
    TENDS_TO_ZERO = "tends to 0 in the limit"
    UNKNOWN_SIGN = "of unknown sign"
    UNDECIDED = "no zero found, none excluded"


@dataclass(frozen=True)
class Verdict:
    """A sign, and for VANISHES the point, for TENDS_TO_ZERO the direction (a state going to plus or minus infinity)."""

    sign: Sign
    point: Point = field(default_factory=dict)

    @property
    def bounded_away(self) -> bool:
        """True if the function was proven to be bounded away from 0."""
        return self.sign in (Sign.POSITIVE, Sign.NEGATIVE)

    def __str__(self) -> str:
        arrow = " -> " if self.sign is Sign.TENDS_TO_ZERO else " = "
        return ", ".join(f"{s}{arrow}{_short(v)}" for s, v in self.point.items())


def sign_of(expression: sp.Expr, states: Sequence[sp.Symbol]) -> Verdict:
    """Return what can be decided about the sign of a function of the states, each ranging over all real numbers.

    Symbols that are no states are real constants, of which else only their SymPy assumptions are known.
    """
    constants = {s for s in expression.free_symbols - set(states) if s.is_extended_real is None}
    real = {s: sp.Symbol(s.name, real=True) for s in (*states, *constants)}
    back = {v: k for k, v in real.items()}
    verdict = _sign_of(expression.xreplace(real), [real[s] for s in states if s in expression.free_symbols])
    return Verdict(verdict.sign, {back[s]: v.xreplace(back) for s, v in verdict.point.items()})


def _sign_of(e: sp.Expr, states: list[sp.Symbol]) -> Verdict:
    low, high = _range(e)
    if low > 0 or high < 0:
        return Verdict(Sign.POSITIVE if low > 0 else Sign.NEGATIVE)
    if e.atoms(AppliedUndef):
        return Verdict(Sign.UNDECIDED)
    if not states:
        return _sign_of_constant(e)
    point = _zero_on_lattice(e, states) or _zero_on_lines(e, states) or _zero_by_change_of_sign(e, states)
    if point:
        return Verdict(Sign.VANISHES, point)
    if _is_rational_polynomial(e, states):  # all real roots were looked for, there are none, so |e| has a minimum
        return Verdict(Sign.POSITIVE if e.subs(states[0], 0) > 0 else Sign.NEGATIVE)
    direction = _zero_at_infinity(e, states)
    return Verdict(Sign.TENDS_TO_ZERO, direction) if direction else Verdict(Sign.UNDECIDED)


def _is_rational_polynomial(e: sp.Expr, states: list[sp.Symbol]) -> bool:
    if len(states) != 1 or e.free_symbols != set(states) or not e.is_polynomial(*states):
        return False
    return all(c.is_Rational for c in sp.Poly(e, states[0]).coeffs())


def _sign_of_constant(e: sp.Expr) -> Verdict:
    if e.is_positive:
        return Verdict(Sign.POSITIVE)
    if e.is_negative:
        return Verdict(Sign.NEGATIVE)
    return Verdict(Sign.VANISHES if e.is_zero else Sign.UNKNOWN_SIGN)


def _range(e: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return an interval, exact and possibly unbounded, that contains every value of a real expression."""
    if e.is_number and e.is_extended_real:
        return e, e
    if e.is_Add:
        lows, highs = zip(*(_range(a) for a in e.args), strict=True)
        return sp.Add(*lows), sp.Add(*highs)
    if e.is_Mul:
        low, high = _range(e.args[0])
        for factor in e.args[1:]:
            low, high = _product((low, high), _range(factor))
        return low, high
    if e.is_Pow and e.exp.is_Integer:
        return _power(_range(e.base), int(e.exp))
    if isinstance(e, (sp.sin, sp.cos, sp.tanh, sp.erf)):
        return -sp.S.One, sp.S.One
    if isinstance(e, sp.atan):
        return -sp.pi / 2, sp.pi / 2
    if isinstance(e, sp.cosh):
        return sp.S.One, sp.oo
    if e.is_nonnegative:
        return sp.S.Zero, sp.oo
    return (-sp.oo, sp.S.Zero) if e.is_nonpositive else (-sp.oo, sp.oo)


def _product(a: tuple[sp.Expr, sp.Expr], b: tuple[sp.Expr, sp.Expr]) -> tuple[sp.Expr, sp.Expr]:
    corners = [sp.S.Zero if 0 in (s, t) else s * t for s in a for t in b]
    return sp.Min(*corners), sp.Max(*corners)


def _power(base: tuple[sp.Expr, sp.Expr], exponent: int) -> tuple[sp.Expr, sp.Expr]:
    low, high = base
    if exponent < 0:
        if not (low > 0 or high < 0):
            return (sp.S.Zero, sp.oo) if exponent % 2 == 0 else (-sp.oo, sp.oo)
        low, high = 1 / high, 1 / low
        exponent = -exponent
    ends = sorted((low**exponent, high**exponent))
    if exponent % 2 == 0 and low < 0 < high:
        return sp.S.Zero, ends[1]
    return ends[0], ends[1]


def _zero_on_lattice(e: sp.Expr, states: list[sp.Symbol]) -> Point:
    """Return a point of the lattice at which e is exactly 0, or nothing."""
    if e.free_symbols != set(states):
        return {}
    function = sp.lambdify(states, e, "math")
    for corner in itertools.islice(itertools.product(LATTICE, repeat=len(states)), GRID_POINTS):
        if abs(_float(function, [float(value) for value in corner])) < 1e-9:
            point = dict(zip(states, map(sp.sympify, corner), strict=True))
            if sp.simplify(e.subs(point)) == 0:
                return point
    return {}


def _zero_on_lines(e: sp.Expr, states: list[sp.Symbol]) -> Point:
    """Return a point of {e = 0} on a line parallel to an axis, or nothing."""
    for value, s in itertools.product(LINES if len(states) > 1 else LINES[:1], states):
        others = {o: sp.Integer(value) for o in states if o != s}
        for root in _real_roots(e.subs(others), s):
            return {o: others.get(o, root) for o in states}
    return {}


def _real_roots(e: sp.Expr, s: sp.Symbol) -> Iterator[sp.Expr]:
    if s not in e.free_symbols:
        if e.is_zero:
            yield sp.S.Zero
        return
    if _is_rational_polynomial(e, [s]):
        yield from sp.real_roots(sp.Poly(e, s))
        return
    try:
        solutions = sp.solveset(e, s, sp.S.Reals)
        candidates = list(itertools.islice(iter(solutions), 3)) if solutions.is_iterable else []
    except (NotImplementedError, TypeError, ValueError):
        candidates = []
    yield from (c for c in candidates if c.is_real)


def _zero_by_change_of_sign(e: sp.Expr, states: list[sp.Symbol]) -> Point:
    """Return a zero between two grid points of opposite sign, to double precision, or nothing."""
    if e.free_symbols != set(states):
        return {}
    function = sp.lambdify(states, e, "math")
    positive, negative = None, None
    for corner in itertools.islice(itertools.product(GRID, repeat=len(states)), GRID_POINTS):
        value = _float(function, corner)
        positive = corner if value > 1e-9 and positive is None else positive
        negative = corner if value < -1e-9 and negative is None else negative
        if positive and negative:
            zero = _bisect(function, positive, negative)
            at_a_pole = not abs(_float(function, zero)) < 1e-6
            return {} if at_a_pole else dict(zip(states, map(sp.Float, zero), strict=True))
    return {}


def _float(function: Callable[..., float], corner: Sequence[float]) -> float:
    try:
        return float(function(*corner))
    except (ArithmeticError, ValueError, TypeError):
        return math.nan


def _bisect(function: Callable[..., float], positive: Sequence[float], negative: Sequence[float]) -> list[float]:
    middle = list(positive)
    for _ in range(60):
        middle = [(a + b) / 2 for a, b in zip(positive, negative, strict=True)]
        if _float(function, middle) > 0:
            positive = middle
        else:
            negative = middle
    return middle


def _zero_at_infinity(e: sp.Expr, states: list[sp.Symbol]) -> Point:
    """Return {state: plus or minus infinity} if e tends to 0 there with the other states at 0, or nothing."""
    for s, end in itertools.product(states, (sp.oo, -sp.oo)):
        try:
            if sp.limit(e.subs({o: 0 for o in states if o != s}), s, end) == 0:
                return {s: end}
        except (NotImplementedError, ValueError, TypeError, AttributeError):
            continue
    return {}


def singularities(expression: sp.Expr, states: Sequence[sp.Symbol]) -> Iterator[tuple[sp.Expr, Verdict]]:
    """Yield every subexpression that keeps a function of the states from being smooth, and where it does so.

    The verdict is VANISHES with the point for a pole or a branch point, UNDECIDED where smoothness is not excluded but
    has to be assumed, and UNKNOWN_SIGN for functions that are not smooth, or not known here to be.
    """
    for e in sp.preorder_traversal(expression):
        verdict = None
        if e.is_Pow or isinstance(e, sp.log):
            verdict = _singularity_of_power(e, states)
        elif isinstance(e, (sp.tan, sp.sec)):
            verdict = sign_of(sp.cos(e.args[0]), states)
        elif isinstance(e, (sp.cot, sp.csc)):
            verdict = sign_of(sp.sin(e.args[0]), states)
        elif isinstance(e, AppliedUndef):
            verdict = Verdict(Sign.UNDECIDED)
        elif not (e.is_Atom or e.is_Add or e.is_Mul or isinstance(e, (*SMOOTH, sp.Derivative, sp.Tuple))):
            verdict = Verdict(Sign.UNKNOWN_SIGN)
        if verdict and not (verdict.bounded_away or verdict.sign is Sign.TENDS_TO_ZERO):
            yield e, verdict


def _singularity_of_power(e: sp.Expr, states: Sequence[sp.Symbol]) -> Verdict | None:
    base, exponent = (e.args[0], None) if isinstance(e, sp.log) else (e.base, e.exp)
    if exponent is not None and exponent.is_Integer and (exponent >= 0 or not e.free_symbols & set(states)):
        return None
    if not e.free_symbols & set(states):  # a constant, which has to be real
        return None if base.is_nonnegative or sign_of(base, ()).sign is Sign.POSITIVE else Verdict(Sign.UNKNOWN_SIGN)
    verdict = sign_of(base, states)
    if verdict.sign is Sign.NEGATIVE and (exponent is None or not exponent.is_Integer):
        return Verdict(Sign.UNKNOWN_SIGN)
    return verdict


def is_bounded(expression: sp.Expr, time: sp.Symbol) -> bool:
    """Return whether a smooth function of the time was proven to be bounded for all times >= 0.

    Other symbols are real constants. The proof is by sums, products and functions of what is bounded, or by a finite
    limit at infinity.
    """
    real = {s: sp.Symbol(s.name, real=True) for s in expression.free_symbols - {time} if s.is_extended_real is None}
    t = sp.Symbol(time.name, nonnegative=True)
    return _is_bounded(expression.xreplace(real | {time: t}), t)


def _is_bounded(e: sp.Expr, t: sp.Symbol) -> bool:
    if t not in e.free_symbols or isinstance(e, (sp.sin, sp.cos, sp.tanh, sp.atan, sp.erf)):
        return True
    inverse = e.is_Pow and e.exp.is_Integer and e.exp < 0
    if (isinstance(e, sp.exp) and e.args[0].is_nonpositive) or (inverse and sign_of(e.base, (t,)).bounded_away):
        return True
    if (e.is_Add or e.is_Mul or isinstance(e, SMOOTH)) and all(_is_bounded(a, t) for a in e.args):
        return True
    if e.is_Pow and e.exp.is_Integer and e.exp > 0 and _is_bounded(e.base, t):
        return True
    try:
        return sp.limit(e, t, sp.oo).is_finite is True
    except (NotImplementedError, ValueError, TypeError, AttributeError):
        return False


def _short(value: sp.Expr) -> str:
    text = str(value)
    return text if len(text) < 25 and not value.has(sp.Float) else f"{float(value):.6g}"
