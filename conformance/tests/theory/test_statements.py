# SPDX-License-Identifier: MIT
"""The statements of a design read as the lesson's, agree with the recursion, and pass the V' identity as written."""

import random
import re
from dataclasses import replace
from fractions import Fraction

import pytest
import sympy as sp

from conformance.programs.ports import ROOT
from conformance.theory import expressions
from conformance.theory.design import random_rational
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment, Unknown
from conformance.theory.expressions import Expression, Negative, Product, Sum, names_in, operations
from conformance.theory.identity import Dual, Functions, WrongStatement, dual, prove
from conformance.theory.program import evaluate
from conformance.theory.reader import read
from conformance.theory.statements import (
    CONTROLLER,
    LARGE,
    REFERENCE,
    REGRESSOR,
    Statement,
    TooLarge,
    ordered_form,
    parameters_of,
    reference_names,
    statements_of,
)
from conformance.theory.symbolic import design_of, form_of, symbols_of, to_sympy

from .lesson import random_gains, random_Gamma, random_plant

PLANTS = {path.stem: path for path in sorted((ROOT / "plants").glob("*.toml"))}

LESSON = """
r = amplitude * sin(omega * t)  # (15) reference
r_dot = amplitude * omega * cos(omega * t)  # (15) its first derivative
r_ddot = -amplitude * omega * omega * sin(omega * t)  # (15) its second derivative
phi = x1  # (4) regressor
z1 = x1 - r  # (5) tracking error
alpha1 = -k1 * z1 - theta_hat * phi + r_dot  # (7) virtual control
z2 = x2 - alpha1  # (5) deviation from the virtual control
# phi(x1) = x1 has the derivative 1
alpha1_x1 = -k1 - theta_hat  # (7) partial derivative of alpha1 by x1
tau2 = phi * z1 - alpha1_x1 * phi * z2  # (7) tuning function
theta_hat_dot = gamma * tau2  # (7) update law
# alpha1' with theta_hat in the place of theta, as if constant
alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * phi) + k1 * r_dot + r_ddot  # (7) known part
# alpha1 moves with theta_hat too: hence the last term
u = alpha1_dot_known - z1 - k2 * z2 - phi * theta_hat_dot  # (7) control
x1_dot = x2 + theta_true * phi  # (7) plant, row 1
x2_dot = u  # (7) plant, row 2
"""


def experiment(name: str) -> Experiment:
    return read_experiment(PLANTS[name])


def controller(e: Experiment, large: bool = False) -> list[Statement]:
    return [s for s in statements_of(e, large) if s.section in (REGRESSOR, CONTROLLER)]


def random_experiment(n: int, p: int, seed: int) -> Experiment:
    """An experiment of a random plant with cubic rows, gains g_i that depend on the state, and a full Gamma."""
    source = random.Random(seed)
    plant = random_plant(n, p, source)
    states = tuple(s.name for s in plant.states)
    rows = tuple(read(str(row)) for row in plant.rhs)
    unknown = tuple(Unknown(s.name, Fraction(1), Fraction(0)) for s in plant.parameters)
    Gamma = tuple(tuple(Fraction(int(v.p), int(v.q)) for v in row) for row in random_Gamma(p, source).tolist())
    k = tuple(Fraction(int(v.p), int(v.q)) for v in random_gains(n, source))
    zero = (Fraction(0),) * n
    return Experiment(
        "random", "random", "ours", states, rows, (), unknown, k, Gamma, read("sin(t)"), zero, Fraction(1)
    )


RANDOM = [(1, 0), (1, 2), (2, 0), (2, 3), (3, 1)]


# ------------------------------------------------------------------ how they read


def test_the_statements_of_the_lesson_are_its_own_lines() -> None:
    written = []
    for s in statements_of(experiment("Chapter17_Lesson1")):
        written += [f"# {s.remark}"] * bool(s.remark) + [f"{s}  # {s.tag} {s.wording}"]
    assert written == LESSON.strip().splitlines()


