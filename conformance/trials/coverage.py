# SPDX-License-Identifier: MIT
"""Experiments of a program's own: drawn by a seed that follows from its source, and of those the ones that go furthest.

A program cannot hold answers to experiments that follow from its text, nor be right only where the lesson goes.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt

from conformance.judging.verdict import Judgement, Verdict
from conformance.programs.ports import SIX, Port
from conformance.theory.experiments import Experiment, values_of
from conformance.theory.lesson import LESSON
from conformance.trials.campaign import FOLDER, RANGES, Outcome, Trial, carry_out, draw, prepare, prove, trial
from conformance.truth.exact import functions_of

Floats = npt.NDArray[np.float64]
DRAWN = 256  # of which a few are taken
HORIZON = Fraction(RANGES["horizon"][0])  # s: the transient, where every term counts
STEP = 0.01  # s, of a rough simulation, which says where an experiment leads


OWN = 3  # experiments in the verdict on a port that is not one of the six


def with_own_experiments(judgement: Judgement, ports: Mapping[str, Port]) -> Judgement:
    """The judgement, in which a port that is not one of the six must pass experiments of its own too."""
    return replace(judgement, verdicts=tuple(_tried(verdict, ports) for verdict in judgement.verdicts))


def _tried(verdict: Verdict, ports: Mapping[str, Port]) -> Verdict:
    if verdict.name in SIX or verdict.name not in ports or not verdict.conforms:
        return verdict
    try:
        outcomes = [carry_out(one, prove(one.experiment)) for one in own_trials(ports[verdict.name], OWN)]
    except ValueError as error:  # an edit that does not apply
        return replace(verdict, status="error", reason=f"experiments of its own: {error}")
    failed = [outcome for outcome in outcomes if outcome.status != "pass"]
    if not failed:
        return verdict
    return replace(verdict, status="fail", reason="\n".join(map(_told, failed)))


def _told(outcome: Outcome) -> str:
    return f"on an experiment of its own ({FOLDER.name}/{outcome.scenario}/experiment.toml): {outcome.reason}"


def own_trials(port: Port, count: int, folder: Path = FOLDER) -> list[Trial]:
    """A program on the experiments that follow from its source."""
    program = prepare(port)
    return [trial(experiment, program, folder) for experiment in own_experiments(port, count)]


def own_experiments(port: Port, count: int) -> tuple[Experiment, ...]:
    """The experiments that follow from a program's source."""
    return furthest(own_seed(port), count)


def own_seed(port: Port) -> int:
    """The seed that follows from a program's source."""
    return int(port.source_hash()[:15], 16)


@functools.cache
def furthest(seed: int, count: int) -> tuple[Experiment, ...]:
    """Of the first experiments of a seed, cut short, those that most extend what states, estimates and u have reached.

    The lesson's own experiment has reached its ranges before; each that is taken adds its own.
    """
    drawn = [replace(draw(seed, number), horizon=HORIZON) for number in range(DRAWN)]
    lowest, highest = extremes(drawn)
    (low,), (high,) = extremes([LESSON])
    width = high - low
    taken: list[int] = []
    for _ in range(count):
        more = np.maximum(low - lowest, 0) + np.maximum(highest - high, 0)
        best = int(np.argmax((more / width).sum(axis=1) - 1e9 * np.isin(np.arange(DRAWN), taken)))
        taken.append(best)
        low, high = np.minimum(low, lowest[best]), np.maximum(high, highest[best])
    return tuple(drawn[number] for number in taken)


def extremes(experiments: Sequence[Experiment]) -> tuple[Floats, Floats]:
    """The least and greatest states, estimates and u of each experiment over HORIZON, shapes (experiments, m + 1)."""
    low, high = np.zeros((2, len(experiments), len(LESSON.names) + 1))
    for reference in {experiment.reference for experiment in experiments}:
        chosen = [number for number, experiment in enumerate(experiments) if experiment.reference == reference]
        paths = simulated([experiments[number] for number in chosen])
        low[chosen], high[chosen] = paths.min(axis=0), paths.max(axis=0)
    return low, high


def simulated(some: Sequence[Experiment]) -> Floats:
    """States, estimates and u of experiments of one family, shape (steps + 1, experiments, m + 1), by classical RK4."""
    functions, all_values = functions_of(some[0]), list(map(values_of, some))
    values = {name: np.array([float(one[name]) for one in all_values]) for name in all_values[0]}
    state = np.array([values[f"{name}_start"] for name in some[0].names])

    def slope(t: float, y: Floats) -> Floats:
        return functions("first", values, np.full(len(some), t), y)

    paths = []
    for number in range(round(float(HORIZON) / STEP) + 1):
        t = number * STEP
        paths.append(np.vstack([state, functions("control", values, np.full(len(some), t), state)]).T)
        s1 = slope(t, state)
        s2 = slope(t + STEP / 2, state + STEP / 2 * s1)
        s3 = slope(t + STEP / 2, state + STEP / 2 * s2)
        s4 = slope(t + STEP, state + STEP * s3)
        state = state + STEP / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
    whole: Floats = np.nan_to_num(np.array(paths))
    return whole
