# SPDX-License-Identifier: MIT
"""Which plants are in strict-feedback form, and why the others are not; (2), (3), (4), (16), (17)."""

import pytest
import sympy as sp

from conformance.theory.strict_feedback import (
    DesignError,
    NotStrictFeedback,
    Plant,
    Rule,
    StrictFeedback,
    classify,
    strict_feedback,
)

x1, x2, x3, u, t = sp.symbols("x1 x2 x3 u t")
theta, theta1, theta2 = sp.symbols("theta theta1 theta2")
eta, d, b = sp.symbols("eta d b")
b_positive, b_nonzero = sp.Symbol("b", positive=True), sp.Symbol("b", nonzero=True)
c = sp.Symbol("c")
sin, cos = sp.sin, sp.cos


def plant(*rhs, parameters=(theta, theta1, theta2), **more):
    return Plant((x1, x2, x3)[: len(rhs)], u, parameters, rhs, **more)


ACCEPTED = {
    "problem 1 (a)": plant(x1**2 + x2, theta * sin(x1) + u),
    "problem 1 (c)": plant(x2 + theta1 * x1**3, x3 + theta2 * x1 * x2, u),
    "the worked example (7)": plant(x2 + theta * x1, u),
    "linear in theta, not in x (4)": plant(x2, u + theta1 * x1**3 + theta2 * sin(x1 * x2)),
    "one parameter in several rows (2)": plant(x2 + theta * x1, x3 + theta * x2**2, u + theta * x3),
    "a gain of negative sign": plant(-2 * x2, (-1 - x1**2) * u),
    "a gain with a positive constant": plant(b_positive * x2, u / b_positive, constants=(b_positive,)),
    "a gain that no real constant makes vanish": plant((c**2 + 1) * x2, u / (2 + sin(c)), constants=(c,)),
    "an oscillating gain that stays above 1": plant((2 + sin(x1)) * x2, u),
    "a polynomial gain without real zeros": plant((x1**2 - x1 + 1) * x2, u),
    "a next state that cancels to affine": plant((x1 + x2) ** 2 - x2**2 - 2 * x1 * x2 + x2, u),
    "a state ahead that cancels": plant(x2 + sin(x3) ** 2 + cos(x3) ** 2, x3, u),
    "no parameters at all": plant(x2, u, parameters=()),
    "a single state": plant(x1**3 + theta * x1 + u),
}


@pytest.mark.parametrize("case", ACCEPTED.values(), ids=ACCEPTED)
def test_strict_feedback_plant_is_accepted_and_its_entries_give_its_rows_back(case):
    form = strict_feedback(case)
    assert form.assumptions == ()
    for rebuilt, row in zip(form.rhs, case.rhs, strict=True):
        assert sp.simplify(rebuilt - row) == 0


def test_entries_of_problem_1c_are_read_off_row_by_row():
    form = strict_feedback(plant(x2 + theta1 * x1**3, x3 + theta2 * x1 * x2, u, parameters=(theta1, theta2)))
    assert form.f == (0, 0, 0)
    assert form.g == (1, 1, 1)
    assert form.phi == ((x1**3, 0), (0, x1 * x2), (0, 0))