def test_the_lesson_written_by_hand_holds_the_same_lines() -> None:
    lines = [
        line.strip().replace("np.", "") for line in (ROOT / "python" / "Chapter17_Lesson1.py").read_text().splitlines()
    ]
    for name in ("amplitude", "omega", "k1", "k2", "gamma", "theta_true"):
        lines = [line.replace(name.upper(), name) for line in lines]
    assert [line for line in LESSON.strip().splitlines() if line not in lines] == []


def test_problem_6_differs_from_the_lesson_in_its_reference_alone() -> None:
    lesson, problem_6 = (statements_of(experiment(name)) for name in ("Chapter17_Lesson1", "problem_6"))
    assert {a.name for a, b in zip(lesson, problem_6, strict=True) if a != b} == {"r", "r_dot", "r_ddot"}


@pytest.mark.parametrize("name", PLANTS)
def test_statements_can_be_computed_in_their_order_and_none_is_idle(name: str) -> None:
    e = experiment(name)
    statements = statements_of(e)
    known = {"t", *e.states, *e.estimates, *(p.name for p in parameters_of(e))}
    for s in statements:
        assert set(names_in(s.expression)) <= known and s.name not in known, s
        known.add(s.name)
    used = {name for s in statements for name in names_in(s.expression)}
    rates = {f"{name}_dot" for name in (*e.states, *e.estimates)}
    assert [s.name for s in statements if s.name not in used | rates] == []


def test_problem_1c_is_short_enough_to_be_read() -> None:
    statements = controller(experiment("problem_1c"))
    assert len(statements) <= 45 and sum(operations(s.expression) for s in statements) < 153


def test_what_belongs_together_is_named_together_and_stands_together() -> None:
    names = [s.name for s in controller(experiment("problem_1c"))]
    assert {"w3_1", "w3_2", "tau2_1", "tau2_2", "x1_dot_known", "x2_dot_known"} <= {*names}
    partials = [i for i, name in enumerate(names) if re.match(r"alpha2_(x\d|r)|alpha2_theta", name)]
    assert names.index("z3") < partials[0] and partials[-1] < names.index("w3_1")


def test_remarks_tell_terms_of_a_moving_estimate_from_those_that_earlier_tau_lack() -> None:
    remarks = {s.name: s.remark for s in controller(experiment("problem_1c"))}
    assert remarks["alpha2"].endswith("hence the last term, with tau2_1 since tau3_1 needs alpha2 itself")
    assert remarks["u"].endswith("hence the terms with theta1_hat_dot and theta2_hat_dot; "
                                 "the last term of u makes up for w3_1 z3, which tau2_1 lacks")  # fmt: skip
    remarks = {s.name: s.remark for s in controller(experiment("chain_4"))}
    assert remarks["alpha3"].endswith("hence the term before the last, with tau3 since tau4 needs alpha3 itself; "
                                      "the last term of alpha3 makes up for w3 z3, which tau2 lacks")  # fmt: skip
    assert remarks["u"].endswith("hence the term with theta_hat_dot; "
                                 "the last 2 terms of u make up for w4 z4, which tau2 and tau3 lack")  # fmt: skip
    remarks = {s.name: s.remark for s in controller(experiment("ship_course"))}
    assert remarks["u"].endswith("d_hat, n1_hat and n3_hat too: hence the terms with their derivatives")


def test_remarks_tell_where_each_of_three_steps_or_more_begins() -> None:
    told = {name: [s for s in controller(experiment(name)) if s.remark.startswith("step ")] for name in PLANTS}
    assert [(s.name, s.remark) for s in told["motor_arm"]] == [
        ("z1", "step 1 of 3: z1, and alpha1 for v to follow"),
        ("g2", "step 2 of 3: z2, and alpha2 for I to follow"),
        ("z3", "step 3 of 3: z3, the update laws, and u"),
    ]
    assert told["khalil"][-1].remark == "step 3 of 3: z3 and u" and len(told["chain_4"]) == 4
    assert told["Chapter17_Lesson1"] == []


def test_a_partial_derivative_says_by_what() -> None:
    wordings = {s.name: s.wording for s in controller(experiment("chain_4"))}
    assert wordings["alpha3_r_dot"] == "partial derivative of alpha3 by r_dot"
    assert wordings["w2_x1_x1"] == "second partial derivative of w2 by x1"
    assert wordings["alpha2_x1_theta_hat"] == "second partial derivative of alpha2 by x1 and theta_hat"


