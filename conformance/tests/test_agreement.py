# SPDX-License-Identifier: MIT
"""Each program agrees with the exact solution, and with every other program."""

from pathlib import Path

import numpy as np

from conformance import checks
from conformance.scenario import LESSON
from conformance.tests.programs import PORTS, engine_of, trajectory_of
from conformance.trajectory import Trajectory

CONTRACT = 1e-6  # no program may be further from the exact solution, in any column at any row


def assert_all(*results: checks.Result) -> None:
    assert all(result.passed for result in results), "\n".join(map(str, results))


def test_states_equal_the_exact_solution(trajectory: Trajectory, tolerance: float) -> None:
    assert tolerance <= CONTRACT
    assert_all(*checks.states_equal_the_exact_solution(trajectory, LESSON, tolerance))


def test_reference_is_the_scenarios(trajectory: Trajectory) -> None:
    assert_all(checks.reference_is_the_scenarios(trajectory, LESSON))


def test_programs_agree_with_each_other() -> None:
    trajectories = {name: trajectory_of(port) for name, port in PORTS.items()}
    tolerances = {name: engine_of(port).tolerance for name, port in PORTS.items()}
    assert_all(*checks.programs_agree(trajectories, LESSON, tolerances))


def test_interpolation_reproduces_the_exact_solution_between_rows(trajectory: Trajectory) -> None:
    midpoints = (trajectory.t[1:] + trajectory.t[:-1]) / 2
    assert checks.interpolation_error(trajectory, LESSON, midpoints) < 1e-7


def test_a_wrong_column_does_not_agree(trajectory: Trajectory, tolerance: float, tmp_path: Path) -> None:
    shifted = checks.replace(trajectory, x2=trajectory.x2 + 10 * tolerance)
    assert not all(r.passed for r in checks.states_equal_the_exact_solution(shifted, LESSON, tolerance))
    missing = checks.replace(trajectory, x1=np.full_like(trajectory.x1, np.nan))
    assert not all(r.passed for r in checks.states_equal_the_exact_solution(missing, LESSON, tolerance))
    assert not checks.lyapunov_function_never_grows(missing, LESSON, tolerance).passed
