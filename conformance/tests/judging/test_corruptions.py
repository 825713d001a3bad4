# SPDX-License-Identifier: MIT
"""The kill matrix of data: every corruption of a right CSV is refused by its named check, and no harmless change is."""

import os
import random
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from conformance.judging.checks import Check, checks_of
from conformance.judging.layout import columns_of
from conformance.judging.trajectory import Array, TrajectoryError, load
from conformance.judging.verdict import Verdict, judge_file
from conformance.tests.judging.test_verdict import validate
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact

EXACT = exact(LESSON)
COLUMNS = columns_of(LESSON.names)
Columns = dict[str, Array]


def right(t: Array) -> Columns:
    """The exact solution at these times, as the columns of a CSV."""
    return logged(t, EXACT.evaluate(t))


def logged(t: Array, states: Array) -> Columns:
    """The columns of a program that logs these states."""
    reference = EXACT.reference(t)
    return dict(zip(COLUMNS, (t, *states, reference, states[0] - reference), strict=True))


def text(columns: Columns, number: str = "%.17g", names: Sequence[str] = ()) -> str:
    """The CSV; a number is printed by the format given."""
    row = ",".join([number] * len(columns)) + "\n"
    header = ",".join(names or columns) + "\n"
    return header + "".join(row % values for values in zip(*columns.values(), strict=True))


ROWS = np.arange(4001)
UNIFORM = 0.005 * ROWS
RIGHT = right(UNIFORM)
RIGHT_TEXT = text(RIGHT)
LINES = RIGHT_TEXT.splitlines(keepends=True)


def judged(content: str | bytes, folder: Path, checks: Sequence[Check] | None = None) -> Verdict:
    path = folder / "judged.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return judge_file(path, LESSON, checks=checks)


# ---- Corruptions ----


def changed(**new: Array) -> str:
    """The CSV with columns replaced; where a state is, its tracking error follows."""
    columns = RIGHT | new
    if "x1" in new or "reference" in new:
        columns["tracking_error"] = columns["x1"] - columns["reference"]
    return text(columns)


def cell(line: int, column: int, value: str) -> str:
    """The CSV with one cell replaced."""
    lines = list(LINES)
    cells = lines[line - 1].rstrip("\n").split(",")
    cells[column] = value
    lines[line - 1] = ",".join(cells) + "\n"
    return "".join(lines)


def other_start() -> Columns:
    """The closed loop from another x2, by a good solver."""
    return logged(UNIFORM, dop853(x2_start=-0.4))


def dop853(x2_start: float = -0.5) -> Array:
    """The closed loop by another method than any program's, shape (3, rows)."""
    from scipy.integrate import solve_ivp  # which takes a second

    def rhs(t: float, state: Array) -> Array:
        return EXACT.first(np.array([t]), state[:, None])[:, 0]

    start = [1.2, x2_start, 0.0]
    states: Array = solve_ivp(rhs, (0, 20), start, "DOP853", UNIFORM, rtol=1e-11, atol=1e-13).y
    return states


def euler() -> str:
    """The closed loop by Euler's method with the step of the rows."""
    states = np.empty((3, UNIFORM.size))
    states[:, 0] = EXACT.evaluate(0.0)
    for i, h in enumerate(np.diff(UNIFORM)):
        at = states[:, i : i + 1]
        states[:, i + 1] = states[:, i] + h * EXACT.first(UNIFORM[i : i + 1], at)[:, 0]
    return text(logged(UNIFORM, states))


def late(values: Array, rows: int = 1) -> Array:
    """The values, each logged some rows later than it should be."""
    return np.r_[values[:1].repeat(rows), values[:-rows]]


def spoilt(values: Array, first: int, count: int, value: float) -> Array:
    """The values, some of them replaced."""
    rows = np.arange(values.size)
    return np.where((rows >= first) & (rows < first + count), value, values)


def single(values: Array) -> Array:
    """The values, as single precision keeps them."""
    return values.astype(np.float32).astype(np.float64)


X1, X2, THETA_HAT, REFERENCE = (RIGHT[name] for name in (*LESSON.names, "reference"))
NAN = np.full_like(X1, np.nan)
SHUFFLED = random.Random(1).sample(LINES[1:], len(LINES) - 1)
WITHOUT_THETA_HAT = {name: RIGHT[name] for name in COLUMNS if name != "theta_hat"}

