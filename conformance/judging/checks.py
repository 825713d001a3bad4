# SPDX-License-Identifier: MIT
"""One function per claim about a trajectory: the measured figure, the bound, and where the bound comes from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from conformance.judging.identification import NEARER, neighbour, value
from conformance.judging.measured import Measured, interpolate, interpolation_error
from conformance.judging.trajectory import (
    COARSEST,
    USUAL,
    Array,
    Trajectory,
    digits_shown,
    is_single,
    print_error,
)
from conformance.theory.experiments import Experiment
from conformance.truth.exact import CONTRACT, Exact

SETTLED = 0.75  # share of the horizon after which the transient is over: 15 s of 20 s
FOUND = 0.01  # share of its first error that the exact estimate must fall below to be said to approach theta
GRID = 0.005  # s, on which programs are compared with each other
DOUBLE = float(np.finfo(float).eps)
SMALLEST = float(np.finfo(float).tiny)
MANTISSA = (1 << 52) - 1  # the bits of a double that hold its digits
DIGITS_15 = 0.5e-14  # half a unit of the 15th significant digit, of a number that begins with 1

Tolerance = tuple[float, ...]  # of states and estimates: how far from the exact solution they may be
LARGEST_RATIO = 10  # of a port's tolerance to its largest error


def contract(exact: Exact) -> Tolerance:
    """The contract's tolerance: the experiment's own, or else 1e-6 max(1, max |state|) of each state."""
    return tuple(exact.tolerance.tolist())


@dataclass(frozen=True)
class Result:
    """What a check found: `figure` must not exceed `bound`, which comes from `bound_from`."""

    claim: str
    section: str
    figure: float
    bound: float
    where: str
    bound_from: str

    @property
    def passed(self) -> bool:
        return bool(self.figure <= self.bound)  # a NaN does not pass

    def __str__(self) -> str:
        verdict = "holds" if self.passed else "FAILS"
        figure, bound = told_apart(self.figure, self.bound)
        return f"{self.claim} {self.section} {verdict}: {figure}, bound {bound} ({self.bound_from}); {self.where}"


def told_apart(a: float, b: float) -> tuple[str, str]:
    """Two numbers in as few digits, three or more, as show them different where they are."""
    texts = ((f"{a:.{digits}g}", f"{b:.{digits}g}") for digits in range(3, 18))
    return next((pair for pair in texts if pair[0] != pair[1] or a == b), (repr(float(a)), repr(float(b))))


def largest(values: Array, t: Array, what: str) -> tuple[float, str]:
    """The largest |value|, a NaN before all, and where it is."""
    sizes = np.where(np.isnan(values), np.inf, np.abs(values))
    i = int(np.argmax(sizes))
    return float(sizes[i]), f"{what} at t = {t[i]:.6g}"


# ---- Against the exact solution ----


def rows_are_close_enough(log: Measured, tolerance: Tolerance) -> Result:
    """Between the rows, the exact solution can be drawn from its values at the rows, to within the contract."""
    figure, where = largest(log.interpolation_error, log.trajectory.t[:-1], "the quintic through the exact rows, after")
    return Result("rows-are-close-enough", "(10)", figure, CONTRACT, where, "the contract")


def states_are_in_double_precision(log: Measured, tolerance: Tolerance) -> list[Result]:
    """Each state is kept and printed with the digits of a double in three quarters of its values, at least.

    No single precision, no fixed decimals on the way. It is of the ports' contract: see `digit_notes` for other files.
    Each value counts once: that at which a state has come to rest may have few digits, and fill most of the rows.
    """
    results = []
    for name, logged in zip(log.trajectory.names, log.trajectory.states, strict=True):
        values = np.unique(logged)
        _, digits = digits_shown(values)
        printed = 0.5 * 10.0 ** (1 - digits) if digits else 0.0
        used = np.ascontiguousarray(values).view(np.int64) & MANTISSA
        last_bits = np.partition(used & -used, int((1 - USUAL) * used.size))  # that a number uses
        figure = max(printed, DOUBLE * float(last_bits[int((1 - USUAL) * used.size)]))
        figure = figure if np.isfinite(values).all() else np.inf
        where = f"relative; {digits} digits are shown"
        results.append(Result(f"{name}-is-in-double-precision", "(10)", figure, DIGITS_15, where, "15 digits"))
    return results


def digit_notes(trajectory: Trajectory) -> list[str]:
    """What is to be said of a file whose states are kept or printed in less than double precision."""
    said: dict[str, list[str]] = {}
    for name, values in zip(trajectory.names, trajectory.states, strict=True):
        _, digits = digits_shown(values)
        if is_single(values):
            said.setdefault("in single precision, 7 digits", []).append(name)
        elif 0 < digits < 15:
            said.setdefault(f"printed to {digits} digits", []).append(name)
    return [f"{', '.join(names)}: {what}; a double has 17" for what, names in said.items()]


def reference_is_the_scenarios(log: Measured, tolerance: Tolerance) -> Result:
    """The reference column is r(t): equal but for the rounding of its argument, of the wave, and of the print."""
    logged, rounding = log.trajectory.reference, log.exact.reference_rounding
    figure, where = largest(logged - log.exact.reference(log.trajectory.t), log.trajectory.t, "reference")
    clock = float(print_error(log.trajectory.t).max() * log.exact.reference_rate)
    printed = min(float(print_error(logged).max()) + clock, COARSEST)
    return Result(
        "reference-is-that-of-the-experiment", "(10)", figure, rounding + printed, where, "rounding and print"
    )


def obeys_its_differential_equation(row: int, name: str) -> Callable[[Measured, Tolerance], Result]:
    """From row to row this state moves as its row of the closed loop says, by the Hermite-Simpson rule, (7).

    The defect of the exact solution, and what the other states' defects cause, is taken off. What is left is, to first
    order in the error e of the log, e_1 - e_0 - h/6 (J e_0 + 4 J e_m + J e_1), where J is the Jacobian and
    e_m = (e_0 + e_1)/2 + h/8 J (e_0 - e_1). After the first step in which any state breaks its equation the others are
    not judged: J is that of the exact solution, which the log has left.
    """

    def check(log: Measured, tolerance: Tolerance) -> Result:
        t, J, e = log.trajectory.t, log.exact.gains.field, np.array(tolerance)
        h = float(np.diff(t).max())
        bounds = 2 * e + h * J @ e + h**2 / 6 * J @ J @ e + DOUBLE * np.abs(log.trajectory.states).max(axis=1)
        broken = ~(log.defect <= bounds[:, None]).all(axis=0)
        end = int(np.argmax(broken)) + 1 if broken.any() else broken.size
        figure, where = largest(log.defect[row, :end], t[:end], f"defect of {name}' in the step")
        claim = f"{name}-obeys-its-differential-equation"
        return Result(claim, "(7)", figure, float(bounds[row]), where, "tolerance, at both ends of a step")

    check.__name__ = f"{name}_obeys_its_differential_equation"
    check.__doc__ = (
        f"From row to row {name} moves as its row of the closed loop says, by the Hermite-Simpson rule, (7)."
    )
    return check


def states_equal_the_exact_solution(log: Measured, tolerance: Tolerance) -> list[Result]:
    """Each state column against the exact solution at the file's own times."""
    results = []
    names, scales = log.trajectory.names, log.exact.table.scale
    for name, exact, off, bound in zip(names, scales, log.deviation, tolerance, strict=True):
        figure, where = largest(off, log.trajectory.t, name)
        digits = np.log10(1 / min(max(figure / max(exact, SMALLEST), DOUBLE), 1.0))
        where += f"; {digits:.1f} digits agree; {figure / bound:.2g} times the tolerance"
        results.append(Result(f"{name}-equals-the-exact-solution", "(10)", figure, bound, where, "tolerance"))
    return results


