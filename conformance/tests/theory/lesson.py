# SPDX-License-Identifier: MIT
"""What the tests share: the lesson's plant and experiment, random plants, and a plain Runge-Kutta integrator."""

import functools
import itertools
import random

import sympy as sp

from conformance.theory.design import closed_loop, tuning_functions
from conformance.theory.strict_feedback import Plant, StrictFeedback, strict_feedback

x1, x2, u, theta, theta_hat, t = sp.symbols("x1 x2 u theta theta_hat t")
r, r_dot, r_ddot = sp.symbols("r r' r''")
k1, k2, gamma = sp.symbols("k1 k2 gamma", positive=True)

EXPERIMENT = {k1: 2, k2: "2.5", gamma: 3}  # (10)
START = (1.2, -0.5, 0.0)  # (10)
REFERENCE = sp.Rational(1, 2) * sp.sin(sp.Rational(7, 10) * t)  # (10)


def lesson_design():
    """The design of (7), with the gains as symbols."""
    plant = Plant((x1, x2), u, (theta,), (x2 + theta * x1, u))  # (7)
    return tuning_functions(strict_feedback(plant), (k1, k2), gamma)


def lesson_loop(reference=REFERENCE):
    """The closed loop of the experiment (10)."""
    return closed_loop(lesson_design(), ["1.2"], reference, EXPERIMENT)


def random_cubic(source, states):
    """A polynomial of degree 3: the cube of the last state and up to six others, with rational coefficients."""
    monomials = list(itertools.combinations_with_replacement((1, *states), 3))[:-1]
    drawn = [*source.sample(monomials, min(6, len(monomials))), 3 * states[-1:]]
    return sp.Add(*(sp.Rational(source.choice((-1, 1)) * source.randint(1, 9), 4) * sp.Mul(*m) for m in drawn))


def random_plant(n, p, source):
    """A strict-feedback plant of cubic f_i and phi_i, and g_i = plus or minus (1 + square), which never vanishes."""
    x, thetas = sp.symbols(f"x1:{n + 1}"), sp.symbols(f"theta1:{p + 1}")
    f = [random_cubic(source, x[:i]) for i in range(1, n + 1)]
    lines = [sum(source.randint(-4, 4) * s for s in x[:i]) for i in range(1, n + 1)]
    g = [source.choice((-1, 1)) * (1 + line**2) for line in lines]
    phi = [[random_cubic(source, x[:i]) for _ in range(p)] for i in range(1, n + 1)]
    return StrictFeedback(x, u, thetas, f, g, phi)


def random_gains(n, source):
    """n positive rationals."""
    return [sp.Rational(source.randint(1, 12), source.randint(2, 5)) for _ in range(n)]


def random_Gamma(p, source):
    """A full symmetric positive definite rational matrix, A A' + I."""
    A = sp.Matrix(p, p, lambda i, j: sp.Rational(source.randint(-6, 6), source.randint(1, 4)))
    return A * A.T + sp.eye(p)


def new_random_design(n, p):
    """A design for a random plant, with random gains and a full Gamma; the same one for the same n and p."""
    source = random.Random(f"{n} {p}")
    return tuning_functions(random_plant(n, p, source), random_gains(n, source), random_Gamma(p, source))


random_design = functools.cache(new_random_design)


def integrate(loop, start, horizon, h=0.002):
    """Return the states at the horizon by classical Runge-Kutta of order 4."""
    f = sp.lambdify((loop.time, *loop.states), [loop.explicit(e) for e in loop.rhs], "math", cse=True)
    y = list(start)
    for step in range(round(horizon / h)):
        s = step * h
        a = f(s, *y)
        b = f(s + h / 2, *(v + h / 2 * d for v, d in zip(y, a, strict=True)))
        c = f(s + h / 2, *(v + h / 2 * d for v, d in zip(y, b, strict=True)))
        e = f(s + h, *(v + h * d for v, d in zip(y, c, strict=True)))
        slopes = zip(y, a, b, c, e, strict=True)
        y = [v + h / 6 * (d1 + 2 * d2 + 2 * d3 + d4) for v, d1, d2, d3, d4 in slopes]
    return y
