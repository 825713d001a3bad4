# SPDX-License-Identifier: MIT
"""A scenario's exact solution and closed loop, as functions of arrays: proven once, then kept.

The functions are those of `closed_loop`, derived from the plant and part of the sources. Only the first use of a
scenario needs SymPy and ball arithmetic; the numbers found are kept in build/truth, and checked whenever they are read.
"""

import functools
import hashlib
import io
import math
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from conformance.places import PACKAGE, proofs
from conformance.theory.scenario import PARAMETERS, Scenario
from conformance.truth import cache, closed_loop
from conformance.truth.piecewise import DEGREE, Floats, Table

KEPT = proofs()
TARGET = 1e-18  # radius of the proof
SAMPLES = 4001  # of the exact solution, where the largest slopes along it are looked for
JUMP = 1e-13  # relative, by which a table may miss: what doubles explain
NEAR = 1e-2  # relative, by which sensitivities and gains may miss what is found at samples
FUNCTIONS = ("reference", "control", "first", "second", "errors", "lyapunov", "dissipation", "gradients")
ROOMS = ("theory", "truth")  # on whose modules a proof depends
LIBRARIES = ("mpmath", "numpy", "python-flint", "sympy")
Function = Callable[..., list[Floats]]


@dataclass(frozen=True)
class Gains:
    """How far a quantity moves when the states x1, x2, theta_hat do, by up to 1e-6 from the exact solution: proven."""

    field: Floats  # (3, 3) largest |d state_i' / d state_j|
    z: Floats  # (2, 3) largest |d z_i / d state_j|
    V: Floats  # (3,) largest |dV / d state_j|
    dissipated: Floats  # (3,) integral of |d (k1 z1^2 + k2 z2^2) / d state_j| over the horizon


COLUMNS = (*PARAMETERS, "x1_start", "x2_start", "theta_hat_start")  # of the sensitivities


@dataclass(frozen=True)
class Sensitivity:
    """dx/dp, how the exact x1, x2, theta_hat move with each of the COLUMNS: piecewise polynomials in t - start.

    starts: (pieces,) s. polynomial: (pieces, order, 3, columns). radius: (3, columns), of |value - dx/dp| at all times.
    end: s.
    """

    starts: Floats
    polynomial: Floats
    radius: Floats
    end: float

    def __call__(self, times: Floats, derivative: int = 0) -> Floats:
        """dx/dp at these times (s), or a derivative of it by the time, shape (3, columns, times)."""
        piece = np.clip(np.searchsorted(self.starts, times, side="right") - 1, 0, self.starts.size - 1)
        s = (times - self.starts[piece])[:, None, None]
        total = np.zeros((times.size, *self.radius.shape))
        for k in range(self.polynomial.shape[1] - 1, derivative - 1, -1):
            total = total * s + self.polynomial[piece, k] * math.perm(k, derivative)
        found: Floats = np.moveaxis(total, 0, 2)
        return found


@dataclass(frozen=True)
class Exact:
    """The exact solution, within `table.bound`, and the closed loop; times t in s.

    Functions of (t, states) take shapes (rows,) and (3, rows): x1, x2, theta_hat.
    """

    scenario: Scenario
    table: Table  # of x1, x2, theta_hat
    gains: Gains
    sensitivity: Sensitivity
    functions: dict[str, Function]

    def evaluate(self, times: ArrayLike) -> Floats:
        """x1, x2 and theta_hat, shape (3, *times.shape); raises ValueError for a time outside of the horizon."""
        return self.table(times, range(3))

    def reference(self, t: Floats) -> Floats:
        """r(t), shape (rows,)."""
        return self._row("reference", t)

    def control(self, t: Floats, states: Floats) -> Floats:
        """u, shape (rows,)."""
        return self._row("control", t, states)

    def first(self, t: Floats, states: Floats) -> Floats:
        """The states' derivatives, shape (3, rows)."""
        return self._rows("first", t, states)

    def second(self, t: Floats, states: Floats) -> Floats:
        """The states' second derivatives along solutions, shape (3, rows)."""
        return self._rows("second", t, states)

    def errors(self, t: Floats, states: Floats) -> Floats:
        """z1 and z2, shape (2, rows)."""
        return self._rows("errors", t, states)

    def lyapunov(self, t: Floats, states: Floats) -> Floats:
        """V, shape (rows,)."""
        return self._row("lyapunov", t, states)

    def dissipation(self, t: Floats, states: Floats) -> Floats:
        """k1 z1^2 + k2 z2^2, which is -V', and its derivative along solutions, shape (2, rows)."""
        return self._rows("dissipation", t, states)

    def _row(self, name: str, t: Floats, states: Iterable[Floats] = ()) -> Floats:
        row: Floats = self._rows(name, t, states)[0]
        return row

    def _rows(self, name: str, t: Floats, states: Iterable[Floats] = ()) -> Floats:
        return rows(self.functions[name], self.scenario, t, states)