CORRUPTIONS: dict[str, tuple[str, Callable[[], str | bytes]]] = {
    # refused by the loader: its message
    "all NaN": ("line 2, column x1: found 'nan', not a number", lambda: text(RIGHT | dict.fromkeys(COLUMNS[1:], NAN))),
    "one late NaN": ("line 4000, column theta_hat: found 'nan', not a number", lambda: cell(4000, 3, "nan")),
    "infinity": ("line 3000, column x2: found 'inf', infinite", lambda: cell(3000, 2, "inf")),
    "a missing column": ("missing theta_hat", lambda: text(WITHOUT_THETA_HAT)),
    "a column without its name": ("missing theta_hat", lambda: RIGHT_TEXT.replace("theta_hat,", "", 1)),
    "a name without its column": ("line 2: found 5 columns", lambda: text(WITHOUT_THETA_HAT, names=COLUMNS)),
    "columns swapped": ("another order", lambda: RIGHT_TEXT.replace("x1,x2", "x2,x1", 1)),
    "cut off at 19.9": ("found 19.900000000000002 in the last row", lambda: "".join(LINES[:3982])),
    "cut off at 1": ("found 1 in the last row, expected 20", lambda: "".join(LINES[:202])),
    "rows shuffled": ("expected strictly increasing times", lambda: LINES[0] + "".join(SHUFFLED)),
    "a duplicate row": ("line 102, column t", lambda: "".join([*LINES[:101], LINES[100], *LINES[101:]])),
    "decimal commas": ("decimal comma", lambda: RIGHT_TEXT.replace(".", ",")),
    "semicolons": ("the separator is a comma", lambda: RIGHT_TEXT.replace(",", ";")),
    "semicolons and decimal commas": ("separator is a comma", lambda: RIGHT_TEXT.replace(",", ";").replace(".", ",")),
    "a last line cut off": ("line 4002: found 3 columns", lambda: RIGHT_TEXT[: RIGHT_TEXT.rindex(",", 0, -50)]),
    "a binary file": ("found a binary file", lambda: bytes(range(256)) * 16),
    "UTF-16": ("found UTF-16", lambda: RIGHT_TEXT.encode("utf-16")),
    "an empty file": ("found an empty file", lambda: ""),
    "a header alone": ("found 0 rows", lambda: LINES[0]),
    "no header": ("line 1: found", lambda: "".join(LINES[1:])),
    "a tracking error of other rows": (
        "expected x1 - reference",
        lambda: text(RIGHT | {"tracking_error": late(RIGHT["tracking_error"])}),
    ),
    # refused by a check: its claim
    "columns swapped under their names": ("x1-equals-the-exact-solution", lambda: changed(x1=X2, x2=X1)),
    "every row a step late": (
        "reference-is-that-of-the-experiment",
        lambda: changed(x1=late(X1), x2=late(X2), theta_hat=late(THETA_HAT), reference=late(REFERENCE)),
    ),
    "states a step late": (
        "x1-obeys-its-differential-equation",
        lambda: changed(x1=late(X1), x2=late(X2), theta_hat=late(THETA_HAT)),
    ),
    "gain +1 %": ("x1-equals-the-exact-solution", lambda: changed(x1=1.01 * X1)),
    "gain +9 %": ("output-approaches-reference", lambda: changed(x1=1.09 * X1)),
    "a steady offset of 1e-5": ("x1-equals-the-exact-solution", lambda: changed(x1=X1 + 1e-5)),
    "190 samples set to 50": ("errors-stay-bounded", lambda: changed(x1=spoilt(X1, 1000, 190, 50.0))),
    "x1 in single precision but for one row": (
        "x1-is-in-double-precision",
        lambda: changed(x1=np.where(ROWS == 1234, X1, single(X1))),
    ),
    "a third of the rows in single precision": (
        "x1-is-in-double-precision",
        lambda: changed(x1=np.where(ROWS % 3 == 0, single(X1), X1)),
    ),
    "a last row 0.19 late": ("found 20.19 in the last row", lambda: text(right(np.r_[0.42 * np.arange(48), 20.19]))),
    "x1 in single precision": ("x1-is-in-double-precision", lambda: changed(x1=single(X1))),
    "12 decimals": ("x2-is-in-double-precision", lambda: text(RIGHT, "%.12f")),
    "Euler instead of RK4": ("x2-equals-the-exact-solution", euler),
    "theta_hat frozen": ("theta_hat-obeys-its-differential-equation", lambda: changed(theta_hat=0 * THETA_HAT)),
    "theta_hat frozen early": (
        "estimate-approaches-theta",
        lambda: changed(theta_hat=THETA_HAT[np.minimum(ROWS, 400)]),
    ),
    "an estimate that runs away": ("estimate-stays-bounded", lambda: changed(theta_hat=THETA_HAT + UNIFORM)),
    "another start, within the tolerance": (
        "parameters-are-those-of-the-experiment",
        lambda: text(logged(UNIFORM, dop853(x2_start=-0.5000001))),
    ),
    "another start": ("x2-equals-the-exact-solution", lambda: text(other_start())),
    "rows left out": ("rows-are-close-enough", lambda: "".join([*LINES[:20], *LINES[120:]])),
    "another reference": ("reference-is-that-of-the-experiment", lambda: changed(reference=1.001 * REFERENCE)),
    "an x1 that never settles": ("z1-approaches-zero", lambda: changed(x1=X1 + 1e-4 * np.sin(UNIFORM))),
    "an x2 that never settles": ("z2-approaches-zero", lambda: changed(x2=X2 + 1e-4 * np.sin(UNIFORM))),
    "a jump of x2": ("x2-obeys-its-differential-equation", lambda: changed(x2=X2 + 1e-5 * (ROWS > 3000))),
    "theta_hat off by 2e-6": ("theta_hat-equals-the-exact-solution", lambda: changed(theta_hat=THETA_HAT + 2e-6)),
    "theta_hat in single precision": ("theta_hat-is-in-double-precision", lambda: changed(theta_hat=single(THETA_HAT))),
    "V that rises": ("lyapunov-function-never-grows", lambda: changed(theta_hat=THETA_HAT + 0.5 * (UNIFORM > 10))),
    "V that falls too fast": (
        "lyapunov-function-falls-by-what-is-dissipated",
        lambda: changed(theta_hat=1.2 + 0.99 * (THETA_HAT - 1.2)),
    ),
}


