# SPDX-License-Identifier: MIT
"""The equations of the lesson's steps, in LaTeX."""

from conformance.theory.scenario import Scenario

ALPHA1_X1 = r"\frac{\partial\alpha_1}{\partial x_1}"
EQUATIONS = {
    "notation": (r"\dot x_1 = x_2 + \theta x_1, \quad \dot x_2 = u, \quad y = x_1",),
    "reference": (
        r"r = A \sin\omega t, \quad \dot r = A \omega \cos\omega t, \quad \ddot r = -A \omega^2 \sin\omega t",
    ),
    "virtual-control": (r"\varphi = x_1", r"z_1 = x_1 - r", r"\alpha_1 = -k_1 z_1 - \hat\theta \varphi + \dot r"),
    "tuning-function": (
        r"z_2 = x_2 - \alpha_1",
        ALPHA1_X1 + r" = -k_1 - \hat\theta",
        r"\tau_2 = \varphi z_1 - " + ALPHA1_X1 + r" \varphi z_2",
    ),
    "update-law": (r"\dot{\hat\theta} = \gamma \tau_2",),
    "control": (
        r"\dot\alpha_1^{\text{known}} = " + ALPHA1_X1 + r" (x_2 + \hat\theta \varphi) + k_1 \dot r + \ddot r",
        r"u = \dot\alpha_1^{\text{known}} - z_1 - k_2 z_2 - \varphi \dot{\hat\theta}",
    ),
    "plant": (r"\dot x_1 = x_2 + \theta \varphi", r"\dot x_2 = u"),
    "csv": (r"t, \; x_1, \; x_2, \; \hat\theta, \; r, \; z_1 = x_1 - r",),
    "report": (r"z_1(T), \quad \hat\theta(T), \quad \theta",),
}
SYMBOLS = {  # of the parameters
    "theta": r"\theta",
    "k1": "k_1",
    "k2": "k_2",
    "gamma": r"\gamma",
    "amplitude": "A",
    "omega": r"\omega",
}


def equations(scenario: Scenario) -> dict[str, tuple[str, ...]]:
    """The equations of every step, by its key; parameters, start and horizon with the values of the scenario."""

    def value(name: str) -> str:
        return f"{float(getattr(scenario, name)):g}"

    start = {"x1_start": "x_1(0)", "x2_start": "x_2(0)", "theta_hat_start": r"\hat\theta(0)"}
    horizon = rf"0 \le t \le {value('horizon')} \text{{ s}}"
    return {
        **EQUATIONS,
        "parameters": tuple(f"{symbol} = {value(name)}" for name, symbol in SYMBOLS.items()),
        "integration": (*(f"{symbol} = {value(name)}" for name, symbol in start.items()), horizon),
    }