def rows(function: Function, scenario: Scenario, t: Floats, states: Iterable[Floats]) -> Floats:
    """A derived function in a scenario, shape (results, rows); a constant becomes a row as long as the others."""
    parameters = {name: float(getattr(scenario, name)) for name in PARAMETERS}
    return np.stack([np.broadcast_to(value, t.shape) for value in function(t, *states, **parameters)])


# ---- Proven once, then kept ----


@functools.lru_cache(maxsize=64)  # a campaign's worker sees thousands of scenarios
def exact(scenario: Scenario, target: float = TARGET) -> Exact:
    """The exact solution of a scenario, by a proof whose radius is at most `target`; from the cache where it is.

    Raises ProofEnded where the proof cannot be continued to the horizon.
    """
    key = _key((scenario, target))
    path = KEPT / f"{key}.exact"
    payload = cache.read(path, key)
    if payload is not None:
        found = unpacked(scenario, payload)
        if found is not None and believable(found):
            return found
    payload = prove(scenario, target)
    cache.write(path, key, payload)
    found = unpacked(scenario, payload)
    assert found is not None
    return found


def derived_functions(wave: str) -> dict[str, Function]:
    """The closed loop's functions of t, states and parameters, by name."""
    return {name: getattr(closed_loop, f"{name}_{wave}") for name in FUNCTIONS}


