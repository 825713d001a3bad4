# SPDX-License-Identifier: MIT
"""The facts that experiment files state, against the enclosure of the solution of their statements as written."""

from fractions import Fraction

import pytest
import sympy as sp
from flint import arb, fmpq

from conformance.programs.ports import ROOT
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.statements import parameters_of, statements_of
from conformance.theory.symbolic import to_sympy
from conformance.truth.taylor import precision
from conformance.truth.truth import InitialValueProblem, enclose

PLANTS = ROOT / "plants"
WITH_FACTS = [path.stem for path in sorted(PLANTS.glob("*.toml")) if "[[fact]]" in path.read_text()]


def written_problem(e: Experiment) -> InitialValueProblem:
    """The closed loop in the very statements that programs write, with numbers for the constants."""
    numbers = {p.name: sp.Rational(p.value) for p in parameters_of(e)}
    states = tuple(map(sp.Symbol, (*e.states, *e.estimates)))
    definitions = tuple(
        (sp.Symbol(s.name), to_sympy(s.expression, lambda name: numbers.get(name, sp.Symbol(name))))
        for s in statements_of(e)
    )
    rhs = tuple(sp.Symbol(f"{s}_dot") for s in states)
    start = tuple(map(sp.Rational, (*e.start, *(p.start for p in e.unknown))))
    return InitialValueProblem(sp.Symbol("t"), states, rhs, start, sp.Rational(e.horizon), definitions)


def test_some_experiments_state_facts() -> None:
    assert {"Chapter17_Lesson1", "no_excitation", "khalil", "duffing", "wing_rock"} <= set(WITH_FACTS)


@pytest.mark.parametrize("name", WITH_FACTS)
def test_a_fact_is_true_to_its_last_digit(name: str) -> None:
    e = read_experiment(PLANTS / f"{name}.toml")
    assert e.facts
    enclosed = enclose(written_problem(e), float(min(unit for fact in e.facts for _, _, unit in fact.values)) / 4)
    for fact in e.facts:
        balls = dict(zip((*e.states, *e.estimates), enclosed.at(fact.t), strict=True))
        for symbol, value, unit in fact.values:
            with precision(200):
                assert abs(balls[symbol] - ball(value)) < ball(unit), (symbol, fact.t)


def ball(value: Fraction) -> arb:
    return arb(fmpq(value.numerator, value.denominator))