def parameters_are_the_scenarios(log: Measured, tolerance: Tolerance) -> list[Result]:
    """No other value of one parameter or start value explains the log much better than the experiment's own does.

    The figure: how many times nearer the log is to the solution for that value, to first order in the proven dx/dp. A
    solver's errors look like no change of one parameter; a wrong one is found however small, down to these errors.
    """
    if not log.exact.sensitivity.columns.size:
        return []
    found = neighbour(log)
    own = value(log.exact, found.name)
    figure = found.nearer if np.isfinite(log.deviation).all() else np.inf
    where = f"times nearer to the solution for {found.name} = {own + found.change:.10g} than for {own:.10g}"
    return [Result("parameters-are-those-of-the-experiment", "(10)", figure, NEARER, where, "more is no chance")]


# ---- The checklist (15) ----


def output_approaches_reference(log: Measured, tolerance: Tolerance) -> Result:
    """After the transient, |x1 - reference| as logged is at most what the exact |z1| is there, plus the tolerance."""
    late = _late(log)
    figure, where = largest(log.trajectory.tracking_error[late], log.trajectory.t[late], "tracking_error")
    bound = float(_exact_late(log.exact)[0]) + tolerance[0]
    return Result("output-approaches-reference", "(15)", figure, bound, where, "the exact |z1| and the tolerance")


