# SPDX-License-Identifier: MIT
"""A CSV of the contract's form, validated, as arrays."""

import codecs
import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conformance.foreign import plain, regular, shown
from conformance.judging.layout import (
    BEGINNINGS,
    HEADERS,
    ROWS,
    Line,
    cell_trait,
    columns_of,
    is_number,
    line_of,
    named,
    numbers_of,
)
from conformance.theory.experiments import Experiment

BLOCK = 1 << 24  # bytes read at a time
LONGEST = 1 << 16  # bytes of a line: its numbers take far fewer
COARSEST = 1e-6  # the contract's tolerance: a file printed more coarsely than this cannot be judged
LATE = 1e-3  # share of the horizon by which the last row may miss it
PLAIN_BYTES = (
    b"0123456789.eE+-, \r\n"  # what numbers in rows are made of; pandas reads no more into these than there is
)
QUOTED = re.compile(rb'(?<![^,\n])"([^"\r\n,]*)"(?![^,\r\n])')

Array = NDArray[np.float64]


class TrajectoryError(ValueError):
    """A file that is no trajectory: the message says where, what was found and what was expected."""


@dataclass(frozen=True)
class Trajectory:
    """The logged columns, of shape (rows,): times in seconds, strictly increasing from 0, reference, tracking error.

    `states` has shape (n + p, rows), n states of the plant and p estimates by `names`. `notes` tell what the reader
    accepted though it is not of the contract.
    """

    t: Array
    states: Array
    reference: Array
    tracking_error: Array
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Array:
        """A column by its name, shape (rows,)."""
        if name in self.names:
            row: Array = self.states[self.names.index(name)]
            return row
        return {"t": self.t, "reference": self.reference, "tracking_error": self.tracking_error}[name]


def load(path: Path, experiment: Experiment) -> Trajectory:
    """Read and validate a CSV of an experiment, whose time must run from 0 to the horizon within half a step.

    Its columns are t, the states and estimates by their names, reference and tracking_error.

    Accepted too: quoted names and numbers, spaces beside commas, empty lines at the end, a header after # or %, a line
    sep=, before it. Raises TrajectoryError for the first thing that is wrong, in this order: no regular file, empty,
    not UTF-8 text, the header, a row that is incomplete or not numeric, a value that is not finite, times that do not
    increase strictly from 0 to the horizon, a tracking error that is not the first state - reference.
    """
    readable(path)
    names, horizon = experiment.names, float(experiment.horizon)
    reader = _Reader(plain(path.name), columns_of(names))
    parts = [columns for block in _blocks(path, reader.columns) for columns in reader.numbers(block)]
    if reader.line == 1:
        raise TrajectoryError(f"{reader.name}: found an empty file, expected the header {','.join(reader.columns)!r}")
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)] or [np.empty(0) for _ in reader.columns]
    t, *states, reference, tracking_error = columns
    trajectory = Trajectory(t, np.stack(states), reference, tracking_error, names, tuple(reader.notes))
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers near 1e308
        _check_times(reader, trajectory.t, horizon)
        _check_tracking_error(reader, trajectory)
    return trajectory


def readable(path: Path) -> None:
    """Raise TrajectoryError unless there is a regular file, which can be read without waiting."""
    try:
        regular(path)
    except ValueError as error:
        raise TrajectoryError(str(error)) from None


def _blocks(path: Path, columns: tuple[str, ...]) -> Iterator[bytes]:
    """The file in blocks of whole lines, without a byte-order mark; a bar tells of a long reading, on a terminal."""
    name = plain(path.name)
    with open(path, "rb") as file, _progress(path) as bar:
        first = True
        while block := file.read(BLOCK) + file.readline(LONGEST):
            what = next((what for begin, what in BEGINNINGS if first and block.startswith(begin)), "")
            if what or b"\0" in block:
                raise TrajectoryError(f"{name}: found {what or 'a binary file or UTF-16'}, expected text in UTF-8")
            if len(block) >= BLOCK + LONGEST:
                found = f"found a line of more than {LONGEST} bytes"
                raise TrajectoryError(f"{name}: {found}, expected {numbers_of(columns)}")
            if bar is not None:
                bar.update(len(block))
            yield block.removeprefix(codecs.BOM_UTF8) if first else block
            first = False


def _progress(path: Path) -> Any:
    """A bar over the bytes of the file on a terminal, from 2 s on; none for a file that is read at once."""
    size = path.stat().st_size
    if size <= BLOCK:
        return contextlib.nullcontext()
    from tqdm import tqdm

    return tqdm(total=size, desc=plain(path.name), unit="B", unit_scale=True, delay=2, disable=None, leave=False)