def test_a_chain_of_four_states_is_short_enough_to_be_written() -> None:
    assert len(controller(experiment("chain_4"))) <= LARGE


@pytest.mark.beyond
def test_a_design_of_five_states_is_refused_unless_it_is_asked_for() -> None:
    states = tuple(f"x{i}" for i in range(1, 6))
    rows = tuple(map(read, ("x2 + theta*x1^2", "x3", "x4", "x5", "u")))
    one = (Fraction(1),) * 5
    e = replace(experiment("chain_4"), states=states, rows=rows, k=one, start=one)
    with pytest.raises(TooLarge, match="--large"):
        statements_of(e)
    wordings = [s.wording for s in controller(e, large=True)]
    assert len(wordings) > LARGE and "third partial derivative of alpha2 by x1 twice and x2" in wordings


def test_a_constant_is_a_name_in_the_statements_and_a_number_in_the_proof() -> None:
    e = experiment("motor_arm")
    assert {"M", "L", "R", "K_B"} <= {name for s in controller(e) for name in names_in(s.expression)}
    assert form_of(e).g[1] == 2


def test_a_constant_reference_leaves_no_derivatives_behind() -> None:
    names = {s.name for s in statements_of(experiment("khalil"))}
    assert "r" in names and "r_dot" not in names and not any("_r" in name for name in names)


# ------------------------------------------------------------------ that they are right


@pytest.mark.parametrize("name", PLANTS)
def test_the_statements_as_written_pass_the_identity(name: str) -> None:
    e = experiment(name)
    prove(e, statements_of(e))


@pytest.mark.parametrize("size", RANDOM, ids=str)
def test_the_statements_of_random_plants_pass_the_identity_and_agree_with_the_recursion(size: tuple[int, int]) -> None:
    e = random_experiment(*size, seed=sum(size))
    prove(e, statements_of(e, large=True))
    compare_with_recursion(e)


@pytest.mark.parametrize("name", PLANTS)
def test_the_statements_give_the_control_and_the_update_law_of_the_recursion(name: str) -> None:
    compare_with_recursion(experiment(name))


def compare_with_recursion(e: Experiment) -> None:
    """z_i, alpha_i, u and theta_hat' by the statements and by the recursion, at a random point, exactly."""
    derived, statements = design_of(e), controller(e, large=True)
    source = random.Random(1)
    functions = Functions(source)
    written = {s.name for s in statements_of(e, large=True) if s.section == REFERENCE}
    known = {name: random_rational(source) for name in (*e.states, *e.estimates)}
    known |= {r: random_rational(source) if r in written else Fraction(0) for r in reference_names(len(e.states) + 1)}
    point = dict(zip(derived.plant.states, map(known.get, e.states), strict=True))
    point |= dict(zip(derived.theta_hat, map(known.get, e.estimates), strict=True))
    point |= dict(zip(derived.r, map(known.get, reference_names(len(e.states) + 1)), strict=True))

    def function(f: sp.Expr) -> Fraction:
        return functions(f.func.__name__, theirs(f.args[0]))

    def theirs(part: sp.Expr) -> Fraction:
        return evaluate(part, point, derived.program.definitions, function)

    known |= {p.name: p.value for p in parameters_of(e) if p.name not in known}
    for s in statements:
        known[s.name] = dual(s.expression, {name: Dual(value) for name, value in known.items()}, functions).value
    n = len(e.states)
    ours = (
        [f"z{i}" for i in range(1, n + 1)]
        + [f"alpha{i}" for i in range(1, n)]
        + ["u", *(f"{s}_dot" for s in e.estimates)]
    )
    assert [known[name] for name in ours] == list(map(theirs, (*derived.z, *derived.alpha, *derived.theta_hat_dot)))


@pytest.mark.parametrize("name", PLANTS)
def test_f_g_and_phi_in_their_authors_order_are_those_of_the_classification(name: str) -> None:
    e = experiment(name)
    ordered, form = ordered_form(e), form_of(e)
    for ours, theirs in zip(
        (*ordered.f, *ordered.g, *sum(ordered.phi, ())), (*form.f, *form.g, *sum(form.phi, ())), strict=True
    ):
        assert sp.simplify(to_sympy(ours, symbols_of(e)) - theirs) == 0