def errors_approach_zero(log: Measured, tolerance: Tolerance) -> list[Result]:
    """After the transient, each |z_i|, computed from the log, is at most the exact one plus the tolerance."""
    late = _late(log)
    results = []
    bounds = _exact_late(log.exact) + log.exact.gains.z @ np.array(tolerance)
    for i, (values, bound) in enumerate(zip(log.z, bounds.tolist(), strict=True), start=1):
        figure, where = largest(values[late], log.trajectory.t[late], f"z{i}")
        source = f"the exact |z{i}| and the tolerance"
        results.append(Result(f"z{i}-approaches-zero", "(15)", figure, bound, where, source))
    return results


def errors_stay_bounded(log: Measured, tolerance: Tolerance) -> Result:
    """|z| <= sqrt(2 V(0)): the theorem's own bound, since V never grows."""
    size, where = largest(np.sqrt((log.z**2).sum(axis=0)), log.trajectory.t, "|z|")
    bound = float(np.sqrt(2 * log.exact.V_start) + np.linalg.norm(log.exact.gains.z @ np.array(tolerance)))
    return Result("errors-stay-bounded", "(15)", size, bound, where, "sqrt(2 V(0))")


def estimate_stays_bounded(log: Measured, tolerance: Tolerance) -> Result:
    """theta_tilde' Gamma^-1 theta_tilde <= 2 V(0), an ellipsoid, since V never grows; |theta_tilde| where p is 1."""
    setting = log.exact.setting
    inverse = np.linalg.inv(setting.Gamma)
    tilde = log.trajectory.states[setting.n :] - setting.theta[:, None]
    if setting.p == 1:
        gain = float(np.sqrt(setting.Gamma[0, 0]))
        figure, where = largest(tilde[0], log.trajectory.t, "theta_tilde")
        bound, source = gain * float(np.sqrt(2 * log.exact.V_start)) + tolerance[-1], "sqrt(2 gamma V(0))"
    else:
        sizes = np.sqrt(np.einsum("it,ij,jt->t", tilde, inverse, tilde))
        figure, where = largest(sizes, log.trajectory.t, "sqrt(theta_tilde' Gamma^-1 theta_tilde)")
        rim = float(np.sqrt(np.diag(inverse)) @ np.array(tolerance[setting.n :]))  # of errors within the tolerance
        bound, source = float(np.sqrt(2 * log.exact.V_start)) + rim, "sqrt(2 V(0))"
    return Result("estimate-stays-bounded", "(15)", figure, bound, where, source)


