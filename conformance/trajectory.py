# SPDX-License-Identifier: MIT
"""A CSV of the lesson's form, validated, as arrays."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

COLUMNS = ("t", "x1", "x2", "theta_hat", "reference", "tracking_error")
STATES = ("x1", "x2", "theta_hat")

Array = NDArray[np.float64]


class TrajectoryError(ValueError):
    """A file that is no trajectory: the message says where, what was found and what was expected."""


@dataclass(frozen=True)
class Trajectory:
    """The logged columns, each of shape (rows,); times in seconds, strictly increasing from 0."""

    t: Array
    x1: Array
    x2: Array
    theta_hat: Array
    reference: Array
    tracking_error: Array

    @property
    def states(self) -> Array:
        """x1, x2 and theta_hat, shape (rows, 3)."""
        return np.column_stack([self.x1, self.x2, self.theta_hat])


def load(path: Path, horizon: float) -> Trajectory:
    """Read and validate a CSV.

    Raises TrajectoryError for a missing or empty file, another header, a value that is no finite number, times
    that do not increase strictly from 0 to `horizon` (s), or a tracking error that is not x1 - reference.
    """
    if not path.is_file():
        raise TrajectoryError(f"{path.name}: no such file; the program writes it")
    lines = path.read_text(encoding="utf-8").splitlines()
    expected = ",".join(COLUMNS)
    if not lines or lines[0] != expected:
        raise TrajectoryError(f"{path.name}, line 1: found {lines[0] if lines else 'nothing'!r}, expected {expected!r}")
    for number, line in enumerate(lines[1:], start=2):
        if line.count(",") != len(COLUMNS) - 1:
            raise TrajectoryError(f"{path.name}, line {number}: found {line!r}, expected {len(COLUMNS)} columns")
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    columns = {name: _numbers(path, name, table[name]) for name in COLUMNS}
    trajectory = Trajectory(**columns)
    _check_times(path, trajectory.t, horizon)
    _check_tracking_error(path, trajectory)
    return trajectory


def _numbers(path: Path, name: str, texts: "pd.Series[str]") -> Array:
    values = pd.to_numeric(texts, errors="coerce").to_numpy(dtype=np.float64)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise TrajectoryError(
            f"{path.name}, line {bad[0] + 2}, column {name}: found {texts[bad[0]]!r}, expected a finite number"
        )
    # read_csv and to_numeric may miss the nearest double by one unit in the last place; float() does not
    return np.array([float(text) for text in texts])


def _check_times(path: Path, t: Array, horizon: float) -> None:
    if t.size < 2:
        raise TrajectoryError(f"{path.name}: found {t.size} rows, expected at least 2")
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        raise TrajectoryError(
            f"{path.name}, line {back[0] + 3}, column t: found {t[back[0] + 1]:g} after {t[back[0]]:g}, "
            "expected strictly increasing times"
        )
    if t[0] != 0 or t[-1] != horizon:
        raise TrajectoryError(f"{path.name}, column t: found {t[0]:.17g} to {t[-1]:.17g}, expected 0 to {horizon:g}")


def _check_tracking_error(path: Path, trajectory: Trajectory) -> None:
    difference = trajectory.x1 - trajectory.reference
    wrong = np.flatnonzero(np.abs(trajectory.tracking_error - difference) > np.spacing(np.abs(trajectory.x1)))
    if wrong.size:
        raise TrajectoryError(
            f"{path.name}, line {wrong[0] + 2}, column tracking_error: found {trajectory.tracking_error[wrong[0]]:g}, "
            f"expected x1 - reference = {difference[wrong[0]]:g}"
        )
