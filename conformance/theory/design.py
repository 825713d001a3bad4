# SPDX-License-Identifier: MIT
"""Adaptive backstepping by tuning functions: the controller, the closed loop, and the proof of its Lyapunov identity.

Notation, the lesson's: x_i states, xbar_i = (x_1 .. x_i), u input, theta unknown parameters, theta_hat their estimate,
theta_tilde = theta_hat - theta, r reference, z_i errors, alpha_i virtual controls, w_i regressors, tau_i tuning
functions, k_i gains, Gamma adaptation gain, V Lyapunov function. A number in brackets is a section of the lesson.

The recursion is that of Krstić, Kanellakopoulos, Kokotović (1992), Systems & Control Letters 19(3) 177-185.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import sympy as sp

from .faults import DesignError
from .nonzero import is_bounded, singularities
from .program import Program, evaluate, explicit, needed
from .strict_feedback import TIME, StrictFeedback, expression


class IdentityRefuted(DesignError):
    """A design for which V' + sum k_i z_i^2 is not 0: `value` is what it is at `point`."""

    def __init__(self, point: Mapping[sp.Expr, Fraction], value: Fraction) -> None:
        super().__init__(f"V' + sum k_i z_i^2 is {float(value):.6g}, not 0, at a rational point")
        self.point = point
        self.value = value


@dataclass(frozen=True)
class Design:
    """Every object of the recursion (8), for i = 1 .. n at index i - 1.

    `z`, `alpha` hold n expressions; `w`, `tau` hold n columns of shape (p, 1); `theta_hat_dot` has shape (p, 1);
    `r` holds r, r', .., r^(n). They are names of `program`; `explicit` writes one out in x, theta_hat and r.
    """

    plant: StrictFeedback
    k: tuple[sp.Expr, ...]
    Gamma: sp.Matrix
    r: tuple[sp.Symbol, ...]
    theta_hat: tuple[sp.Symbol, ...]
    z: tuple[sp.Expr, ...]
    w: tuple[sp.Matrix, ...]
    tau: tuple[sp.Matrix, ...]
    alpha: tuple[sp.Expr, ...]
    u: sp.Expr
    theta_hat_dot: sp.Matrix
    V: sp.Expr
    program: Program

    def explicit(self, expression: sp.Expr) -> sp.Expr:
        """Return an expression, or a matrix of them, written out in x, theta_hat, r and its derivatives, and theta."""
        return self.program.explicit(expression)


# ------------------------------------------------------------------ the recursion (8)


def tuning_functions(plant: StrictFeedback, k: Sequence[Any], Gamma: Any) -> Design:
    """Design the adaptive controller of a strict-feedback plant, for any n states and p parameters; (5) to (8).

    `k` holds n positive gains, `Gamma` is a symmetric positive definite p x p matrix (a number will do for p = 1); both
    may hold exact numbers or symbols, which must be declared positive where they stand for k_i or for a scalar Gamma.
    Raises DesignError for wrong lengths, and for gains that are not positive or not positive definite.
    """
    n, p = len(plant.states), len(plant.parameters)
    gains, Gamma = checked_gains(k, n), checked_Gamma(Gamma, p)
    r = tuple(sp.Symbol(_reference_name(order)) for order in range(n + 1))
    theta_hat = tuple(sp.Symbol(_estimate_name(theta.name)) for theta in plant.parameters)
    program = _new_program(plant, r, theta_hat)

    # Counted from 1 as in the lesson; index 0 holds alpha_0 = r, tau_0 = 0, and z_0 = g_0 = 0 for the first step.
    x = (None, *plant.states)
    f, g = (_named(program, name, entries) for name, entries in (("f", plant.f), ("g", plant.g)))
    phi = [sp.zeros(p, 1), *(_column(program, f"phi_{i}", row) for i, row in enumerate(plant.phi, 1))]
    z, w, tau, alpha = [sp.S.Zero], [sp.zeros(p, 1)], [sp.zeros(p, 1)], [r[0]]
    estimate = sp.Matrix(p, 1, theta_hat)

    for i in range(1, n + 1):
        d_x = [None, *program.gradient(alpha[i - 1], plant.states[: i - 1])]
        z.append(program.let(f"z_{i}", x[i] - alpha[i - 1]))  # (5)
        w.append(_column(program, f"w_{i}", regressor(i, phi, d_x)))  # (8)
        tau.append(_column(program, f"tau_{i}", tau[i - 1] + w[i] * z[i]))  # (6), (8)
        drift = sum((d_x[j] * (f[j] + g[j] * x[j + 1]) for j in range(1, i)), sp.S.Zero)
        known = drift + _reference_rate(program, alpha[i - 1], r)
        adaptation = adaptation_terms(i, program, alpha, theta_hat, Gamma, tau, w, z)
        numerator = -g[i - 1] * z[i - 1] - gains[i - 1] * z[i] - f[i] - _dot(w[i], estimate) + known + adaptation
        alpha.append(program.let(f"alpha_{i}", numerator / g[i]))  # (6), (8)

    theta_hat_dot = _column(program, "theta_hat_dot", Gamma * tau[n])  # (8)
    theta_tilde = estimate - sp.Matrix(p, 1, plant.parameters)  # (5)
    V = program.let("V", sum(z_i**2 for z_i in z) / 2 + _quadratic(theta_tilde, Gamma) / 2)  # (6), (7)
    return Design(
        plant, gains, Gamma, r, theta_hat, tuple(z[1:]), tuple(w[1:]), tuple(tau[1:]), tuple(alpha[1:]),
        alpha[n], theta_hat_dot, V, program,
    )  # fmt: skip