def estimates_end_where_theory_says(log: Measured, tolerance: Tolerance) -> list[Result]:
    """At the horizon an estimate is as near to theta as the exact one, or as far: no theorem says which, (9)."""
    setting = log.exact.setting
    start, end = np.abs(log.exact.evaluate([0.0, setting.horizon])[setting.n :].T - setting.theta)
    results, subjects = [], _subjects(setting.unknown, setting.estimates)
    for j, (theta, name) in enumerate(zip(setting.theta.tolist(), setting.estimates, strict=True)):
        row = setting.n + j
        last, allowed = float(log.trajectory.states[row, -1]), tolerance[row]
        subject, aim = subjects[j]
        where = f"{name} ends at {last:.6g}, {setting.unknown[j]} is {theta:.6g}"
        if end[j] <= FOUND * start[j]:
            source = "the exact distance and the tolerance"
            bound = float(end[j]) + allowed
            results.append(Result(f"{subject}-approaches-{aim}", "(15)", abs(last - theta), bound, where, source))
        else:
            figure = abs(abs(last - theta) - float(end[j]))
            where += f", and the exact one stays {end[j]:.6g} away"
            results.append(Result(f"{subject}-stays-away-from-{aim}", "(9)", figure, allowed, where, "tolerance"))
    return results


def lyapunov_function_never_grows(log: Measured, tolerance: Tolerance) -> Result:
    """V from the log never rises between rows by more than errors at both ends explain.

    V' = - sum k_i z_i^2 by the theorem's formula is shown beside it: a check of its sign could not fail.
    """
    figure, where = largest(np.maximum(np.diff(log.V), 0), log.trajectory.t[1:], "rise of V")
    where += f"; V' by its formula runs from {log.V_dot.min():.3g} to {log.V_dot.max():.3g}"
    bound = 2 * float(log.exact.gains.V @ np.array(tolerance)) + 4 * DOUBLE * float(log.V[0])
    return Result("lyapunov-function-never-grows", "(15)", figure, bound, where, "tolerance, at both ends of a step")


def lyapunov_function_falls_by_what_is_dissipated(log: Measured, tolerance: Tolerance) -> Result:
    """Between any two rows V falls by the integral of sum k_i z_i^2, since V' is minus that.

    The bound: V moves by its gradient times the tolerance at both rows, the integral by that of its integrand, and
    the quadrature misses what it misses on the exact solution.
    """
    imbalance, missed = log.imbalance
    values = np.where(np.isnan(imbalance), np.inf, imbalance)
    i, j = sorted((int(np.argmin(values)), int(np.argmax(values))))
    figure = float(values.max() - values.min()) if np.isfinite(values).all() else np.inf
    e, gains = np.array(tolerance), log.exact.gains
    rounding = 2 * DOUBLE * float(log.V[0]) * np.sqrt(values.size)
    bound = float((2 * gains.V + gains.dissipated) @ e) + missed + rounding
    where = f"from t = {log.trajectory.t[i]:.6g} to {log.trajectory.t[j]:.6g}"
    source = f"tolerance, and {missed:.1g} of the quadrature"
    return Result("lyapunov-function-falls-by-what-is-dissipated", "(7)", figure, bound, where, source)


def _late(log: Measured) -> slice:
    return slice(int(np.searchsorted(log.trajectory.t, SETTLED * log.exact.setting.horizon)), None)


def _exact_late(exact: Exact) -> Array:
    """The largest exact |z_1| .. |z_n| after the transient."""
    horizon = exact.setting.horizon
    t = np.linspace(SETTLED * horizon, horizon, 2001)
    sizes: Array = np.abs(exact.errors(t, exact.evaluate(t))).max(axis=1)
    return sizes


# ---- Between programs ----