REFUSED = {
    "problem 1 (b), pure feedback": (plant(x1 + sin(x2), u), 1, Rule.PURE_FEEDBACK, sin(x2)),
    "next state squared": (plant(x2 + x2**2, u), 1, Rule.PURE_FEEDBACK, x2**2),
    "cubic next state, the usual pure feedback": (plant(x2, x3 + x3**3 / 3, u), 2, Rule.PURE_FEEDBACK, x3**3 / 3),
    "theta in a pure-feedback term": (plant(theta * sin(x2), u), 1, Rule.PURE_FEEDBACK, theta * sin(x2)),
    "a state ahead of its row": (plant(x2 + x1 * x3, x3, u), 1, Rule.STATE_AHEAD, x1 * x3),
    "a state ahead beside theta": (plant(x2 + theta * x3, x3, u), 1, Rule.STATE_AHEAD, theta * x3),
    "u before the last row": (plant(x2 + x1 * u, u), 1, Rule.INPUT_EARLY, u * x1),
    "u not affine in the last row": (plant(x2, u + u**3), 2, Rule.INPUT_NOT_AFFINE, u**3),
    "saturated u": (plant(x2, sp.tanh(u)), 2, Rule.INPUT_NOT_AFFINE, sp.tanh(u)),
    "theta squared": (plant(x2 + theta**2 * x1, u), 1, Rule.NONLINEAR_IN_PARAMETERS, theta**2 * x1),
    "theta inside a sine": (plant(x2, sin(theta * x1) + u), 2, Rule.NONLINEAR_IN_PARAMETERS, sin(theta * x1)),
    "a product of parameters": (plant(x2 + theta1 * theta2 * x1, u), 1, Rule.NONLINEAR_IN_PARAMETERS, None),
    "theta multiplies the next state": (plant(theta * x2 + x1, u), 1, Rule.PARAMETER_IN_GAIN, theta * x2),
    "theta multiplies u": (plant(x2, x1 + theta * u), 2, Rule.PARAMETER_IN_GAIN, theta * u),
    "next state absent": (plant(x1 + theta, u), 1, Rule.NEXT_STATE_ABSENT, x1 + theta),
    "u absent": (plant(x2, x1 * x2), 2, Rule.NEXT_STATE_ABSENT, x1 * x2),
    "theta varies with time (4)": (
        plant(x2 + sp.Function("theta")(t) * x1, u), 1, Rule.TIME_VARYING_PARAMETER, sp.Function("theta")(t) * x1,
    ),
    "disturbance without a model (4)": (plant(x2, u + sp.Function("d")(t)), 2, Rule.UNMODELLED_SIGNAL, None),
    "hidden dynamics (4)": (plant(x2 + eta, u, hidden=(eta,)), 1, Rule.HIDDEN_STATE, eta),
    "a state that is not measured (3)": (plant(x2, u, hidden=(x2,)), 1, Rule.HIDDEN_STATE, x2),
    "gain of unknown sign (4)": (plant(x2, b_nonzero * u, constants=(b_nonzero,)), 2, Rule.GAIN_SIGN_UNKNOWN, None),
    "undeclared gain": (plant(x2, b * u), 2, Rule.UNDECLARED_SYMBOL, b * u),
    "undeclared disturbance": (plant(x2 + d, u), 1, Rule.UNDECLARED_SYMBOL, d),
    "explicit time": (plant(x2 + sin(t), u), 1, Rule.TIME_VARYING_ROW, sin(t)),
    "a kink": (plant(x2 + sp.Abs(x1), u), 1, Rule.NOT_SMOOTH, sp.Abs(x1)),
    "a switch": (plant(x2, u + sp.sign(x2)), 2, Rule.NOT_SMOOTH, sp.sign(x2)),
}  # fmt: skip


@pytest.mark.parametrize(("case", "row", "rule", "term"), REFUSED.values(), ids=REFUSED)
def test_plant_outside_the_class_is_refused_with_row_rule_and_term(case, row, rule, term):
    result = classify(case)
    assert not result.accepted
    first = result.violations[0]
    assert (first.row, first.rule) == (row, rule)
    assert term is None or first.term == term
    assert str(first).startswith(f"row {row}: {first.term}: ") and "\n" not in str(first)


