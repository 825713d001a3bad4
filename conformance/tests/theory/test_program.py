# SPDX-License-Identifier: MIT
"""Derivatives through names agree with SymPy's derivatives of what the names stand for; evaluation is exact."""

import itertools
from fractions import Fraction

import pytest
import sympy as sp

from conformance.theory.program import Program, evaluate

from .lesson import random_design

x, y = sp.symbols("x y")


def test_derivatives_through_names_equal_derivatives_of_the_written_out_expression():
    program = Program((x, y))
    a = program.let("a", x * sp.sin(y) + y**3)
    b = program.let("b", a**2 / (1 + x**2) + y)
    for order in itertools.product((x, y), repeat=2):
        through_names = b
        for v in order:
            through_names = program.diff(through_names, v)
        assert sp.simplify(program.explicit(through_names) - sp.diff(program.explicit(b), *order)) == 0


def test_derivatives_of_a_virtual_control_equal_those_of_its_written_out_expression():
    design = random_design(2, 2)
    alpha = design.alpha[0]
    point = {s: Fraction(k + 2, 3) for k, s in enumerate(sorted(design.explicit(alpha).free_symbols, key=str))}
    for v, w in itertools.product(point, repeat=2):
        through_names = design.program.diff(design.program.diff(alpha, v), w)
        written_out = sp.diff(design.explicit(alpha), v, w)
        assert evaluate(through_names, point, design.program.definitions) == evaluate(written_out, point)


def test_mixed_derivatives_are_kept_once():
    program = Program((x, y))
    a = program.let("a", x**3 * y**3)
    before = len(program.definitions)
    assert program.diff(program.diff(a, x), y) == program.diff(program.diff(a, y), x)
    assert len(program.definitions) == before + 3  # a_x, a_y, a_xy


def test_derivative_that_is_another_name_is_differentiated_further():
    program = Program((x, y))
    b = program.let("b", x**3)
    a = program.let("a", b * y)
    assert program.diff(a, y) == b
    assert program.explicit(program.diff(program.diff(a, y), x)) == 3 * x**2
    assert program.explicit(program.diff(program.diff(a, x), y)) == 3 * x**2


def test_evaluation_is_exact():
    e = (x - sp.Rational(1, 3)) ** -2 + y / 7
    assert evaluate(e, {x: Fraction(1, 2), y: Fraction(7, 5)}) == Fraction(181, 5)


def test_pole_missing_value_and_irrational_value_are_errors():
    with pytest.raises(ZeroDivisionError):
        evaluate(1 / x, {x: Fraction(0)})
    with pytest.raises(ValueError, match="y has no value"):
        evaluate(x + y, {x: Fraction(1)})
    with pytest.raises(ValueError, match=r"sin\(x\) has no value"):
        evaluate(sp.sin(x), {x: Fraction(1)})


def test_name_is_given_once():
    program = Program((x,))
    program.let("a", x**2)
    with pytest.raises(ValueError, match="the name a is taken"):
        program.let("a", x**3)