class _Reader:
    """Reads block after block; `line` is the number of the next line, `notes` what was accepted."""

    def __init__(self, name: str, columns: tuple[str, ...]) -> None:
        self.columns = columns
        self.name, self.line, self.head, self.notes = name, 1, 1, list[str]()
        self.header = ""
        self.blank = 0  # the first empty line after the rows so far

    def numbers(self, block: bytes) -> Iterator[list[Array]]:
        """The numbers of a block of whole lines; raises TrajectoryError."""
        if self.line == 1:
            block = self._after_header(block)
        rows = block.rstrip(b" \t\r\n")
        ends = block[len(rows) :].count(b"\n")
        if rows and self.blank:
            raise self.wrong(self.blank, f"found an empty line, expected {numbers_of(self.columns)}")
        if rows:
            columns = self._numbers(rows)
            yield columns
            self.line += columns[0].size
            ends -= 1
        if ends > 0:
            self.blank = self.blank or self.line
            self.line += ends

    def wrong(self, line: int, what: str) -> TrajectoryError:
        """The error that stands in a line."""
        return TrajectoryError(f"{self.name}, line {line}: {what}")

    def text(self, some: bytes, line: int) -> str:
        """Bytes that begin at this line, as text."""
        try:
            return some.decode()
        except UnicodeDecodeError as error:
            line += some.count(b"\n", 0, error.start)
            found = f"found the byte {some[error.start]:#04x}"
            raise self.wrong(line, f"{found}, expected text in UTF-8") from None

    def _after_header(self, block: bytes) -> bytes:
        """Check the header; returns what follows."""
        first, _, block = block.partition(b"\n")
        if re.fullmatch(rb'"?sep=,"?\s*', first) and block:
            self.notes.append("a line sep=, stands before the header; it is skipped")
            self.head = 2
            first, _, block = block.partition(b"\n")
        text = self.text(first, self.head).removesuffix("\r")
        line = line_of(text, self.columns)
        first_cell = line.cells[0]
        if first_cell[:1] in ("#", "%"):
            bare = replace(line, cells=(first_cell.lstrip("#% \t"), *line.cells[1:]))
            if bare.names == self.columns:
                self.notes.append(f"the header stands after {first_cell[0]}")
                line = bare
        if line.names != self.columns:
            raise self.wrong(self.head, _wrong_header(line_of(text, self.columns)))
        self.line = self.head + 1
        return block

    def _numbers(self, rows: bytes) -> list[Array]:
        """The numbers of whole rows; what the fast reader stumbles over, the slow one names."""
        if b'"' in rows:
            self._note("numbers stand in quotes; they are read, slower")
            rows = QUOTED.sub(rb"\1", rows)
        columns = None if rows.translate(None, PLAIN_BYTES) else _read_quickly(rows, self.columns)
        return columns or self._read_slowly(rows)

    def _note(self, what: str) -> None:
        if what not in self.notes:
            self.notes.append(what)

    def _read_slowly(self, block: bytes) -> list[Array]:
        rows = []
        texts = self.text(block, self.line).split("\n")
        for number, text in enumerate(texts, start=self.line):
            line = line_of(text.removesuffix("\r"), self.columns, number - self.line == len(texts) - 1)
            if not all(line.numbers) or line.extra:
                why = named(line, ROWS)
                if why or line.extra:
                    found = f"found {len(line.cells)} columns in {shown(text)}, expected {len(self.columns)}"
                    raise self.wrong(number, f"{found}; {why}" if why else found)
            for name, cell in zip(self.columns, line.cells, strict=True):
                what = "" if is_number(cell) else cell_trait(cell)
                if not what and not np.isfinite(float(cell)):
                    what = "beyond 1.8e308"
                if what:
                    raise TrajectoryError(
                        f"{self.name}, line {number}, column {name}: found {shown(cell, 40)}, {what}; "
                        "expected a finite number"
                    )
            rows.append([float(cell) for cell in line.cells])
        return list(np.array(rows).T)


def _wrong_header(line: Line) -> str:
    """What is wrong with a header, in a line."""
    missing = [name for name in line.columns if name not in line.names]
    unknown = [plain(name, 40) for name in line.names if name not in line.columns]
    parts = [f"missing {' '.join(missing)}"] * bool(missing) + [f"unknown {plain(' '.join(unknown))}"] * bool(unknown)
    why = named(line, HEADERS) or "; ".join(parts)
    return f"found {shown(line.text)}, expected {','.join(line.columns)!r} ({why})"


