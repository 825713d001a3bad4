# SPDX-License-Identifier: MIT
"""The pictures of the exact solution: what the first screen shows, and the estimate without excitation."""

from typing import Any

import numpy as np
from markupsafe import Markup

from conformance.pages.report.curves import GRID
from conformance.pages.report.picture import Line, picture
from conformance.places import PLANTS
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import Experiment
from conformance.truth.exact import exact

AIM, EXACT = "var(--colour-1)", "var(--accent)"  # what is to be met, and the exact solution


def opening(experiment: Experiment) -> list[tuple[str, Markup]]:
    """(caption in LaTeX, picture): the output meets the reference, the estimate finds the parameter, V falls."""
    solution, t = exact(experiment), GRID * float(experiment.horizon)
    states = solution.evaluate(t)
    output = [Line(solution.reference(t), AIM), Line(states[0], EXACT)]
    estimate = [Line(np.full_like(t, float(experiment.unknown[0].true)), AIM), Line(states[2], EXACT)]
    lyapunov = [Line(solution.lyapunov(t, states), EXACT)]
    return [
        (r"x_1 \text{ meets } r", picture(t, output, "x1 comes to lie on the reference r")),
        (r"\hat\theta \text{ finds } \theta", picture(t, estimate, "the estimate theta_hat comes to theta")),
        (r"V \text{ falls}", picture(t, lyapunov, "V falls over many decades", logarithmic=True)),
    ]


def at_rest(experiment: Experiment) -> dict[str, Any]:
    """What the estimate does with r = 0: where it stops, and a picture beside the lesson's run."""
    t = GRID * float(experiment.horizon)
    moving, stopped = exact(experiment).evaluate(t)[2], exact(as_written(PLANTS / "no_excitation.toml")).evaluate(t)[2]
    theta = np.full_like(t, float(experiment.unknown[0].true))
    words = "with r = 0 the estimate stops above theta; with the lesson's r it comes to theta"
    return {
        "estimate": f"{stopped[-1]:.5g}",
        "theta": f"{float(experiment.unknown[0].true):g}",
        "picture": picture(t, [Line(theta, AIM), Line(moving, EXACT), Line(stopped, "var(--text)")], words),
    }
