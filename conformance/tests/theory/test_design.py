# SPDX-License-Identifier: MIT
"""The recursion (8) gives the lesson's formulas (7), and satisfies its Lyapunov identity exactly for every plant."""

import dataclasses

import pytest
import sympy as sp

from conformance.theory import design as design_module
from conformance.theory.design import (
    IdentityRefuted,
    V_dot,
    check_identity,
    dissipation,
    identity_holds,
    lyapunov_defect,
    tuning_functions,
)
from conformance.theory.program import evaluate
from conformance.theory.strict_feedback import DesignError, StrictFeedback, is_zero

from .lesson import (
    gamma,
    k1,
    k2,
    lesson_design,
    new_random_design,
    r,
    r_ddot,
    r_dot,
    random_design,
    theta,
    theta_hat,
    u,
    x1,
    x2,
)


def same(a, b):
    return is_zero(a - b)


# ------------------------------------------------------------------ (7), symbol for symbol


def test_lesson_plant_gives_the_formulas_of_section_7():
    design = lesson_design()
    got = design.explicit
    z1 = x1 - r
    alpha1 = -k1 * z1 - theta_hat * x1 + r_dot
    z2 = x2 - alpha1
    alpha1_x1 = -k1 - theta_hat
    tau2 = x1 * z1 - alpha1_x1 * x1 * z2
    theta_hat_dot = gamma * tau2
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot

    assert design.r == (r, r_dot, r_ddot)
    assert same(got(design.z[0]), z1)
    assert same(got(design.alpha[0]), alpha1)
    assert same(got(design.z[1]), z2)
    assert same(got(design.program.diff(design.alpha[0], x1)), alpha1_x1)
    assert same(got(design.w[1])[0], -alpha1_x1 * x1)
    assert same(got(design.tau[0])[0], x1 * z1)
    assert same(got(design.tau[1])[0], tau2)
    assert same(got(design.theta_hat_dot)[0], theta_hat_dot)
    assert same(got(design.u), alpha1_dot_known - z1 - k2 * z2 - x1 * theta_hat_dot)
    assert same(got(design.V), z1**2 / 2 + z2**2 / 2 + (theta_hat - theta) ** 2 / (2 * gamma))
    assert same(got(V_dot(design)), -k1 * z1**2 - k2 * z2**2)
    assert same(got(dissipation(design)), k1 * z1**2 + k2 * z2**2)


# ------------------------------------------------------------------ the identity V' + sum k_i z_i^2 = 0, (8)


def test_identity_holds_symbolically_for_the_lesson_plant():
    assert identity_holds(lesson_design())


def general_plant(n, p):
    """f_i, g_i, phi_i as undefined functions of xbar_i."""
    x, thetas = sp.symbols(f"x1:{n + 1}"), sp.symbols(f"theta1:{p + 1}")

    def row(name):
        return [sp.Function(f"{name}{i}")(*x[:i]) for i in range(1, n + 1)]

    columns = [row(f"phi_{j}_") for j in range(1, p + 1)]
    return StrictFeedback(x, u, thetas, row("f"), row("g"), list(zip(*columns, strict=True)))


def test_identity_holds_symbolically_for_every_plant_of_two_states_and_one_parameter():
    assert identity_holds(tuning_functions(general_plant(2, 1), (k1, k2), gamma))


@pytest.mark.beyond
@pytest.mark.parametrize("n", [1, 2, 3, 4])
@pytest.mark.parametrize("p", [1, 2, 3])
def test_identity_holds_exactly_for_random_cubic_plants_with_full_Gamma(n, p):
    check_identity(random_design(n, p))


@pytest.mark.beyond
@pytest.mark.parametrize(("n", "p"), [(2, 2), (3, 2), (4, 1)])
def test_identity_holds_exactly_for_undefined_functions_and_symbolic_gains(n, p):
    gains = sp.symbols(f"k1:{n + 1}", positive=True)
    Gamma = sp.Matrix(p, p, lambda i, j: sp.Symbol(f"Gamma{min(i, j)}{max(i, j)}", positive=True))
    check_identity(tuning_functions(general_plant(n, p), gains, Gamma))


def test_identity_holds_for_transcendental_rows():
    f, phi = (sp.sin(x1), x1 * sp.exp(x2)), ((sp.cos(x1),), (sp.sin(x1 * x2),))
    plant = StrictFeedback((x1, x2), u, (theta,), f, (2 + sp.sin(x1), sp.sqrt(1 + x2**2)), phi)
    design = tuning_functions(plant, (k1, k2), gamma)
    check_identity(design)


def test_plant_without_parameters_is_plain_backstepping():
    plant = StrictFeedback((x1, x2), u, (), (x1**2, x1 * x2), (1, 1), ((), ()))
    design = tuning_functions(plant, (k1, k2), [])
    assert identity_holds(design)
    assert design.theta_hat == () and design.theta_hat_dot.shape == (0, 1)


# ------------------------------------------------------------------ the identity refuses wrong designs

