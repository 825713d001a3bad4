# SPDX-License-Identifier: MIT
"""Are the statements of a design right, as they are written? Decided on their own trees, in exact arithmetic.

Every statement is evaluated in rationals at random points, with its rate along the plant's solution beside its value
(forward differentiation). No partial derivative is taken symbolically, and nothing of the recursion is used: the plant
is its author's rows with the true parameters, V is its definition, and V' + sum k_i z_i^2 must be 0, (7) and (8).

A function such as sin is given a random value at each argument, and the rate that its rule says in terms of those
values. What holds for all of them holds for the function.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import sympy as sp

from conformance.theory.design import random_rational
from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.expressions import (
    Call,
    Expression,
    Name,
    Negative,
    Number,
    Power,
    Product,
    Quotient,
    Sum,
    text,
)
from conformance.theory.faults import DesignError
from conformance.theory.statements import CONTROLLER, PLANT, REFERENCE, REGRESSOR, Statement, reference_names

POINTS = 3
TRIES = 20  # of points, until one is at no pole


class WrongStatement(DesignError):
    """Statements that do not do what they are for, at some rational point."""


class Dual(NamedTuple):
    """A value and its rate."""

    value: Fraction
    rate: Fraction = Fraction(0)


class Functions:
    """Random values of functions, the same whenever the argument is."""

    def __init__(self, source: random.Random) -> None:
        self.source = source
        self.known: dict[tuple[str, Fraction], Fraction] = {}

    def __call__(self, name: str, argument: Fraction) -> Fraction:
        """The value of a function."""
        return self.known.setdefault((name, argument), random_rational(self.source))


def dual(e: Expression, names: Mapping[str, Dual], functions: Functions) -> Dual:
    """The value and the rate of an expression; raises ZeroDivisionError at a pole."""

    def d(part: Expression) -> Dual:
        return dual(part, names, functions)

    match e:
        case Number(value):
            return Dual(value)
        case Name(name):
            return names[name]
        case Negative(of):
            a = d(of)
            return Dual(-a.value, -a.rate)
        case Sum(terms):
            parts = list(map(d, terms))
            return Dual(sum((a.value for a in parts), Fraction(0)), sum((a.rate for a in parts), Fraction(0)))
        case Product(factors):
            a = Dual(Fraction(1))
            for b in map(d, factors):
                a = Dual(a.value * b.value, a.rate * b.value + a.value * b.rate)
            return a
        case Quotient(over, under):
            a, b = d(over), d(under)
            return Dual(a.value / b.value, (a.rate - a.value / b.value * b.rate) / b.value)
        case Power(base, exponent):
            return _power(d(base), exponent, functions)
        case Call(function, argument):
            a = d(argument)
            value, slope = _function(function, a.value, functions)
            return Dual(value, slope * a.rate)
    raise AssertionError(text(e))


def _power(a: Dual, exponent: Fraction, functions: Functions) -> Dual:
    """a^n, and a^(n + q) as a^n times a value of its own for each fraction q."""
    whole = exponent.numerator // exponent.denominator
    part = exponent - whole
    root = functions(f"power {part}", a.value) if part else Fraction(1)
    lower = a.value ** (whole - 1) * root
    return Dual(lower * a.value, exponent * lower * a.rate)


def _function(name: str, a: Fraction, functions: Functions) -> tuple[Fraction, Fraction]:
    """The value and the slope of a function."""
    value = functions(name, a)
    partners = {"sin": "cos", "cos": "sin", "sinh": "cosh", "cosh": "sinh"}
    if name in partners:
        return value, functions(partners[name], a) * (-1 if name == "cos" else 1)
    slopes = {
        "exp": lambda: value,
        "tan": lambda: 1 + value**2,
        "tanh": lambda: 1 - value**2,
        "log": lambda: 1 / a,
        "sqrt": lambda: 1 / (2 * value),
        "atan": lambda: 1 / (1 + a**2),
    }
    return value, slopes[name]()


# ------------------------------------------------------------------ what is checked


def prove(experiment: Experiment, statements: Sequence[Statement], points: int = POINTS, seed: int = 0) -> None:
    """Check at random rational points, in exact arithmetic and without tolerance, that the statements are right.

    Those of the controller make V' + sum k_i z_i^2 = 0 along the plant's rows, those of the plant are these rows, and
    each of the reference is the derivative of the one before. Raises WrongStatement, which says what is not so;
    DesignError if no point avoids the poles.
    """
    source = random.Random(seed)
    for _ in range(points):
        for _ in range(TRIES):
            try:
                _check_at(_Point(experiment, statements, source))
                break
            except ZeroDivisionError:
                continue
        else:
            raise DesignError("no random point found at which every statement has a value")


class _Point:
    """A random state, estimate, parameter, reference and time, and the statements evaluated there."""

    def __init__(self, experiment: Experiment, statements: Sequence[Statement], source: random.Random) -> None:
        self.experiment = experiment
        self.sections = {name: [s for s in statements if s.section == name] for name in (REFERENCE, PLANT)}
        self.controller = [s for s in statements if s.section in (REGRESSOR, CONTROLLER)]
        self.functions = Functions(source)
        gains = {f"k{i}": gain for i, gain in enumerate(experiment.k, 1)}
        gains |= experiment.gammas
        self.constants = {name: Dual(value) for name, value in (*experiment.constants, *gains.items())}
        self.theta = {p.name: random_rational(source) for p in experiment.unknown}
        self.state = {name: random_rational(source) for name in (*experiment.states, *experiment.estimates)}
        written = {s.name for s in self.sections[REFERENCE]}
        names = reference_names(len(experiment.states) + 1)
        self.reference = {name: random_rational(source) if name in written else Fraction(0) for name in names}
        self.time = random_rational(source)

    def carried_out(self, statements: Iterable[Statement], names: Mapping[str, Dual]) -> dict[str, Dual]:
        """The names, and those that the statements define."""
        known = {**self.constants, **names}
        for s in statements:
            known[s.name] = dual(s.expression, known, self.functions)
        return known

    def rows(self, u: Fraction) -> dict[str, Fraction]:
        """The rates of the states, by the rows of the plant with the true parameters."""
        values = {**self.state, **self.theta, INPUT: u}
        names = {**self.constants, **{name: Dual(value) for name, value in values.items()}}
        rates = (dual(row, names, self.functions).value for row in self.experiment.rows)
        return dict(zip(self.experiment.states, rates, strict=True))


def _check_at(point: _Point) -> None:
    still = {name: Dual(value) for name, value in (point.state | point.reference).items()}
    known = point.carried_out(point.controller, still)
    rates = point.rows(known[INPUT].value)
    _check_plant(point, known, rates)
    rates |= {name: known[f"{name}_dot"].value for name in point.experiment.estimates}
    higher = [*point.reference.values()][1:]
    rates |= dict(zip(point.reference, higher, strict=False))
    moving = {name: Dual(a.value, rates.get(name, Fraction(0))) for name, a in still.items()}
    defect = _defect(point, point.carried_out(point.controller, moving))
    if defect:
        raise WrongStatement(f"V' + sum k_i z_i^2 is {float(defect):.6g}, not 0, at a random rational point")
    _check_reference(point)


def _defect(point: _Point, known: Mapping[str, Dual]) -> Fraction:
    """V' + sum k_i z_i^2, where V = sum z_i^2 / 2 + theta_tilde' Gamma^-1 theta_tilde / 2."""
    e = point.experiment
    z = [known[f"z{i}"] for i in range(1, len(e.states) + 1)]
    defect = sum((a.value * a.rate + gain * a.value**2 for a, gain in zip(z, e.k, strict=True)), Fraction(0))
    inverse = sp.Matrix(len(e.unknown), len(e.unknown), [sp.Rational(v) for row in e.Gamma for v in row]).inv()
    errors = [point.state[p.estimate] - point.theta[p.name] for p in e.unknown]
    rates = [known[f"{p.estimate}_dot"].value for p in e.unknown]
    for i, error in enumerate(errors):
        for j, rate in enumerate(rates):
            defect += error * Fraction(int(inverse[i, j].p), int(inverse[i, j].q)) * rate
    return defect


def _check_plant(point: _Point, known: Mapping[str, Dual], rates: Mapping[str, Fraction]) -> None:
    true = {f"{name}_true": Dual(value) for name, value in point.theta.items()}
    written = point.carried_out(point.sections[PLANT], {**known, **true})
    for name, rate in rates.items():
        if written[f"{name}_dot"].value != rate:
            raise WrongStatement(f"{name}_dot is not what the plant's row says, at a random rational point")


def _check_reference(point: _Point) -> None:
    """r is the file's, and each derivative is the rate of the one before."""
    names = {"t": Dual(point.time, Fraction(1))}
    known = point.carried_out(point.sections[REFERENCE], names)
    wanted = dual(point.experiment.reference, {**point.constants, **names}, point.functions)
    for name in point.reference:
        found = known.get(name, Dual(Fraction(0)))
        if found.value != wanted.value:
            raise WrongStatement(f"{name} is not what the reference says, at a random rational time")
        wanted = Dual(found.rate)
