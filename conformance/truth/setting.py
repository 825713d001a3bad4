# SPDX-License-Identifier: MIT
"""An experiment in doubles, as the checks need it: names, gains, true parameters, start and horizon."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from conformance.theory.scenario import Scenario
from conformance.truth.piecewise import Floats

if TYPE_CHECKING:  # it needs SymPy, and the lesson's kept proofs do not
    from conformance.theory.experiments import Experiment


@dataclass(frozen=True, eq=False)
class Setting:
    """The numbers of an experiment of n states and p unknown parameters, whose names are `states` and `unknown`.

    k: (n,). Gamma: (p, p). theta: (p,), the true values. start: (n + p,), of states and `estimates`. horizon: s.
    """

    states: tuple[str, ...]
    unknown: tuple[str, ...]
    estimates: tuple[str, ...]
    k: Floats
    Gamma: Floats
    theta: Floats
    start: Floats
    horizon: float

    @property
    def names(self) -> tuple[str, ...]:
        """Of the states, and behind them the estimates."""
        return self.states + self.estimates

    @property
    def n(self) -> int:
        """How many states the plant has."""
        return len(self.states)

    @property
    def p(self) -> int:
        """How many unknown parameters the plant has."""
        return len(self.unknown)


def setting_of(experiment: Scenario | Experiment) -> Setting:
    """The numbers of an experiment; a scenario is one of the lesson's plant."""
    if isinstance(experiment, Scenario):
        e = experiment
        start = _row((e.x1_start, e.x2_start, e.theta_hat_start))
        k, Gamma, theta = _row((e.k1, e.k2)), _row([e.gamma])[None], _row([e.theta])
        return Setting(("x1", "x2"), ("theta",), ("theta_hat",), k, Gamma, theta, start, float(e.horizon))
    p = len(experiment.unknown)
    return Setting(
        experiment.states,
        tuple(parameter.name for parameter in experiment.unknown),
        experiment.estimates,
        _row(experiment.k),
        _row(gain for row in experiment.Gamma for gain in row).reshape(p, p),
        _row(parameter.true for parameter in experiment.unknown),
        _row((*experiment.start, *(parameter.start for parameter in experiment.unknown))),
        float(experiment.horizon),
    )


def _row(numbers: Iterable[Fraction]) -> Floats:
    return np.array([float(number) for number in numbers])
