# SPDX-License-Identifier: MIT
"""Every program passes every check: the exact solution (10), the checklist (15), and agreement with the others."""

from dataclasses import replace

import numpy as np
import pytest

from conformance.judging import checks
from conformance.judging.checks import LARGEST_RATIO, Check, Tolerance, checks_of, contract, programs_agree
from conformance.judging.measured import Measured, interpolation_error
from conformance.judging.trajectory import Trajectory
from conformance.pages.tolerances import PAGE, page
from conformance.programs.ports import the_six
from conformance.tests.under_test import PORTS, engine_of, trajectory_of
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact

EXACT_SOLUTION = exact(LESSON)

CHECKS, CONTRACT = checks_of(LESSON), contract(EXACT_SOLUTION)
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
        nowhere = Trajectory(trajectory.t, np.stack([nothing] * 3), nothing, nothing, LESSON.names)
        lost = Measured(nowhere, EXACT_SOLUTION)
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
    if not the_six().keys() <= PORTS.keys():
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
    times = checks.GRID * np.arange(round(float(LESSON.horizon) / checks.GRID) + 1)
    missed = interpolation_error(good, EXACT_SOLUTION, times)  # more than the tolerance, of a log with few rows
    stray = replace(good, states=good.states + np.array([[0], [3 * (tolerance[1] + missed)], [0]]))
    (result,) = programs_agree(
        {name: good, "stray": stray}, EXACT_SOLUTION, {name: tolerance, "stray": tolerance}
    ).values()
    assert not result.passed and result.where.startswith("x2")


def test_times_that_are_summed_are_refused() -> None:
    """t += h, as in the lesson's own C++ and Java listings: 2e-12 s off at the end."""
    h, rows, errors = 0.002, 10001, [4e-10, 4e-9, 3e-9]
    summed = np.concatenate([[0], np.cumsum(np.full(rows - 1, h))])
    for t, passed in ((np.arange(rows) * h, True), (np.linspace(0, 20, rows), True), (summed, False)):
        found = {result.claim: result for result in checks.contract_of_ports((2e-9, 2e-8, 2e-8), errors, t, 20.0, rows)}
        assert found["times-are-counted-not-summed"].passed is passed, found
