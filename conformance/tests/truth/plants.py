# SPDX-License-Identifier: MIT
"""Closed loops of other plants than the lesson's, mild ones and harsh ones, as initial-value problems.

Mild: k_i = 1, Gamma = I, theta_i = 1/2, the start as given. Harsh: k_i = 3, Gamma = 2 I, theta_i = 3/2, start doubled.
The reference is sin(t) / 2, the estimates start from 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import sympy as sp

from conformance.theory.design import ClosedLoop, closed_loop, tuning_functions
from conformance.theory.strict_feedback import TIME, Plant, strict_feedback
from conformance.truth.truth import InitialValueProblem

R = sp.Rational
HORIZON = R(10)  # s


@dataclass(frozen=True)
class Kind:
    """The gains k_i, the adaptation gain as a multiple of the unit matrix, theta_i, and a factor of the start."""

    k: int
    Gamma: int
    theta: sp.Rational
    start: int


MILD, HARSH = Kind(1, 1, R(1, 2), 1), Kind(3, 2, R(3, 2), 2)

PLANTS = {  # rows, and the start of the states
    "chain of three, problem 1(c)": ("x2 + theta1*x1**3", "x3 + theta2*x1*x2", "u", "1/4", "0", "0"),
    "example of the 1992 paper": ("x2 + theta1*x1**2", "x3", "u", "1/4", "0", "0"),
    "wing rock with actuator, p = 4": (
        "x2", "x3 + theta1*x1 + theta2*x2 + theta3*x1**2*x2 + theta4*x1*x2**2", "u - 2*x3", "2/5", "0", "0",
    ),
    "wing rock with actuator, p = 5": (
        "x2", "x3 + theta1*x1 + theta2*x2 + theta3*x1**2*x2 + theta4*x1*x2**2 + theta5*x1**3", "u - 2*x3",
        "2/5", "0", "0",
    ),
    "pendulum with motor": ("x2", "x3 - theta1*sin(x1) - theta2*x2", "u - x3", "1/2", "0", "0"),
    "chain of four": ("x2 + theta1*x1**2", "x3", "x4 + theta2*x3", "u", "1/8", "0", "0", "0"),
    "levitation": ("x2", "x3 - theta1*x2", "x4 + theta2*x1*x3", "u - x4", "1/4", "0", "0", "0"),
}  # fmt: skip


@cache
def loop(name: str, kind: Kind) -> ClosedLoop:
    """A plant under the controller designed for it."""
    rows = PLANTS[name][: len(PLANTS[name]) // 2]
    n = len(rows)
    x, u = sp.symbols(f"x1:{n + 1}"), sp.Symbol("u")
    rhs = tuple(sp.sympify(row) for row in rows)
    theta = tuple(sorted({s for row in rhs for s in row.free_symbols} - {*x, u}, key=str))
    plant = strict_feedback(Plant(x, u, theta, rhs))
    design = tuning_functions(plant, [kind.k] * n, kind.Gamma * sp.eye(len(theta)))
    return closed_loop(design, [kind.theta] * len(theta), sp.sin(TIME) / 2)


def problem(name: str, kind: Kind) -> InitialValueProblem:
    """The closed loop of a plant from its start, the estimates from 0."""
    closed = loop(name, kind)
    given = [kind.start * R(value) for value in PLANTS[name][len(PLANTS[name]) // 2 :]]
    start = (*given, *(R(0) for _ in closed.states[len(given) :]))
    return InitialValueProblem(closed.time, closed.states, closed.rhs, start, HORIZON, closed.definitions)
