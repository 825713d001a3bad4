# SPDX-License-Identifier: MIT
"""What a correct run shows, lesson (15)."""

from conformance import checks
from conformance.scenario import LESSON
from conformance.tests.programs import PORTS
from conformance.tests.test_agreement import assert_all
from conformance.trajectory import Trajectory


def test_output_approaches_reference(trajectory: Trajectory, tolerance: float) -> None:
    assert_all(checks.output_approaches_reference(trajectory, LESSON, tolerance))


def test_z1_and_z2_approach_zero(trajectory: Trajectory, tolerance: float) -> None:
    assert_all(*checks.errors_approach_zero(trajectory, LESSON, tolerance))


def test_all_states_stay_bounded(trajectory: Trajectory, tolerance: float) -> None:
    assert_all(*checks.states_stay_bounded(trajectory, LESSON, tolerance))


def test_estimate_approaches_theta_in_this_experiment(trajectory: Trajectory, tolerance: float) -> None:
    assert_all(checks.estimate_approaches_theta(trajectory, LESSON, tolerance))


def test_lyapunov_function_never_grows(trajectory: Trajectory, tolerance: float) -> None:
    assert_all(checks.lyapunov_function_never_grows(trajectory, LESSON, tolerance))


def test_there_is_a_program_to_check() -> None:
    assert PORTS
