# SPDX-License-Identifier: MIT
"""A trajectory beside the exact solution: the figures that the checks look at, each computed once."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from conformance.judging.trajectory import Array, Trajectory
from conformance.truth.exact import CONTRACT, Exact

BLOCK = 16384  # steps taken together, so that a log of 10 million rows needs little more memory than its columns


@dataclass(frozen=True)
class Measured:
    """What follows from a trajectory and the exact solution of its experiment: n states, m = n + p with estimates."""

    trajectory: Trajectory
    exact: Exact

    @cached_property
    def deviation(self) -> Array:
        """Logged minus exact states and estimates, shape (m, rows)."""
        difference: Array = self.trajectory.states - self.exact.evaluate(self.trajectory.t)
        return difference

    @cached_property
    def z(self) -> Array:
        """z_1 .. z_n of the logged states, (5), (8); shape (n, rows)."""
        return self.exact.errors(self.trajectory.t, self.trajectory.states)

    @cached_property
    def V(self) -> Array:
        """V of the logged states, shape (rows,)."""
        return self.exact.lyapunov(self.trajectory.t, self.trajectory.states)

    @cached_property
    def V_dot(self) -> Array:
        """V' of the logged states by the theorem's formula, minus the sum of k_i z_i^2; shape (rows,)."""
        rate: Array = -(self.exact.setting.k @ self.z**2)
        return rate

    @cached_property
    def interpolation_error(self) -> Array:
        """By how much the quintic through the exact rows misses the exact solution midway, shape (rows - 1,).

        The largest of the states, each in its unit.
        """
        errors, units = np.empty(self.trajectory.t.size - 1), self.exact.tolerance[:, None] / CONTRACT
        for steps, t, _, states in self._blocks():
            h = np.diff(t)
            midway = self.exact.evaluate(t[:-1] + h / 2)
            errors[steps] = (np.abs(quintic_midway(self.exact, t, states) - midway) / units).max(axis=0)
        return errors

    @cached_property
    def defect(self) -> Array:
        """The size of each logged step's Hermite-Simpson defect, shape (m, rows - 1).

        It is beyond that of the exact solution, and beyond what the other states' defects d bring about in it by the
        midpoint of the rule, at most h/6 |J| d.
        """
        m = len(self.exact.setting.names)
        defects = np.empty((m, self.trajectory.t.size - 1))
        others = self.exact.gains.field * (1 - np.eye(m))
        for steps, t, logged, states in self._blocks():
            d = np.abs(hermite_simpson_defect(self.exact, t, logged) - hermite_simpson_defect(self.exact, t, states))
            defects[:, steps] = np.maximum(d - np.diff(t) / 6 * (others @ d), 0)
        return defects

    @cached_property
    def imbalance(self) -> tuple[Array, float]:
        """V(t) - V(0) + the integral of sum k_i z_i^2 along the log, shape (rows,), which is 0 for a solution;
        and by how much the quadrature misses the integral between any two rows of the exact solution.
        """
        t = self.trajectory.t
        logged, exact, true_V = np.zeros(t.size), np.zeros(t.size), np.zeros(t.size)
        for steps, times, states, true_states in self._blocks():
            rows = slice(steps.start + 1, steps.stop + 1)
            logged[rows] = corrected_trapezoid(self.exact, times, states)
            exact[rows] = corrected_trapezoid(self.exact, times, true_states)
            true_V[steps.start : steps.stop + 1] = self.exact.lyapunov(times, true_states)
        missed = true_V + np.cumsum(exact)
        return self.V - self.V[0] + np.cumsum(logged), float(np.ptp(missed))

    def _blocks(self) -> Iterator[tuple[slice, Array, Array, Array]]:
        """Steps, and for the rows at their ends: times, logged states, exact states."""
        t, states = self.trajectory.t, self.trajectory.states
        for first in range(0, t.size - 1, BLOCK):
            last = min(first + BLOCK, t.size - 1)
            rows = slice(first, last + 1)
            yield slice(first, last), t[rows], states[:, rows], states[:, rows] - self.deviation[:, rows]


# ---- Formulas on the steps between rows ----


def quintic_midway(exact: Exact, t: Array, states: Array) -> Array:
    """The quintic Hermite polynomials of the steps, at their middles; shape (m, rows - 1)."""
    h, slope, curvature = np.diff(t), exact.first(t, states), exact.second(t, states)
    middle: Array = (
        (states[:, :-1] + states[:, 1:]) / 2
        + 5 * h / 32 * (slope[:, :-1] - slope[:, 1:])
        + h**2 / 64 * (curvature[:, :-1] + curvature[:, 1:])
    )
    return middle


def hermite_simpson_defect(exact: Exact, t: Array, states: Array) -> Array:
    """What each step misses of Simpson's rule for state' on the cubic Hermite polynomial, O(h^5); (m, rows - 1)."""
    h, slope = np.diff(t), exact.first(t, states)
    middle = (states[:, :-1] + states[:, 1:]) / 2 + h / 8 * (slope[:, :-1] - slope[:, 1:])
    simpson = slope[:, :-1] + 4 * exact.first(t[:-1] + h / 2, middle) + slope[:, 1:]
    defect: Array = np.diff(states) - h / 6 * simpson
    return defect


def corrected_trapezoid(exact: Exact, t: Array, states: Array) -> Array:
    """The integral of sum k_i z_i^2 over each step by values and slopes at its ends, O(h^5); (rows - 1,)."""
    h, (rate, slope) = np.diff(t), exact.dissipation(t, states)
    integral: Array = h / 2 * (rate[:-1] + rate[1:]) + h**2 / 12 * (slope[:-1] - slope[1:])
    return integral


def interpolate(trajectory: Trajectory, exact: Exact, times: Array, states: Array | None = None) -> Array:
    """The states at other times, shape (m, times), by quintic Hermite polynomials through state, state' and state''.

    `states`, shape (m, rows), stand in for the trajectory's own where given.
    """
    t, y = trajectory.t, trajectory.states if states is None else states
    i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, t.size - 2)
    slope, curvature = exact.first(t, y), exact.second(t, y)
    h = t[i + 1] - t[i]
    s = (times - t[i]) / h
    q = 1 - s
    left = y[:, i] * (1 + 3 * s + 6 * s**2) + h * slope[:, i] * s * (1 + 3 * s) + h**2 * curvature[:, i] * s**2 / 2
    i = i + 1
    right = y[:, i] * (1 + 3 * q + 6 * q**2) - h * slope[:, i] * q * (1 + 3 * q) + h**2 * curvature[:, i] * q**2 / 2
    value: Array = q**3 * left + s**3 * right
    return value


def interpolation_error(trajectory: Trajectory, exact: Exact, times: Array) -> float:
    """The largest |error| of `interpolate` at these times, given the exact solution at this trajectory's rows."""
    drawn = interpolate(trajectory, exact, times, exact.evaluate(trajectory.t))
    return float(np.abs(drawn - exact.evaluate(times)).max())
