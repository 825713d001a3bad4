# SPDX-License-Identifier: MIT
"""An experiment of any strict-feedback plant: rows, gains, reference, start and horizon, and the names it may use."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import NamedTuple

from conformance.foreign import plain, shown
from conformance.theory.expressions import FUNCTIONS, Expression, Name, walk

INPUT, HORIZON = "u", "horizon"
LONGEST_NAME = 24  # characters


class Unknown(NamedTuple):
    """An unknown parameter: its name, its true value, which is the plant's alone, and its estimate at t = 0."""

    name: str
    true: Fraction
    start: Fraction

    @property
    def estimate(self) -> str:
        """The name of its estimate."""
        return f"{self.name}_hat"


class Constant(NamedTuple):
    """A known number with a name."""

    name: str
    value: Fraction


class Meaning(NamedTuple):
    """What a symbol is, and its unit, for people; either may be empty."""

    name: str
    text: str
    unit: str


class Fact(NamedTuple):
    """Values at a time, computed independently of this: name, value, and one unit of its last digit."""

    t: Fraction
    values: tuple[tuple[str, Fraction, Fraction], ...]
    source: str


@dataclass(frozen=True)
class Experiment:
    """A plant of n states and p unknown parameters under its adaptive controller; all numbers exact, times in s.

    `rows` are expressions in the states, the input u, the unknown parameters and the constants, `reference` is one in t
    and the constants; `k` and `start` hold n numbers, `Gamma` p rows of p; `step` is that of the fixed-step programs,
    and `tolerance` how far a state may be from the exact one, where it is not to follow from the state's size;
    `section` is that of the lesson which lists the numbers, such as "(15)", or nothing where they are not the lesson's.
    """

    title: str
    name: str
    source: str
    states: tuple[str, ...]
    rows: tuple[Expression, ...]
    constants: tuple[Constant, ...]
    unknown: tuple[Unknown, ...]
    k: tuple[Fraction, ...]
    Gamma: tuple[tuple[Fraction, ...], ...]
    reference: Expression
    start: tuple[Fraction, ...]
    horizon: Fraction
    step: Fraction | None = None
    tolerance: Fraction | None = None
    symbols: tuple[Meaning, ...] = ()
    facts: tuple[Fact, ...] = ()
    section: str = ""

    @property
    def estimates(self) -> tuple[str, ...]:
        """The names of the p estimates."""
        return tuple(parameter.estimate for parameter in self.unknown)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the states, and behind them of the estimates."""
        return self.states + self.estimates

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the p unknown parameters."""
        return tuple(parameter.name for parameter in self.unknown)

    def gamma(self, i: int, j: int) -> str:
        """The name of entry i, j of Gamma, from 1: gamma of a number times I, gamma1 of a diagonal, gamma12."""
        if not is_diagonal(self):
            return f"gamma{min(i, j)}{max(i, j)}"
        return "gamma" if len({row[a] for a, row in enumerate(self.Gamma)}) == 1 else f"gamma{i}"

    @property
    def gammas(self) -> dict[str, Fraction]:
        """The entries of Gamma that are not 0, by name."""
        pairs = combinations_with_replacement(range(len(self.unknown)), 2)
        return {self.gamma(i + 1, j + 1): self.Gamma[i][j] for i, j in pairs if self.Gamma[i][j]}


# ------------------------------------------------------------------ the numbers of an experiment, by name


def numbers_of_loop(experiment: Experiment) -> dict[str, Fraction]:
    """What the closed loop depends on, by name: true parameters, gains k_i, the entries of Gamma, and constants."""
    e = experiment
    gains = {f"k{i}": gain for i, gain in enumerate(e.k, 1)} | e.gammas
    return {**{p.name: p.true for p in e.unknown}, **gains, **dict(e.constants)}


def starts_of(experiment: Experiment) -> dict[str, Fraction]:
    """The start values of states and estimates, by name: x1_start."""
    values = (*experiment.start, *(parameter.start for parameter in experiment.unknown))
    return {f"{name}_start": v for name, v in zip(experiment.names, values, strict=True)}


def values_of(experiment: Experiment) -> dict[str, Fraction]:
    """Every number of an experiment by name: those of the loop, the start values, and the horizon."""
    return {**numbers_of_loop(experiment), **starts_of(experiment), HORIZON: experiment.horizon}


