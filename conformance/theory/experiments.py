# SPDX-License-Identifier: MIT
"""An experiment of any strict-feedback plant: rows, gains, reference, start and horizon, and the names it may use."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import sympy as sp

from conformance.foreign import plain
from conformance.theory.design import Design, tuning_functions
from conformance.theory.expressions import FUNCTIONS, Expression, to_sympy
from conformance.theory.strict_feedback import Plant, StrictFeedback, strict_feedback

INPUT = "u"
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
    and the constants; `k` and `start` hold n numbers, `Gamma` p rows of p; `step` is that of the fixed-step programs.
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
    symbols: tuple[Meaning, ...] = ()
    facts: tuple[Fact, ...] = ()

    @property
    def estimates(self) -> tuple[str, ...]:
        """The names of the p estimates."""
        return tuple(parameter.estimate for parameter in self.unknown)

    def symbol(self, name: str) -> sp.Expr:
        """What a name stands for in SymPy: a constant for its number, any other name for its symbol."""
        return sp.Rational(dict(self.constants)[name]) if name in dict(self.constants) else sp.Symbol(name)


def plant_of(experiment: Experiment) -> Plant:
    """The plant in SymPy, with numbers in the place of the constants; raises DesignError for a row that is not real."""
    symbols = [tuple(map(sp.Symbol, names)) for names in (experiment.states, [p.name for p in experiment.unknown])]
    rows = tuple(to_sympy(row, experiment.symbol) for row in experiment.rows)
    return Plant(symbols[0], sp.Symbol(INPUT), symbols[1], rows)


@functools.lru_cache(64)
def form_of(experiment: Experiment) -> StrictFeedback:
    """The strict-feedback form of an experiment's plant; raises NotStrictFeedback."""
    return strict_feedback(plant_of(experiment))


@functools.lru_cache(16)
def design_of(experiment: Experiment) -> Design:
    """The design by the recursion (8), with numbers in the place of gains and constants."""
    return tuning_functions(form_of(experiment), experiment.k, [list(row) for row in experiment.Gamma])


def reference_of(experiment: Experiment) -> sp.Expr:
    """The reference in SymPy, an expression in the time alone."""
    return to_sympy(experiment.reference, experiment.symbol)


# ------------------------------------------------------------------ which names a file may use

NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*", re.ASCII)
OURS = re.compile(
    r"u|t|r|V|phi(_\w+)?|gamma|\w*_(hat|tilde|d+ot|start|true|known)(_\w+)?"
    r"|(z|f|g|w|k|tau|phi|alpha|gamma)_?\d\w*|r_d+ot|final_time|reference|tracking_error",
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
