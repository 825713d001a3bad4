# SPDX-License-Identifier: MIT
"""A scenario's exact solution and derived closed loop, as functions of arrays: derived once, then kept.

Only the first use needs SymPy and ball arithmetic (`experiment`); what it finds is kept in build/truth.
"""

import functools
import hashlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from conformance import cache
from conformance.piecewise import Floats, Table
from conformance.ports import ROOT
from conformance.scenario import Scenario

KEPT = ROOT / "build" / "truth"
TARGET = 1e-18  # radius of the proof
SAMPLES = 20001  # of the exact solution, for the largest gradients along it
MODULES = (
    "cache dense design enclosure exact experiment nonzero piecewise program scenario strict_feedback taylor truth"
)
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
    """The exact solution, within 1e-15 of each row's scale, and the closed loop; times t in s.

    Functions of (t, states) take shapes (rows,) and (3, rows): x1, x2, theta_hat.
    """

    scenario: Scenario
    names: tuple[str, ...]  # of the rows: x1, x2, theta_hat, dissipated, z1, z2, V
    table: Table
    gains: Gains
    functions: dict[str, Function]

    def evaluate(self, times: ArrayLike, names: Sequence[str]) -> Floats:
        """Rows of the exact solution, shape (len(names), *times.shape); ValueError for a time outside the horizon."""
        return self.table(times, [self.names.index(name) for name in names])

    def reference(self, t: Floats) -> Floats:
        """r(t), shape (rows,)."""
        row: Floats = _rows(self.functions["reference"](t), t)[0]
        return row

    def control(self, t: Floats, states: Floats) -> Floats:
        """u, shape (rows,)."""
        row: Floats = _rows(self.functions["control"](t, *states), t)[0]
        return row

    def first(self, t: Floats, states: Floats) -> Floats:
        """The states' derivatives, shape (3, rows)."""
        return _rows(self.functions["first"](t, *states), t)

    def second(self, t: Floats, states: Floats) -> Floats:
        """The states' second derivatives along solutions, shape (3, rows)."""
        return _rows(self.functions["second"](t, *states), t)

    def errors(self, t: Floats, states: Floats) -> Floats:
        """z1 and z2, shape (2, rows)."""
        return _rows(self.functions["errors"](t, *states), t)

    def lyapunov(self, t: Floats, states: Floats) -> Floats:
        """V, shape (rows,)."""
        row: Floats = _rows(self.functions["lyapunov"](t, *states), t)[0]
        return row

    def dissipation(self, t: Floats, states: Floats) -> Floats:
        """k1 z1^2 + k2 z2^2, which is -V', and its derivative along solutions, shape (2, rows)."""
        return _rows(self.functions["dissipation"](t, *states), t)


def _rows(values: Sequence[Floats], t: Floats) -> Floats:
    """The values as rows; a constant becomes a row as long as the others."""
    return np.stack([np.broadcast_to(value, t.shape) for value in values])


@functools.cache
def exact(scenario: Scenario, target: float = TARGET) -> Exact:
    """The exact solution of a scenario, by a proof whose radius is at most `target`; from the cache where it is.

    Raises ProofEnded where the proof cannot be continued to the horizon.
    """
    key = _key(scenario, target)
    path = KEPT / f"{key}.exact"
    payload = cache.read(path, key)
    if payload is None:
        payload = _derive(scenario, target)
        cache.write(path, key, payload)
    with np.load(io.BytesIO(payload), allow_pickle=False) as stored:
        arrays: dict[str, Floats] = dict(stored)
    text, names = (arrays.pop(name).tobytes().decode() for name in ("source", "names"))
    gains = Gains(**{name: arrays.pop(f"gain_{name}") for name in Gains.__annotations__})
    return Exact(scenario, tuple(names.split()), Table(**arrays), gains, _functions(text))


def _key(scenario: Scenario, target: float) -> str:
    """A digest of all that the answer depends on: scenario, target, the sources and the locked libraries."""
    digest = hashlib.sha256(repr((scenario, target)).encode())
    for path in (*(Path(__file__).with_name(f"{name}.py") for name in MODULES.split()), ROOT / "requirements.txt"):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _derive(scenario: Scenario, target: float) -> bytes:
    """Prove the solution, derive the functions, and measure the gains: as the bytes that are kept."""
    from conformance.experiment import source, truth

    enclosed, text = truth(scenario, target), source(scenario)
    t = np.linspace(0, float(scenario.horizon), SAMPLES)
    states = enclosed.evaluate(t, ("x1", "x2", "theta_hat"))
    gradients = np.abs(_rows(_functions(text)["gradients"](t, *states), t)).reshape(7, 3, SAMPLES)
    largest = gradients.max(axis=2)
    stream = io.BytesIO()
    np.savez(
        stream,
        source=np.frombuffer(text.encode(), dtype=np.uint8),
        names=np.frombuffer(" ".join(enclosed.names).encode(), dtype=np.uint8),
        gain_field=largest[:3],
        gain_z=largest[3:5],
        gain_V=largest[5],
        gain_dissipated=np.trapezoid(gradients[6], t, axis=1),
        **enclosed.table.arrays(),
    )
    return stream.getvalue()


def _functions(text: str) -> dict[str, Function]:
    names: dict[str, Function] = {}
    exec(compile(text, "derived closed loop", "exec"), {"sin": np.sin, "cos": np.cos}, names)
    return names
