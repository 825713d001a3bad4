# SPDX-License-Identifier: MIT
"""One function per claim about a trajectory: the measured figure, the bound, and where the bound comes from."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from conformance.experiment import Field, field, truth
from conformance.scenario import Scenario
from conformance.trajectory import STATES, Array, Trajectory, print_error

SETTLED = 0.75  # share of the horizon after which the transient is over: 15 s of 20 s
CONTRACT = 1e-6  # no program may be further from the exact solution, in any column at any row
DOUBLE = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Result:
    """What a check found: `figure` must not exceed `bound`."""

    claim: str
    section: str
    figure: float
    bound: float
    where: str

    @property
    def passed(self) -> bool:
        return bool(self.figure <= self.bound)  # a NaN does not pass

    def __str__(self) -> str:
        verdict = "holds" if self.passed else "FAILS"
        return f"{self.claim} {self.section} {verdict}: {self.figure:.3g}, bound {self.bound:.3g}; {self.where}"


def largest(values: Array, t: Array, what: str) -> tuple[float, str]:
    """The largest |value|, a NaN before all, and where it is."""
    sizes = np.where(np.isnan(values), np.inf, np.abs(values))
    i = int(np.argmax(sizes))
    return float(sizes[i]), f"{what} at t = {t[i]:.6g}"


# ---- Against the exact solution ----


def rows_are_close_enough(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> Result:
    """Between the rows, the exact solution can be drawn from its values at the rows, to within the contract."""
    midpoints = (trajectory.t[1:] + trajectory.t[:-1]) / 2
    off = np.abs(interpolation_errors(trajectory, scenario, midpoints)).max(axis=1)
    figure, where = largest(off, midpoints, "interpolation")
    return Result("rows-are-close-enough", "(10)", figure, CONTRACT, where)


def states_equal_the_exact_solution(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> list[Result]:
    """Each state column against the truth at the file's own times; the bound is the engine's tolerance."""
    exact = truth(scenario).evaluate(trajectory.t, STATES)
    results = []
    for name, logged, wanted in zip(STATES, trajectory.states.T, exact, strict=True):
        figure, where = largest(logged - wanted, trajectory.t, name)
        results.append(Result(f"{name}-equals-the-exact-solution", "(10)", figure, tolerance, where))
    return results


def reference_is_the_scenarios(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> Result:
    """The reference column is r(t): equal but for the rounding of its argument, of the sine, and of the print."""
    wanted = field(scenario).reference(trajectory.t)
    figure, where = largest(trajectory.reference - wanted, trajectory.t, "reference")
    argument = float(abs(scenario.phase) + abs(scenario.omega) * scenario.horizon)
    rounding = 4 * DOUBLE * float(abs(scenario.amplitude)) * (1 + argument)
    printed = min(float(print_error(trajectory.reference).max()), tolerance)
    return Result("reference-is-the-scenarios", "(10)", figure, rounding + printed, where)


# ---- The checklist (15) ----


def output_approaches_reference(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> Result:
    """After the transient, |x1 - reference| as logged is at most what the exact |z1| is there, plus the tolerance."""
    late = trajectory.t >= SETTLED * float(scenario.horizon)
    figure, where = largest(trajectory.tracking_error[late], trajectory.t[late], "tracking_error")
    return Result("output-approaches-reference", "(15)", figure, _exact_late(scenario, "z1") + tolerance, where)


def errors_approach_zero(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> list[Result]:
    """After the transient, |z1| and |z2|, computed from the log, are at most the exact ones plus the tolerance."""
    late = trajectory.t >= SETTLED * float(scenario.horizon)
    results = []
    for name, values in zip(("z1", "z2"), _errors(trajectory, scenario), strict=True):
        figure, where = largest(values[late], trajectory.t[late], name)
        bound = _exact_late(scenario, name) + field(scenario).error_gain * tolerance
        results.append(Result(f"{name}-approaches-zero", "(15)", figure, bound, where))
    return results


def states_stay_bounded(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> list[Result]:
    """|z| <= sqrt(2 V(0)) and |theta_tilde| <= sqrt(2 gamma V(0)): the theorem's own bound, since V never grows."""
    V0 = float(truth(scenario).evaluate([0.0], ["V"])[0, 0])
    z1, z2 = _errors(trajectory, scenario)
    size, where = largest(np.hypot(z1, z2), trajectory.t, "|z|")
    estimate, where_estimate = largest(trajectory.theta_hat - float(scenario.theta), trajectory.t, "theta_tilde")
    slack = (1 + field(scenario).error_gain) * tolerance
    return [
        Result("errors-stay-bounded", "(15)", size, np.sqrt(2 * V0) + slack, where),
        Result(
            "estimate-stays-bounded", "(15)", estimate, np.sqrt(2 * float(scenario.gamma) * V0) + slack, where_estimate
        ),
    ]


