# SPDX-License-Identifier: MIT
# Written by: python -m conformance.truth.experiment
"""The closed loop of the lesson's plant under the controller derived for it; `experiment` derived what stands here.

Each function gives a list of arrays, or numbers, from t (s), the states and the parameters; r is a sine or a cosine.
"""

from typing import Any

from numpy import cos, sin

from conformance.truth.piecewise import Floats


def reference_sin(
    t: Floats, theta: float, k1: float, k2: float, gamma: float, amplitude: float, omega: float, phase: float
) -> list[Any]:
    return [amplitude * sin(omega * t + phase)]


def control_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = -k1 - theta_hat
    x3 = theta_hat * x1
    x4 = omega * t + phase
    x5 = amplitude * omega * cos(x4)
    x6 = amplitude * sin(x4)
    x7 = -x1 + x6
    x8 = -x7
    x9 = k1 * x8 + x2 + x3 - x5
    return [-gamma * x1 * (-x0 * x1 * x9 + x1 * x8) + k1 * x5 - k2 * x9 - omega**2 * x6 + x0 * x2 + x0 * x3 + x7]


def first_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = -k1 - theta_hat
    x3 = theta_hat * x1
    x4 = omega * t + phase
    x5 = amplitude * omega * cos(x4)
    x6 = amplitude * sin(x4)
    x7 = -x1 + x6
    x8 = -x7
    x9 = k1 * x8 + x2 + x3 - x5
    x10 = gamma * (-x0 * x1 * x9 + x1 * x8)
    return [theta * x1 + x2, k1 * x5 - k2 * x9 - omega**2 * x6 + x0 * x2 + x0 * x3 - x1 * x10 + x7, x10]


def second_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = theta * x1 + x2
    x3 = k1 + theta_hat
    x4 = -x3
    x5 = omega * t + phase
    x6 = amplitude * sin(x5)
    x7 = -x1 + x6
    x8 = -x7
    x9 = amplitude * cos(x5)
    x10 = omega * x9
    x11 = -x10
    x12 = theta_hat * x1
    x13 = x12 + x2
    x14 = k1 * x8 + x11 + x13
    x15 = x14 * x4
    x16 = -x1 * x15 + x1 * x8
    x17 = gamma * x16
    x18 = omega**2 * x6
    x19 = k1 * x10 - x18
    x20 = -k2 * x14 - x1 * x17 + x12 * x4 + x19 + x2 * x4 + x7
    x21 = -x19
    x22 = x1 * x4
    x23 = gamma * (-x1 * x10 - x21 * x22)
    x24 = x1**2
    x25 = x1 * x14 - x24 * x4
    x26 = gamma * x1
    x27 = 2 * x1 - x15 - x22 * x3 - x6
    return [
        theta * x0 + x20,
        gamma * x16 * (-k2 * x1 + x1 * x4 - x13 - x25 * x26)
        - k1 * x18
        - k2 * x21
        - omega**3 * x9
        + x0 * (-k2 * x3 + theta_hat * x4 - x17 - x26 * x27 - 1)
        - x1 * x23
        - x11
        + x20 * (gamma * x24 * x4 - k2 - x3),
        gamma**2 * x16 * x25 + gamma * x0 * x27 - gamma * x20 * x22 + x23,
    ]


def errors_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = -amplitude * sin(x0) + x1
    return [x3, -amplitude * omega * cos(x0) + k1 * x3 + theta_hat * x1 + x2]


def lyapunov_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = -amplitude * sin(x0) + x1
    return [
        (1 / 2) * x3**2
        + (1 / 2) * (-amplitude * omega * cos(x0) + k1 * x3 + theta_hat * x1 + x2) ** 2
        + (1 / 2) * (-theta + theta_hat) ** 2 / gamma
    ]