def regressor(i: int, phi: Sequence[sp.Matrix], d_x: Sequence[Any]) -> sp.Matrix:
    """Return w_i = phi_i - sum_{j<i} (d alpha_{i-1} / d x_j) phi_j, of shape (p, 1); (8)."""
    return phi[i] - sum((d_x[j] * phi[j] for j in range(1, i)), sp.zeros(*phi[i].shape))


def adaptation_terms(
    i: int,
    program: Program,
    alpha: Sequence[sp.Expr],
    theta_hat: Sequence[sp.Symbol],
    Gamma: sp.Matrix,
    tau: Sequence[sp.Matrix],
    w: Sequence[sp.Matrix],
    z: Sequence[sp.Expr],
) -> sp.Expr:
    """Return (d alpha_{i-1} / d theta_hat) Gamma tau_i + sum_{2<=j<i} (d alpha_{j-1} / d theta_hat) Gamma w_i z_j; (8).

    The first term answers the part of theta_hat' that is known at step i; the sum answers the part that this step adds
    to theta_hat' behind the backs of the steps before it.
    """
    own = _dot(program.gradient(alpha[i - 1], theta_hat), Gamma * tau[i])
    earlier = (_dot(program.gradient(alpha[j - 1], theta_hat), Gamma * w[i]) * z[j] for j in range(2, i))
    return own + sum(earlier, sp.S.Zero)


def _reference_rate(program: Program, alpha: sp.Expr, r: Sequence[sp.Symbol]) -> sp.Expr:
    """The terms of alpha' in r', r'', ..: the sum of (d alpha / d r^(k)) r^(k+1); for alpha_0 = r this is r'."""
    return program.derivative_along(alpha, dict(pairwise(r)))


# ------------------------------------------------------------------ the Lyapunov identity (6) to (8)


def V_dot(design: Design) -> sp.Expr:
    """Return V' along the plant with the true theta, under the design's u and theta_hat', by the chain rule; (7), (8).

    It uses V, u and theta_hat' of the design, and nothing of how they came about.
    """
    plant = design.plant
    field = {x: row.xreplace({plant.input: design.u}) for x, row in zip(plant.states, plant.rhs, strict=True)}
    field |= dict(zip(design.theta_hat, design.theta_hat_dot, strict=True))
    field |= dict(pairwise(design.r))
    return design.program.derivative_along(design.V, field)


def dissipation(design: Design) -> sp.Expr:
    """Return sum_i k_i z_i^2, the rate at which V falls; (7), (8)."""
    return sum(k * z**2 for k, z in zip(design.k, design.z, strict=True))


def lyapunov_defect(design: Design) -> sp.Expr:
    """Return V' + sum_i k_i z_i^2, which is 0 identically if the design is right; (8)."""
    return V_dot(design) + dissipation(design)


def identity_holds(design: Design) -> bool:
    """Decide symbolically whether V' + sum_i k_i z_i^2 = 0, for all x, theta_hat, r, .., theta and all gains; (7), (8).

    Quick for n = 2, and for n = 3 with short rows; `check_identity` is for the others.
    """
    return bool(sp.cancel(sp.together(design.explicit(lyapunov_defect(design)))) == 0)