@pytest.mark.parametrize("name", CORRUPTIONS)
def test_corruption_is_refused_by_its_check(name: str, tmp_path: Path) -> None:
    reason, corrupt = CORRUPTIONS[name]
    verdict = judged(corrupt(), tmp_path, checks_of(LESSON))
    failed = [result.claim for result in verdict.results if not result.passed]
    assert verdict.status == "fail"
    assert reason in failed if verdict.results else reason in verdict.reason, (failed, verdict.reason)


def test_every_claim_has_refused_something(tmp_path: Path) -> None:
    claims = {result.claim for result in judged(RIGHT_TEXT, tmp_path, checks_of(LESSON)).results}
    assert claims <= {reason for reason, _ in CORRUPTIONS.values()}


def test_the_state_whose_equation_is_broken_is_named(tmp_path: Path) -> None:
    wrong_update = EXACT.evaluate(UNIFORM)
    wrong_update[2] = 1.2 + 0.9 * (wrong_update[2] - 1.2)
    verdict = judged(text(logged(UNIFORM, wrong_update)), tmp_path)
    broken = [result.claim for result in verdict.results if not result.passed and "obeys" in result.claim]
    assert broken[-1] == "theta_hat-obeys-its-differential-equation" and "x1" not in broken[0]


def test_a_wrong_start_is_told_from_a_wrong_equation(tmp_path: Path) -> None:
    verdict = judged(text(other_start()), tmp_path)
    assert not any("obeys" in result.claim for result in verdict.results if not result.passed)


# ---- What makes no difference ----