def estimate_approaches_theta(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> Result:
    """At the horizon theta_hat is as near to theta as the exact one; a fact of this experiment, no theorem."""
    theta = float(scenario.theta)
    exact = float(truth(scenario).evaluate([float(scenario.horizon)], ["theta_hat"])[0, 0])
    figure = abs(float(trajectory.theta_hat[-1]) - theta)
    return Result(
        "estimate-approaches-theta", "(15)", figure, abs(exact - theta) + tolerance, "theta_hat at the last row"
    )


def lyapunov_function_never_grows(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> Result:
    """V from the log never rises between rows by more than the tolerance explains; V' = -k1 z1^2 - k2 z2^2 <= 0."""
    z1, z2 = _errors(trajectory, scenario)
    V = z1**2 / 2 + z2**2 / 2 + (trajectory.theta_hat - float(scenario.theta)) ** 2 / (2 * float(scenario.gamma))
    V0 = float(V[0])
    # dV = z1 dz1 + z2 dz2 + theta_tilde dtheta_hat / gamma at each end of a step, sizes by the theorem's bound
    slope = np.sqrt(2 * V0) * (1 + field(scenario).error_gain) + np.sqrt(2 * V0 / float(scenario.gamma))
    figure, where = largest(np.maximum(np.diff(V), 0), trajectory.t[1:], "rise of V")
    return Result("lyapunov-function-never-grows", "(15)", figure, 2 * slope * tolerance, where)


def _errors(trajectory: Trajectory, scenario: Scenario) -> tuple[Array, Array]:
    """z1 and z2 of the logged states; (5), (7)."""
    z = field(scenario).errors(trajectory.t, trajectory.states)
    return z[:, 0], z[:, 1]


def _exact_late(scenario: Scenario, name: str) -> float:
    horizon = float(scenario.horizon)
    return float(np.abs(truth(scenario).evaluate(np.linspace(SETTLED * horizon, horizon, 2001), [name])).max())


# ---- Between programs ----


def interpolate(trajectory: Trajectory, f: Field, times: Array) -> Array:
    """The states at other times, shape (times, 3), by quintic Hermite polynomials through state, state' and state''."""
    t, y = trajectory.t, trajectory.states
    d, c = f.first(t, y), f.second(t, y)
    i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, t.size - 2)
    h = (t[i + 1] - t[i])[:, None]
    s = (times - t[i])[:, None] / h
    q = 1 - s
    left = y[i] * (1 + 3 * s + 6 * s**2) + h * d[i] * s * (1 + 3 * s) + h**2 * c[i] * s**2 / 2
    right = y[i + 1] * (1 + 3 * q + 6 * q**2) - h * d[i + 1] * q * (1 + 3 * q) + h**2 * c[i + 1] * q**2 / 2
    return q**3 * left + s**3 * right


def interpolation_errors(trajectory: Trajectory, scenario: Scenario, times: Array) -> Array:
    """What `interpolate` is off by, shape (times, 3), given the exact solution at this trajectory's times."""
    solution = truth(scenario)
    exact = replace(trajectory, **dict(zip(STATES, solution.evaluate(trajectory.t, STATES), strict=True)))
    error: Array = interpolate(exact, field(scenario), times) - solution.evaluate(times, STATES).T
    return error


def programs_agree(
    trajectories: dict[str, Trajectory], scenario: Scenario, tolerances: dict[str, float], step: float = 0.005
) -> list[Result]:
    """Every pair on a common grid; the bound is the sum of the two tolerances and of the two interpolation errors."""
    times = step * np.arange(round(float(scenario.horizon) / step) + 1, dtype=np.float64)
    on_grid = {name: interpolate(trajectory, field(scenario), times) for name, trajectory in trajectories.items()}
    slack = {
        name: tolerances[name] + float(np.abs(interpolation_errors(trajectory, scenario, times)).max())
        for name, trajectory in trajectories.items()
    }
    results = []
    for a, b in combinations(on_grid, 2):
        difference = np.abs(on_grid[a] - on_grid[b])
        column = int(np.argmax(difference.max(axis=0)))
        figure, where = largest(difference[:, column], times, STATES[column])
        results.append(Result(f"{a}-agrees-with-{b}", "(10)", figure, slack[a] + slack[b], where))
    return results


# ---- The list ----


@dataclass(frozen=True)
class Check:
    """One claim, and what usually causes it to fail; `run` gives one result per column or quantity."""

    run: Callable[[Trajectory, Scenario, float], Result | list[Result]]
    cause: str

    def __call__(self, trajectory: Trajectory, scenario: Scenario, tolerance: float) -> list[Result]:
        results = self.run(trajectory, scenario, tolerance)
        return results if isinstance(results, list) else [results]


CHECKS = (
    Check(rows_are_close_enough, "too few rows, or rows left out: log at least every 0.02 s"),
    Check(reference_is_the_scenarios, "another reference, or times that are off by a step"),
    Check(
        states_equal_the_exact_solution,
        "a term or sign of the controller (16), a constant, the start, an Euler step, or a tolerance that is too loose",
    ),
    Check(output_approaches_reference, "a reference whose derivatives do not belong to it, or a missing term (16)"),
    Check(errors_approach_zero, "the x1 theta_hat' term of u, or a derivative of the reference, is missing (16)"),
    Check(states_stay_bounded, "a wrong sign in the update law or the control"),
    Check(estimate_approaches_theta, "an estimate that is not updated, or updated with a wrong sign or gain"),
    Check(lyapunov_function_never_grows, "a wrong tuning function, or theta where theta_hat belongs (16)"),
)


def judge(trajectory: Trajectory, scenario: Scenario, tolerance: float) -> list[tuple[Check, Result]]:
    """Every result of every check, in the order of CHECKS."""
    return [(check, result) for check in CHECKS for result in check(trajectory, scenario, tolerance)]