@pytest.mark.parametrize("name", PLANTS)
def test_the_rows_of_the_plant_are_the_authors(name: str) -> None:
    e = experiment(name)
    statements = statements_of(e)
    values = {s.name: s.expression for s in statements if s.name.startswith("phi")}
    back = {f"{p.name}_true": sp.Symbol(p.name) for p in e.unknown}

    def symbol(name: str) -> sp.Expr:
        return to_sympy(values[name], symbols_of(e)) if name in values else back.get(name, symbols_of(e)(name))

    for row, s in zip(e.rows, statements[-len(e.rows) :], strict=True):
        assert sp.expand(to_sympy(s.expression, symbol) - to_sympy(row, symbols_of(e))) == 0


# ------------------------------------------------------------------ that a wrong one is refused


def broken(e: Expression) -> Expression | None:
    """The expression with the sign of its last term or factor turned."""
    if isinstance(e, Sum):
        return Sum((*e.terms[:-1], expressions.negative(e.terms[-1])))
    if isinstance(e, Product):
        return Negative(e)
    return None


@pytest.mark.parametrize("name", ["Chapter17_Lesson1", "problem_1c"])
def test_a_wrong_sign_in_any_statement_is_refused(name: str) -> None:
    e = experiment(name)
    statements = statements_of(e)
    tried = 0
    for i, s in enumerate(statements):
        wrong = broken(s.expression)
        if wrong is not None:
            tried += 1
            with pytest.raises(WrongStatement):
                prove(e, (*statements[:i], s._replace(expression=wrong), *statements[i + 1 :]))
    assert tried >= 8


def test_the_proof_uses_the_statements_and_not_the_recursion() -> None:
    e = experiment("Chapter17_Lesson1")
    by_hand = [s._replace(expression=read(f"0*gamma + {expressions.text(s.expression)}")) for s in statements_of(e)]
    prove(e, by_hand)
    idle = [s._replace(expression=read("0")) if s.name == "theta_hat_dot" else s for s in by_hand]
    with pytest.raises(WrongStatement):
        prove(e, idle)


@pytest.mark.parametrize(
    "row",
    [
        "x2 + theta*exp(-x1^2)",
        "x2 + theta*sqrt(1 + x1^2)",
        "exp(atan(x1))*x2 + theta*x1^2",
        "x2*(2 + tanh(x1)) + log(2 + sin(x1)) + theta*(1 + x1^2)^(3/2)",
    ],
)
def test_functions_of_every_kind_are_proven(row: str) -> None:
    e = replace(experiment("Chapter17_Lesson1"), rows=(read(row), read("u*(3 - cos(x2)) + theta*cosh(x1)*sinh(x2)")))
    prove(e, statements_of(e))


# ------------------------------------------------------------------ constants


def test_the_constants_of_the_lesson_are_those_of_its_programs() -> None:
    stated = {p.name: str(p.value) for p in parameters_of(experiment("Chapter17_Lesson1"))}
    assert stated == {
        "theta_true": "6/5", "k1": "2", "k2": "5/2", "gamma": "3", "amplitude": "1/2", "omega": "7/10",
        "x1_start": "6/5", "x2_start": "-1/2", "theta_hat_start": "0", "final_time": "20",
    }  # fmt: skip


def test_a_full_Gamma_states_its_entries_and_a_diagonal_one_its_diagonal() -> None:
    full, diagonal = (parameters_of(experiment(name)) for name in ("problem_5", "motor_arm"))
    assert [p.name for p in full if "gamma" in p.name] == ["gamma11", "gamma12", "gamma22"]
    assert [p.name for p in diagonal if "gamma" in p.name] == ["gamma1", "gamma2"]


def test_names_that_would_mean_two_things_are_refused() -> None:
    e = experiment("chain_4")
    rows = tuple(map(read, ("a_r + theta*a^2", "b", "c", "u")))
    with pytest.raises(ValueError, match="two things"):
        statements_of(replace(e, states=("a", "a_r", "b", "c"), rows=rows))
