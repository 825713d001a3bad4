# SPDX-License-Identifier: MIT
"""Each program writes the CSV of the contract, and a file that is not one is refused with its reason."""

import os
import re
from fractions import Fraction
from pathlib import Path

import pytest

from conformance.judging.trajectory import Trajectory, TrajectoryError, load
from conformance.places import PLANTS
from conformance.programs.ports import Port
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON

HEAD = "t,x1,x2,theta_hat,reference,tracking_error\n"
GOOD = HEAD + "0,1.5,0,0,0.5,1\n1,0.5,0,0,0.25,0.25\n20,0.25,0,0,0.25,0\n"
BAD = {
    "nothing": ("", "found an empty file"),
    "another header": (GOOD.replace("theta_hat", "estimate"), "line 1"),
    "columns exchanged": (GOOD.replace("x1,x2", "x2,x1"), "line 1"),
    "no rows": (HEAD, "0 rows"),
    "a doubled column": (GOOD.replace("x1,x2", "x1,x1"), "a column stands twice"),
    "an unknown column": (GOOD.replace("x1,x2", "x1,velocity"), "missing x2; unknown velocity"),
    "semicolons": (GOOD.replace(",", ";"), "the separator is a comma"),
    "a column short": (GOOD.replace("0.25,0.25", "0.25"), "line 3: found 5 columns"),
    "a line cut off": (GOOD[:-8], "line 4: found 4 columns in '20,0.25,0,0', expected 6; the line is cut off"),
    "an empty line": (GOOD.replace("\n1,", "\n\n1,"), "line 3: found 1 columns in '', expected 6; the line is empty"),
    "a column more": (GOOD.replace("0.25,0.25", "0.25,0.25,0"), "line 3: found 7 columns"),
    "a decimal comma": (GOOD.replace("1.5", "1,5"), "line 2: found 7 columns"),
    "a word": (GOOD.replace("1.5", "one"), "line 2, column x1: found 'one'"),
    "not a number": (GOOD.replace("1.5", "nan"), "column x1: found 'nan', not a number"),
    "infinity": (GOOD.replace("1.5", "-Infinity"), "column x1: found '-Infinity', infinite"),
    "a number beyond all": (GOOD.replace("1.5", "1e999"), "column x1: found '1e999', beyond 1.8e308"),
    "the Wolfram Language's exponent": (GOOD.replace("1.5", "1.5*^0"), "write 1.2e-9"),
    "Fortran's exponent": (GOOD.replace("1.5", "1.5d0"), "Fortran's exponent letter d"),
    "a thousands separator": (GOOD.replace("1.5", "1 000.5"), "thousands separators"),
    "an empty cell": (GOOD.replace("1.5", ""), "column x1: found '', an empty cell"),
    "time standing still": (GOOD.replace("\n1,", "\n0,"), "line 3, column t"),
    "a late start": (GOOD.replace("\n0,", "\n0.5,"), "line 2, column t: found 0.5, expected 0"),
    "an early end": (GOOD.replace("\n20,", "\n9,"), "found 9 in the last row, expected 20 within half a step"),
    "a tracking error that is none": (GOOD.replace("0.25,0.25", "0.25,0.26"), "line 3, column tracking_error"),
}


def test_csv_is_valid(trajectory: Trajectory) -> None:
    assert trajectory.t.size > 1000


def test_csv_has_the_logged_times_of_the_contract(port: Port, trajectory: Trajectory) -> None:
    assert trajectory.t.size == (port.rows or trajectory.t.size)


@pytest.mark.parametrize("case", BAD)
def test_bad_csv_is_refused(case: str, tmp_path: Path) -> None:
    text, reason = BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(TrajectoryError) as refusal:
        load(path, LESSON)
    assert reason in str(refusal.value) and "\n" not in str(refusal.value)


def test_good_csv_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "good.csv"
    path.write_text(GOOD)
    assert load(path, LESSON)["x1"].tolist() == [1.5, 0.5, 0.25]


