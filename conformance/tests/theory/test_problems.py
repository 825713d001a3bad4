# SPDX-License-Identifier: MIT
"""Problems 2 to 5 of (17), worked. Each test is read as a solution: what is given, what is found, why it holds."""

import dataclasses

import pytest
import sympy as sp

from conformance.theory.design import V_dot, check_identity, dissipation, identity_holds, tuning_functions
from conformance.theory.strict_feedback import StrictFeedback, is_zero

from .lesson import (
    START,
    gamma,
    integrate,
    k1,
    k2,
    lesson_design,
    lesson_loop,
    r,
    r_ddot,
    r_dot,
    theta,
    theta_hat,
    u,
    x1,
    x2,
)

f1, g1, phi1 = (sp.Function(name)(x1) for name in ("f1", "g1", "phi1"))
theta_tilde = theta_hat - theta  # (5)


def same(a, b):
    return is_zero(a - b)


def test_problem_2_first_virtual_control_for_general_f1_g1_phi1():
    # Given x1' = f1 + g1 x2 + phi1 theta, whatever f1, g1 and phi1 are, ...
    plant = StrictFeedback((x1, x2), u, (theta,), (f1, 0), (g1, 1), ((phi1,), (0,)))
    design = tuning_functions(plant, (k1, k2), gamma)
    z1, z2 = map(design.explicit, design.z)

    # ... the virtual control cancels f1, follows r', damps z1, and puts theta_hat where theta is unknown, (6) ...
    assert same(design.explicit(design.alpha[0]), (-f1 + r_dot - k1 * z1 - phi1 * theta_hat) / g1)

    # ... which leaves damping, the next error, and the parameter error in z1', (6) ...
    z1_dot = f1 + g1 * x2 + phi1 * theta - r_dot
    assert same(z1_dot, -k1 * z1 + g1 * z2 - phi1 * theta_tilde)

    # ... and with the second step V' = -k1 z1^2 - k2 z2^2.
    assert identity_holds(design)


def test_problem_3_update_law_removes_the_parameter_error_from_the_derivative_of_V():
    # Leave theta_hat' open, in u as well as in the plant: u has the form of (7) with the unknown law in it.
    law = sp.Symbol("law")
    design = lesson_design()
    z1, z2 = design.z
    alpha1_x1 = design.program.diff(design.alpha[0], x1)
    alpha1_dot_known = alpha1_x1 * (x2 + theta_hat * x1) + k1 * r_dot + r_ddot  # (7)
    control = alpha1_dot_known - z1 - k2 * z2 - x1 * law  # (7)
    open_law = dataclasses.replace(design, u=control, theta_hat_dot=sp.Matrix([law]))

    # Then theta_tilde is a factor of all that V' has besides -k1 z1^2 - k2 z2^2, ...
    rest = design.explicit(V_dot(open_law) + dissipation(open_law))
    factor = design.explicit(-x1 * z1 + alpha1_x1 * x1 * z2) + law / gamma
    assert same(rest, theta_tilde * factor)

    # ... and the one law that makes the factor vanish, without knowing theta, is that of (7), the design's own.
    (solution,) = sp.solve(factor, law)
    assert same(solution, design.explicit(design.theta_hat_dot[0]))
    assert same(solution, gamma * design.explicit(x1 * z1 - alpha1_x1 * x1 * z2))
    assert not solution.has(theta)


def test_problem_4_vanishing_errors_do_not_identify_theta():
    # V' has no theta_tilde: it is 0 wherever z = 0, however wrong the estimate is, ...
    design = lesson_design()
    V_rate = sp.simplify(design.explicit(V_dot(design)))
    assert not V_rate.has(theta)

    # ... and once z = 0, adaptation stops, since tau_2 is a combination of z1 and z2.
    z1, z2 = design.z
    tau_2 = design.program.definitions[design.tau[1][0]].xreplace({design.tau[0][0]: x1 * z1})
    assert tau_2.subs({z1: 0, z2: 0}) == 0

    # With r = 0 the state itself is at rest with z = 0, for any estimate at all: nothing is left to learn from.
    rest = lesson_loop(reference=0)
    at_rest = {x1: 0, x2: 0}
    assert [sp.simplify(rest.explicit(e).subs(at_rest)) for e in rest.rhs] == [0, 0, 0]

    # And so it happens: the state goes to 0 and the estimate stops at 2.77724, not at theta = 1.2.
    x1_end, x2_end, theta_hat_end = integrate(rest, START, 20)
    assert abs(x1_end) < 1e-9 and abs(x2_end) < 1e-9
    assert theta_hat_end == pytest.approx(2.77724, abs=5e-6)


def test_problem_5_vector_theta_is_adapted_by_one_tuning_function_with_a_full_Gamma():
    # One row, theta in R^2: tau_1 = phi z_1 and theta_hat' = Gamma tau_1, with every entry of Gamma at work.
    g11, g12, g22 = sp.symbols("Gamma11 Gamma12 Gamma22", positive=True)
    Gamma = sp.Matrix([[g11, g12], [g12, g22]])
    thetas = sp.symbols("theta1:3")
    phi = sp.Matrix([x1**2, sp.sin(x1)])
    one_row = tuning_functions(StrictFeedback((x1,), u, thetas, (0,), (1,), (tuple(phi),)), (k1,), Gamma)
    assert one_row.explicit(one_row.tau[0]) == phi * (x1 - r)
    assert sp.simplify(one_row.explicit(one_row.theta_hat_dot) - Gamma * phi * (x1 - r)) == sp.zeros(2, 1)
    assert identity_holds(one_row)

    # A second row extends the sum, tau_2 = tau_1 + w_2 z_2, and leaves one estimate per parameter, not per row (16).
    rows = (tuple(phi), (x1 * x2, x2**2))
    two_rows = tuning_functions(StrictFeedback((x1, x2), u, thetas, (0, 0), (1, 1), rows), (k1, k2), Gamma)
    z1, z2 = two_rows.z
    w_2 = sp.Matrix(rows[1]) - two_rows.program.diff(two_rows.alpha[0], x1) * phi
    extended = two_rows.explicit(phi * z1 + w_2 * z2)
    assert sp.simplify(two_rows.explicit(two_rows.tau[1]) - extended) == sp.zeros(2, 1)
    assert sp.simplify(two_rows.explicit(two_rows.theta_hat_dot) - Gamma * extended) == sp.zeros(2, 1)
    assert len(two_rows.theta_hat) == 2
    check_identity(two_rows)