SIZES = pytest.mark.parametrize(("n", "p"), [(2, 1), (2, 3), (3, 2), (4, 1)])


def refused(design):
    with pytest.raises(IdentityRefuted) as error:
        check_identity(design, points=1)
    witness = error.value
    at_the_point = evaluate(lyapunov_defect(design), witness.point, design.program.definitions)
    return at_the_point == witness.value != 0


@SIZES
def test_update_law_stopped_at_the_first_tuning_function_is_refused(n, p):
    right = random_design(n, p)
    wrong = dataclasses.replace(right, theta_hat_dot=right.Gamma * right.tau[0])
    assert refused(wrong)


@SIZES
def test_control_without_its_theta_hat_dot_term_is_refused(n, p):
    right = random_design(n, p)
    d_theta_hat = right.program.gradient(right.alpha[n - 2], right.theta_hat)
    term = (d_theta_hat * right.theta_hat_dot)[0] / right.plant.g[n - 1]
    assert refused(dataclasses.replace(right, u=right.u - term))


@SIZES
def test_wrong_sign_in_the_regressor_is_refused(n, p, monkeypatch):
    def wrong_sign(i, phi, d_x):
        return phi[i] + sum((d_x[j] * phi[j] for j in range(1, i)), sp.zeros(p, 1))

    monkeypatch.setattr(design_module, "regressor", wrong_sign)
    assert refused(new_random_design(n, p))


@pytest.mark.beyond
@pytest.mark.parametrize(("n", "p"), [(3, 1), (3, 2)])
def test_recursion_without_the_terms_of_earlier_steps_is_refused(n, p, monkeypatch):
    def own_term_alone(i, program, alpha, theta_hat, Gamma, tau, w, z):
        return (program.gradient(alpha[i - 1], theta_hat) * Gamma * tau[i])[0]

    monkeypatch.setattr(design_module, "adaptation_terms", own_term_alone)
    assert refused(new_random_design(n, p))


def test_wrong_designs_of_the_lesson_plant_are_refused_symbolically():
    right = lesson_design()
    assert not identity_holds(dataclasses.replace(right, theta_hat_dot=gamma * right.tau[0]))
    assert not identity_holds(dataclasses.replace(right, u=right.u + x1 * right.theta_hat_dot[0]))
    assert not identity_holds(dataclasses.replace(right, theta_hat_dot=-right.theta_hat_dot))


def test_control_that_cancels_with_theta_where_theta_hat_belongs_is_refused():
    right = lesson_design()  # (16)
    assert not identity_holds(dataclasses.replace(right, u=right.explicit(right.u).subs(theta_hat, theta)))


# ------------------------------------------------------------------ bad input

BAD_GAINS = {
    "too few gains": ((1,), 1, "gains: 1 given, 2 needed"),
    "zero gain": ((1, 0), 1, "row 2: k_2 = 0 is not positive"),
    "negative gain": (("-2.5", 1), 1, "row 1: k_1 = -5/2 is not positive"),
    "gain of unknown sign": ((sp.Symbol("k"), 1), 1, "row 1: k_1 = k is not declared positive"),
    "double": ((2.5, 1), 1, "row 1: k_1: the double 2.5 is not exact; write '2.5'"),
    "no number": (("two", 1), 1, "row 1: k_1: 'two' is not a number"),
    "no scalar": (([2], 1), 1, r"row 1: k_1: \[2\] is not a SymPy expression"),
    "Gamma of the wrong size": ((1, 1), sp.eye(2), "Gamma must be 1 x 1"),
    "Gamma negative": ((1, 1), -3, "Gamma is not positive definite: leading minor 1 = -3"),
    "Gamma a double": ((1, 1), 0.5, r"Gamma\[1,1\]: the double 0.5 is not exact"),
}


@pytest.mark.parametrize(("k", "Gamma", "message"), BAD_GAINS.values(), ids=BAD_GAINS)
def test_bad_gains_are_a_one_line_error(k, Gamma, message):
    with pytest.raises(DesignError, match=message) as error:
        tuning_functions(lesson_design().plant, k, Gamma)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("Gamma", "message"),
    [
        ([[2, 1], [0, 2]], r"Gamma is not symmetric: Gamma\[2,1\] = 0, and across the diagonal stands 1"),
        ([[1, 2], [2, 1]], "Gamma is not positive definite: leading minor 2 = -3"),
        ([[1, 2], [2]], "Gamma must be 2 x 2"),
        (1, "Gamma must be 2 x 2"),
    ],
    ids=["not symmetric", "indefinite", "ragged", "scalar"],
)
def test_bad_matrix_Gamma_is_refused(Gamma, message):
    with pytest.raises(DesignError, match=message):
        tuning_functions(general_plant(1, 2), (1,), Gamma)


def test_plant_symbol_with_the_name_of_a_design_object_is_refused():
    z_1 = sp.Symbol("z_1")
    plant = StrictFeedback((z_1,), u, (), (0,), (1,), ((),))
    with pytest.raises(DesignError, match="symbol z_1 has the name of an object of the design"):
        tuning_functions(plant, (1,), [])
