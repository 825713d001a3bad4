# SPDX-License-Identifier: MIT
"""How far an expression that is computed in doubles may be from its value, by first-order error analysis.

Every number and every operation brings a relative error of at most one unit, 2^-52, a function four (Higham 2002,
chapter 3); what the operands bring is multiplied by the slopes.
"""

from collections.abc import Mapping

import numpy as np

from conformance.theory.expressions import (
    FUNCTIONS,
    Call,
    Expression,
    Name,
    Negative,
    Number,
    Power,
    Product,
    Quotient,
    Sum,
)
from conformance.truth.piecewise import Floats

UNIT = 2.0**-52
OF_FUNCTION = 4 * UNIT
FUNCTIONS_OF_ARRAYS = {name: getattr(np, {"atan": "arctan"}.get(name, name)) for name in FUNCTIONS}
SLOPES = {  # of the functions, from argument and value
    "sin": lambda a, v: np.cos(a),
    "cos": lambda a, v: np.sin(a),
    "tan": lambda a, v: 1 + v**2,
    "exp": lambda a, v: v,
    "log": lambda a, v: 1 / a,
    "sqrt": lambda a, v: 0.5 / v,
    "sinh": lambda a, v: np.cosh(a),
    "cosh": lambda a, v: np.sinh(a),
    "tanh": lambda a, v: 1 - v**2,
    "atan": lambda a, v: 1 / (1 + a**2),
}


def rounding(e: Expression, values: Mapping[str, float], t: Floats) -> Floats:
    """A bound of |expression in doubles - expression| at the times t (s), which are exact; shape (rows,)."""
    return np.broadcast_to(_worth(e, values, t)[1], t.shape)


def _worth(e: Expression, values: Mapping[str, float], t: Floats) -> tuple[Floats, Floats]:
    """The value and the bound of its error."""

    def own(value: Floats, error: Floats, unit: float = UNIT) -> tuple[Floats, Floats]:
        return value, error + unit * np.abs(value)

    def w(part: Expression) -> tuple[Floats, Floats]:
        return _worth(part, values, t)

    match e:
        case Number(number):
            return own(np.array(float(number)), np.zeros(()))
        case Name(name):
            return (t, np.zeros_like(t)) if name == "t" else own(np.array(values[name]), np.zeros(()))
        case Negative(of):
            a, error = w(of)
            return -a, error
        case Sum((first, *others)):
            a, error = w(first)
            for b, more in map(w, others):
                a, error = own(a + b, error + more)
            return a, error
        case Product((first, *others)):
            a, error = w(first)
            for b, more in map(w, others):
                a, error = own(a * b, error * np.abs(b) + np.abs(a) * more)
            return a, error
        case Quotient(over, under):
            (a, error), (b, more) = w(over), w(under)
            return own(a / b, (error + np.abs(a / b) * more) / np.abs(b))
        case Power(base, exponent):
            (a, error), n = w(base), float(exponent)
            return own(a**n, np.abs(n * a ** (n - 1)) * error, OF_FUNCTION)
        case Call(function, argument):
            a, error = w(argument)
            value = FUNCTIONS_OF_ARRAYS[function](a)
            return own(value, np.abs(SLOPES[function](a, value)) * error, OF_FUNCTION)
    raise AssertionError(e)