VANISHING = {
    "x1": (x1, {x1: 0}),
    "x1 - 2": (x1 - 2, {x1: 2}),
    "a zero without change of sign": ((x1 - 3) ** 2, {x1: 3}),
    "cos x1": (cos(x1), {x1: sp.pi / 2}),
    "1 + cos x1": (1 + cos(x1), {x1: sp.pi}),
    "two squares that vanish together": (x1**2 + sin(x1) ** 2, {x1: 0}),
    "two bowls that touch 0 together": (2 - sp.exp(-(x1**2)) - cos(x1), {x1: 0}),
    "two even powers": (x1**4 + sp.tanh(x1) ** 2, {x1: 0}),
    "two squares off the origin": ((x1 - 1) ** 2 + sp.sinh(x1 - 1) ** 2, {x1: 1}),
    "two squares at pi": (sin(x1) ** 2 + (x1 - sp.pi) ** 4, {x1: sp.pi}),
    "exp(x1) - 2": (sp.exp(x1) - 2, {x1: sp.log(2)}),
}


@pytest.mark.parametrize(("gain", "zero"), VANISHING.values(), ids=VANISHING)
def test_gain_that_vanishes_is_refused_with_the_point(gain, zero):
    (violation,) = classify(plant(gain * x2, u)).violations
    assert violation.rule is Rule.GAIN_VANISHES
    assert gain.subs(violation.point) == 0
    assert abs(float(violation.point[x1])) == pytest.approx(abs(float(zero[x1])))


@pytest.mark.parametrize(
    "gain", [x1 + x2, 1 + x1 * x2, x1**2 + x2**2 - 25, x1 + sp.exp(x2) - 3 * sin(x1 * x2) - 7], ids=str
)
def test_gain_of_two_states_that_vanishes_is_refused_with_a_point(gain):
    (violation,) = classify(plant(x2, gain * u)).violations
    assert violation.rule is Rule.GAIN_VANISHES
    assert abs(float(gain.subs(violation.point))) < 1e-9


@pytest.mark.parametrize(("gain", "end"), [(sp.exp(x1), -sp.oo), (1 / (1 + x1**2), sp.oo)], ids=str)
def test_gain_that_tends_to_zero_is_not_bounded_away_from_it(gain, end):
    (violation,) = classify(plant(gain * x2, u)).violations
    assert violation.rule is Rule.GAIN_VANISHES
    assert violation.point == {x1: end}
    assert "tends to 0 as x1 -> " in violation.reason


@pytest.mark.parametrize("entry", [1 / x1, sp.sqrt(x1), sp.log(x1), 1 / sin(x1)], ids=str)
def test_pole_or_branch_point_is_refused_with_the_point(entry):
    (violation,) = classify(plant(x2 + theta * entry, u)).violations
    assert (violation.row, violation.rule, violation.point) == (1, Rule.NOT_SMOOTH, {x1: 0})


def test_root_of_a_constant_of_unknown_sign_is_not_known_to_be_real():
    (violation,) = classify(plant(x2 + sp.sqrt(c) * x1, u, constants=(c,))).violations
    assert (violation.row, violation.rule, violation.term) == (1, Rule.NOT_SMOOTH, sp.sqrt(c))
    assert classify(plant(x2 + sp.sqrt(b_positive) * x1, u, constants=(b_positive,))).accepted


@pytest.mark.parametrize(
    "entry", [1 / (1 + x1**2), sp.sqrt(2 + cos(x1)), sp.log(1 + x1**2), x1 ** sp.Rational(4, 2)], ids=str
)
def test_smooth_entry_is_accepted(entry):
    assert classify(plant(x2 + theta * entry, u)).accepted


def test_unproven_gain_is_accepted_as_a_stated_assumption():
    f1, g1 = sp.Function("f1")(x1), sp.Function("g1")(x1)
    form = strict_feedback(plant(f1 + g1 * x2, u))
    assert "f1(x1) in row 1 is known and smooth" in form.assumptions
    assert any(a.startswith("g_1 = g1(x1) is bounded away from 0") for a in form.assumptions)


def test_every_broken_rule_of_every_row_is_reported():
    found = classify(plant(sin(x2) + x3 + u, theta**2 + x3, x1)).violations
    assert [(v.row, v.rule) for v in found] == [
        (1, Rule.STATE_AHEAD),
        (1, Rule.INPUT_EARLY),
        (1, Rule.PURE_FEEDBACK),
        (2, Rule.NONLINEAR_IN_PARAMETERS),
        (3, Rule.NEXT_STATE_ABSENT),
    ]