def programs_agree(
    trajectories: Mapping[str, Trajectory], exact: Exact, tolerances: Mapping[str, Tolerance]
) -> dict[tuple[str, str], Result]:
    """Every pair on a common grid; the bound is the sum of the two tolerances and of the two interpolation errors."""
    times = GRID * np.arange(round(exact.setting.horizon / GRID) + 1, dtype=np.float64)
    on_grid = {name: interpolate(trajectory, exact, times) for name, trajectory in trajectories.items()}
    missed = {name: interpolation_error(trajectory, exact, times) for name, trajectory in trajectories.items()}
    results = {}
    for a, b in combinations(on_grid, 2):
        bounds = np.add(tolerances[a], tolerances[b]) + missed[a] + missed[b]
        difference = np.abs(on_grid[a] - on_grid[b])
        row = int(np.argmax(difference.max(axis=1) / bounds))
        figure, where = largest(difference[row], times, exact.setting.names[row])
        source = f"both tolerances, and {missed[a] + missed[b]:.1g} of the interpolation"
        results[a, b] = Result(f"{a}-agrees-with-{b}", "(10)", figure, float(bounds[row]), where, source)
    return results


# ---- Ports on the lesson's experiment ----


def contract_of_ports(
    tolerance: Tolerance, errors: Sequence[float], t: Array, horizon: float, wanted: int
) -> list[Result]:
    """The tolerance that port.toml states is at most the contract's, and 10 times what was found; the rows are there.

    `errors` of states and estimates; t, shape (rows,), up to the horizon, s; `wanted` rows, 0 where the solver chooses
    them. Where it does not, row i is at t = i h to rounding: a running sum t += h drifts by hundreds of times as much.
    """
    rows = t.size
    loosest = max(tolerance)
    ratio = max(t / max(e, DOUBLE) for t, e in zip(tolerance, errors, strict=True))
    results = [
        Result("tolerance-keeps-the-contract", "(10)", loosest, CONTRACT, "in port.toml", "the contract"),
        Result("tolerance-is-tight", "(10)", ratio, LARGEST_RATIO, "tolerance in port.toml over error", "the contract"),
    ]
    if wanted:
        where = f"{rows} rows, port.toml says {wanted}"
        results.append(Result("rows-are-those-of-the-contract", "(10)", abs(rows - wanted), 0, where, "the contract"))
    if wanted == rows:
        figure, where = largest(t - np.arange(rows) * horizon / (rows - 1), t, "the times")
        bound = float(2 * np.spacing(horizon))
        results.append(Result("times-are-counted-not-summed", "(12)", figure, bound, where, "t = i h, to rounding"))
    return results


# ---- The list ----


@dataclass(frozen=True)
class Check:
    """Claims of one kind, and what usually causes one to fail; `run` gives one result per column or quantity."""

    run: Callable[[Measured, Tolerance], Result | list[Result]]
    claims: tuple[str, ...]
    cause: str

    def __call__(self, log: Measured, tolerance: Tolerance) -> list[Result]:
        results = self.run(log, tolerance)
        return results if isinstance(results, list) else [results]

    @property
    def meaning(self) -> str:
        """What is claimed, in a sentence."""
        return " ".join((self.run.__doc__ or "").split("\n\n")[0].split())


def _subjects(unknown: Sequence[str], estimates: Sequence[str]) -> list[tuple[str, str]]:
    """How claims name an estimate and its parameter: by their own names where there are several."""
    return [("estimate", "theta")] if len(unknown) == 1 else list(zip(estimates, unknown, strict=True))


