# SPDX-License-Identifier: MIT
"""Every program passes every check: the exact solution (10), the checklist (15), and agreement with the others."""

from dataclasses import fields, replace

import numpy as np
import pytest

from conformance import checks
from conformance.checks import CHECKS, CONTRACT, Check, Tolerance, judge, programs_agree
from conformance.exact import exact
from conformance.measured import Measured
from conformance.ports import read_ports
from conformance.scenario import LESSON
from conformance.tests.programs import PORTS, engine_of, trajectory_of
from conformance.tolerances import LARGEST_RATIO, PAGE, page
from conformance.trajectory import Trajectory

EXACT_SOLUTION = exact(LESSON)

each_check = pytest.mark.parametrize("check", CHECKS, ids=[check.run.__name__.replace("_", "-") for check in CHECKS])


def test_there_is_a_program_to_check() -> None:
    assert PORTS


@each_check
def test_program_passes(check: Check, trajectory: Trajectory, tolerance: Tolerance) -> None:
    results = check(Measured(trajectory, EXACT_SOLUTION), tolerance)
    assert results and all(result.passed for result in results), "\n".join(map(str, results))


@each_check
def test_check_refuses_a_trajectory_that_is_not_a_number(check: Check, trajectory: Trajectory) -> None:
    nothing = np.full_like(trajectory.t, np.nan)
    if check.run is not checks.rows_are_close_enough:  # which looks at the times alone
        lost = Measured(Trajectory(trajectory.t, *[nothing] * 5), EXACT_SOLUTION)
        assert not any(result.passed for result in check(lost, CONTRACT))


def test_tolerances_keep_the_contract() -> None:
    engines = [engine for port in PORTS.values() for engine in port.engines]
    assert all((np.array(engine.tolerance) <= CONTRACT).all() for engine in engines)


def test_tolerances_of_engines_that_ran_are_at_most_10_times_the_largest_error(
    trajectory: Trajectory, tolerance: Tolerance
) -> None:
    largest = np.abs(Measured(trajectory, EXACT_SOLUTION).deviation).max(axis=1)
    assert (tolerance <= LARGEST_RATIO * largest).all()


def test_page_of_tolerances_is_current() -> None:
    """Another compiler or library may round otherwise: measured figures may differ by a tenth."""
    if set(PORTS) != set(read_ports()):
        pytest.skip("PORTS leaves some out")
    written, now = ([line.split("|") for line in text.splitlines()] for text in (PAGE.read_text(), page()))
    measured = slice(5, 7)
    for old, new in zip(written, now, strict=True):
        figures = [list(map(float, filter(is_number, line[measured]))) for line in (old, new)]
        assert len(figures[0]) == len(figures[1]) and np.allclose(*figures, rtol=0.1), (old, new)
        assert [*old[:5], *old[7:]] == [*new[:5], *new[7:]]


def is_number(cell: str) -> bool:
    return cell.strip().replace(".", "").replace("e-", "").isdigit()


def test_programs_agree_with_each_other() -> None:
    trajectories = {name: trajectory_of(port) for name, port in PORTS.items()}
    tolerances = {name: engine_of(port).tolerance for name, port in PORTS.items()}
    results = programs_agree(trajectories, EXACT_SOLUTION, tolerances).values()
    assert len(results) == len(PORTS) * (len(PORTS) - 1) // 2
    assert all(result.passed for result in results), "\n".join(map(str, results))


def test_program_that_strays_agrees_with_no_other() -> None:
    name, port = next(iter(PORTS.items()))
    good, tolerance = trajectory_of(port), engine_of(port).tolerance
    stray = replace(good, x2=good.x2 + 3 * tolerance[1])
    (result,) = programs_agree(
        {name: good, "stray": stray}, EXACT_SOLUTION, {name: tolerance, "stray": tolerance}
    ).values()
    assert not result.passed and result.where.startswith("x2")


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


EXACT, EQUATION, REFERENCE, OUTPUT, ERRORS, BOUNDED, ESTIMATE, GROWTH, BALANCE, ROWS, DIGITS = (
    checks.states_equal_the_exact_solution,
    checks.states_obey_the_differential_equation,
    checks.reference_is_the_scenarios,
    checks.output_approaches_reference,
    checks.errors_approach_zero,
    checks.states_stay_bounded,
    checks.estimate_ends_where_theory_says,
    checks.lyapunov_function_never_grows,
    checks.lyapunov_function_falls_by_what_is_dissipated,
    checks.rows_are_close_enough,
    checks.states_are_in_double_precision,
)
WRONG = {
    "x1 off by 1e-5": (EXACT, lambda y: replace(y, x1=y.x1 + 1e-5)),
    "x2 off by 2e-6 from the middle on": (EXACT, lambda y: replace(y, x2=half(y.x2, 2e-6))),
    "x1 in single precision": (DIGITS, lambda y: replace(y, x1=single(y.x1))),
    "x1 and x2 exchanged": (EXACT, lambda y: replace(y, x1=y.x2, x2=y.x1)),
    "theta_hat frozen": (ESTIMATE, lambda y: replace(y, theta_hat=0 * y.t)),
    "time shifted by a step": (REFERENCE, lambda y: replace(y, t=np.append(0, y.t[:-1] + 1e-3))),
    "reference 1 % too large": (REFERENCE, lambda y: replace(y, reference=1.01 * y.reference)),
    "tracking error that stays": (OUTPUT, lambda y: replace(y, tracking_error=half(y.tracking_error, 1e-3))),
    "x2 that keeps an error": (ERRORS, lambda y: replace(y, x2=y.x2 + 1e-5)),
    "190 samples set to 50": (BOUNDED, lambda y: replace(y, x1=first_samples(y.x1, 190, 50.0))),
    "a jump of x2 by 1e-5": (EQUATION, lambda y: replace(y, x2=half(y.x2, 1e-5))),
    "z2 that is dissipated at another rate": (BALANCE, lambda y: replace(y, x2=y.x2 + 1e-2 * np.exp(-y.t))),
    "V that rises": (GROWTH, lambda y: replace(y, theta_hat=half(y.theta_hat, 0.5))),
    "rows left out": (ROWS, lambda y: Trajectory(*(getattr(y, f.name)[np.r_[0:5, -5:0]] for f in fields(y)))),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_trajectory_is_refused_by_its_check(name: str) -> None:
    claim, change = WRONG[name]
    port = next(iter(PORTS.values()))
    judged = judge(change(trajectory_of(port)), EXACT_SOLUTION, engine_of(port).tolerance)
    assert claim in {check.run for check, result in judged if not result.passed}


def test_every_check_has_refused_something() -> None:
    assert {claim for claim, _ in WRONG.values()} == {check.run for check in CHECKS}
