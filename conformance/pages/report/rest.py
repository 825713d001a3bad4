# SPDX-License-Identifier: MIT
"""The estimate without excitation, beside that of the lesson's run."""

from typing import Any

import numpy as np

from conformance.pages.report.curves import GRID
from conformance.pages.report.picture import Line, picture
from conformance.places import PLANTS
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import Experiment
from conformance.truth.exact import exact

EXACT, OTHER = "var(--accent)", "var(--second)"  # the lesson's run, another


def at_rest(experiment: Experiment) -> dict[str, Any]:
    """What the estimate does with r = 0: where it stops, and a picture beside the lesson's run."""
    t = GRID * float(experiment.horizon)
    moving, stopped = exact(experiment).evaluate(t)[2], exact(as_written(PLANTS / "no_excitation.toml")).evaluate(t)[2]
    theta = np.full_like(t, float(experiment.unknown[0].true))
    lines = [
        Line(theta, "var(--quiet)", 1.25, "4 4", symbol="theta"),
        Line(moving, EXACT, symbol="theta_hat"),
        Line(stopped, OTHER, symbol="theta_hat"),
    ]
    words = "with r = 0 the estimate stops above theta; with the lesson's r it comes to theta"
    return {
        "estimate": f"{stopped[-1]:.5g}",
        "theta": f"{float(experiment.unknown[0].true):g}",
        "picture": picture(t, lines, words),
        "legend": (
            ("line-0", r"\hat\theta,\ \text{the lesson's } r"),
            ("line-1", r"\hat\theta,\ r = 0"),
            ("beside", r"\theta"),
        ),
    }