def checks_of(experiment: Experiment) -> tuple[Check, ...]:
    """Every check of an experiment, in the order of the verdict."""
    states, unknown, estimates = experiment.states, experiment.parameters, experiment.estimates
    n, p = len(states), len(unknown)
    every = (*states, *estimates)
    tuning, gain = f"tau{n}", "gamma" if p == 1 else "Gamma"
    virtual = "alpha1" if n == 2 else f"alpha1 to alpha{n - 1}"
    parts = ", ".join([virtual] * (n > 1) + [tuning] * (p > 0)) + " or " * (n > 1 or p > 0)
    adaptation = "the " + " or ".join(f"{name}'" for name in estimates) if p else "a"
    causes = [
        *(f"row {i} of the plant, such as sin({x}) for {x} (16)" + ", or theta" * bool(p)
          for i, x in enumerate(states[1:], start=1)),
        f"the control u: a term, sign or gain in it (16), or in {parts}a derivative of r, of which it is made",
        *([f"the update law: {gain}, or a sign or term in {tuning}"] * p),
    ]  # fmt: skip
    checks = (
        Check(
            rows_are_close_enough,
            ("rows-are-close-enough",),
            "too few rows, or rows left out: log at least every 0.02 s",
        ),
        Check(
            states_are_in_double_precision,
            tuple(f"{name}-is-in-double-precision" for name in every),
            "single precision, or too few digits printed: %.17g gives a double back, %.12f does not",
        ),
        Check(
            reference_is_the_scenarios,
            ("reference-is-that-of-the-experiment",),
            "another reference, or times that are off by a step",
        ),
        *(
            Check(
                obeys_its_differential_equation(row, name),
                (f"{name}-obeys-its-differential-equation",),
                cause,
            )
            for row, (name, cause) in enumerate(zip(every, causes, strict=True))
        ),
        Check(
            states_equal_the_exact_solution,
            tuple(f"{name}-equals-the-exact-solution" for name in every),
            "where a state breaks its equation, that; else the start, the method, such as an Euler step, "
            "or its tolerance",
        ),
        Check(
            parameters_are_the_scenarios,
            ("parameters-are-those-of-the-experiment",),
            "another value of the parameter or start value that is named",
        ),
        Check(
            output_approaches_reference,
            ("output-approaches-reference",),
            "a reference whose derivatives do not belong to it, or a missing term (16)",
        ),
        Check(
            errors_approach_zero,
            tuple(f"z{i}-approaches-zero" for i in range(1, n + 1)),
            f"{adaptation} term of u, or a derivative of the reference, is missing (16)",
        ),
        Check(
            errors_stay_bounded,
            ("errors-stay-bounded",),
            "a wrong sign in the update law or the control",
        ),
        Check(
            estimate_stays_bounded,
            ("estimate-stays-bounded",) * bool(p),
            "a wrong sign in the update law or the control",
        ),
        Check(
            estimates_end_where_theory_says,
            tuple(
                f"{subject}-{end}-{aim}"
                for subject, aim in _subjects(unknown, estimates)
                for end in ("approaches", "stays-away-from")
            ),
            "an estimate that is not updated, or updated with a wrong sign or gain",
        ),
        Check(
            lyapunov_function_never_grows,
            ("lyapunov-function-never-grows",),
            f"a wrong tuning function, or {unknown[0]} where {estimates[0]} belongs (16)" if p else "a wrong u",
        ),
        Check(
            lyapunov_function_falls_by_what_is_dissipated,
            ("lyapunov-function-falls-by-what-is-dissipated",),
            f"a term missing in u{f' or {tuning}' * (p > 0)}, so that V' keeps a cross term",
        ),
    )
    return tuple(check for check in checks if check.claims)  # none on estimates where nothing is unknown


def checks_of_anyone(experiment: Experiment) -> tuple[Check, ...]:
    """The checks of anyone's log, in which digits are no verdict."""
    return tuple(check for check in checks_of(experiment) if check.run is not states_are_in_double_precision)


def judge(log: Measured, tolerance: Tolerance, checks: Sequence[Check]) -> list[tuple[Check, Result]]:
    """Every result of every check, in the order of `checks`."""
    with np.errstate(all="ignore"):  # of numbers near 1e308, which no check lets pass
        return [(check, result) for check in checks for result in check(log, tolerance)]
