# SPDX-License-Identifier: MIT
"""An experiment's exact solution and closed loop, as functions of arrays: proven once, then kept.

The numbers found are kept in build/truth, and checked whenever they are read. The functions of the lesson's experiment
with any numbers are those of `closed_loop`, part of the sources: only the first use needs SymPy and ball arithmetic.
Those of other plants and references are derived anew by each process.
"""

from __future__ import annotations

import functools
import hashlib
import io
import math
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from conformance.places import PACKAGE, proofs
from conformance.theory.experiments import Experiment, bare, family_of, numbers_of_loop, starts_of
from conformance.truth import cache, closed_loop
from conformance.truth.piecewise import DEGREE, Floats, Table
from conformance.truth.rounding import rounding
from conformance.truth.setting import Setting, setting_of

if TYPE_CHECKING:
    from conformance.truth.enclosure import Progress

KEPT = proofs()
CONTRACT = 1e-6  # the tolerance, of each state's size
TARGET = 1e-18  # radius of the proof
SAMPLES = 4001  # of the exact solution, where the largest slopes along it are looked for
FINE = 20001  # of them where these are the gains
PLACES = DEGREE + 1  # of each piece of a table, where its slope is compared with the field
JUMP = 1e-13  # relative, by which a table may miss: what doubles explain
NEAR = 1e-6  # relative, by which sensitivities may miss the variational equation, its slopes by differences
BELOW, ABOVE = 1e-3, 1e-2  # relative, by which gains may miss the largest slopes found at samples
FUNCTIONS = ("reference", "control", "first", "second", "errors", "lyapunov", "dissipation", "gradients")
ROOMS = ("theory", "truth")  # on whose modules a proof depends
LIBRARIES = ("mpmath", "numpy", "python-flint", "sympy")
Function = Callable[..., list[Floats]]
Names = NDArray[np.str_]


@dataclass(frozen=True)
class Gains:
    """How far a quantity moves when the m = n + p states and estimates do, from the exact solution.

    Proven, for moves of up to 1e-6 max(1, max |state|); where no proof ends, the largest slopes at samples.
    """

    field: Floats  # (m, m) largest |d state_i' / d state_j|
    z: Floats  # (n, m) largest |d z_i / d state_j|
    V: Floats  # (m,) largest |dV / d state_j|
    dissipated: Floats  # (m,) integral of |d sum k_i z_i^2 / d state_j| over the horizon


class Functions(NamedTuple):
    """Functions of t, states and parameters, by name; each gives a list of arrays or numbers."""

    parameters: tuple[str, ...]
    by_name: dict[str, Function]

    def __call__(self, name: str, values: Mapping[str, Any], t: Floats, states: Iterable[Floats] = ()) -> Floats:
        """The results at these values of the parameters, shape (results, rows); a constant becomes a row."""
        given = (values[parameter] for parameter in self.parameters)
        return np.stack([np.broadcast_to(value, t.shape) for value in self.by_name[name](t, *states, *given)])