def check_identity(design: Design, points: int = 3, seed: int = 0) -> None:
    """Check V' + sum_i k_i z_i^2 = 0 at random rational points, in exact arithmetic and without tolerance; (8).

    The value is computed from the very names and derivatives that the recursion made, over Python's fractions. Of
    polynomial rows it is a rational function of everything drawn, so one that is not identically 0 can be 0 at a random
    point by bad luck only. A value that is no rational there, such as sin(x1) or an undefined f_1(x_1), is drawn at
    random as well, which asks more of the identity and not less.
    Raises IdentityRefuted, with the point, if the identity fails; DesignError if no point avoids the poles.
    """
    source = random.Random(seed)
    defect = lyapunov_defect(design)
    definitions = design.program.definitions
    symbols = sorted(needed([defect], definitions) - definitions.keys(), key=str)
    for _ in range(points):
        point, value = _value_at_random_point(defect, symbols, definitions, source)
        if value != 0:
            raise IdentityRefuted(point, value)


def _value_at_random_point(
    e: sp.Expr, symbols: Sequence[sp.Symbol], definitions: Mapping[sp.Symbol, sp.Expr], source: random.Random
) -> tuple[dict[sp.Expr, Fraction], Fraction]:
    for _ in range(20):
        point: dict[sp.Expr, Fraction] = {s: random_rational(source) for s in symbols}
        try:
            return point, evaluate(e, point, definitions, lambda _: random_rational(source))
        except ZeroDivisionError:
            continue
    raise DesignError("no random point found at which V' is defined")


def random_rational(source: random.Random) -> Fraction:
    """Return a random fraction in [-9, 9] with a small denominator, never 0."""
    return Fraction(source.choice((-1, 1)) * source.randint(1, 36), source.randint(4, 9))


# ------------------------------------------------------------------ the closed loop (7), (10)


@dataclass(frozen=True)
class ClosedLoop:
    """The closed loop as an exact first-order system in (x_1 .. x_n, theta_hat_1 .. theta_hat_p).

    `definitions` are shared subexpressions (name, expression) in the order of computation, each in `time`, `states` and
    earlier names; `rhs` (n + p expressions), `z` (n), `u`, `reference`, `V`, `V_dot` and `dissipation`
    (sum k_i z_i^2) may use all of them. `V_dot` is derived by the chain rule, not set to minus the dissipation.
    """

    time: sp.Symbol
    states: tuple[sp.Symbol, ...]
    definitions: tuple[tuple[sp.Symbol, sp.Expr], ...]
    rhs: tuple[sp.Expr, ...]
    u: sp.Expr
    reference: sp.Expr
    z: tuple[sp.Expr, ...]
    V: sp.Expr
    V_dot: sp.Expr
    dissipation: sp.Expr

    def explicit(self, expression: sp.Expr) -> sp.Expr:
        """Return an expression written out in time and states, without the shared names."""
        return explicit(expression, dict(self.definitions))

    def at(self, numbers: Mapping[sp.Symbol, sp.Rational]) -> ClosedLoop:
        """The closed loop with numbers in the place of symbols that were left free."""
        outputs = (*self.rhs, *self.z, self.u, self.reference, self.V, self.V_dot, self.dissipation)
        definitions, found = _substituted(dict(self.definitions), outputs, numbers)
        m, n = len(self.rhs), len(self.z)
        u, r, V, V_dot, dissipated = found[m + n :]
        rhs, z = tuple(found[:m]), tuple(found[m : m + n])
        return ClosedLoop(self.time, self.states, tuple(definitions.items()), rhs, u, r, z, V, V_dot, dissipated)