def with_values(experiment: Experiment, values: Mapping[str, Fraction]) -> Experiment:
    """The experiment with other numbers, by name; what is known of it as a fact is known of it no more.

    Raises ValueError for a name that it does not have, and for a gain or a horizon that is not positive.
    """
    e, known = experiment, values_of(experiment)
    for name, value in values.items():
        if name not in known:
            raise ValueError(f"found {shown(name)}, expected one of {', '.join(known)}")
        if name in (HORIZON, "gamma", *(f"k{i}" for i in range(1, len(e.k) + 1))) and not value > 0:
            raise ValueError(f"{name}: found {plain(value, 40)}, expected a positive number")
    new = {**known, **values}
    if new == known:
        return experiment
    places = range(1, len(e.unknown) + 1)
    return replace(
        e,
        constants=tuple(Constant(name, new[name]) for name, _ in e.constants),
        unknown=tuple(Unknown(p.name, new[p.name], new[f"{p.estimate}_start"]) for p in e.unknown),
        k=tuple(new[f"k{i}"] for i in range(1, len(e.k) + 1)),
        Gamma=tuple(tuple(new.get(e.gamma(i, j), Fraction(0)) if e.Gamma[i - 1][j - 1] else Fraction(0)
                          for j in places) for i in places),
        start=tuple(new[f"{state}_start"] for state in e.states),
        horizon=new[HORIZON],
        facts=(),
    )  # fmt: skip


def family_of(experiment: Experiment, fixed: bool = False) -> Experiment:
    """What experiments that differ in numbers alone have in common: each with plain numbers in the place of its own.

    The sign of a constant of the plant is kept, its value too where it is to be `fixed`, and a Gamma that is full.
    """
    e = experiment
    in_rows = {node.name for row in e.rows for node in walk(row) if isinstance(node, Name)}
    values = dict.fromkeys(numbers_of_loop(e), Fraction(1)) | dict.fromkeys(starts_of(e), Fraction(0))
    values |= {name: value for name, value in e.constants if fixed}
    values |= {name: Fraction((v > 0) - (v < 0)) for name, v in e.constants if name in in_rows and not fixed}
    values |= {name: Fraction(i) for i, name in enumerate(e.gammas, 1)} if is_diagonal(e) else e.gammas
    return with_values(bare(e), {**values, HORIZON: Fraction(1)})


def bare(experiment: Experiment) -> Experiment:
    """The experiment without its words and what is known of it, on which no number of its solution depends."""
    wordless = replace(experiment, title="", name="", source="", section="", symbols=())
    return replace(wordless, step=None, tolerance=None, facts=())


def is_diagonal(experiment: Experiment) -> bool:
    """Whether each unknown parameter has an adaptation gain of its own."""
    return not any(gain for i, row in enumerate(experiment.Gamma) for j, gain in enumerate(row) if i != j)


# ------------------------------------------------------------------ which names a file may use

NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*", re.ASCII)
OURS = re.compile(
    r"u|t|r|V|phi(_\w+)?|gamma|\w*_(hat|tilde|d+ot|start|true|known)(_\w+)?"
    r"|(z|f|g|w|k|tau|phi|alpha|gamma)_?\d\w*|r_d+ot|final_time|horizon|reference|tracking_error",
    re.ASCII,
)


def refused_name(name: str) -> str | None:
    """Why a file may not give this name to a state, a parameter or a constant, or None if it may.

    What a language reserves is no matter here: each writer respells it.
    """
    if not NAME.fullmatch(name) or len(name) > LONGEST_NAME:
        return f"{plain(name, 40)} is no name: letters, digits and single underscores between, at most {LONGEST_NAME}"
    if name in FUNCTIONS:
        return f"{name} is the name of a function"
    if OURS.fullmatch(snake(name)):
        return f"{name} is a name that the design uses itself"
    return None


def snake(name: str) -> str:
    """The name with an underscore where camel case has a capital: thetaHat is theta_hat."""
    return re.sub(r"(?<=[a-z0-9])[A-Z](?=[a-z])", lambda capital: f"_{capital[0].lower()}", name)


def camel(name: str) -> str:
    """The name in camel case, as Java, MATLAB and Mathematica spell it: theta_hat is thetaHat, r_ddot is rDDot."""
    first, *others = name.split("_")
    capitals = (re.sub(r"^d+(?=ot$)|^[a-z]", lambda found: found[0].upper(), part) for part in others)
    return first + "".join(capitals)


def without_accents(text: str) -> str:
    """The letters of a text without their accents, one for one, as programs hold names such as Kokotović."""
    return "".join(unicodedata.normalize("NFD", character)[0] for character in text)
