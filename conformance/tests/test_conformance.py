# SPDX-License-Identifier: MIT
"""Every program passes every check: the exact solution (10), the checklist (15), and agreement with the others."""

from dataclasses import replace

import numpy as np
import pytest

from conformance import checks
from conformance.checks import CHECKS, CONTRACT, Check, judge, programs_agree
from conformance.scenario import LESSON
from conformance.tests.programs import PORTS, engine_of, trajectory_of
from conformance.trajectory import Trajectory

each_check = pytest.mark.parametrize("check", CHECKS, ids=[check.run.__name__.replace("_", "-") for check in CHECKS])


def test_there_is_a_program_to_check() -> None:
    assert PORTS


@each_check
def test_program_passes(check: Check, trajectory: Trajectory, tolerance: float) -> None:
    results = check(trajectory, LESSON, tolerance)
    assert results and all(result.passed for result in results), "\n".join(map(str, results))


@each_check
def test_check_refuses_a_trajectory_that_is_not_a_number(check: Check, trajectory: Trajectory) -> None:
    nothing = np.full_like(trajectory.t, np.nan)
    if check.run.__name__ != "rows_are_close_enough":  # which looks at the times alone
        lost = Trajectory(trajectory.t, *[nothing] * 5)
        assert not all(result.passed for result in check(lost, LESSON, CONTRACT))


def test_tolerances_keep_the_contract() -> None:
    assert all(engine.tolerance <= CONTRACT for port in PORTS.values() for engine in port.engines)


def test_tolerances_of_engines_that_ran_are_at_most_10_times_the_largest_error(
    trajectory: Trajectory, tolerance: float
) -> None:
    figures = [
        r.figure for _, r in judge(trajectory, LESSON, tolerance) if r.claim.endswith("equals-the-exact-solution")
    ]
    assert tolerance <= 10 * max(figures)


def test_programs_agree_with_each_other() -> None:
    trajectories = {name: trajectory_of(port) for name, port in PORTS.items()}
    results = programs_agree(trajectories, LESSON, {name: engine_of(port).tolerance for name, port in PORTS.items()})
    assert all(result.passed for result in results), "\n".join(map(str, results))


# ---- What each check is for, it refuses ----


def half(values: np.ndarray, by: float) -> np.ndarray:
    """The values, changed from the middle on."""
    return np.where(np.arange(values.size) > values.size // 2, values + by, values)


def single(values: np.ndarray) -> np.ndarray:
    """The values, as single precision keeps them."""
    return values.astype(np.float32).astype(np.float64)


def first_samples(values: np.ndarray, count: int, value: float) -> np.ndarray:
    """The values, the first few of them replaced."""
    return np.where(np.arange(values.size) < count, value, values)


EXACT, REFERENCE, OUTPUT, ERRORS, BOUNDED, ESTIMATE, LYAPUNOV, ROWS = (
    checks.states_equal_the_exact_solution,
    checks.reference_is_the_scenarios,
    checks.output_approaches_reference,
    checks.errors_approach_zero,
    checks.states_stay_bounded,
    checks.estimate_approaches_theta,
    checks.lyapunov_function_never_grows,
    checks.rows_are_close_enough,
)
WRONG = {
    "x1 off by 1e-5": (EXACT, lambda y: replace(y, x1=y.x1 + 1e-5)),
    "x2 off by 2e-6 from the middle on": (EXACT, lambda y: replace(y, x2=half(y.x2, 2e-6))),
    "x1 in single precision": (EXACT, lambda y: replace(y, x1=single(y.x1))),
    "x1 and x2 exchanged": (EXACT, lambda y: replace(y, x1=y.x2, x2=y.x1)),
    "theta_hat frozen": (ESTIMATE, lambda y: replace(y, theta_hat=0 * y.t)),
    "time shifted by a step": (REFERENCE, lambda y: replace(y, t=np.append(0, y.t[:-1] + 1e-3))),
    "reference 1 % too large": (REFERENCE, lambda y: replace(y, reference=1.01 * y.reference)),
    "tracking error that stays": (OUTPUT, lambda y: replace(y, tracking_error=half(y.tracking_error, 1e-3))),
    "x2 that keeps an error": (ERRORS, lambda y: replace(y, x2=y.x2 + 1e-5)),
    "190 samples set to 50": (BOUNDED, lambda y: replace(y, x1=first_samples(y.x1, 190, 50.0))),
    "V that rises": (LYAPUNOV, lambda y: replace(y, theta_hat=half(y.theta_hat, 0.5))),
    "rows left out": (ROWS, lambda y: Trajectory(*(column[np.r_[0:5, -5:0]] for column in vars(y).values()))),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_trajectory_is_refused_by_its_check(name: str) -> None:
    claim, change = WRONG[name]
    port = next(iter(PORTS.values()))
    judged = judge(change(trajectory_of(port)), LESSON, engine_of(port).tolerance)
    assert claim in {check.run for check, result in judged if not result.passed}


def test_every_check_has_refused_something() -> None:
    assert {claim for claim, _ in WRONG.values()} == {check.run for check in CHECKS}
