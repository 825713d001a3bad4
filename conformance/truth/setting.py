# SPDX-License-Identifier: MIT
"""An experiment in doubles, as the checks need it: names, gains, true parameters, start and horizon."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from conformance.theory.experiments import Experiment, starts_of
from conformance.truth.piecewise import Floats


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


def setting_of(experiment: Experiment) -> Setting:
    """The numbers of an experiment."""
    p = len(experiment.unknown)
    return Setting(
        experiment.states,
        experiment.parameters,
        experiment.estimates,
        _row(experiment.k),
        _row(gain for row in experiment.Gamma for gain in row).reshape(p, p),
        _row(parameter.true for parameter in experiment.unknown),
        _row(starts_of(experiment).values()),
        float(experiment.horizon),
    )


def _row(numbers: Iterable[Fraction]) -> Floats:
    return np.array([float(number) for number in numbers])