def _read_quickly(rows: bytes, names: tuple[str, ...]) -> list[Array] | None:
    """The columns of whole rows of PLAIN_BYTES; None where they are not a finite number per name each."""
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            table = pd.read_csv(
                io.BytesIO(rows), header=None, names=names, index_col=False, dtype=np.float64, quoting=3,
                keep_default_na=False, skip_blank_lines=False,
            )  # fmt: skip
    except (ValueError, pd.errors.ParserError, pd.errors.ParserWarning):
        return None
    columns = [table[name].to_numpy() for name in names]
    whole = rows.count(b"\n") + 1 == len(table) and rows.count(b",") == (len(names) - 1) * len(table)
    return columns if whole and all(np.isfinite(column).all() for column in columns) else None


def _check_times(reader: _Reader, t: Array, horizon: float) -> None:
    if t.size < 2:
        raise TrajectoryError(f"{reader.name}: found {t.size} rows, expected at least 2")
    row = reader.head + 1  # of the first numbers
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        at = int(back[0]) + 1
        raise TrajectoryError(
            f"{reader.name}, line {row + at}, column t: found {number(t[at])} after {number(t[at - 1])}, "
            "expected strictly increasing times"
        )
    if t[0] != 0:
        raise TrajectoryError(f"{reader.name}, line {row}, column t: found {number(t[0])}, expected 0")
    if abs(t[-1] - horizon) > min((t[-1] - t[-2]) / 2, LATE * horizon):
        raise TrajectoryError(
            f"{reader.name}, line {row + t.size - 1}, column t: found {number(t[-1])} in the last row, "
            f"expected {number(horizon)} within half a step"
        )


def _check_tracking_error(reader: _Reader, trajectory: Trajectory) -> None:
    output = trajectory.states[0]
    difference = output - trajectory.reference
    kept = (trajectory.tracking_error, output, trajectory.reference)
    slack = np.minimum(sum(map(print_error, kept)), COARSEST) + 2 * np.spacing(np.abs(output))
    wrong = np.flatnonzero(~(np.abs(trajectory.tracking_error - difference) <= slack))
    if wrong.size:
        at = int(wrong[0])
        raise TrajectoryError(
            f"{reader.name}, line {reader.head + 1 + at}, column tracking_error: "
            f"found {number(trajectory.tracking_error[at])}, "
            f"expected {trajectory.names[0]} - reference = {number(difference[at])}"
        )


def number(value: float) -> str:
    """The shortest digits that give the double back: two that differ never look the same."""
    return repr(float(value)).removesuffix(".0")


# ---- Digits ----

ALMOST_ALL = 0.9  # share of the rows: of 9 digits by chance few are those of a number in single precision
USUAL = 0.25  # quantile of the rows: what fewer show or keep is by chance, as 0.5 in a column of doubles


def digits_shown(values: Array, sample: int = 400) -> tuple[int, int]:
    """The last decimal place and the significant digits that three quarters of printed numbers show: (-12, 13).

    The shortest decimals that give the doubles back stand for what was printed; zeros show nothing: (0, 0).
    """
    some = values[values != 0]
    shown = [Decimal(repr(float(v))).normalize().as_tuple() for v in some[:: max(1, some.size // sample)]]
    places = [number.exponent for number in shown if isinstance(number.exponent, int)]  # finite
    digits = sorted(len(number.digits) for number in shown)
    return min(places, default=0), digits[int(USUAL * len(digits))] if digits else 0


def is_single(values: Array, sample: int = 400) -> bool:
    """Whether most of the numbers are those of single precision, as doubles or in the 8 or 9 digits that it needs."""
    some = values[values != 0]
    if not some.size:
        return False
    with np.errstate(over="ignore", under="ignore"):
        if np.mean(some.astype(np.float32).astype(np.float64) == some) > USUAL:
            return True
        few = some[:: max(1, some.size // sample)]
        printed = [
            value in (float(f"{single:.9g}"), float(str(single)))
            for value, single in zip(few, few.astype(np.float32), strict=True)
        ]
    return digits_shown(values)[1] in (8, 9) and float(np.mean(printed)) > ALMOST_ALL


def print_error(values: Array) -> Array:
    """How far each number may be from the one meant, shape (rows,), by the digits that the column shows and keeps.

    Half a unit of the last decimal place, for fixed formats, plus half a unit of the last significant digit; half a
    unit of single precision where that is more.
    """
    place, digits = digits_shown(values)
    if not digits:
        return np.zeros_like(values)
    bound: Array = 0.5 * 10.0**place + 0.5 * np.abs(values) * 10.0 ** (1 - digits)
    if is_single(values):
        with np.errstate(over="ignore", under="ignore"):
            bound = np.maximum(bound, 0.5 * np.spacing(np.abs(values).astype(np.float32)).astype(np.float64))
    return bound
