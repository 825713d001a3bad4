# SPDX-License-Identifier: MIT
"""Expressions keep their author's order, are read as mathematics reads them, and differentiate as SymPy does."""

import random
from contextlib import suppress
from fractions import Fraction

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from conformance.theory import expressions
from conformance.theory.expressions import (
    FUNCTIONS,
    ONE,
    ZERO,
    Call,
    Expression,
    Name,
    Negative,
    Number,
    Power,
    Product,
    Quotient,
    Sum,
    add,
    derivative,
    operations,
    product,
    quotient,
    substitute,
    text,
    value,
    walk,
)
from conformance.theory.reader import Unreadable, read
from conformance.theory.symbolic import to_sympy

SAME = [
    "x2 + theta * x1",
    "-x^2",
    "(-x)^2",
    "a - (b + c)",
    "a - b + c",
    "a / (b * c)",
    "a / b * c",
    "a * (b / c)",
    "-a * b",
    "a * (-b)",
    "x^(-1)",
    "x^(3/2)",
    "(x + 1)^2",
    "sin(omega * t)^2",
    "0.5 * exp(-x / T)",
    "1e-30 * x",
    "(a * b)^3 / (c - d)",
]


@pytest.mark.parametrize("source", SAME)
def test_an_expression_keeps_the_order_in_which_it_was_written(source: str) -> None:
    assert text(read(source)) == source


READ = {
    "-x^2": "-(x**2)",
    "2^-1*x": "x/2",
    "a/b/c": "a/(b*c)",
    "a-b-c": "a-(b+c)",
    "a/b*c": "a*c/b",
    "x**2": "x^2",
    "-(a-b)*c": "(b-a)*c",
    "1.50": "3/2",
    "1e-3": "1/1000",
    ".5": "1/2",
    "x^(1/2)": "sqrt(x)",
}


@pytest.mark.parametrize("source", READ)
def test_signs_and_powers_bind_as_in_mathematics(source: str) -> None:
    assert sp.simplify(in_sympy(read(source)) - in_sympy(read(READ[source]))) == 0


def test_a_place_is_kept_for_every_part() -> None:
    source = "x2 + theta*(x1 - sin( x2 )^2)/3"
    spans = {source[slice(*node.span)] for node in walk(read(source))}
    assert spans >= {source, "theta*(x1 - sin( x2 )^2)/3", "(x1 - sin( x2 )^2)", "sin( x2 )^2", "sin( x2 )", "3"}


DERIVATIVES = {
    "amplitude*sin(omega*t)": [
        "amplitude * omega * cos(omega * t)",
        "-amplitude * omega * omega * sin(omega * t)",
        "-amplitude * omega * omega * omega * cos(omega * t)",
    ],
    "0.4*cos(0.5*t)": ["-0.2 * sin(0.5 * t)", "-0.1 * cos(0.5 * t)"],
    "1 + t": ["1", "0"],
    "t^3/3": ["t^2", "2 * t"],
    "a*exp(-t)": ["-a * exp(-t)", "a * exp(-t)"],
}


@pytest.mark.parametrize("source", DERIVATIVES)
def test_derivatives_keep_the_authors_order(source: str) -> None:
    e, found = read(source), []
    for _ in DERIVATIVES[source]:
        e = derivative(e, lambda name: ONE if name == "t" else ZERO)
        found.append(text(e))
    assert found == DERIVATIVES[source]


def test_terms_of_0_and_factors_of_1_are_left_out() -> None:
    x, y = Name("x"), Name("y")
    assert add(ZERO, x, ZERO) == x and product(ONE, x, ONE) == x and product(x, ZERO, y) == ZERO
    assert text(add(x, y, Negative(x))) == "y" and text(add(x, y, x)) == "2 * x + y"
    assert text(product(x, Negative(y), Number(Fraction(2)))) == "-2 * x * y"
    assert (
        text(product(x, Quotient(ONE, y))) == "x / y"
        and text(quotient(product(Number(Fraction(3)), x), Number(Fraction(3)))) == "x"
    )
    assert text(substitute(read("a*x + b*y + 2"), {"a": ZERO, "b": ONE})) == "y + 2"


def test_operations_are_counted_as_they_are_written() -> None:
    assert [operations(read(e)) for e in ("x", "-x", "a - b", "a + b*c - d", "sin(x)^2/3", "-a*b")] == [
        0,
        1,
        1,
        3,
        3,
        2,
    ]


def in_sympy(e: Expression) -> sp.Expr:
    return to_sympy(e, lambda name: sp.Symbol(name, positive=True))


NUMBERS = st.fractions(0, 20, max_denominator=20).map(Number)
LEAVES = st.sampled_from("xyz").map(Name) | NUMBERS


def larger(inner: st.SearchStrategy[Expression]) -> st.SearchStrategy[Expression]:
    several = st.lists(inner, min_size=2, max_size=3).map(tuple)
    smooth = st.sampled_from([name for name in FUNCTIONS if name not in ("log", "sqrt", "tan")])
    return st.one_of(
        inner.map(Negative),
        several.map(Sum),
        several.map(Product),
        st.builds(Quotient, inner, inner),
        st.builds(Power, inner, st.integers(-3, 4).map(Fraction)),
        st.builds(Call, smooth, inner),
    )


TREES = st.recursive(LEAVES, larger, max_leaves=8)


def floating(e: Expression, values: dict[str, sp.Float]) -> complex:
    return complex(to_sympy(e, values.__getitem__).evalf(30))


@settings(max_examples=60, deadline=None)
@given(TREES, st.integers(0, 2**32))
def test_an_expression_is_worth_the_same_when_written_and_read_back(e: Expression, seed: int) -> None:
    try:
        again = read(text(e))
    except Unreadable as error:
        assert "degree" in error.sentence or "terms" in error.sentence
        return
    assert text(again) == text(e)
    point = {name: Fraction(random.Random(seed + ord(name)).randint(1, 9), 7) for name in "xyz"}
    with suppress(ValueError, ZeroDivisionError):  # a function, or a pole
        assert value(again, point) == value(e, point)


@settings(max_examples=60, deadline=None)
@given(TREES)
def test_the_derivative_is_that_of_sympy(e: Expression) -> None:
    x, y, z = sp.symbols("x y z")
    symbols = {"x": x, "y": y, "z": z}
    try:
        ours = to_sympy(derivative(e, lambda name: ONE if name == "x" else ZERO), symbols.__getitem__)
    except ZeroDivisionError:
        return
    point = {x: sp.Rational(7, 5), y: sp.Rational(-3, 7), z: sp.Rational(11, 13)}
    wanted = sp.diff(to_sympy(e, symbols.__getitem__), x)
    if wanted.has(sp.nan, sp.zoo, sp.oo) or ours.has(sp.nan, sp.zoo, sp.oo):
        return
    a, b = (number.subs(point).evalf(30) for number in (ours, wanted))
    if a.is_finite and b.is_finite and abs(b) < 1e20:
        assert abs(a - b) <= 1e-20 * (1 + abs(b))


def test_the_module_knows_every_function_that_it_reads() -> None:
    for name in FUNCTIONS:
        e = derivative(read(f"{name}(2*x)"), lambda _: ONE)
        wanted = sp.diff(getattr(sp, name)(2 * sp.Symbol("x", positive=True)), sp.Symbol("x", positive=True))
        assert sp.simplify(in_sympy(e) - wanted) == 0, expressions.text(e)
