# SPDX-License-Identifier: MIT
"""The equations of the lesson's steps, in LaTeX."""

from fractions import Fraction

from conformance.scenario import LESSON, Scenario

ALPHA1_X1 = r"\frac{\partial\alpha_1}{\partial x_1}"
EQUATIONS = {
    "notation": (r"\dot x_1 = x_2 + \theta x_1, \quad \dot x_2 = u, \quad y = x_1",),
    "reference": (
        r"r = A \sin\omega t, \quad \dot r = A \omega \cos\omega t, \quad \ddot r = -A \omega^2 \sin\omega t",
    ),
    "virtual-control": (r"z_1 = x_1 - r", r"\alpha_1 = -k_1 z_1 - \hat\theta x_1 + \dot r"),
    "tuning-function": (
        r"z_2 = x_2 - \alpha_1",
        ALPHA1_X1 + r" = -k_1 - \hat\theta",
        r"\tau_2 = x_1 z_1 - " + ALPHA1_X1 + r" x_1 z_2",
    ),
    "update-law": (r"\dot{\hat\theta} = \gamma \tau_2",),
    "control": (
        r"\dot\alpha_1^{\text{known}} = " + ALPHA1_X1 + r" (x_2 + \hat\theta x_1) + k_1 \dot r + \ddot r",
        r"u = \dot\alpha_1^{\text{known}} - z_1 - k_2 z_2 - x_1 \dot{\hat\theta}",
    ),
    "plant": (r"\dot x_1 = x_2 + \theta x_1", r"\dot x_2 = u"),
    "integration": (
        rf"x_1(0) = {float(LESSON.x1_start):g}, \quad x_2(0) = {float(LESSON.x2_start):g}, "
        rf"\quad \hat\theta(0) = {float(LESSON.theta_hat_start):g}, "
        rf"\quad 0 \le t \le {float(LESSON.horizon):g} \text{{ s}}",
    ),
    "csv": (r"t, \; x_1, \; x_2, \; \hat\theta, \; r, \; z_1 = x_1 - r",),
    "report": (r"z_1(T), \quad \hat\theta(T), \quad \theta",),
}
SYMBOLS = {  # of the parameters (10)
    "theta": r"\theta",
    "k1": "k_1",
    "k2": "k_2",
    "gamma": r"\gamma",
    "amplitude": "A",
    "omega": r"\omega",
}


def parameter_values(scenario: Scenario) -> tuple[str, ...]:
    """The parameters and their values."""

    def value(number: Fraction) -> str:
        return f"{float(number):g}"

    return (r", \quad ".join(f"{symbol} = {value(getattr(scenario, name))}" for name, symbol in SYMBOLS.items()),)
