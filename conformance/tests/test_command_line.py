# SPDX-License-Identifier: MIT
"""The command line prints what it says, and answers bad input with one line and status 2."""

import csv
import os
import pty
import select
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import pytest
import sympy as sp
from flint import arb, fmpq

from conformance.programs.ports import ROOT
from conformance.tests.truth.problems import lesson
from conformance.theory.experiment_file import to_toml
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.truth.experiment import printed_of, truth
from conformance.truth.taylor import precision
from conformance.truth.truth import ball_function


def conformance(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)


def ball(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))


def test_truth_prints_values_whose_radius_covers_the_exact_solution() -> None:
    answer = conformance("truth", "--times", "0.1,1/3,20", "--digits", "8")
    rows = list(csv.DictReader(answer.stdout.splitlines()))
    assert [row["t"] for row in rows] == ["0.1", "1/3", "20"]
    errors = ball_function(lesson(), sp.symbols("z1 z2 V"))
    for row in rows:
        with precision(200):
            states = truth(LESSON).at(Fraction(row["t"]))
            enclosed = (*states, *errors(Fraction(row["t"]), states))
            for name, exact in zip(printed_of(LESSON), enclosed, strict=True):
                value, radius = Fraction(row[name]), Fraction(row[name + "_radius"])
                assert abs(exact - ball(value)) <= ball(radius) and radius < Fraction(1, 10**6), (name, row)


def test_truth_prints_every_step_to_the_horizon() -> None:
    rows = conformance("truth", "--step", "2.5").stdout.splitlines()
    assert [row.split(",")[0] for row in rows] == ["t", "0", "2.5", "5", "7.5", "10", "12.5", "15", "17.5", "20"]


def test_more_digits_are_proven_when_asked_for() -> None:
    (row,) = csv.DictReader(conformance("truth", "--times", "20", "--digits", "30").stdout.splitlines())
    assert row["x1"].startswith("0.495303675161773531805091312294") and Fraction(row["x1_radius"]) < Fraction(1, 10**28)


BAD = {
    "a time beyond the horizon": (["--times", "21"], "time 21 is outside of [0, 20]"),
    "a negative time": (["--times=-1"], "time -1 is outside of [0, 20]"),
    "a time that is no number": (["--times", "now"], "found 'now', expected a finite decimal"),
    "a time divided by zero": (["--times", "1/0"], "found '1/0', expected a finite decimal"),
    "a step of zero": (["--step", "0"], "found '0', expected a positive number"),
    "times and a step": (["--times", "1", "--step", "1"], "not allowed with"),
    "no digits": (["--digits", "0"], "expected a whole number from 1 to 100"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_answered_in_one_line(case: str) -> None:
    words, reason = BAD[case]
    answer = conformance("truth", *words)
    assert answer.returncode == 2 and answer.stdout == ""
    assert reason in answer.stderr and len(answer.stderr.splitlines()) == 1


def test_help_tells_of_every_option() -> None:
    text = conformance("truth", "--help").stdout
    assert all(option in text for option in ("--plant", "--times", "--step", "--digits"))


def on_a_terminal(*words: str, **environment: str) -> str:
    """What the command shows on a terminal."""
    master, slave = pty.openpty()
    command = [sys.executable, "-m", "conformance", *words]
    with subprocess.Popen(command, cwd=ROOT, stdout=slave, stderr=slave, env=os.environ | environment) as process:
        os.close(slave)
        shown = b""
        while process.poll() is None or select.select([master], [], [], 0)[0]:
            try:
                shown += os.read(master, 65536)
            except OSError:  # the other end is closed
                break
    os.close(master)
    return shown.decode()


def test_colour_is_for_terminals_that_want_it(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("t,x1\n")
    assert "\033[31mdoes not conform\033[0m" in on_a_terminal("validate", str(bad), NO_COLOR="")
    assert "\033[" not in on_a_terminal("validate", str(bad), NO_COLOR="1")
    assert "\033[" not in conformance("validate", str(bad)).stdout


def test_the_experiment_may_be_a_file(tmp_path: Path) -> None:
    path = tmp_path / "other.toml"
    path.write_text(to_toml(with_values(LESSON, {"theta": Fraction(-1), "horizon": Fraction(1)})))
    row = list(csv.DictReader(conformance("truth", "--plant", str(path), "--step", "1").stdout.splitlines()))[-1]
    assert row["t"] == "1" and not row["x1"].startswith("0.3")