@dataclass(frozen=True)
class Sensitivity:
    """dx/dp, how the m states and estimates move with each of the columns: piecewise polynomials in t - start.

    columns: the names of parameters and start values. starts: (pieces,) s. polynomial: (pieces, order, m, columns).
    radius: (m, columns), of |value - dx/dp| at all times. end: s.
    """

    columns: Names
    starts: Floats
    polynomial: Floats
    radius: Floats
    end: float

    def __call__(self, times: Floats, derivative: int = 0) -> Floats:
        """dx/dp at these times (s), or a derivative of it by the time, shape (m, columns, times)."""
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

    Functions of (t, states) take shapes (rows,) and (m, rows), m = n + p: the plant's states, then the estimates.
    """

    experiment: Experiment
    table: Table  # of states and estimates
    gains: Gains
    sensitivity: Sensitivity
    functions: Functions

    @functools.cached_property
    def setting(self) -> Setting:
        """The experiment's numbers."""
        return setting_of(self.experiment)

    @functools.cached_property
    def values(self) -> dict[str, float]:
        """What the closed loop depends on, by name."""
        return {name: float(value) for name, value in numbers_of_loop(self.experiment).items()}

    @functools.cached_property
    def tolerance(self) -> Floats:
        """The contract's, shape (m,): the experiment's own, or else 1e-6 max(1, max |state|) of each state."""
        stated = self.experiment.tolerance
        sizes = CONTRACT * np.maximum(1, self.table.scale)
        return sizes if stated is None else np.full_like(sizes, float(stated))

    @functools.cached_property
    def V_start(self) -> float:
        """V at t = 0."""
        return float(self.lyapunov(np.zeros(1), self.evaluate(np.zeros(1)))[0])

    @functools.cached_property
    def reference_rate(self) -> float:
        """The largest |r'| at samples, 1/s."""
        t = np.linspace(0, self.setting.horizon, FINE)
        return float(np.abs(self.functions("reference", self.values, t)[1]).max())

    @functools.cached_property
    def reference_rounding(self) -> float:
        """By how much r in doubles may differ between two who compute it."""
        t = np.linspace(0, self.setting.horizon, FINE)
        return 2 * float(np.max(rounding(self.experiment.reference, self.values, t)))

    def evaluate(self, times: ArrayLike) -> Floats:
        """States and estimates, shape (m, *times.shape); raises ValueError for a time outside of the horizon."""
        return self.table(times, range(self.table.scale.size))

    def reference(self, t: Floats) -> Floats:
        """r(t), shape (rows,)."""
        return self._row("reference", t)

    def control(self, t: Floats, states: Floats) -> Floats:
        """u, shape (rows,)."""
        return self._row("control", t, states)

    def first(self, t: Floats, states: Floats) -> Floats:
        """The derivatives of states and estimates, shape (m, rows)."""
        return self._rows("first", t, states)

    def second(self, t: Floats, states: Floats) -> Floats:
        """Their second derivatives along solutions, shape (m, rows)."""
        return self._rows("second", t, states)

    def errors(self, t: Floats, states: Floats) -> Floats:
        """z_1 .. z_n, shape (n, rows)."""
        return self._rows("errors", t, states)

    def lyapunov(self, t: Floats, states: Floats) -> Floats:
        """V, shape (rows,)."""
        return self._row("lyapunov", t, states)

    def dissipation(self, t: Floats, states: Floats) -> Floats:
        """sum k_i z_i^2, which is -V', and its derivative along solutions, shape (2, rows)."""
        return self._rows("dissipation", t, states)

    def _row(self, name: str, t: Floats, states: Iterable[Floats] = ()) -> Floats:
        row: Floats = self._rows(name, t, states)[0]
        return row

    def _rows(self, name: str, t: Floats, states: Iterable[Floats] = ()) -> Floats:
        return self.functions(name, self.values, t, states)


# ---- Proven once, then kept ----


@functools.lru_cache(maxsize=64)  # a campaign's worker sees thousands of scenarios
def exact(experiment: Experiment, target: float = TARGET, progress: Progress | None = None) -> Exact:
    """The exact solution of an experiment, by a proof whose radius is at most `target`; from the cache where it is.

    `progress` is told the time reached (s). Raises ProofEnded where the proof cannot be continued to the horizon.
    """
    key = _key((bare(experiment), target))
    path = KEPT / f"{key}.exact"
    payload = cache.read(path, key)
    if payload is not None:
        found = unpacked(experiment, payload)
        if found is not None and believable(found):
            return found
    payload = prove(experiment, target, progress)
    cache.write(path, key, payload)
    found = unpacked(experiment, payload)
    assert found is not None
    return found


@functools.lru_cache(maxsize=64)
def functions_of(experiment: Experiment) -> Functions:
    """The functions of an experiment's closed loop: those kept as source where they are its family's."""
    if digest_of_family(experiment) == closed_loop.FAMILY:
        return Functions(closed_loop.PARAMETERS, {name: getattr(closed_loop, name) for name in FUNCTIONS})
    from conformance.truth.experiment import family  # which needs SymPy
    from conformance.truth.functions import derived

    return derived(family(experiment))


