# SPDX-License-Identifier: MIT
"""The closed loop of any plant as functions of arrays, derived and made in this process; nothing is read from a file.

The parts of the design keep their names, and derivatives are taken through them: written out, the expressions swell.
"""

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

from conformance.theory.design import ClosedLoop
from conformance.theory.program import Program, needed


def derived(loop: ClosedLoop) -> dict[str, Callable[..., Any]]:
    """The functions of `exact`, by name, of t (s) and the states; each gives a list of arrays or numbers."""
    time, states = sp.Symbol("t"), [sp.Symbol(f"y{i}") for i, _ in enumerate(loop.states)]
    plain = {loop.time: time, **dict(zip(loop.states, states, strict=True))}
    plain |= {name: sp.Symbol(f"v{i}") for i, (name, _) in enumerate(loop.definitions)}
    program = Program((time, *states))
    for name, e in loop.definitions:
        program.let(plain[name].name, e.xreplace(plain))

    def own(expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
        return [e.xreplace(plain) for e in expressions]

    field, z, (V, fall, u, r) = own(loop.rhs), own(loop.z), own((loop.V, loop.dissipation, loop.u, loop.reference))
    flow = {time: sp.S.One, **dict(zip(states, field, strict=True))}
    gradients = [program.diff(e, state) for e in (*field, *z, V, fall) for state in states]
    wanted = {
        "control": [u],
        "first": field,
        "second": [program.derivative_along(e, flow) for e in field],
        "errors": z,
        "lyapunov": [V],
        "dissipation": [fall, program.derivative_along(fall, flow)],
        "gradients": gradients,
    }
    made = {name: _function((time, *states), expressions, program) for name, expressions in wanted.items()}
    return made | {"reference": _function((time,), [r], program)}


def _function(arguments: Sequence[sp.Symbol], expressions: list[sp.Expr], program: Program) -> Callable[..., Any]:
    used = needed(expressions, program.definitions)
    shared = [(name, e) for name, e in program.definitions.items() if name in used]
    made: Callable[..., Any] = sp.lambdify(arguments, expressions, "numpy", cse=lambda _: (shared, expressions))
    return made
