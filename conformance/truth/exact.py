# SPDX-License-Identifier: MIT
"""A scenario's exact solution and derived closed loop, as functions of arrays: derived once, then kept.

Only the first use needs SymPy and ball arithmetic (`experiment`); what it finds is kept in `places.proofs`.
"""

import functools
import hashlib
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from numpy.typing import ArrayLike

from conformance.places import PACKAGE, proofs
from conformance.theory.scenario import PARAMETERS, Scenario
from conformance.truth import cache
from conformance.truth.piecewise import Floats, Table

KEPT = proofs()
TARGET = 1e-18  # radius of the proof
SAMPLES = 20001  # of the exact solution, for the largest gradients along it
ROOMS = ("theory", "truth")  # on whose modules a proof depends
LIBRARIES = ("mpmath", "numpy", "python-flint", "sympy")
Function = Callable[..., list[Floats]]


@dataclass(frozen=True)
class Gains:
    """How far a quantity moves when the states x1, x2, theta_hat do, along the exact solution, to first order."""

    field: Floats  # (3, 3) largest |d state_i' / d state_j|
    z: Floats  # (2, 3) largest |d z_i / d state_j|
    V: Floats  # (3,) largest |dV / d state_j|
    dissipated: Floats  # (3,) integral of |d (k1 z1^2 + k2 z2^2) / d state_j| over the horizon


@dataclass(frozen=True)
class Exact:
    """The exact solution, within `table.bound`, and the closed loop; times t in s.

    Functions of (t, states) take shapes (rows,) and (3, rows): x1, x2, theta_hat.
    """

    scenario: Scenario
    table: Table  # of x1, x2, theta_hat
    gains: Gains
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


# ---- Derived once, then kept ----


@functools.lru_cache(maxsize=64)  # a campaign's worker sees thousands of scenarios
def exact(scenario: Scenario, target: float = TARGET) -> Exact:
    """The exact solution of a scenario, by a proof whose radius is at most `target`; from the cache where it is.

    Raises ProofEnded where the proof cannot be continued to the horizon.
    """
    functions = derived_functions(scenario.wave)
    payload = _kept("exact", (scenario, target), lambda: _prove(scenario, target, functions["gradients"]))
    with np.load(io.BytesIO(payload), allow_pickle=False) as stored:
        arrays: dict[str, Floats] = dict(stored)
    gains = Gains(**{name: arrays.pop(f"gain_{name}") for name in Gains.__annotations__})
    return Exact(scenario, Table(**arrays), gains, functions)


@functools.cache
def derived_functions(wave: str) -> dict[str, Function]:
    """The closed loop's functions of t, states and parameters, by name; from the cache where they are."""

    def derive() -> bytes:
        from conformance.truth.experiment import source

        return source(wave).encode()

    text = _kept("functions", wave, derive).decode()
    names: dict[str, Function] = {}
    exec(compile(text, "derived closed loop", "exec"), {"sin": np.sin, "cos": np.cos}, names)
    return names


def _kept(kind: str, of: object, derive: Callable[[], bytes]) -> bytes:
    """What is kept, or else derived, and then kept."""
    key = _key(of)
    path = KEPT / f"{key}.{kind}"
    payload = cache.read(path, key)
    if payload is None:
        payload = derive()
        cache.write(path, key, payload)
    return payload


def _key(of: object) -> str:
    """A digest of this and of all that its derivation depends on: the sources and the versions of the libraries."""
    digest = hashlib.sha256(repr((of, *map(version, LIBRARIES))).encode())
    for path in (path for room in ROOMS for path in sorted((PACKAGE / room).glob("*.py"))):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _prove(scenario: Scenario, target: float, gradients: Function) -> bytes:
    """Prove the solution and measure the gains along it: as the bytes that are kept."""
    from conformance.truth.experiment import problem
    from conformance.truth.truth import compute

    enclosed = compute(problem(scenario), target)
    t = np.linspace(0, float(scenario.horizon), SAMPLES)
    slopes = np.abs(rows(gradients, scenario, t, enclosed.evaluate(t))).reshape(7, 3, SAMPLES)
    largest = slopes.max(axis=2)
    stream = io.BytesIO()
    np.savez(
        stream,
        gain_field=largest[:3],
        gain_z=largest[3:5],
        gain_V=largest[5],
        gain_dissipated=np.trapezoid(slopes[6], t, axis=1),
        **enclosed.table.arrays(),
    )
    return stream.getvalue()
