# SPDX-License-Identifier: MIT
"""Expressions and experiments in SymPy."""

from __future__ import annotations

import functools
from collections.abc import Callable

import sympy as sp

from conformance.theory.design import Design, tuning_functions
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
)
from conformance.theory.strict_feedback import Plant, StrictFeedback, strict_feedback


def to_sympy(e: Expression, symbols: Callable[[str], sp.Expr]) -> sp.Expr:
    """The expression in SymPy, where `symbols` gives what each name stands for."""

    def s(part: Expression) -> sp.Expr:
        return to_sympy(part, symbols)

    match e:
        case Number(value):
            return sp.Rational(value)
        case Name(name):
            return symbols(name)
        case Negative(of):
            return -s(of)
        case Sum(terms):
            return sp.Add(*map(s, terms))
        case Product(factors):
            return sp.Mul(*map(s, factors))
        case Quotient(over, under):
            return s(over) / s(under)
        case Power(base, exponent):
            return s(base) ** sp.Rational(exponent)
        case Call(function, argument):
            return getattr(sp, function)(s(argument))


def symbols_of(experiment: Experiment) -> Callable[[str], sp.Expr]:
    """What a name stands for: a constant for its number, any other name for its symbol."""
    constants = dict(experiment.constants)
    return lambda name: sp.Rational(constants[name]) if name in constants else sp.Symbol(name)


def plant_of(experiment: Experiment) -> Plant:
    """The plant, with numbers in the place of the constants; raises DesignError for a row that is not real."""
    states, parameters = ([*map(sp.Symbol, names)] for names in (experiment.states, experiment.parameters))
    rows = tuple(to_sympy(row, symbols_of(experiment)) for row in experiment.rows)
    return Plant(tuple(states), sp.Symbol(INPUT), tuple(parameters), rows)


@functools.lru_cache(64)
def form_of(experiment: Experiment) -> StrictFeedback:
    """The strict-feedback form of an experiment's plant; raises NotStrictFeedback."""
    return strict_feedback(plant_of(experiment))


@functools.lru_cache(16)
def design_of(experiment: Experiment) -> Design:
    """The design by the recursion (8), with numbers in the place of gains and constants."""
    return tuning_functions(form_of(experiment), experiment.k, [list(row) for row in experiment.Gamma])


def reference_of(experiment: Experiment) -> sp.Expr:
    """The reference, an expression in the time alone."""
    return to_sympy(experiment.reference, symbols_of(experiment))