def closed_loop(
    design: Design,
    theta: Sequence[Any],
    reference: Any,
    values: Mapping[sp.Symbol, Any] | None = None,
    time: sp.Symbol = TIME,
    free: Sequence[sp.Symbol] = (),
) -> ClosedLoop:
    """Derive the closed loop of a plant with true parameters `theta` and reference r(t); (7), (10).

    Nothing of it is written down by hand: right-hand sides, z, V and V' come out of the design.
    `theta` holds p exact numbers, `reference` is an expression in `time`, `values` gives exact numbers to the symbols
    among the gains and constants. Numbers are int, Fraction, SymPy rationals, or decimals as strings: "1.2" is 6/5.
    Symbols in `free` stay, as parameters of a family of closed loops; `theta` and `reference` may hold them.
    Raises DesignError for a wrong length, a float, a symbol left without a value, gains that are not positive, or a
    reference that is not real, smooth and bounded with its first n derivatives, (3).
    """
    plant = design.plant
    if len(theta) != len(plant.parameters):
        raise DesignError(f"theta: {len(theta)} values given, {len(plant.parameters)} needed, one per parameter")
    numbers = {s: v if v in free else number(v, str(s)) for s, v in zip(plant.parameters, theta, strict=True)}
    symbols = {*plant.constants, *(s for e in (*design.k, *design.Gamma) for s in e.free_symbols)}
    for s, value in (values or {}).items():
        if s not in symbols:
            raise DesignError(f"values: {s} is neither a constant of the plant nor a symbol in a gain")
        numbers[s] = number(value, str(s))
    checked_gains([e.xreplace(numbers) for e in design.k], len(plant.states))
    checked_Gamma(design.Gamma.xreplace(numbers), len(plant.parameters))
    if time in (*plant.states, plant.input, *plant.parameters, *plant.constants):
        raise DesignError(f"the time {time} is a symbol of the plant")
    rows = [row.xreplace({plant.input: design.u}) for row in plant.rhs]
    outputs = [*rows, *design.theta_hat_dot, design.u, design.r[0], *design.z, design.V, V_dot(design)]
    outputs = [*outputs, dissipation(design)]
    given = dict(zip(design.r, _derivatives(reference, time, len(design.r), free), strict=True))
    definitions, outputs = _substituted(given | dict(design.program.definitions), outputs, numbers)
    _check_closed(definitions, outputs, {*plant.states, *design.theta_hat, time, *free})
    rhs, rest = outputs[: len(rows) + len(theta)], outputs[len(rows) + len(theta) :]
    u, r, *z, V, rate, fall = rest
    states = (*plant.states, *design.theta_hat)
    return ClosedLoop(time, states, tuple(definitions.items()), tuple(rhs), u, r, tuple(z), V, rate, fall)


def _derivatives(reference: Any, time: sp.Symbol, count: int, free: Sequence[sp.Symbol]) -> list[sp.Expr]:
    r = expression(reference, "the reference")
    if r.free_symbols - {time, *free}:
        raise DesignError(f"the reference: {r} may use {time} alone")
    for e, verdict in singularities(r, (time,)):
        raise DesignError(f"the reference: {e} is not smooth, or not known to be {verdict}".rstrip())
    derivatives = [sp.diff(r, time, order) for order in range(count)]
    for e in derivatives:
        if not is_bounded(e, time):
            raise DesignError(f"the reference: {e} is not bounded, or not known to be (3)")
    return derivatives


def _substituted(
    definitions: Mapping[sp.Symbol, sp.Expr], outputs: Sequence[sp.Expr], numbers: Mapping[sp.Symbol, sp.Expr]
) -> tuple[dict[sp.Symbol, sp.Expr], list[sp.Expr]]:
    """Put numbers in, replace names that become a number or a symbol, and drop what the outputs do not use."""
    used = needed(outputs, definitions)
    replaced = dict(numbers)
    kept = {}
    for s, e in definitions.items():
        if s in used:
            value = e.xreplace(replaced)
            if value.is_Atom:
                replaced[s] = value
            else:
                kept[s] = value
    results = [e.xreplace(replaced) for e in outputs]
    live = needed(results, kept)
    return {s: e for s, e in kept.items() if s in live}, results


def _check_closed(definitions: Mapping[sp.Symbol, sp.Expr], outputs: Sequence[sp.Expr], known: Set[sp.Symbol]) -> None:
    unknown = needed(outputs, definitions) - definitions.keys() - known
    if unknown:
        raise DesignError(f"{min(map(str, unknown))} has no value in the closed loop")


# ------------------------------------------------------------------ checked input


def number(value: Any, where: str) -> sp.Rational:
    """Return an exact rational from an int, a Fraction, a SymPy rational or a decimal string.

    Raises DesignError, naming `where`, for anything else, doubles included.
    """
    if isinstance(value, str):
        try:
            return sp.Rational(Fraction(value))
        except (ValueError, ZeroDivisionError):
            raise DesignError(f"{where}: {value!r} is not a number") from None
    if isinstance(value, float):
        raise DesignError(f"{where}: the double {value!r} is not exact; write '{value!r}'")
    result = expression(value, where)
    if not result.is_Rational:
        raise DesignError(f"{where}: {value} is not a rational number")
    return result


