# SPDX-License-Identifier: MIT
"""Scenarios of a program's own: drawn by a seed that follows from its source, and of those the ones that go furthest.

A program cannot hold answers to experiments that follow from its text, nor be right only where the lesson goes.
"""

import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import numpy.typing as npt

from conformance.judging.verdict import Judgement, Verdict
from conformance.programs.ports import SIX, Port
from conformance.theory.scenario import LESSON, PARAMETERS, RANGES, WAVES, Scenario
from conformance.trials.campaign import FOLDER, Outcome, Trial, carry_out, draw, prepare, prove, trial
from conformance.truth.exact import derived_functions

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
        outcomes = [carry_out(one, prove(one.scenario)) for one in own_trials(ports[verdict.name], OWN)]
    except ValueError as error:  # an edit that does not apply
        return replace(verdict, status="error", reason=f"experiments of its own: {error}")
    failed = [outcome for outcome in outcomes if outcome.status != "pass"]
    if not failed:
        return verdict
    return replace(verdict, status="fail", reason="\n".join(map(_told, failed)))


def _told(outcome: Outcome) -> str:
    return f"on an experiment of its own ({FOLDER.name}/{outcome.scenario}/scenario.toml): {outcome.reason}"


def own_trials(port: Port, count: int, folder: Path = FOLDER) -> list[Trial]:
    """A program on the experiments that follow from its source."""
    program = prepare(port)
    return [trial(scenario, program, folder) for scenario in own_scenarios(port, count)]


def own_scenarios(port: Port, count: int) -> tuple[Scenario, ...]:
    """The experiments that follow from a program's source."""
    return furthest(int(port.source_hash()[:15], 16), count)


@functools.cache
def furthest(seed: int, count: int) -> tuple[Scenario, ...]:
    """Of the first scenarios of a seed, cut short, those that most extend what x1, x2, theta_hat and u have reached.

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


def extremes(scenarios: Sequence[Scenario]) -> tuple[Floats, Floats]:
    """The least and greatest x1, x2, theta_hat and u of each scenario over HORIZON, shapes (scenarios, 4), roughly."""
    low, high = np.zeros((2, len(scenarios), 4))
    for wave in WAVES:
        chosen = [number for number, scenario in enumerate(scenarios) if scenario.wave == wave]
        if chosen:
            paths = simulated(wave, [scenarios[number] for number in chosen])
            low[chosen], high[chosen] = paths.min(axis=0), paths.max(axis=0)
    return low, high


def simulated(wave: str, scenarios: Iterable[Scenario]) -> Floats:
    """x1, x2, theta_hat and u of scenarios of one wave, shape (steps + 1, scenarios, 4), by classical RK4."""
    some, functions = list(scenarios), derived_functions(wave)
    given = {name: np.array([float(getattr(scenario, name)) for scenario in some]) for name in PARAMETERS}
    starts = ("x1_start", "x2_start", "theta_hat_start")
    state = np.array([[float(getattr(scenario, name)) for scenario in some] for name in starts])

    def slope(t: float, y: Floats) -> Floats:
        return np.stack(np.broadcast_arrays(*functions["first"](t, *y, **given)))

    paths = []
    for number in range(round(float(HORIZON) / STEP) + 1):
        t = number * STEP
        (control,) = functions["control"](t, *state, **given)
        paths.append(np.stack([*state, control], axis=1))
        s1 = slope(t, state)
        s2 = slope(t + STEP / 2, state + STEP / 2 * s1)
        s3 = slope(t + STEP / 2, state + STEP / 2 * s2)
        s4 = slope(t + STEP, state + STEP * s3)
        state = state + STEP / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
    whole: Floats = np.nan_to_num(np.array(paths))
    return whole
