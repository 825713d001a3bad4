# SPDX-License-Identifier: MIT
"""From an experiment to the truth: the plant, the derived closed loop, and the enclosure of its solution.

No formula of the controller stands here: `design` derives them from the plant, once for all experiments that differ in
numbers alone.
"""

import functools
from collections.abc import Iterable, Iterator
from decimal import ROUND_UP, Decimal, localcontext
from fractions import Fraction
from typing import NamedTuple

import sympy as sp
from flint import arb

from conformance.theory.design import ClosedLoop, closed_loop, tuning_functions
from conformance.theory.experiments import (
    INPUT,
    Experiment,
    family_of,
    is_diagonal,
    numbers_of_loop,
    starts_of,
)
from conformance.theory.faults import DesignError
from conformance.theory.strict_feedback import Plant, strict_feedback
from conformance.theory.symbolic import form_of, to_sympy
from conformance.truth.enclosure import Progress
from conformance.truth.setting import setting_of
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, InitialValueProblem, ball_function, enclose

BEYOND = Fraction(101, 100)  # of the horizon: a file's last row may lie half a step behind it


class Family(NamedTuple):
    """The closed loop of all experiments that differ in these parameters alone, which stand in it as symbols."""

    loop: ClosedLoop
    parameters: tuple[sp.Symbol, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(s.name for s in self.parameters)

    def numbers(self, experiment: Experiment) -> dict[sp.Symbol, sp.Rational]:
        """The values of the parameters."""
        known = numbers_of_loop(experiment)
        return {s: sp.Rational(known[s.name]) for s in self.parameters}


def family(experiment: Experiment) -> Family:
    """The closed loop in symbols for true parameters, gains and constants; raises DesignError.

    A Gamma that is full stays in numbers, and so do the constants where (2) or (3) rest on more than their signs.
    """
    try:
        return _derived(family_of(experiment), False)
    except DesignError:
        return _derived(family_of(experiment, fixed=True), True)


@functools.lru_cache(32)
def _derived(e: Experiment, fixed: bool) -> Family:
    constants = {} if fixed else {name: _symbol(name, value) for name, value in e.constants}
    known = dict(e.constants)

    def symbol(name: str) -> sp.Expr:
        return sp.Rational(known[name]) if fixed and name in known else constants.get(name, sp.Symbol(name))

    states, theta = (tuple(map(sp.Symbol, names)) for names in (e.states, e.parameters))
    rows = tuple(to_sympy(row, symbol) for row in e.rows)
    plant = strict_feedback(Plant(states, sp.Symbol(INPUT), theta, rows, tuple(constants.values())))
    k = tuple(_symbol(f"k{i}", 1) for i, _ in enumerate(e.k, 1))
    gammas = {name: _symbol(name, 1) for name in e.gammas} if is_diagonal(e) else {}
    p = range(len(theta))
    Gamma = [[gammas.get(e.gamma(i + 1, j + 1), gain) if (gain := e.Gamma[i][j]) else 0 for j in p] for i in p]
    free = (*theta, *k, *gammas.values(), *constants.values())
    loop = closed_loop(tuning_functions(plant, k, Gamma), theta, to_sympy(e.reference, symbol), free=free)
    return Family(loop, free)


def _symbol(name: str, sign: Fraction | int) -> sp.Symbol:
    """A symbol of the sign of a number."""
    return sp.Symbol(name, positive=sign > 0 or None, negative=sign < 0 or None)


@functools.lru_cache(64)
def loop_of(experiment: Experiment) -> ClosedLoop:
    """The closed loop of an experiment, in numbers; raises DesignError."""
    form_of(experiment)  # whose numbers may break what their signs do not
    found = family(experiment)
    return found.loop.at(found.numbers(experiment))


def problem(experiment: Experiment) -> InitialValueProblem:
    """The closed loop of an experiment as an initial-value problem in states and estimates."""
    loop = loop_of(experiment)
    start = tuple(map(sp.Rational, starts_of(experiment).values()))
    horizon = sp.Rational(experiment.horizon * BEYOND)
    return InitialValueProblem(loop.time, loop.states, loop.rhs, start, horizon, loop.definitions)


@functools.cache
def truth(experiment: Experiment, target: float = 1e-18, progress: Progress | None = None) -> Enclosure:
    """The proven enclosure of states and estimates, with a radius of at most `target`."""
    return enclose(problem(experiment), target, progress=progress)


def printed_of(experiment: Experiment) -> tuple[str, ...]:
    """What a table of the truth holds: states and estimates, z_1 .. z_n, and V."""
    setting = setting_of(experiment)
    return (*setting.names, *(f"z{i}" for i in range(1, setting.n + 1)), "V")


def truth_table(
    experiment: Experiment, times: Iterable[Fraction], digits: int, progress: Progress | None = None
) -> Iterator[list[str]]:
    """Rows of text: a header, then per time (s) states, estimates, errors z and V, as value and radius.

    A value has `digits` significant digits; its radius, rounded up, covers the enclosure and the rounding of the value.
    Raises ValueError for a time outside of the enclosure, ProofEnded where there is none.
    """
    flow, loop = problem(experiment), loop_of(experiment)
    enclosed = enclose(flow, min(1e-18, 10.0**-digits), progress=progress)
    errors = ball_function(flow, [*loop.z, loop.V])
    yield ["t", *(text for name in printed_of(experiment) for text in (name, f"{name}_radius"))]
    for t in times:
        with precision(enclosed.bits):
            states = enclosed.at(t)
            balls = (*states, *errors(t, states))
        yield [_decimal(t), *(text for ball in balls for text in _printed(ball, digits))]


def _decimal(t: Fraction) -> str:
    power = next((k for k in range(40) if (t * 10**k).denominator == 1), None)
    return str(t) if power is None else format(Decimal(int(t * 10**power)).scaleb(-power), "f")


def _printed(ball: arb, digits: int) -> tuple[str, str]:
    with precision(1024):
        value = str(ball.mid().str(digits, radius=False))
        mantissa, exponent = (abs(ball - arb(value))).upper().man_exp()
        radius = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    with localcontext(prec=3, rounding=ROUND_UP):
        return value, f"{Decimal(radius.numerator) / Decimal(radius.denominator):.2e}"
