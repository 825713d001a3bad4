# SPDX-License-Identifier: MIT
"""The terms of V' are all that there are: those of each step, as shown, add up to the rate along the plant's rows."""

import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import pytest
import sympy as sp

from conformance.programs.ports import ROOT
from conformance.theory.cancellation import Fate, Step, cancellation
from conformance.theory.derivation import juxtaposed
from conformance.theory.design import random_rational
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.expressions import ZERO, Negative
from conformance.theory.identity import Dual, Functions, dual
from conformance.theory.statements import recursion_of

PLANTS = {path.stem: path for path in sorted((ROOT / "plants").glob("*.toml"))}


def experiment(name: str) -> Experiment:
    return read_experiment(PLANTS[name])


def along_the_plant(e: Experiment) -> tuple[dict[str, Dual], Functions]:
    """Every name of the design at a random point, with its rate in closed loop."""
    source = random.Random(1)
    functions, recursion = Functions(source), recursion_of(e, large=True)
    gains = {f"k{i}": gain for i, gain in enumerate(e.k, 1)} | e.gammas
    fixed = {name: Dual(value) for name, value in (*e.constants, *gains.items())}
    fixed |= {p.name: Dual(random_rational(source)) for p in e.unknown}
    there = {name: random_rational(source) for name in (*e.states, *e.estimates)}
    there |= {name: random_rational(source) if r != ZERO else Fraction(0) for name, r in recursion.reference.items()}

    def carried_out(rates: Mapping[str, Fraction]) -> dict[str, Dual]:
        known = fixed | {name: Dual(value, rates.get(name, Fraction(0))) for name, value in there.items()}
        for name, definition in recursion.chain.definitions.items():
            known[name] = dual(definition, known, functions)
        return known

    still = carried_out({})
    rates = {x: dual(row, still, functions).value for x, row in zip(e.states, e.rows, strict=True)}
    rates |= {name: still[f"{name}_dot"].value for name in e.estimates}
    derivatives = [*recursion.reference]
    rates |= {a: there[b] for a, b in pairwise(derivatives)}
    known = carried_out(rates)
    for p in e.unknown:
        known[f"{p.name}_tilde"] = Dual(known[p.estimate].value - known[p.name].value, known[p.estimate].rate)
    return known, functions


def wrong_steps(e: Experiment, steps: tuple[Step, ...]) -> list[str]:
    """What of the steps is not so: the terms against z_i z_i', of step 1 with V_0', and what is left against V_i'."""
    known, functions = along_the_plant(e)
    p, found = len(e.unknown), []
    inverse = sp.Matrix(p, p, [sp.Rational(v) for row in e.Gamma for v in row]).inv()
    errors = [known[f"{q.name}_tilde"] for q in e.unknown]
    rate = Fraction(0)
    for i, a in enumerate(errors):
        for j, b in enumerate(errors):
            rate += a.value * Fraction(int(inverse[i, j].p), int(inverse[i, j].q)) * b.rate
    for step in steps:
        z = known[f"z{step.i}"]
        brought = z.value * z.rate + (rate if step.i == 1 else 0)
        gained = [t.term for t in step.terms if not (t.inherited or t.collected)]
        gained += [t.answer for t in step.terms if not t.collected]
        if sum((dual(e, known, functions).value for e in gained), Fraction(0)) != brought:
            found.append(f"terms of step {step.i}")
        rate += z.value * z.rate
        if dual(step.left, known, functions).value != rate:
            found.append(f"what step {step.i} leaves")
    return found


@pytest.mark.parametrize("name", PLANTS)
def test_terms_of_every_step_are_those_of_the_lyapunov_function(name: str) -> None:
    e = experiment(name)
    assert wrong_steps(e, cancellation(e)) == []


@pytest.mark.parametrize("name", ["Chapter17_Lesson1", "problem_1c"])
def test_wrong_term_would_be_noticed(name: str) -> None:
    e = experiment(name)
    for i, step in enumerate(steps := cancellation(e)):
        for j, term in enumerate(step.terms):
            if not (term.inherited or term.collected):
                terms = (*step.terms[:j], term._replace(term=Negative(term.term)), *step.terms[j + 1 :])
                wrong = (*steps[:i], replace(step, terms=terms), *steps[i + 1 :])
                assert wrong_steps(e, wrong) == [f"terms of step {i + 1}"]
        wrong = (*steps[:i], replace(step, left=Negative(step.left)), *steps[i + 1 :])
        assert wrong_steps(e, wrong) == [f"what step {i + 1} leaves"]


@pytest.mark.parametrize("name", PLANTS)
def test_what_cancels_is_answered_by_its_negative(name: str) -> None:
    e = experiment(name)
    known, functions = along_the_plant(e)
    for step in cancellation(e):
        for t in step.terms:
            if t.fate is Fate.CANCELS:
                pair = [dual(side, known, functions).value for side in (t.term, t.answer)]
                assert sum(pair) == 0 and t.by
            else:
                assert (t.answer == ZERO) or step.i < len(e.states)


def test_steps_of_the_lesson_are_its_own() -> None:
    first, second = cancellation(experiment("Chapter17_Lesson1"))
    assert [juxtaposed(t.term) for t in second.terms] == [
        "z1 z2",
        "-alpha1_dot_known z2",
        "phi theta_hat_dot z2",
        "-k2 z2^2",
        "theta_tilde alpha1_x1 phi z2",
        "-theta_tilde tau2",
    ]
    assert [juxtaposed(t.term) for t in first.terms if t.cause == "the estimate moves"] == [
        "theta_tilde theta_hat_dot/gamma"
    ]
    assert [t.term for t in second.terms if t.collected] == [second.terms[-1].term]
    assert [t.by for t in second.terms] == ["u", "u", "u", "", "tau2", "theta_hat_dot"]
    assert juxtaposed(second.left) == "-k1 z1^2 - k2 z2^2"
    assert juxtaposed(first.left) == "-k1 z1^2 + z1 z2 - theta_tilde (phi z1 - theta_hat_dot/gamma)"


@pytest.mark.parametrize(("plant", "gain"), [("chain_4", "gamma"), ("problem_1c", "Gamma")])
def test_gain_of_one_parameter_has_its_name_and_that_of_several_is_a_matrix(plant: str, gain: str) -> None:
    causes = [term.cause for step in cancellation(experiment(plant)) for term in step.terms]
    grown = [cause for cause in causes if "counted on" in cause]
    assert grown and all(f"counted on {gain} tau" in cause and f"grown to {gain} tau" in cause for cause in grown)
