# SPDX-License-Identifier: MIT
"""V' = -sum k_i z_i^2, in balls, along the whole solution: that of the lesson, and those of other plants."""

import random
from dataclasses import replace
from fractions import Fraction

import pytest
import sympy as sp

from conformance.tests.truth.plants import MILD, loop, problem
from conformance.theory.lesson import LESSON
from conformance.truth.experiment import loop_of
from conformance.truth.experiment import problem as experiment
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, InitialValueProblem, ball_function, enclose

TARGET = 1e-12


def along(of: InitialValueProblem, rate: sp.Expr) -> Enclosure:
    """The problem with one more state, the integral of an expression from 0."""
    states, rhs = (*of.states, sp.Symbol("integral")), (*of.rhs, rate)
    return enclose(replace(of, states=states, rhs=rhs, start=(*of.start, sp.S.Zero)), TARGET)


def stays_zero(enclosed: Enclosure) -> bool:
    """Whether the last state is enclosed as 0 at every time: an integral of what is 0 at every time."""
    return all(abs(p[0]) <= step.radii[-1] for step in enclosed.steps() for p in step.polynomials[-1:])


@pytest.mark.parametrize("name", ["lesson", pytest.param("pendulum with motor", marks=pytest.mark.beyond)])
def test_lyapunov_function_falls_as_derived_at_every_time(name: str) -> None:
    if name == "lesson":
        closed, of = loop_of(LESSON), experiment(LESSON)
    else:
        closed, of = loop(name, MILD), problem(name, MILD)
    V_dot, dissipation = closed.V_dot, closed.dissipation
    enclosed = along(of, V_dot + dissipation)
    assert enclosed.largest_radius <= TARGET and stays_zero(enclosed)
    short = replace(of, horizon=sp.S.One)
    assert not stays_zero(along(short, V_dot + dissipation * sp.Rational(1000001, 10**6)))

    defect, source = ball_function(of, [V_dot + dissipation]), random.Random(name)
    with precision(128):
        for _ in range(300):
            time = Fraction(source.random()) * Fraction(enclosed.end)
            (ball,) = defect(time, enclosed.at(time)[:-1])
            assert ball.contains(0) and ball.rad() < 1e-9, (time, ball)