def _key(of: object) -> str:
    """A digest of this and of all that its derivation depends on: the sources and the versions of the libraries."""
    digest = hashlib.sha256(repr((of, *map(version, LIBRARIES))).encode())
    for path in (path for room in ROOMS for path in sorted((PACKAGE / room).glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def prove(scenario: Scenario, target: float) -> bytes:
    """The solution, the sensitivities and the gains along it: as the bytes that are kept."""
    from conformance.truth.experiment import problem
    from conformance.truth.sensitivity import sensitivity
    from conformance.truth.truth import compute

    table = compute(problem(scenario), target).table
    found, gains = sensitivity(scenario)
    return packed(Exact(scenario, table, gains, found, {}))


def packed(found: Exact) -> bytes:
    """The numbers of an Exact as bytes, which `unpacked` reads."""
    stream = io.BytesIO()
    named = ((part, f.name) for part in (found.table, found.gains, found.sensitivity) for f in fields(part))
    np.savez(stream, **{f"{type(part).__name__}.{name}": getattr(part, name) for part, name in named})
    return stream.getvalue()


def unpacked(scenario: Scenario, payload: bytes) -> Exact | None:
    """What `prove` gave, or None where this is something else."""
    try:
        with np.load(io.BytesIO(payload), allow_pickle=False) as stored:
            arrays: dict[str, Any] = dict(stored)
        return Exact(
            scenario,
            Table(*(arrays[f"Table.{f.name}"] for f in fields(Table))),
            Gains(*(arrays[f"Gains.{f.name}"] for f in fields(Gains))),
            Sensitivity(*(arrays[f"Sensitivity.{f.name}"] for f in fields(Sensitivity))),
            derived_functions(scenario.wave),
        )
    except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile):
        return None


# ---- What is read is checked ----


def believable(found: Exact) -> bool:
    """Whether numbers obey the equations that they are said to solve: none is far from what a proof would give.

    In doubles: the table starts where the scenario does, has no jump, and its slope is the field; dx/dp obeys the
    variational equation; the gains are the largest slopes found at samples, and hardly larger.
    """
    with np.errstate(all="ignore"):
        return bool(_solves(found) and _varies(found) and _gains(found))


def _solves(found: Exact) -> bool:
    table, scenario = found.table, found.scenario
    pieces = table.centre.size
    good = table.edges.shape == (pieces + 1,) and table.half.shape == (pieces,) and table.bound.shape == (3,)
    if not good or table.polynomial.shape != (3, DEGREE + 1, pieces) or table.scale.shape != (3,) or not pieces:
        return False
    spans = [table.edges[0] == 0, table.edges[-1] >= float(scenario.horizon), (table.half > 0).all()]
    spans += [np.allclose(table.centre - table.half, table.edges[:-1], rtol=0, atol=1e-9)]
    v = np.array([-1.0, 0.0, 1.0])[:, None, None, None]
    k = np.arange(DEGREE + 1)[:, None]
    value = (table.polynomial * v**k).sum(axis=2)  # (3 places, 3 states, pieces)
    slope = (table.polynomial * k * v ** np.maximum(k - 1, 0)).sum(axis=2) / table.half
    scale = np.abs(value).max(axis=(0, 2))
    spans += [(table.bound <= 1e-10 * (1 + scale)).all(), (table.scale <= scale * (1 + 1e-6)).all()]
    start = np.array([float(scenario.x1_start), float(scenario.x2_start), float(scenario.theta_hat_start)])
    jumps = value[0] - np.column_stack([start, value[2, :, :-1]])
    spans += [(np.abs(jumps) <= JUMP * (1 + scale[:, None]) + 2 * table.bound[:, None]).all()]
    for place, s in enumerate(v.ravel()):
        wanted = found.first(table.centre + s * table.half, value[place])
        sizes = 1 + np.abs(wanted).max(axis=1, keepdims=True)
        spans += [(np.abs(slope[place] - wanted) * table.half <= JUMP * sizes).all()]
    return all(map(bool, spans))


def _varies(found: Exact) -> bool:
    s, scenario = found.sensitivity, found.scenario
    shape = s.polynomial.shape
    if s.starts.ndim != 1 or len(shape) != 4 or shape[0] != s.starts.size or shape[2:] != (3, len(COLUMNS)):
        return False
    if not (s.starts.size and s.starts[0] == 0 and (np.diff(s.starts) > 0).all() and s.radius.shape == shape[2:]):
        return False
    ends = np.append(s.starts[1:], s.end)
    t = np.concatenate([s.starts, s.starts + 0.75 * (ends - s.starts)])
    t = t[t <= found.table.edges[-1]]
    h, states = 1e-5, found.evaluate(t)
    J = rows(found.functions["gradients"], scenario, t, states).reshape(7, 3, t.size)[:3]
    f_p = np.zeros((3, len(COLUMNS), t.size))
    for column, name in enumerate(PARAMETERS):
        p = {other: float(getattr(scenario, other)) for other in PARAMETERS}
        above, below = (
            np.stack(np.broadcast_arrays(*found.functions["first"](t, *states, **(p | {name: p[name] + d})), t)[:3])
            for d in (h, -h)
        )
        f_p[:, column] = (above - below) / (2 * h)
    wanted = np.einsum("ijt,jct->ict", J, s(t)) + f_p
    slope = s(t, derivative=1)
    sizes = 1 + np.abs(wanted).max(axis=2, keepdims=True)
    start = np.hstack([np.zeros((3, len(PARAMETERS))), np.eye(3)])
    jumps = s(s.starts[1:]) - s(np.nextafter(s.starts[1:], 0)) if s.starts.size > 1 else np.zeros(1)
    whole = np.abs(jumps).max() <= JUMP * sizes.max() and (s(np.zeros(1))[..., 0] == start).all()
    return bool(whole and (np.abs(slope - wanted) <= NEAR * sizes).all())


def _gains(found: Exact) -> bool:
    t = np.linspace(0, float(found.scenario.horizon), SAMPLES)
    slopes = np.abs(rows(found.functions["gradients"], found.scenario, t, found.evaluate(t))).reshape(7, 3, SAMPLES)
    largest, gains = slopes.max(axis=2), found.gains
    known = (gains.field, gains.z, gains.V[None], gains.dissipated[None])
    wanted = (largest[:3], largest[3:5], largest[5:6], np.trapezoid(slopes[6], t, axis=1)[None])
    return all(
        a.shape == b.shape and (a >= b * (1 - NEAR)).all() and (a <= b * (1 + NEAR) + NEAR).all()
        for a, b in zip(known, wanted, strict=True)
    )
