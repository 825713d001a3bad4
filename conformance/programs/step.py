# SPDX-License-Identifier: MIT
"""The step of the fixed-step programs, and how close rows are logged: the largest that keep their share of error."""

import functools
import keyword
import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from conformance.programs.ports import Port
from conformance.programs.spelling import Spelling
from conformance.theory.experiments import Experiment, starts_of
from conformance.theory.expressions import FUNCTIONS
from conformance.theory.statements import parameters_of, statements_of

LARGEST = Fraction(1, 100)  # s
SMALLEST = Fraction(1, 100_000)
SHARE = 1e-6 / 3  # of each state's scale
PYTHON = Port(
    name="step", folder=Path(), language="Python", source="", method="", comment=("# ", ""), section="", products=(),
    engines=(), power="{} ** {}", functions=tuple((name, f"{name}({{}})") for name in FUNCTIONS),
)  # fmt: skip

State = tuple[float, ...]


@functools.lru_cache(64)
def step_of(experiment: Experiment) -> Fraction:
    """The step that the file states or, if it states none, the largest one with which RK4 keeps its share.

    The error of a step is estimated by comparison with half of it, over the whole horizon.
    Raises ValueError where no step does.
    """
    if experiment.step is not None:
        return experiment.step
    slope, start = closed_loop(experiment), initial_state(experiment)
    finer = None
    for step in candidates(experiment.horizon):
        coarse = finer if finer and finer[0] == step else (step, trajectory(slope, start, experiment.horizon, step))
        finer = (step / 2, trajectory(slope, start, experiment.horizon, step / 2))
        if error(coarse[1], finer[1]) <= SHARE:
            return step
    raise ValueError(f"{experiment.name}: RK4 keeps {SHARE:.1e} with no step from {float(SMALLEST)} s; state a step")


@functools.lru_cache(64)
def intervals_of(experiment: Experiment, spacing: Fraction) -> int:
    """In how many intervals of about that spacing (s) to log; twice or more times as many where these are too long.

    They are too long where the solution cannot be drawn from its rows to within the share.
    Raises ValueError where no spacing will do.
    """
    slope, start, horizon = closed_loop(experiment), initial_state(experiment), experiment.horizon
    count = max(1, round(horizon / spacing))
    while horizon / count >= SMALLEST:
        if missed(trajectory(slope, start, horizon, horizon / count)) <= SHARE:
            return count
        count *= 2
    raise ValueError(f"{experiment.name}: rows are too far apart at any spacing from {float(SMALLEST)} s")


def missed(rows: Sequence[State]) -> float:
    """By how much the quintics through rows and their derivatives miss the solution midway, of each state's scale.

    It is h^6 / 46080 times the sixth derivative, which the sixth differences of the rows estimate.
    """
    worst = 0.0
    for values in zip(*rows, strict=True):
        scale, differences = max(1.0, max(map(abs, values))), values
        for _ in range(6):
            differences = tuple(b - a for a, b in pairwise(differences))
        sizes = (abs(d) / scale / 46080 for d in differences)
        worst = max([worst, *(size if math.isfinite(size) else math.inf for size in sizes)])
    return worst


def candidates(horizon: Fraction) -> Iterator[Fraction]:
    """1, 2 and 5 times powers of ten that divide the horizon, from the largest on."""
    power = LARGEST
    while power >= SMALLEST:
        for factor in (Fraction(1), Fraction(1, 2), Fraction(1, 5)):
            if (horizon / (power * factor)).denominator == 1:
                yield power * factor
        power /= 10


def error(coarse: Sequence[State], fine: Sequence[State]) -> float:
    """The largest error of the coarse trajectory, of each state's scale, by the one with half its step; of order 4."""
    worst = 0.0
    for a, b in zip(zip(*coarse, strict=True), zip(*fine[::2], strict=True), strict=True):
        scale = max(1.0, max(map(abs, b)))
        worst = max(
            worst,
            *(abs(x - y) / scale * 16 / 15 if math.isfinite(x - y) else math.inf for x, y in zip(a, b, strict=True)),
        )
    return worst


def closed_loop(experiment: Experiment) -> Callable[[float, State], State]:
    """The right-hand side of the closed loop in doubles, from the statements that the programs write."""
    statements = statements_of(experiment)
    constants = [c.name for c in parameters_of(experiment)]
    state = experiment.names
    names = dict.fromkeys([*state, *constants, *(s.name for s in statements)])
    spelling = Spelling(PYTHON, constants, names, lambda name: RESERVED)
    lines = [f"{spelling.name(c.name)} = {float(c.value)!r}" for c in parameters_of(experiment)]
    lines += ["def slope(t, state):", f"    {', '.join(map(spelling.name, state))}, = state"]
    lines += [f"    {spelling.definition(s.name, s.expression)}" for s in statements]
    lines.append(f"    return {', '.join(spelling.name(f'{name}_dot') for name in state)},")
    scope = {name: getattr(math, name) for name in FUNCTIONS}
    exec("\n".join(lines), scope)
    found: Callable[[float, State], State] = scope["slope"]
    return found


RESERVED = frozenset([*FUNCTIONS, "slope", "state", *keyword.kwlist])


def initial_state(experiment: Experiment) -> State:
    """The state and the estimates at t = 0."""
    return tuple(map(float, starts_of(experiment).values()))


def trajectory(slope: Callable[[float, State], State], start: State, horizon: Fraction, step: Fraction) -> list[State]:
    """The states at every step of the classical RK4; not numbers from where it fails."""
    h, states = float(step), [start]
    for i in range(int(horizon / step)):
        try:
            states.append(rk4_step(slope, i * h, states[-1], h))
        except (OverflowError, ZeroDivisionError, ValueError):
            states.append(tuple(math.nan for _ in start))
    return states


def rk4_step(slope: Callable[[float, State], State], t: float, x: State, h: float) -> State:
    """The state after a step of the classical Runge-Kutta method."""
    k1 = slope(t, x)
    k2 = slope(t + h / 2, tuple(a + h / 2 * b for a, b in zip(x, k1, strict=True)))
    k3 = slope(t + h / 2, tuple(a + h / 2 * b for a, b in zip(x, k2, strict=True)))
    k4 = slope(t + h, tuple(a + h * b for a, b in zip(x, k3, strict=True)))
    return tuple(a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4, strict=True))
