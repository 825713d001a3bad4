# SPDX-License-Identifier: MIT
"""A CSV of the lesson's form, validated, as arrays."""

import codecs
import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

COLUMNS = ("t", "x1", "x2", "theta_hat", "reference", "tracking_error")
STATES = ("x1", "x2", "theta_hat")
ALIASES = {"thetaHat": "theta_hat", "referenceSignal": "reference", "trackingError": "tracking_error"}  # the lesson's

BLOCK = 1 << 24  # bytes read at a time
LONGEST = 1 << 16  # bytes of a line: six numbers take far fewer
COARSEST = 1e-6  # the contract's tolerance: a file printed more coarsely than this cannot be judged

Array = NDArray[np.float64]

NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", re.ASCII)
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

    @cached_property
    def states(self) -> Array:
        """x1, x2 and theta_hat, shape (3, rows)."""
        return np.stack([self.x1, self.x2, self.theta_hat])


def load(path: Path, horizon: float) -> Trajectory:
    """Read and validate a CSV, whose time must run from 0 to `horizon` (s) within half a step.

    Raises TrajectoryError for the first thing that is wrong, in this order: no regular file, empty, not UTF-8 text, the
    header, a row that is incomplete or not numeric, a value that is not finite, times that do not increase strictly
    from 0 to the horizon, a tracking error that is not x1 - reference.
    """
    readable(path)
    parts: list[list[Array]] = []
    line = 1
    for block in _blocks(path):
        rows = block
        if line == 1:
            header, _, rows = block.partition(b"\n")
            _check_header(path, header)
            line = 2
        if rows:
            parts.append(_columns(path, rows, line))
            line += parts[-1][0].size
    if line == 1:
        raise TrajectoryError(f"{path.name}: found an empty file, expected the header {','.join(COLUMNS)!r}")
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)] or [np.empty(0) for _ in COLUMNS]
    trajectory = Trajectory(*columns)
    _check_times(path, trajectory.t, horizon)
    _check_tracking_error(path, trajectory)
    return trajectory


def readable(path: Path) -> None:
    """Raise TrajectoryError unless there is a regular file, which can be read without waiting."""
    if not path.exists():
        raise TrajectoryError(f"{path.name}: no such file")
    if not path.is_file():
        raise TrajectoryError(f"{path.name}: found a folder or a device, expected a file")


def _blocks(path: Path) -> Iterator[bytes]:
    """The file in blocks of whole lines, without a byte-order mark; a bar tells of a long reading, on a terminal."""
    with open(path, "rb") as file, _progress(path) as bar:
        mark = codecs.BOM_UTF8
        while block := file.read(BLOCK) + file.readline(LONGEST):
            if b"\0" in block:
                raise TrajectoryError(f"{path.name}: found a binary file or UTF-16, expected text in UTF-8")
            if len(block) >= BLOCK + LONGEST:
                raise TrajectoryError(f"{path.name}: found a line of more than {LONGEST} bytes, expected six numbers")
            if bar is not None:
                bar.update(len(block))
            yield block.removeprefix(mark)
            mark = b""


def _progress(path: Path) -> Any:
    """A bar over the bytes of the file on a terminal, from 2 s on; none for a file that is read at once."""
    size = path.stat().st_size
    if size <= BLOCK:
        return contextlib.nullcontext()
    from tqdm import tqdm

    return tqdm(total=size, desc=path.name, unit="B", unit_scale=True, delay=2, disable=None, leave=False)


def _text(path: Path, some: bytes, line: int) -> str:
    """Bytes that begin at this line, as text."""
    try:
        return some.decode()
    except UnicodeDecodeError as error:
        line += some.count(b"\n", 0, error.start)
        found = f"the byte {some[error.start]:#04x}"
        raise TrajectoryError(f"{path.name}, line {line}: found {found}, expected text in UTF-8") from None


def _check_header(path: Path, line: bytes) -> None:
    found = _text(path, line, 1).removesuffix("\r")
    expected = ",".join(COLUMNS)
    names = [ALIASES.get(name.strip(), name.strip()) for name in found.split(",")]
    if names == list(COLUMNS):
        return
    if not found.strip():
        why = "the line is empty"
    elif "\r" in found:
        why = "the lines end in a carriage return alone"
    elif ";" in found or "\t" in found:
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


def _columns(path: Path, block: bytes, line: int) -> list[Array]:
    """The numbers of whole rows, which begin at this line; what the fast reader stumbles over, the slow one names."""
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            table = pd.read_csv(
                io.BytesIO(block), header=None, names=COLUMNS, index_col=False, dtype=np.float64, quoting=3,
                keep_default_na=False, skip_blank_lines=False,
            )  # fmt: skip
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning):
        return _read_slowly(path, block, line)
    columns = [table[name].to_numpy() for name in COLUMNS]
    ends = block.count(b"\n") + (not block.endswith(b"\n"))
    whole = ends == len(table) and block.count(b",") == (len(COLUMNS) - 1) * len(table)
    if whole and all(np.isfinite(column).all() for column in columns):
        return columns
    return _read_slowly(path, block, line)


def _read_slowly(path: Path, block: bytes, line: int) -> list[Array]:
    rows = []
    lines = _text(path, block, line).removesuffix("\n").split("\n")
    for number, text in enumerate(lines, start=line):
        cells = text.removesuffix("\r").split(",")
        if len(cells) != len(COLUMNS):
            found, why = f"{len(cells)} columns in {text[:80]!r}", _why_not_six(text)
            raise TrajectoryError(f"{path.name}, line {number}: found {found}, expected {len(COLUMNS)}{why}")
        for name, cell in zip(COLUMNS, cells, strict=True):
            if not NUMBER.fullmatch(cell):
                what = next((what for pattern, what in MISWRITTEN if re.fullmatch(pattern, cell)), "no number")
            elif not np.isfinite(float(cell)):
                what = "beyond 1.8e308"
            else:
                continue
            where = f"{path.name}, line {number}, column {name}"
            raise TrajectoryError(f"{where}: found {cell[:40]!r}, {what}; expected a finite number")
        rows.append([float(cell) for cell in cells])
    return list(np.array(rows).T)


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


def digits_shown(values: Array, sample: int = 200) -> tuple[int, int]:
    """The last decimal place and the most significant digits that printed numbers show, as powers of ten: (-12, 13).

    The shortest decimals that give the doubles back stand for what was printed; zeros show nothing: (0, 0).
    """
    shown = [Decimal(repr(float(v))).normalize().as_tuple() for v in values[:: max(1, values.size // sample)] if v]
    places = [number.exponent for number in shown if isinstance(number.exponent, int)]  # finite
    return min(places, default=0), max((len(number.digits) for number in shown), default=0)


def print_error(values: Array) -> Array:
    """How far each printed number may be from the one meant, shape (rows,), by the digits that the column shows.

    Half a unit of the last decimal place, for fixed formats, plus half a unit of the last significant digit.
    """
    place, digits = digits_shown(values)
    if not digits:
        return np.zeros_like(values)
    bound: Array = 0.5 * 10.0**place + 0.5 * np.abs(values) * 10.0 ** (1 - digits)
    return bound