def dissipation_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = sin(x0)
    x4 = amplitude * x3
    x5 = -x1 + x4
    x6 = -x5
    x7 = theta_hat * x1
    x8 = amplitude * omega * cos(x0)
    x9 = k1 * x6
    x10 = x2 + x7 - x8 + x9
    x11 = 2 * x9
    x12 = 2 * k1
    x13 = omega**2
    x14 = k2 * x10
    x15 = -k1 - theta_hat
    x16 = gamma * (-x1 * x10 * x15 + x1 * x6)
    return [
        k1 * x6**2 + k2 * x10**2,
        k2 * (x11 + 2 * x2 + 2 * x7 - 2 * x8) * (k1 * x8 - x1 * x16 - x13 * x4 - x14 + x15 * x2 + x15 * x7 + x5)
        + 2 * x1 * x14 * x16
        - x11 * x8
        + x14 * (2 * amplitude * x13 * x3 - x12 * x8)
        + (k1 * (2 * x1 - 2 * x4) + x14 * (2 * theta_hat + x12)) * (theta * x1 + x2),
    ]


def gradients_sin(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = k1 + theta_hat
    x3 = -x0
    x4 = omega * t + phase
    x5 = amplitude * sin(x4)
    x6 = x1 - x5
    x7 = k1 * x6
    x8 = amplitude * omega * cos(x4)
    x9 = theta_hat * x1
    x10 = x2 + x9
    x11 = x10 + x7 - x8
    x12 = x11 * x3
    x13 = -2 * x1
    x14 = x1 * x3
    x15 = gamma * (-x0 * x14 - x12 - x13 - x5)
    x16 = x1**2
    x17 = gamma * (x1 * x11 - x16 * x3)
    x18 = x11 * (2 * k1 + 2 * theta_hat)
    return [
        theta,
        1,
        0,
        -gamma * (-x1 * x12 + x1 * x6) - k2 * x0 + theta_hat * x3 - x1 * x15 - 1,
        gamma * x16 * x3 - k2 - x0,
        -k2 * x1 - x1 * x17 + x1 * x3 - x10,
        x15,
        -gamma * x14,
        x17,
        1,
        0,
        0,
        x0,
        1,
        x1,
        x1 + (1 / 2) * x18 - x5,
        x11,
        x1 * x11 + (1 / 2) * (-2 * theta + 2 * theta_hat) / gamma,
        k1 * (-x13 - 2 * x5) + k2 * x18,
        k2 * (2 * x2 + 2 * x7 - 2 * x8 + 2 * x9),
        2 * k2 * x1 * x11,
    ]


def reference_cos(
    t: Floats, theta: float, k1: float, k2: float, gamma: float, amplitude: float, omega: float, phase: float
) -> list[Any]:
    return [amplitude * cos(omega * t + phase)]


def control_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = amplitude * cos(x0)
    x4 = -k1 - theta_hat
    x5 = amplitude * omega * sin(x0)
    x6 = x1 - x3
    x7 = k1 * x6 + theta_hat * x1 + x2 + x5
    return [
        -gamma * x1 * (-x1 * x4 * x7 + x1 * x6)
        - k1 * x5
        - k2 * x7
        - omega**2 * x3
        + theta_hat * x1 * x4
        - x1
        + x2 * x4
        + x3
    ]


def first_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = amplitude * cos(x0)
    x4 = -k1 - theta_hat
    x5 = amplitude * omega * sin(x0)
    x6 = x1 - x3
    x7 = k1 * x6 + theta_hat * x1 + x2 + x5
    x8 = gamma * (-x1 * x4 * x7 + x1 * x6)
    return [theta * x1 + x2, -k1 * x5 - k2 * x7 - omega**2 * x3 + theta_hat * x1 * x4 - x1 * x8 - x1 + x2 * x4 + x3, x8]


def second_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = theta * x1 + x2
    x3 = omega * t + phase
    x4 = amplitude * cos(x3)
    x5 = x1 - x4
    x6 = sin(x3)
    x7 = amplitude * omega * x6
    x8 = theta_hat * x1 + x2
    x9 = k1 * x5 + x7 + x8
    x10 = k1 + theta_hat
    x11 = -x10
    x12 = x11 * x9
    x13 = -x1 * x12 + x1 * x5
    x14 = gamma * x13
    x15 = omega**2 * x4
    x16 = k1 * x7 + x15
    x17 = k2 * x9 - theta_hat * x1 * x11 + x1 * x14 + x1 - x11 * x2 + x16 - x4
    x18 = x1 * x11
    x19 = gamma * (x1 * x7 - x16 * x18)
    x20 = x1**2
    x21 = x1 * x9 - x11 * x20
    x22 = gamma * x1
    x23 = 2 * x1 - x10 * x18 - x12 - x4
    x24 = -x17
    return [
        theta * x0 - x17,
        amplitude * omega**3 * x6
        + gamma * x13 * (-k2 * x1 + x1 * x11 - x21 * x22 - x8)
        - k1 * x15
        - k2 * x16
        + x0 * (-k2 * x10 + theta_hat * x11 - x14 - x22 * x23 - 1)
        - x1 * x19
        + x24 * (gamma * x11 * x20 - k2 - x10)
        - x7,
        gamma**2 * x13 * x21 + gamma * x0 * x23 - gamma * x18 * x24 + x19,
    ]


def errors_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = -amplitude * cos(x0) + x1
    return [x3, amplitude * omega * sin(x0) + k1 * x3 + theta_hat * x1 + x2]


def lyapunov_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = -amplitude * cos(x0) + x1
    return [
        (1 / 2) * x3**2
        + (1 / 2) * (amplitude * omega * sin(x0) + k1 * x3 + theta_hat * x1 + x2) ** 2
        + (1 / 2) * (-theta + theta_hat) ** 2 / gamma
    ]


def dissipation_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = omega * t + phase
    x3 = amplitude * cos(x0)
    x4 = x1 - x3
    x5 = theta_hat * x1
    x6 = amplitude * omega * sin(x0)
    x7 = k1 * x4
    x8 = x2 + x5 + x6 + x7
    x9 = 2 * x7
    x10 = 2 * k1
    x11 = omega**2
    x12 = 2 * x3
    x13 = k2 * x8
    x14 = -k1 - theta_hat
    x15 = gamma * (-x1 * x14 * x8 + x1 * x4)
    return [
        k1 * x4**2 + k2 * x8**2,
        k2
        * (2 * x2 + 2 * x5 + 2 * x6 + x9)
        * (-k1 * x6 + theta_hat * x1 * x14 - x1 * x15 - x1 - x11 * x3 - x13 + x14 * x2 + x3)
        + 2 * x1 * x13 * x15
        + x13 * (x10 * x6 + x11 * x12)
        + x6 * x9
        + (k1 * (2 * x1 - x12) + x13 * (2 * theta_hat + x10)) * (theta * x1 + x2),
    ]


def gradients_cos(
    t: Floats,
    x1: Floats,
    x2: Floats,
    theta_hat: Floats,
    theta: float,
    k1: float,
    k2: float,
    gamma: float,
    amplitude: float,
    omega: float,
    phase: float,
) -> list[Any]:
    x0 = k1 + theta_hat
    x3 = -x0
    x4 = omega * t + phase
    x5 = amplitude * cos(x4)
    x6 = x1 - x5
    x7 = k1 * x6
    x8 = amplitude * omega * sin(x4)
    x9 = theta_hat * x1
    x10 = x2 + x9
    x11 = x10 + x7 + x8
    x12 = x11 * x3
    x13 = -2 * x1
    x14 = x1 * x3
    x15 = gamma * (-x0 * x14 - x12 - x13 - x5)
    x16 = x1**2
    x17 = gamma * (x1 * x11 - x16 * x3)
    x18 = x11 * (2 * k1 + 2 * theta_hat)
    return [
        theta,
        1,
        0,
        -gamma * (-x1 * x12 + x1 * x6) - k2 * x0 + theta_hat * x3 - x1 * x15 - 1,
        gamma * x16 * x3 - k2 - x0,
        -k2 * x1 - x1 * x17 + x1 * x3 - x10,
        x15,
        -gamma * x14,
        x17,
        1,
        0,
        0,
        x0,
        1,
        x1,
        x1 + (1 / 2) * x18 - x5,
        x11,
        x1 * x11 + (1 / 2) * (-2 * theta + 2 * theta_hat) / gamma,
        k1 * (-x13 - 2 * x5) + k2 * x18,
        k2 * (2 * x2 + 2 * x7 + 2 * x8 + 2 * x9),
        2 * k2 * x1 * x11,
    ]
