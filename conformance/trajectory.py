# SPDX-License-Identifier: MIT
"""A CSV of the lesson's form, validated, as arrays."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

COLUMNS = ("t", "x1", "x2", "theta_hat", "reference", "tracking_error")
STATES = ("x1", "x2", "theta_hat")
ALIASES = {"thetaHat": "theta_hat", "referenceSignal": "reference", "trackingError": "tracking_error"}  # the lesson's

COARSEST = 1e-6  # the contract's tolerance: a file printed more coarsely than this cannot be judged

Array = NDArray[np.float64]

NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*")
MISWRITTEN = (  # what a cell that is no number looks like, and what it is
    (r"\s*", "an empty cell"),
    (r"(?i)\s*[-+]?(nan|ind|indeterminate|na)\s*", "not a number: the integration failed"),
    (r"(?i)\s*[-+]?(inf|infinity|directedinfinity.*)\s*", "infinite: the integration blew up"),
    (r".*\*\^.*", "in the Wolfram Language's notation; write 1.2e-9"),
    (r"(?i)\s*[-+]?[\d.]+d[-+]?\d+\s*", "with Fortran's exponent letter d; write e"),
    (r"\s*[-+]?\d{1,3}([ '_]\d{3})+(\.\d*)?\s*", "with thousands separators"),
    (r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*", "with a decimal comma"),
)


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
    """Read and validate a CSV, whose time must run from 0 to `horizon` (s) within half a step.

    Raises TrajectoryError for the first thing that is wrong, in this order: no regular file, empty, not UTF-8 text, the
    header, a row that is incomplete or not numeric, a value that is not finite, times that do not increase strictly
    from 0 to the horizon, a tracking error that is not x1 - reference.
    """
    readable(path)
    _check_content(path)
    names = _header(path)
    trajectory = Trajectory(**dict(zip(names, _columns(path), strict=True)))
    _check_times(path, trajectory.t, horizon)
    _check_tracking_error(path, trajectory)
    return trajectory


def readable(path: Path) -> None:
    """Raise TrajectoryError unless there is a regular file, which can be read without waiting."""
    if not path.exists():
        raise TrajectoryError(f"{path.name}: no such file")
    if not path.is_file():
        raise TrajectoryError(f"{path.name}: found a folder or a device, expected a file")


def _check_content(path: Path) -> None:
    with open(path, "rb") as file:
        start = file.read(4096)
    if not start.strip():
        raise TrajectoryError(f"{path.name}: found an empty file, expected the header {','.join(COLUMNS)!r}")
    if b"\0" in start:
        raise TrajectoryError(f"{path.name}: found a binary file, expected text in UTF-8")


def _lines(path: Path) -> Iterator[str]:
    """The lines without their ends; a byte-order mark is dropped."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            for line in file:
                yield line.rstrip("\n")
    except UnicodeDecodeError as error:
        raise TrajectoryError(
            f"{path.name}: found the byte {error.object[error.start]:#04x}, expected text in UTF-8"
        ) from None


def _header(path: Path) -> list[str]:
    found = next(_lines(path))
    expected = ",".join(COLUMNS)
    names = [ALIASES.get(name.strip(), name.strip()) for name in found.split(",")]
    if names == list(COLUMNS):
        return names
    if ";" in found or "\t" in found:
        why = "the separator is a comma"
    elif sorted(names) == sorted(COLUMNS):
        why = "the columns are in another order"
    elif len(set(names)) < len(names):
        why = "a column stands twice"
    else:
        missing = [name for name in COLUMNS if name not in names]
        unknown = [name for name in names if name not in COLUMNS]
        why = "; ".join(
            f"{kind} {' '.join(some)}" for kind, some in (("missing", missing), ("unknown", unknown)) if some
        )
    raise TrajectoryError(f"{path.name}, line 1: found {found[:80]!r}, expected {expected!r} ({why})")


def _columns(path: Path) -> list[Array]:
    """The numbers, column by column; what the fast reader stumbles over is named by the slow one."""
    import pandas as pd

    try:
        table = pd.read_csv(
            path, header=None, skiprows=1, names=COLUMNS, index_col=False, dtype=np.float64, quoting=3,
            keep_default_na=False, skip_blank_lines=False, encoding="utf-8-sig",
        )  # fmt: skip
        columns = [table[name].to_numpy() for name in COLUMNS]
        commas, ends = _count(path)
        whole = commas == (len(COLUMNS) - 1) * (len(table) + 1) and ends in (len(table), len(table) + 1)
    except (ValueError, pd.errors.ParserError, pd.errors.EmptyDataError):
        whole, columns = False, []
    if whole and all(np.isfinite(column).all() for column in columns):
        return columns
    return _read_slowly(path)


