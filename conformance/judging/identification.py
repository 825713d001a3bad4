# SPDX-License-Identifier: MIT
"""What a log says of the equations: the parameters and start values that it implies, and how well it knows them.

A log that is e away from the exact solution x(t; p) is the solution for p + q, up to what is left of e - S q, where
S = dx/dp is proven. Least squares over all q at once give what the log implies; what is left bounds how far that may be
from what was simulated. One parameter at a time, they tell whether another experiment explains the log better.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from conformance.judging.measured import Measured
from conformance.judging.trajectory import Array
from conformance.theory.experiments import values_of
from conformance.truth.exact import Exact

ROWS = 4000  # of a log that are looked at, evenly spread
UNKNOWN = 1e-9  # relative size of a singular value that tells of a combination which the log cannot show
NEARER = 10.0  # times nearer to another experiment than to its own: a log of which that is no chance
WORTH_A_TRY = 3.0  # times nearer, to first order: a change of up to a third of a parameter
FAR = 0.3  # of the scale of a state: a log this far from the solution implies no parameter
ITERATIONS = 8
MOST_CALLS = 20000  # of the right-hand side for one integration; the lesson's takes 5000


@dataclass(frozen=True)
class Implied:
    """The value of a parameter or start value that a log implies, and a bound of its error; infinite where unknown."""

    name: str
    value: float
    bound: float

    def __str__(self) -> str:
        if not math.isfinite(self.bound):
            return f"{self.name}: the log cannot tell"
        places = max(0, 1 - math.floor(math.log10(max(self.bound, 1e-16))))
        return f"{self.name} = {self.value:.{places}f} +- {self.bound:.0e}"


@dataclass(frozen=True)
class Neighbour:
    """The experiment that explains a log best among those that differ in one parameter or start value."""

    name: str
    change: float  # of the parameter
    nearer: float  # how many times nearer the log is to it than to its own


def sampled(log: Measured) -> tuple[Array, Array, Array]:
    """Times (s), deviations and sensitivities at up to ROWS rows: (rows,), (m, rows), (m, columns, rows)."""
    t = log.trajectory.t
    chosen = np.unique(np.linspace(0, t.size - 1, min(t.size, ROWS)).round().astype(int))
    return t[chosen], log.deviation[:, chosen], log.exact.sensitivity(t[chosen])


def implied(log: Measured) -> list[Implied]:
    """What the log implies of each parameter and start value; nothing where it is not near the solution."""
    _, e, S = sampled(log)
    if not np.abs(e).max() < FAR * log.exact.table.scale.max():
        return []
    A, b = S.transpose(0, 2, 1).reshape(-1, S.shape[1]), e.ravel()
    sizes = np.linalg.norm(A, axis=0)
    sizes = np.where(sizes > 0, sizes, 1.0)
    U, s, V = np.linalg.svd(A / sizes, full_matrices=False)
    seen = s > UNKNOWN * s[0]
    inverse = (V[seen].T / s[seen]) @ U[:, seen].T / sizes[:, None]
    left = np.repeat(np.abs((b - A @ (inverse @ b)).reshape(e.shape)).max(axis=1), e.shape[1])
    bounds = np.abs(inverse) @ left
    bounds[np.abs(V[~seen]).max(axis=0, initial=0) > 1e-6] = np.inf
    return [
        Implied(name, value(log.exact, name) + float(q), float(bound))
        for name, q, bound in zip(log.exact.sensitivity.columns.tolist(), inverse @ b, bounds, strict=True)
    ]


def neighbour(log: Measured) -> Neighbour:
    """The best single change of a parameter or start value, to first order."""
    _, e, S = sampled(log)
    changes, nearer = _single(e, S)
    best = int(np.argmax(nearer))
    return Neighbour(str(log.exact.sensitivity.columns[best]), float(changes[best]), float(nearer[best]))


def _single(e: Array, S: Array) -> tuple[Array, Array]:
    """Per column of S alone: its least-squares coefficient, and how many times it makes the largest |e| smaller."""
    sizes = np.einsum("ict,ict->c", S, S)
    changes = np.einsum("ict,it->c", S, e) / np.where(sizes > 0, sizes, 1.0)
    left = np.abs(e[:, None] - changes[:, None] * S).max(axis=(0, 2))
    return changes, np.abs(e).max() / np.maximum(left, 1e-300)


def value(exact: Exact, name: str) -> float:
    """A parameter or start value of the experiment."""
    return float(values_of(exact.experiment)[name])


def explanation(log: Measured) -> Implied | None:
    """The one parameter or start value, by name and value, for which the log is a solution; None where there is none.

    By Gauss and Newton's method from the first-order guess, for all candidates at once.
    """
    t, e, S = sampled(log)
    if not np.isfinite(e).all():
        return None
    changes, nearer = _single(e, S)
    tried = np.flatnonzero(nearer > WORTH_A_TRY)
    if not tried.size:
        return None
    q, names = changes[tried], log.exact.sensitivity.columns[tried].tolist()
    logged, own, fine = e + log.exact.evaluate(t), np.abs(e).max(), 1e-6
    for _ in range(ITERATIONS):
        steps = np.maximum(np.abs(q), 1e-3) * fine**0.5
        found = solutions(log.exact, names * 2, np.concatenate([q, q + steps]), t)  # (m, 2 candidates, rows)
        if not np.isfinite(found).all():
            return None
        off = logged[:, None] - found[:, : tried.size]
        slope = (found[:, len(tried) :] - found[:, : tried.size]) / steps[:, None]
        sizes = np.einsum("ict,ict->c", slope, slope)
        dq = np.einsum("ict,ict->c", slope, off) / np.where(sizes > 0, sizes, 1.0)
        left = np.abs(off).max(axis=(0, 2))
        q = q + dq
        if (np.abs(dq) <= 1e-3 * np.abs(q) * fine).all():
            break
    left = np.where(np.isfinite(left), left, np.inf)
    best = int(np.argmin(left))
    if not left[best] * NEARER < own:
        return None
    bound = left[best] * np.abs(slope[:, best]).sum() / sizes[best]
    return Implied(names[best], value(log.exact, names[best]) + float(q[best]), float(bound))


def told(log: Measured) -> list[str]:
    """What a log says of the equations, in lines: which experiment explains it better, or what it implies."""
    if not log.exact.sensitivity.columns.size:
        return []
    better = explanation(log) if neighbour(log).nearer > WORTH_A_TRY else None
    if better is not None:
        return [f"this is the solution for {better}, not for {value(log.exact, better.name):.10g}"]
    return [f"implied by the log: {one}" for one in implied(log)]


def solutions(exact: Exact, names: Sequence[str], changes: Array, times: Array) -> Array:
    """Approximate solutions with one parameter or start value changed each, at these times (s): (m, names, times)."""
    from scipy.integrate import solve_ivp  # which takes a second

    values = {name: np.full(len(names), float(number)) for name, number in values_of(exact.experiment).items()}
    for i, (name, change) in enumerate(zip(names, changes, strict=True)):
        values[name][i] += change
    start = np.array([values[f"{name}_start"] for name in exact.setting.names])
    m = len(start)

    calls = count(1)

    def rhs(t: float, x: Array) -> Array:
        if next(calls) > MOST_CALLS:
            raise ArithmeticError("a candidate far from any solution")
        return exact.functions("first", values, np.full(len(names), t), x.reshape(m, -1)).ravel()

    with np.errstate(all="ignore"):
        found = np.full((m, len(names), times.size), np.inf)
        try:
            solved = solve_ivp(rhs, (0, float(times[-1])), start.ravel(), "DOP853", times, rtol=1e-12, atol=1e-13)
        except ArithmeticError:
            return found
    found[..., : solved.y.shape[1]] = solved.y.reshape(m, len(names), -1)
    return found