def direct(**change):
    entries = {"f": (0, x1), "g": (1, 1), "phi": ((x1,), (x2,))} | change
    return lambda: StrictFeedback((x1, x2), u, (theta,), **entries)


BAD_INPUT = {
    "too few rows": (lambda: Plant((x1, x2), u, (), (x2,)), "the right-hand side: 1 given, 2 needed"),
    "a row that is a string": (lambda: plant("x2", u), "row 1: 'x2' is not a SymPy expression"),
    "a row with a double": (lambda: plant(x2, u + 1.2 * x1), "row 2: .* is not exact"),
    "an imaginary coefficient": (lambda: plant(sp.I * x1 + x2, u), r"row 1: I\*x1 \+ x2 is not real"),
    "the root of a negative number": (lambda: plant(x2 + sp.sqrt(-2) * theta, u), "row 1: .* is not real"),
    "a power of a negative number": (
        lambda: plant(x2, u + sp.Integer(-2) ** sp.Rational(1, 3)),
        "row 2: .* is not real",
    ),
    "the logarithm of a negative number": (lambda: plant(x2, u + x1 * sp.log(-3)), "row 2: .* is not real"),
    "an arc sine beyond 1": (lambda: plant(x2 + x1 * sp.asin(2), u), "row 1: .* is not real"),
    "an imaginary constant": (
        lambda: plant(x2, u, constants=(sp.Symbol("c", imaginary=True),)),
        "the constant c is not a real number",
    ),
    "an infinite row": (lambda: plant(x2, u + sp.oo), "row 2: .* is not exact and finite"),
    "a state that is a string": (lambda: Plant(("x1",), u, (), (u,)), "the state 'x1' is not a SymPy symbol"),
    "a symbol twice": (lambda: Plant((x1, x1), u, (), (x1, u)), "the symbol x1 is declared twice"),
    "no states": (lambda: Plant((), u, (), ()), "at least one state"),
    "one string for all states": (lambda: Plant("x1", u, (), (u,)), "states must be a sequence"),
    "unknown symbol": (lambda: strict_feedback(plant(x2, u + d)), "row 2: d: d is declared neither"),
    "f too short": (direct(f=(0,)), "f: 1 given, 2 needed"),
    "phi too narrow": (direct(phi=((), (x2,))), "row 1: phi_1: 0 given, 1 needed"),
    "phi flat": (direct(phi=(x1, x2)), "row 1: phi_1: x1 is not a sequence"),
    "f ahead": (direct(f=(x2, 0)), "row 1: x2: f_1 may use x1 alone, and x2 lies ahead"),
    "theta in g": (direct(g=(theta, 1)), "row 1: theta: g_1 may use x1 alone, and theta is unknown"),
    "u in phi": (direct(phi=((x1,), (u,))), "row 2: u: phi_2 may use x1, x2 alone, and u is the input"),
    "undeclared in f": (direct(f=(d, 0)), "row 1: d: f_1 may use x1 alone, and d is not declared"),
    "g zero": (direct(g=(1, 0)), "row 2: 0: g_2 is 0"),
    "g vanishing": (direct(g=(1, x2 - 5)), "row 2: x2 - 5: g_2 vanishes at x2 = 5"),
}


@pytest.mark.parametrize(("build", "message"), BAD_INPUT.values(), ids=BAD_INPUT)
def test_bad_input_is_a_one_line_error_that_names_the_place(build, message):
    with pytest.raises(DesignError, match=message) as error:
        build()
    assert "\n" not in str(error.value)


def test_refusal_carries_its_violations():
    with pytest.raises(NotStrictFeedback) as error:
        strict_feedback(plant(x1 + sin(x2), u))
    assert error.value.violations[0].rule is Rule.PURE_FEEDBACK
