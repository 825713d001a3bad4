# SPDX-License-Identifier: MIT
"""A closed loop in symbols, with numbers put in, is the one derived with these numbers; r in doubles is near r."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from mpmath import mp

from conformance.places import PLANTS
from conformance.theory.design import closed_loop
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import Constant, Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.theory.reader import read
from conformance.theory.symbolic import design_of, reference_of, symbols_of, to_sympy
from conformance.trials.campaign import draw
from conformance.truth import closed_loop as kept
from conformance.truth.exact import digest_of_family, functions_of
from conformance.truth.experiment import family, loop_of
from conformance.truth.rounding import rounding

pytestmark = pytest.mark.beyond

EVERY = [as_written(path) for path in sorted(PLANTS.glob("*.toml"))]
CANCELLED = replace(  # whose x3 leaves row 1 because a is 2
    as_written(PLANTS / "khalil.toml"),
    rows=(read("x2 + (a - 2)*x3"), read("x3"), read("u")),
    constants=(Constant("a", Fraction(2)),),
)


@pytest.mark.parametrize("experiment", [*EVERY, CANCELLED, draw(1, 1)], ids=lambda experiment: experiment.name)
def test_numbers_put_into_symbols_are_numbers_derived_with(experiment: Experiment) -> None:
    found = loop_of(experiment)
    theta = [parameter.true for parameter in experiment.unknown]
    wanted = closed_loop(design_of(experiment), theta, reference_of(experiment))
    point = {s: sp.Rational(3 * i + 1, 7) for i, s in enumerate((found.time, *found.states))}
    for name in ("rhs", "z", "u", "V", "V_dot", "dissipation", "reference"):
        ours, theirs = (sp.Matrix([loop.explicit(sp.Matrix([getattr(loop, name)]))]) for loop in (found, wanted))
        difference = (ours - theirs).xreplace(point).evalf(30)
        assert max(map(abs, difference)) <= 1e-20 * max(1, *map(abs, theirs.xreplace(point).evalf(30))), name


def test_constants_on_whose_values_the_form_rests_stay_numbers() -> None:
    assert family(CANCELLED).names == ("k1", "k2", "k3")


def test_one_derivation_serves_all_numbers() -> None:
    assert family(draw(1, 1)) is family(with_values(draw(1, 1), {"theta": Fraction(1, 3), "gamma": Fraction(2)}))


def test_the_functions_kept_as_source_are_used_for_their_family_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    assert digest_of_family(LESSON) == kept.FAMILY
    functions_of.cache_clear()
    assert functions_of(LESSON).by_name["first"] is kept.first
    functions_of.cache_clear()
    monkeypatch.setattr(kept, "FAMILY", "another")  # as where the lesson's file has been changed
    own, t, states = functions_of(LESSON), np.linspace(0, 20, 7), np.random.default_rng(2).normal(size=(3, 7))
    values = {name: 1.5 for name in own.parameters}
    assert own.by_name["first"] is not kept.first
    assert (own("first", values, t, states) == np.stack(kept.first(t, *states, *values.values()))).all()
    functions_of.cache_clear()


REFERENCES = (
    "0.5*sin(0.7*t)",
    "exp(-t/3)*cos(40*t + 1/3)",
    "tanh(t - 3)^3/(2 + sin(t))",
    "atan(t)*(1 - exp(-t)) - 0.1",
)


@pytest.mark.parametrize("text", REFERENCES)
def test_rounding_of_a_reference_is_bounded_and_not_by_much(text: str) -> None:
    e, t = read(text), np.random.default_rng(3).uniform(0, 20, 500)
    exact, time = to_sympy(e, symbols_of(LESSON)), sp.Symbol("t")
    doubles = sp.lambdify(time, exact, "numpy")(t)
    with mp.workdps(40):
        precise = sp.lambdify(time, exact, "mpmath")
        off = np.array([float(abs(precise(mp.mpf(s)) - mp.mpf(v))) for s, v in zip(t, doubles, strict=True)])
    bound = rounding(e, {}, t)
    assert (off <= bound).all() and bound.max() < 100 * off.max()
