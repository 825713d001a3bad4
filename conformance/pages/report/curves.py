# SPDX-License-Identifier: MIT
"""The curves of the page, thinned to one grid for all programs."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from conformance.judging.trajectory import STATES, Array, Trajectory
from conformance.truth.exact import Exact

GRID = np.concatenate([np.linspace(0, 0.2, 400, endpoint=False), np.linspace(0.2, 1, 601)])  # shares of the horizon


@dataclass(frozen=True)
class Panel:
    """A chart: a signal of every program, its formula (LaTeX), its axis, and what is drawn beside it."""

    signal: str
    formula: str
    axis: str
    beside: str = ""
    logarithmic: bool = False


X1 = Panel("x1", r"x_1 \text{ and } r", "x₁, r", beside="reference")
Z1 = Panel("z1", r"z_1 = x_1 - r", "z₁")
ESTIMATE = Panel("theta_hat", r"\hat\theta \text{ and } \theta", "θ̂, θ (1/s)", beside="theta")
LYAPUNOV = Panel(
    "V", r"V = \tfrac{1}{2} (z_1^2 + z_2^2 + \tfrac{1}{\gamma} (\hat\theta - \theta)^2)", "V", logarithmic=True
)
PANELS = (
    X1,
    Panel("x2", r"x_2", "x₂ (1/s)"),
    Z1,
    Panel("z2", r"z_2 = x_2 - \alpha_1", "z₂ (1/s)"),
    ESTIMATE,
    Panel("u", r"u", "u (1/s²)"),
    LYAPUNOV,
    Panel("V_dot", r"\dot V = -k_1 z_1^2 - k_2 z_2^2", "V̇ (1/s)"),
)
ERROR_PANELS = (
    Panel("error_x1", r"|x_1 - x_1^{\text{exact}}|", "error of x₁", "tolerance", True),
    Panel("error_x2", r"|x_2 - x_2^{\text{exact}}|", "error of x₂ (1/s)", "tolerance", True),
    Panel("error_theta_hat", r"|\hat\theta - \hat\theta^{\text{exact}}|", "error of θ̂ (1/s)", "tolerance", True),
)


def signals(exact: Exact, t: Array, states: Array) -> dict[str, Array]:
    """Every signal of PANELS by name, from times, shape (rows,), and states, shape (3, rows)."""
    z1, z2 = exact.errors(t, states)
    return {
        **dict(zip(STATES, states, strict=True)),
        "z1": z1,
        "z2": z2,
        "u": exact.control(t, states),
        "V": exact.lyapunov(t, states),
        "V_dot": -exact.dissipation(t, states)[0],
    }


def curves(exact: Exact, trajectory: Trajectory) -> dict[str, Array]:
    """The signals on the grid, on straight lines between rows; of the errors the largest in each interval of the grid.

    An interval without a row gives NaN.
    """
    t, states = trajectory.t, trajectory.states
    grid = GRID * float(exact.scenario.horizon)
    off = np.abs(states - exact.evaluate(t))
    edges = [*np.searchsorted(t, grid), t.size]
    largest = [off[:, i:j].max(axis=1) if j > i else np.full(len(STATES), np.nan) for i, j in pairwise(edges)]
    with np.errstate(over="ignore", invalid="ignore"):  # a program that failed may have left anything
        drawn = {name: np.interp(grid, t, values) for name, values in signals(exact, t, states).items()}
    return drawn | {f"error_{name}": row for name, row in zip(STATES, np.transpose(largest), strict=True)}


def exact_curves(exact: Exact) -> dict[str, Array]:
    """The signals of the exact solution on the grid, and the reference."""
    grid = GRID * float(exact.scenario.horizon)
    return {**signals(exact, grid, exact.evaluate(grid)), "reference": exact.reference(grid)}


def packed(values: Mapping[str, Array]) -> dict[str, str]:
    """The arrays in single precision, base64; what single precision cannot hold becomes NaN."""
    with np.errstate(over="ignore"):
        narrow = {name: array.astype("<f4") for name, array in values.items()}
    return {
        name: base64.b64encode(np.where(np.isfinite(array), array, np.nan).astype("<f4").tobytes()).decode()
        for name, array in narrow.items()
    }
