# SPDX-License-Identifier: MIT
"""Initial-value problems for the tests: some with a closed solution, and the lesson's experiment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import sympy as sp
from flint import arb, fmpq

from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, InitialValueProblem

R = sp.Rational
TWENTY = R(20)
t, x, y = sp.symbols("t x y")


@dataclass(frozen=True)
class Closed:
    """A problem and its solution in closed form, a function from t to one ball per state."""

    problem: InitialValueProblem
    solution: Callable[[arb], tuple[arb, ...]]

    def lies_in(self, enclosed: Enclosure, count: int = 97) -> bool:
        """Whether the solution lies in the enclosure at equidistant times, most of them inside steps."""
        with precision(900):
            return all(self._lies_in(enclosed, fmpq(i, count)) for i in range(count + 1))

    def _lies_in(self, enclosed: Enclosure, share: fmpq) -> bool:
        time = R(int(share.p), int(share.q)) * self.problem.horizon
        balls = enclosed.at(time)
        wanted = self.solution(arb(fmpq(int(time.p), int(time.q))))
        return all(ball.contains(value) for ball, value in zip(balls, wanted, strict=True))


CLOSED = {
    "exponential growth": Closed(InitialValueProblem(t, (x,), (x,), (R(1),), R(20)), lambda s: (s.exp(),)),
    "exponential decay": Closed(InitialValueProblem(t, (x,), (-x,), (R(1),), R(20)), lambda s: ((-s).exp(),)),
    "harmonic oscillator": Closed(
        InitialValueProblem(t, (x, y), (y, -x), (R(1), R(0)), R(20)), lambda s: (s.cos(), -s.sin())
    ),
    "x' = x^2 up to near its pole": Closed(
        InitialValueProblem(t, (x,), (x**2,), (R(1),), R(999, 1000)), lambda s: (1 / (1 - s),)
    ),
    "logistic equation": Closed(
        InitialValueProblem(t, (x,), (x * (1 - x),), (R(1, 10),), R(20)), lambda s: (1 / (1 + 9 * (-s).exp()),)
    ),
    "non-autonomous": Closed(InitialValueProblem(t, (x,), (2 * t * x,), (R(1),), R(5, 2)), lambda s: ((s * s).exp(),)),
    "sine of the state": Closed(
        InitialValueProblem(t, (x,), (sp.sin(x),), (sp.S(1),), R(6)),
        lambda s: (2 * ((arb(1) / 2).tan() * s.exp()).atan(),),
    ),
    "square root": Closed(InitialValueProblem(t, (x,), (sp.sqrt(x),), (R(1),), R(3)), lambda s: ((1 + s / 2) ** 2,)),
    "quotient and logarithm": Closed(
        InitialValueProblem(t, (x, y), (1 / x, sp.log(1 + t)), (R(1), R(0)), R(3)),
        lambda s: ((1 + 2 * s).sqrt(), (1 + s) * (1 + s).log() - s),
    ),
    "arc tangent, hyperbolic tangent, power": Closed(
        InitialValueProblem(t, (x, y), (sp.atan(t), sp.tanh(t) + R(5, 3) * (1 + t) ** R(2, 3)), (R(0), R(1)), R(3)),
        lambda s: (s * s.atan() - (1 + s * s).log() / 2, s.cosh().log() + (1 + s) ** (arb(5) / 3)),
    ),
}


def lesson(horizon: sp.Rational = TWENTY) -> InitialValueProblem:
    """The lesson's closed loop (7) and experiment (10); z1, z2 and V by name."""
    time, x1, x2, theta_hat = sp.symbols("t x1 x2 theta_hat")
    theta, k1, k2, gamma = R("1.2"), R(2), R("2.5"), R(3)
    r = R("0.5") * sp.sin(R("0.7") * time)
    r_dot, r_ddot = sp.diff(r, time), sp.diff(r, time, 2)
    z1 = x1 - r
    alpha1 = -k1 * z1 - theta_hat * x1 + r_dot
    z2 = x2 - alpha1
    alpha1_x1 = -k1 - theta_hat
    theta_hat_dot = gamma * (x1 * z1 - alpha1_x1 * x1 * z2)
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot
    u = alpha1_dot_known - z1 - k2 * z2 - x1 * theta_hat_dot
    V = z1**2 / 2 + z2**2 / 2 + (theta_hat - theta) ** 2 / (2 * gamma)
    named = tuple((sp.Symbol(name), e) for name, e in (("z1", z1), ("z2", z2), ("V", V)))
    rhs = (x2 + theta * x1, u, theta_hat_dot)
    return InitialValueProblem(time, (x1, x2, theta_hat), rhs, (R("1.2"), R("-0.5"), R(0)), horizon, named)
