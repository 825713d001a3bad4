# SPDX-License-Identifier: MIT
"""The pictures of the exact solution: what the first screen shows, and the estimate without excitation."""

from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from conformance.pages.report.curves import GRID
from conformance.pages.report.picture import Line, picture
from conformance.places import PLANTS
from conformance.theory.derivation import letter
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import Experiment
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact

AIM, EXACT, OTHER = "var(--colour-1)", "var(--accent)", "var(--text)"  # what is to be met, the exact solution, another


class Figure(NamedTuple):
    """A picture with its caption (LaTeX), and the colour and name (LaTeX) of each line where there are several."""

    caption: str
    picture: Markup
    legend: tuple[tuple[str, str], ...] = ()


def opening(e: Experiment) -> list[Figure]:
    """The output meets the reference, the estimates move, V falls."""
    solution, t = exact(e), GRID * float(e.horizon)
    states = solution.evaluate(t)
    x = e.states[0]
    met = [Line(solution.reference(t), AIM, symbol="r"), Line(states[0], EXACT, symbol=x)]
    falls = [Line(solution.lyapunov(t, states), EXACT, symbol="V")]
    shown = [
        Figure(
            rf"{letter(x)} \text{{ meets }} r",
            picture(t, met, f"{x} and the reference r"),
            ((EXACT, letter(x)), (AIM, "r")),
        ),
        Figure(r"V \text{ falls}", picture(t, falls, "V falls over many decades", logarithmic=True)),
    ]
    if e.unknown:
        lines = [Line(np.full_like(t, float(q.true)), AIM, symbol=q.name) for q in e.unknown]
        lines += [Line(v, EXACT, symbol=name) for name, v in zip(e.estimates, states[len(e.states) :], strict=True)]
        names = [", ".join(map(letter, names)) for names in (e.estimates, [q.name for q in e.unknown])]
        finds = "finds" if e == LESSON else "and"  # whether it does is the experiment's, and no theorem
        words = f"the estimate of {', '.join(q.name for q in e.unknown)} beside the true value"
        caption, legend = rf"{names[0]} \text{{ {finds} }} {names[1]}", ((EXACT, names[0]), (AIM, names[1]))
        shown.insert(1, Figure(caption, picture(t, lines, words), legend))
    return shown


def at_rest(experiment: Experiment) -> dict[str, Any]:
    """What the estimate does with r = 0: where it stops, and a picture beside the lesson's run."""
    t = GRID * float(experiment.horizon)
    moving, stopped = exact(experiment).evaluate(t)[2], exact(as_written(PLANTS / "no_excitation.toml")).evaluate(t)[2]
    theta = np.full_like(t, float(experiment.unknown[0].true))
    lines = [
        Line(theta, AIM, symbol="theta"),
        Line(moving, EXACT, symbol="theta_hat"),
        Line(stopped, OTHER, symbol="theta_hat"),
    ]
    words = "with r = 0 the estimate stops above theta; with the lesson's r it comes to theta"
    return {
        "estimate": f"{stopped[-1]:.5g}",
        "theta": f"{float(experiment.unknown[0].true):g}",
        "picture": picture(t, lines, words),
        "legend": (
            (EXACT, r"\hat\theta,\ \text{the lesson's } r"),
            (OTHER, r"\hat\theta,\ r = 0"),
            (AIM, r"\theta"),
        ),
    }
