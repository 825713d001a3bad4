# SPDX-License-Identifier: MIT
"""The closed loop of any plant as functions of arrays, derived from its design.

The parts of the design keep their names, and derivatives are taken through them: written out, the expressions swell.
Those of the lesson's plant are kept as source in `closed_loop`, so that its programs are judged without SymPy.
"""

import inspect
import subprocess
import sys
from collections.abc import Sequence

import sympy as sp

from conformance.atomic import write_atomically
from conformance.places import PACKAGE
from conformance.theory.lesson import LESSON
from conformance.theory.program import Program, needed
from conformance.truth.exact import Function, Functions, digest_of_family
from conformance.truth.experiment import Family, family


def derived(of: Family) -> Functions:
    """The functions of a family of closed loops, by name."""
    time, states = sp.Symbol("t"), [sp.Symbol(f"y{i}") for i, _ in enumerate(of.loop.states)]
    free = [sp.Symbol(f"p{i}") for i, _ in enumerate(of.parameters)]
    plain = {of.loop.time: time} | dict(zip((*of.loop.states, *of.parameters), (*states, *free), strict=True))
    plain |= {name: sp.Symbol(f"v{i}") for i, (name, _) in enumerate(of.loop.definitions)}
    program = Program((time, *states))
    for name, e in of.loop.definitions:
        program.let(plain[name].name, e.xreplace(plain))

    def own(expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
        return [e.xreplace(plain) for e in expressions]

    loop = of.loop
    field, z, (V, fall, u, r) = own(loop.rhs), own(loop.z), own((loop.V, loop.dissipation, loop.u, loop.reference))
    flow = {time: sp.S.One, **dict(zip(states, field, strict=True))}
    wanted = {
        "control": [u],
        "first": field,
        "second": [program.derivative_along(e, flow) for e in field],
        "errors": z,
        "lyapunov": [V],
        "dissipation": [fall, program.derivative_along(fall, flow)],
        "gradients": [program.diff(e, state) for e in (*field, *z, V, fall) for state in states],
    }
    made = {name: _function((time, *states, *free), expressions, program) for name, expressions in wanted.items()}
    reference = _function((time, *free), [r, program.diff(r, time)], program)
    return Functions(of.names, {"reference": reference, **made})


def _function(arguments: Sequence[sp.Symbol], expressions: list[sp.Expr], program: Program) -> Function:
    used = needed(expressions, program.definitions)
    shared = [(name, e) for name, e in program.definitions.items() if name in used]
    made: Function = sp.lambdify(arguments, expressions, "numpy", cse=lambda _: (shared, expressions))
    return made


# ---- Those of the lesson's plant, as source ----


def module() -> str:
    """The source of `closed_loop`."""
    functions = derived(family(LESSON))
    head = f'''# SPDX-License-Identifier: MIT
# Written by: python -m conformance.truth.functions
"""The closed loop of the lesson's plant under the controller derived for it; `functions` derived what stands here.

Each function gives a list of arrays, or numbers, from t (s), states and estimates y, and the PARAMETERS p.
"""

from typing import Any

from numpy import cos, sin

FAMILY = "{digest_of_family(LESSON)}"
PARAMETERS = {functions.parameters!r}

'''
    text = head + "\n".join(_source(name, function) for name, function in functions.by_name.items())
    command = [sys.executable, "-m", "ruff", "format", "--line-length", "120", "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


def _source(name: str, function: Function) -> str:
    arguments = ", ".join(f"{argument}: Any" for argument in inspect.signature(function).parameters)
    return f"def {name}({arguments}) -> list[Any]:\n{inspect.getsource(function).partition(chr(10))[2]}"


if __name__ == "__main__":
    write_atomically(PACKAGE / "truth" / "closed_loop.py", module())
