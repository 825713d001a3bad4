# SPDX-License-Identifier: MIT
"""Each program writes the CSV of the contract, and a file that is not one is refused with its reason."""

from pathlib import Path

import pytest

from conformance.ports import Port
from conformance.trajectory import Trajectory, TrajectoryError, load

HEAD = "t,x1,x2,theta_hat,reference,tracking_error\n"
GOOD = HEAD + "0,1.5,0,0,0.5,1\n1,0.5,0,0,0.25,0.25\n20,0.25,0,0,0.25,0\n"
BAD = {
    "nothing": ("", "expected 't,x1"),
    "another header": (GOOD.replace("theta_hat", "thetaHat"), "line 1"),
    "columns exchanged": (GOOD.replace("x1,x2", "x2,x1"), "line 1"),
    "no rows": (HEAD, "0 rows"),
    "a column short": (GOOD.replace("0.25,0.25", "0.25"), "line 3"),
    "a decimal comma": (GOOD.replace("1.5", "1,5"), "line 2"),
    "a word": (GOOD.replace("1.5", "one"), "line 2, column x1: found 'one'"),
    "not a number": (GOOD.replace("1.5", "nan"), "column x1"),
    "infinity": (GOOD.replace("1.5", "inf"), "column x1"),
    "an empty cell": (GOOD.replace("1.5", ""), "column x1"),
    "time standing still": (GOOD.replace("\n1,", "\n0,"), "line 3, column t"),
    "a late start": (GOOD.replace("\n0,", "\n0.5,"), "0.5 to 20"),
    "an early end": (GOOD.replace("\n20,", "\n19,"), "0 to 19"),
    "a tracking error that is none": (GOOD.replace("0.25,0.25", "0.25,0.26"), "line 3, column tracking_error"),
}


def test_csv_is_valid(trajectory: Trajectory) -> None:
    assert trajectory.t.size > 1000


def test_csv_has_the_logged_times_of_the_contract(port: Port, trajectory: Trajectory) -> None:
    rows = {"python": 4001, "cpp": 10001, "java": 10001}
    assert trajectory.t.size == rows.get(port.name, trajectory.t.size)


@pytest.mark.parametrize("case", BAD)
def test_bad_csv_is_refused(case: str, tmp_path: Path) -> None:
    text, reason = BAD[case]
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(TrajectoryError) as refusal:
        load(path, 20.0)
    assert reason in str(refusal.value) and "\n" not in str(refusal.value)


def test_good_csv_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "good.csv"
    path.write_text(GOOD)
    assert load(path, 20.0).x1.tolist() == [1.5, 0.5, 0.25]


def test_missing_csv_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryError, match="no such file"):
        load(tmp_path / "none.csv", 20.0)