def checked_gains(k: Sequence[Any], n: int) -> tuple[sp.Expr, ...]:
    """Return the gains k_1 .. k_n as expressions; raises DesignError unless there are n and all are positive; (6)."""
    if len(k) != n:
        raise DesignError(f"gains: {len(k)} given, {n} needed, one per state")
    gains = tuple(_scalar(value, f"row {i}: k_{i}") for i, value in enumerate(k, 1))
    for i, gain in enumerate(gains, 1):
        if not gain.is_positive:
            raise DesignError(f"row {i}: k_{i} = {gain} is not {_positive(gain)}")
    return gains


def checked_Gamma(Gamma: Any, p: int) -> sp.Matrix:
    """Return the p x p adaptation gain; raises DesignError unless it is symmetric and positive definite; (6).

    Positive definite is decided by the leading principal minors (Sylvester); for p > 1, a minor whose sign the
    assumptions of its symbols leave open is taken on trust.
    """
    rows = Gamma.tolist() if isinstance(Gamma, sp.MatrixBase) else Gamma
    if not isinstance(rows, (list, tuple)):
        rows = [[rows]]
    if len(rows) != p or any(not isinstance(row, (list, tuple)) or len(row) != p for row in rows):
        raise DesignError(f"Gamma must be {p} x {p}, one row and one column per parameter")
    entries = [[_scalar(e, f"Gamma[{i},{j}]") for j, e in enumerate(row, 1)] for i, row in enumerate(rows, 1)]
    matrix = sp.ImmutableDenseMatrix(p, p, [e for row in entries for e in row])
    for i in range(p):
        for j in range(i):
            if sp.simplify(matrix[i, j] - matrix[j, i]) != 0:
                entry = f"Gamma[{i + 1},{j + 1}] = {matrix[i, j]}"
                raise DesignError(f"Gamma is not symmetric: {entry}, and across the diagonal stands {matrix[j, i]}")
    for i in range(1, p + 1):
        minor = matrix[:i, :i].det()
        if minor.is_positive is False or (p == 1 and not minor.is_positive):
            raise DesignError(f"Gamma is not positive definite: leading minor {i} = {minor} is not {_positive(minor)}")
    return matrix


def _scalar(value: Any, where: str) -> sp.Expr:
    return number(value, where) if isinstance(value, (str, float)) else expression(value, where)


def _positive(value: sp.Expr) -> str:
    return "declared positive" if value.is_positive is None else "positive"


# ------------------------------------------------------------------ names and small algebra


def _new_program(plant: StrictFeedback, r: Sequence[sp.Symbol], theta_hat: Sequence[sp.Symbol]) -> Program:
    n, p = len(plant.states), len(plant.parameters)
    own = {str(s) for s in (*r, *theta_hat)} | {"V"} | {f"theta_hat_dot_{j}" for j in range(1, p + 1)}
    own |= {f"{name}_{i}" for name in ("f", "g", "z", "alpha") for i in range(1, n + 1)}
    own |= {f"{name}_{i}_{j}" for name in ("phi", "w", "tau") for i in range(1, n + 1) for j in range(1, p + 1)}
    for s in (*plant.states, plant.input, *plant.parameters, *plant.constants):
        if s.name in own:
            raise DesignError(f"the plant's symbol {s} has the name of an object of the design; rename it")
    return Program((*plant.states, *theta_hat, *r, *plant.parameters))


def _reference_name(order: int) -> str:
    return "r" + "'" * order if order < 4 else f"r^({order})"


def _estimate_name(theta: str) -> str:
    return f"{theta}_hat"


def _named(program: Program, name: str, entries: Sequence[sp.Expr]) -> list[sp.Expr]:
    return [sp.S.Zero, *(program.let(f"{name}_{i}", e) for i, e in enumerate(entries, 1))]


def _column(program: Program, name: str, entries: Any) -> sp.Matrix:
    names = [program.let(f"{name}_{j}", e) for j, e in enumerate(entries, 1)]
    return sp.ImmutableDenseMatrix(len(names), 1, names)


def _dot(a: sp.Matrix, b: sp.Matrix) -> sp.Expr:
    return sum((s * t for s, t in zip(a, b, strict=True)), sp.S.Zero)


def _quadratic(column: sp.Matrix, Gamma: sp.Matrix) -> sp.Expr:
    """Return column' Gamma^-1 column."""
    return _dot(column, Gamma.inv() * column) if column.rows else sp.S.Zero