def digest_of_family(experiment: Experiment) -> str:
    """A digest of what experiments that differ in numbers alone have in common."""
    return hashlib.sha256(repr(family_of(experiment)).encode()).hexdigest()


def _key(of: object) -> str:
    """A digest of this and of all that its derivation depends on: the sources and the versions of the libraries."""
    return hashlib.sha256(repr((of, _sources())).encode()).hexdigest()


@functools.cache
def _sources() -> str:
    digest = hashlib.sha256(repr((*map(version, LIBRARIES),)).encode())
    for path in (path for room in ROOMS for path in sorted((PACKAGE / room).glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def prove(experiment: Experiment, target: float, progress: Progress | None = None) -> bytes:
    """The solution, the sensitivities and the gains along it: as the bytes that are kept."""
    from conformance.truth.experiment import family, problem
    from conformance.truth.sensitivity import sensitivity
    from conformance.truth.truth import ProofEnded, enclose

    enclosed, functions = enclose(problem(experiment), target, progress=progress), functions_of(experiment)
    of, tube = family(experiment), CONTRACT * np.maximum(1, enclosed.scale)
    try:
        found, gains = sensitivity(of.loop, of.numbers(experiment), enclosed, tube)
    except ProofEnded:
        m = enclosed.scale.size
        found = Sensitivity(np.zeros(0, str), np.zeros(1), np.zeros((1, 1, m, 0)), np.zeros((m, 0)), 0.0)
        gains = sampled_gains(Exact(experiment, enclosed.table, Gains(*[np.zeros(0)] * 4), found, functions), FINE)
    return packed(Exact(experiment, enclosed.table, gains, found, functions))


def sampled_gains(found: Exact, samples: int) -> Gains:
    """The largest slopes along the solution, as far as it is proven, at samples, and the integral by them."""
    m, n = len(found.setting.names), found.setting.n
    t = np.linspace(0, found.table.edges[-1], samples)
    slopes = np.abs(found.functions("gradients", found.values, t, found.evaluate(t))).reshape(m + n + 2, m, samples)
    largest = slopes.max(axis=2)
    return Gains(largest[:m], largest[m : m + n], largest[m + n], np.trapezoid(slopes[m + n + 1], t, axis=1))


def packed(found: Exact) -> bytes:
    """The numbers of an Exact as bytes, which `unpacked` reads."""
    stream = io.BytesIO()
    named = ((part, f.name) for part in (found.table, found.gains, found.sensitivity) for f in fields(part))
    np.savez(stream, **{f"{type(part).__name__}.{name}": getattr(part, name) for part, name in named})
    return stream.getvalue()


def unpacked(experiment: Experiment, payload: bytes) -> Exact | None:
    """What `prove` gave, or None where this is something else."""
    try:
        with np.load(io.BytesIO(payload), allow_pickle=False) as stored:
            arrays: dict[str, Any] = dict(stored)
        return Exact(
            experiment,
            Table(*(arrays[f"Table.{f.name}"] for f in fields(Table))),
            Gains(*(arrays[f"Gains.{f.name}"] for f in fields(Gains))),
            Sensitivity(*(arrays[f"Sensitivity.{f.name}"] for f in fields(Sensitivity))),
            functions_of(experiment),
        )
    except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile):
        return None


# ---- What is read is checked ----


def believable(found: Exact) -> bool:
    """Whether numbers obey the equations that they are said to solve: none is far from what a proof would give.

    In doubles: the table starts where the experiment does, has no jump, and its slope is the field; dx/dp obeys the
    variational equation; the gains are the largest slopes found at samples, and hardly larger.
    """
    with np.errstate(all="ignore"):
        return bool(_solves(found) and _varies(found) and _gains(found))


def _solves(found: Exact) -> bool:
    table, setting = found.table, found.setting
    pieces, m = table.centre.size, len(setting.names)
    good = table.edges.shape == (pieces + 1,) and table.half.shape == (pieces,) and table.bound.shape == (m,)
    if not good or table.polynomial.shape != (m, DEGREE + 1, pieces) or table.scale.shape != (m,) or not pieces:
        return False
    spans = [table.edges[0] == 0, table.edges[-1] >= setting.horizon, (table.half > 0).all()]
    spans += [np.allclose(table.centre - table.half, table.edges[:-1], rtol=0, atol=1e-9)]
    v = np.linspace(-1, 1, PLACES)[:, None, None, None]
    k = np.arange(DEGREE + 1)[:, None]
    value = (table.polynomial * v**k).sum(axis=2)  # (PLACES, m states, pieces)
    slope = (table.polynomial * k * v ** np.maximum(k - 1, 0)).sum(axis=2) / table.half
    scale = np.abs(value).max(axis=(0, 2))
    spans += [(table.bound <= 1e-10 * (1 + scale)).all(), (table.scale <= scale * (1 + 1e-6)).all()]
    jumps = value[0] - np.column_stack([setting.start, value[-1, :, :-1]])
    spans += [(np.abs(jumps) <= JUMP * (1 + scale[:, None]) + 2 * table.bound[:, None]).all()]
    for place, s in enumerate(v.ravel()):
        wanted = found.first(table.centre + s * table.half, value[place])
        sizes = 1 + np.abs(wanted).max(axis=1, keepdims=True)
        spans += [(np.abs(slope[place] - wanted) * table.half <= JUMP * sizes).all()]
    return all(map(bool, spans))


def _varies(found: Exact) -> bool:
    s, m, free = found.sensitivity, len(found.setting.names), found.functions.parameters
    shape = s.polynomial.shape
    if not s.columns.size:
        return s.radius.size == 0
    if s.columns.tolist() != [*free, *starts_of(found.experiment)]:
        return False
    if s.starts.ndim != 1 or len(shape) != 4 or shape[0] != s.starts.size or shape[2:] != (m, len(free) + m):
        return False
    if not (s.starts.size and s.starts[0] == 0 and (np.diff(s.starts) > 0).all() and s.radius.shape == shape[2:]):
        return False
    ends = np.append(s.starts[1:], s.end)
    t = np.concatenate([s.starts, s.starts + 0.75 * (ends - s.starts)])
    t = t[t <= found.table.edges[-1]]
    h, states = 1e-5, found.evaluate(t)
    J = found.functions("gradients", found.values, t, states).reshape(-1, m, t.size)[:m]
    f_p = np.zeros((m, len(free) + m, t.size))
    for column, name in enumerate(free):
        value = found.values[name]
        above, below = (found.functions("first", found.values | {name: value + d}, t, states) for d in (h, -h))
        f_p[:, column] = (above - below) / (2 * h)
    wanted = np.einsum("ijt,jct->ict", J, s(t)) + f_p
    slope = s(t, derivative=1)
    sizes = 1 + np.abs(wanted).max(axis=2, keepdims=True)
    start = np.hstack([np.zeros((m, len(free))), np.eye(m)])
    jumps = s(s.starts[1:]) - s(np.nextafter(s.starts[1:], 0)) if s.starts.size > 1 else np.zeros(1)
    whole = np.abs(jumps).max() <= JUMP * sizes.max() and (s(np.zeros(1))[..., 0] == start).all()
    return bool(whole and (np.abs(slope - wanted) <= NEAR * sizes).all())


def _gains(found: Exact) -> bool:
    wanted = sampled_gains(found, SAMPLES)
    return all(
        a.shape == b.shape and (a >= b * (1 - BELOW)).all() and (a <= b * (1 + ABOVE) + ABOVE).all()
        for a, b in ((getattr(found.gains, f.name), getattr(wanted, f.name)) for f in fields(Gains))
    )