def _count(path: Path) -> tuple[int, int]:
    """How many commas and line ends the file has."""
    commas = ends = 0
    with open(path, "rb") as file:
        while block := file.read(1 << 24):
            commas += block.count(b",")
            ends += block.count(b"\n")
    return commas, ends


def _read_slowly(path: Path) -> list[Array]:
    rows = []
    lines = _lines(path)
    next(lines)
    for number, line in enumerate(lines, start=2):
        cells = line.split(",")
        if len(cells) != len(COLUMNS):
            why = _why_not_six(line)
            raise TrajectoryError(
                f"{path.name}, line {number}: found {len(cells)} columns in {line[:80]!r}, expected {len(COLUMNS)}{why}"
            )
        for name, cell in zip(COLUMNS, cells, strict=True):
            if not NUMBER.fullmatch(cell):
                what = next((what for pattern, what in MISWRITTEN if re.fullmatch(pattern, cell)), "no number")
                raise TrajectoryError(
                    f"{path.name}, line {number}, column {name}: found {cell[:40]!r}, {what}; expected a finite number"
                )
        rows.append([float(cell) for cell in cells])
    values = np.array(rows, dtype=np.float64).reshape(-1, len(COLUMNS))
    infinite = np.argwhere(~np.isfinite(values))
    if infinite.size:
        row, column = infinite[0]
        raise TrajectoryError(
            f"{path.name}, line {row + 2}, column {COLUMNS[column]}: "
            "found a number beyond 1.8e308, expected a finite number"
        )
    return list(values.T)


def _why_not_six(line: str) -> str:
    if not line.strip():
        return "; the line is empty"
    if ";" in line:
        return "; the separator is a comma, the decimal sign a point"
    if line.count(",") > len(COLUMNS) - 1:
        return "; a decimal comma or a thousands separator adds columns"
    return "; the line is cut off"


def _check_times(path: Path, t: Array, horizon: float) -> None:
    if t.size < 2:
        raise TrajectoryError(f"{path.name}: found {t.size} rows, expected at least 2")
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        raise TrajectoryError(
            f"{path.name}, line {back[0] + 3}, column t: found {t[back[0] + 1]:g} after {t[back[0]]:g}, "
            "expected strictly increasing times"
        )
    if t[0] != 0:
        raise TrajectoryError(f"{path.name}, line 2, column t: found {t[0]:g}, expected 0")
    if abs(t[-1] - horizon) > min((t[-1] - t[-2]) / 2, horizon / 100):
        raise TrajectoryError(
            f"{path.name}, line {t.size + 1}, column t: found {t[-1]:.17g} in the last row, "
            f"expected {horizon:g} within half a step"
        )


def _check_tracking_error(path: Path, trajectory: Trajectory) -> None:
    difference = trajectory.x1 - trajectory.reference
    printed = (trajectory.tracking_error, trajectory.x1, trajectory.reference)
    slack = np.minimum(sum(map(print_error, printed)), COARSEST) + 2 * np.spacing(np.abs(trajectory.x1))
    wrong = np.flatnonzero(np.abs(trajectory.tracking_error - difference) > slack)
    if wrong.size:
        raise TrajectoryError(
            f"{path.name}, line {wrong[0] + 2}, column tracking_error: found {trajectory.tracking_error[wrong[0]]:g}, "
            f"expected x1 - reference = {difference[wrong[0]]:g}"
        )


def print_error(values: Array, sample: int = 1000) -> Array:
    """How far each printed number may be from the one meant, shape (rows,), by the digits that the column shows.

    Half a unit of the last decimal place, for fixed formats, plus half a unit of the last significant digit.
    """
    shown = [Decimal(repr(float(v))).normalize().as_tuple() for v in values[:: max(1, values.size // sample)] if v]
    shown = [number for number in shown if isinstance(number.exponent, int)]  # finite
    if not shown:
        return np.zeros_like(values)
    place = min(int(number.exponent) for number in shown)
    digits = max(len(number.digits) for number in shown)
    bound: Array = 0.5 * 10.0**place + 0.5 * np.abs(values) * 10.0 ** (1 - digits)
    return bound
