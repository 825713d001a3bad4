# SPDX-License-Identifier: MIT
"""An experiment, (10): the lesson's closed loop under given parameters, reference, start and horizon."""

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True)
class Scenario:
    """Parameters of the lesson's experiment, exact: a decimal is what it says, not its double.

    theta, k1 and k2 in 1/s; r(t) = amplitude sin(omega t), omega in rad/s; horizon in s.
    """

    theta: Fraction = Fraction("1.2")
    k1: Fraction = Fraction("2")
    k2: Fraction = Fraction("2.5")
    gamma: Fraction = Fraction("3")
    amplitude: Fraction = Fraction("0.5")
    omega: Fraction = Fraction("0.7")
    x1_start: Fraction = Fraction("1.2")
    x2_start: Fraction = Fraction("-0.5")
    theta_hat_start: Fraction = Fraction("0")
    horizon: Fraction = Fraction("20")


SCENARIOS = {"lesson": Scenario()}
LESSON = SCENARIOS["lesson"]


def scenario_named(name: str) -> Scenario:
    """The scenario of that name; raises ValueError where there is none."""
    if name not in SCENARIOS:
        raise ValueError(f"--scenario: found {name!r}, expected one of {', '.join(SCENARIOS)}")
    return SCENARIOS[name]
