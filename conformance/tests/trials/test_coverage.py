# SPDX-License-Identifier: MIT
"""A program is tried on experiments that follow from its own text and reach further than the lesson."""

import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from conformance.programs.ports import read_ports
from conformance.tests.under_test import AWK, make, write_awk
from conformance.theory.experiments import values_of
from conformance.theory.lesson import LESSON
from conformance.trials.campaign import RANGES, carry_out, draw, prove
from conformance.trials.coverage import extremes, furthest, own_experiments, own_trials
from conformance.truth.exact import exact

pytestmark = pytest.mark.beyond

TABLE = """\
    if (system("cp ../../awk/table.csv " csv_name)) exit 1
    while ((getline line < csv_name) > 0) split(line, f, ",")
    x[1] = f[2]; r = f[5]; x[3] = f[4]
"""
CHEATS = {  # what no experiment of the suite's sees: right on the lesson, and where it goes
    "gamma is another where x1_start is another": (
        "theta_hat_dot = gamma",
        "theta_hat_dot = (x1_start == 1.2 ? 1 : 0.5) * gamma",
    ),
    "theta_hat is kept below 4": (
        "    closed_loop(t, x[1] + ",
        "    if (x[3] > 4) x[3] = 4\n    closed_loop(t, x[1] + ",
    ),
}


def test_own_experiments_follow_from_the_source(tmp_path: Path) -> None:
    ports = read_ports().values()
    assert [own_experiments(port, 2) for port in ports] == [own_experiments(port, 2) for port in ports]
    assert len({scenario for port in ports for scenario in own_experiments(port, 2)}) == 2 * len(ports)


@pytest.mark.parametrize("seed", range(2))
def test_the_furthest_reach_further_than_the_lesson_and_than_the_first(seed: int) -> None:
    taken = furthest(seed, 2)
    ((low,), (high,)), (lowest, highest) = extremes([LESSON]), extremes(taken)
    drawn = extremes([draw(seed, number) for number in range(2)])
    assert np.ptp([lowest.min(0), highest.max(0)], axis=0)[3] > np.ptp([drawn[0].min(0), drawn[1].max(0)], axis=0)[3]
    assert (highest.max(0) - lowest.min(0) > high - low)[[0, 3]].all() and highest.max(0)[2] > 4
    assert all(
        Fraction(low) <= values_of(experiment)[name] <= Fraction(high)
        for experiment in taken for name, (low, high, _) in RANGES.items()
    )  # fmt: skip


def test_the_rough_simulation_is_the_closed_loop() -> None:
    (scenario,) = furthest(1, 1)
    low, high = extremes([scenario])
    states = exact(scenario, 1e-12).evaluate(np.linspace(0, 4, 401))
    assert np.allclose(low[0, :3], states.min(axis=1), atol=1e-2) and np.allclose(
        high[0, :3], states.max(axis=1), atol=1e-2
    )


@pytest.mark.parametrize("cheat", CHEATS)
def test_a_program_that_is_right_on_the_lesson_alone_is_refused(
    cheat: str, copy_of_the_tree: Callable[..., Path], tmp_path: Path
) -> None:
    root = copy_of_the_tree(write_awk)
    source = root / "awk" / AWK
    old, new = CHEATS[cheat]
    assert source.read_text().count(old) == 1
    source.write_text(source.read_text().replace(old, new))
    trials = own_trials(read_ports(root)["awk"], 2, tmp_path / "own")
    outcomes = [carry_out(one, prove(one.experiment)) for one in trials]
    assert "fail" in {outcome.status for outcome in outcomes}


def test_the_verdict_on_a_guest_includes_experiments_of_its_own(copy_of_the_tree: Callable[..., Path]) -> None:
    """A stored table prints the lesson's rows, and knows no other experiment."""
    root = copy_of_the_tree(write_awk)
    assert make(root, "awk").returncode == 0
    command = [sys.executable, "-m", "conformance", "check", "--ports", "awk"]
    honest = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert honest.returncode == 0 and "1 of 1 conform" in honest.stdout, honest.stdout + honest.stderr
    (root / "awk/table.csv").write_bytes((root / "build/awk/Chapter17_Lesson1_awk.csv").read_bytes())
    source = root / "awk" / AWK
    source.write_text(source.read_text().replace("    simulate()\n", TABLE))
    assert make(root, "awk").returncode == 0
    stored = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert stored.returncode == 1 and "on an experiment of its own" in stored.stdout, stored.stdout + stored.stderr