SAME = {
    "CRLF": GOOD.replace("\n", "\r\n"),
    "a byte-order mark": "\ufeff" + GOOD,
    "no line end at the end": GOOD.rstrip("\n"),
    "more digits": GOOD.replace("1.5", "1.50000000000000000000"),
    "exponents": GOOD.replace("1.5", "15.0E-1"),
    "spaces": GOOD.replace(",", ", "),
    "the lesson's MATLAB names": GOOD.replace(
        "theta_hat,reference,tracking_error", "thetaHat,referenceSignal,trackingError"
    ),
}


@pytest.mark.parametrize("case", SAME)
def test_benign_differences_are_accepted(case: str, tmp_path: Path) -> None:
    path = tmp_path / "same.csv"
    path.write_bytes(SAME[case].encode())
    assert load(path, LESSON)["x1"].tolist() == [1.5, 0.5, 0.25]


def test_numbers_are_read_to_the_nearest_double(tmp_path: Path) -> None:
    path = tmp_path / "digits.csv"
    path.write_text(GOOD.replace("0,1.5,0,0,0.5,1\n", "0,1.1734204837847347,0,0,0.1,1.0734204837847346\n"))
    assert load(path, LESSON)["x1"][0] == 1.1734204837847347


@pytest.mark.parametrize("content", [b"\x00\x01\x02" * 99, GOOD.encode() + b"\xff\xfe", b"\x89PNG\r\n\x1a\n\x00"])
def test_what_is_no_text_is_refused(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "binary.csv"
    path.write_bytes(content)
    with pytest.raises(TrajectoryError, match="UTF-8"):
        load(path, LESSON)


def test_what_is_no_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(TrajectoryError, match="expected a file"):
            load(path, LESSON)


def test_missing_csv_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryError, match="no such file"):
        load(tmp_path / "none.csv", LESSON)


# ---- Another plant's columns ----

OTHER = with_values(as_written(PLANTS / "motor_arm.toml"), {"horizon": Fraction(20)})
OTHER_HEAD = "t,q,v,I,N_hat,B_hat,reference,tracking_error\n"
OTHER_GOOD = OTHER_HEAD + "0,1.5,0,0,0,0,0.5,1\n1,0.5,0,0,1,2,0.25,0.25\n20,0.25,0,3,0,0,0.25,0\n"
OTHER_BAD = {
    "the lesson's header": (
        GOOD,
        f"expected {OTHER_HEAD.strip()!r} (missing q v I N_hat B_hat; unknown x1 x2 theta_hat)",
    ),
    "an index column": ("," + OTHER_GOOD, "an index column"),
    "a column short": (OTHER_GOOD.replace("1,2,0.25", "1,0.25"), "line 3: found 7 columns in"),
    "a footer": (OTHER_GOOD + "done\n", "expected 8; a footer"),
    "an empty line": (OTHER_GOOD.replace("\n1,", "\n\n1,"), "expected 8; the line is empty"),
    "capitals": (OTHER_GOOD.replace("q,v", "Q,V"), "the columns have other names, or units or capitals in them"),
    "a word": (OTHER_GOOD.replace("1,2,", "one,2,"), "line 3, column N_hat: found 'one'"),
    "a tracking error that is none": (OTHER_GOOD.replace("0.25,0.25", "0.25,0.26"), "expected q - reference = 0.25"),
}


def test_columns_follow_from_the_names_of_a_plant(tmp_path: Path) -> None:
    path = tmp_path / "good.csv"
    path.write_text(OTHER_GOOD.replace("N_hat", "NHat").replace("tracking_error", "trackingError"))
    found = load(path, OTHER)
    assert found.names == OTHER.names and found.states.shape == (5, 3) and found["B_hat"].tolist() == [0, 2, 0]


@pytest.mark.parametrize("case", OTHER_BAD)
def test_bad_csv_of_another_plant_is_refused(case: str, tmp_path: Path) -> None:
    text, reason = OTHER_BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=re.escape(reason)):
        load(path, OTHER)