IRREGULAR = 20 * (np.arange(6001) / 6000) ** 1.1
SAME: dict[str, Callable[[], str | bytes]] = {
    "as it is": lambda: RIGHT_TEXT,
    "CRLF": lambda: RIGHT_TEXT.replace("\n", "\r\n"),
    "a byte-order mark": lambda: RIGHT_TEXT.encode("utf-8-sig"),
    "no line end at the end": lambda: RIGHT_TEXT.rstrip("\n"),
    "more digits": lambda: text(RIGHT, "%.25g"),
    "15 digits": lambda: text(RIGHT, "%.15g"),
    "exponents": lambda: text(RIGHT, "%.16E"),
    "the lesson's MATLAB names": lambda: RIGHT_TEXT.replace("theta_hat", "thetaHat", 1),
    "a finer grid": lambda: text(right(np.arange(20001) / 1000)),
    "an irregular grid": lambda: text(right(IRREGULAR)),
    "a last row half a step early": lambda: text(right(np.r_[UNIFORM[:-1], 19.999])),
    "12 decimals": lambda: text(RIGHT, "%.12f"),
    "12 digits": lambda: text(RIGHT, "%.12g"),
    "9 digits": lambda: text(RIGHT, "%.9g"),
    "states kept in single precision": lambda: text(
        RIGHT | {"x1": single(X1), "x2": single(X2), "theta_hat": single(THETA_HAT)}
    ),
    "few rows, dense where the states move": lambda: text(right(20 * (np.arange(401) / 400) ** 1.5)),
    "times that add up": lambda: text(right(np.cumsum(np.r_[0, np.full(10000, 0.002)]))),
    "another solver": lambda: text(logged(UNIFORM, dop853())),
}


@pytest.mark.parametrize("name", SAME)
def test_harmless_difference_conforms(name: str, tmp_path: Path) -> None:
    verdict = judged(SAME[name](), tmp_path)
    assert verdict.conforms, verdict.reason


# ---- More of both kinds ----

quick = settings(
    max_examples=40,
    deadline=None,
    derandomize=True,  # the same cases every time; make bench tries others
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
CELLS = st.text(max_size=12) | st.from_regex(r"[-+0-9.eE_ ]{1,8}", fullmatch=True)


@quick
@given(
    column=st.sampled_from(LESSON.names),
    first=st.integers(0, 4000),
    count=st.integers(1, 4000),
    size=st.floats(3e-6, 1e300) | st.floats(-1e300, -3e-6),
)
def test_any_offset_beyond_the_contract_is_refused(
    column: str, first: int, count: int, size: float, tmp_path: Path
) -> None:
    offset = np.where((first <= ROWS) & (first + count > ROWS), size, 0.0)
    verdict = judged(changed(**{column: RIGHT[column] + offset}), tmp_path)
    assert verdict.status == "fail" and f"{column}-equals-the-exact-solution" in verdict.reason


@quick
@given(line=st.integers(2, 4002), column=st.integers(0, 5), value=CELLS)
def test_a_cell_is_read_as_the_number_it_is_or_refused(line: int, column: int, value: str, tmp_path: Path) -> None:
    try:
        number = float(value) if value.isascii() and "_" not in value else float("nan")
    except ValueError:
        number = float("nan")
    path = tmp_path / "cell.csv"
    path.write_bytes(cell(line, column, value).encode(errors="replace"))
    same = abs(number - float(LINES[line - 1].split(",")[column])) < 1e-15
    try:
        loaded = load(path, LESSON)
    except TrajectoryError as error:
        assert not same and len(str(error).splitlines()) == 1
    else:
        assert loaded[COLUMNS[column]][line - 2] == number


@quick
@given(
    cuts=st.lists(st.floats(0, 20), min_size=0, max_size=50),
    digits=st.integers(15, 30),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_any_fine_grid_in_any_sufficient_print_conforms(
    cuts: list[float], digits: int, end: str, tmp_path: Path
) -> None:
    t = np.unique(np.round(np.r_[UNIFORM, cuts], 12))
    verdict = judged(text(right(t), f"%.{digits}g").replace("\n", end), tmp_path)
    assert verdict.conforms, verdict.reason


@settings(quick, max_examples=150)
@given(content=st.binary(max_size=300), at=st.integers(0, len(RIGHT_TEXT)), gone=st.integers(0, 300))
def test_bytes_of_any_kind_never_break_the_loader(content: bytes, at: int, gone: int, tmp_path: Path) -> None:
    whole = RIGHT_TEXT.encode()
    verdict = judged(whole[:at] + content + whole[at + gone :], tmp_path)
    assert verdict.status in ("pass", "fail") and (verdict.conforms or verdict.reason)


def test_a_pipe_that_never_ends_is_not_waited_on(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for path in (tmp_path / "pipe.csv", tmp_path):
        answer = validate(path)
        assert answer.returncode == 2 and "expected a file" in answer.stderr and len(answer.stderr.splitlines()) == 1
