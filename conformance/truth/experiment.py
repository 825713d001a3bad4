# SPDX-License-Identifier: MIT
"""From an experiment to the truth: the plant, the derived closed loop, and the enclosure of its solution.

No formula of the controller stands here: `design` derives them from the plant.
"""

import functools
import inspect
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from decimal import ROUND_UP, Decimal, localcontext
from fractions import Fraction

import sympy as sp
from flint import arb

from conformance.atomic import write_atomically
from conformance.places import PACKAGE
from conformance.theory.design import ClosedLoop, closed_loop, tuning_functions
from conformance.theory.experiments import Experiment, design_of, reference_of
from conformance.theory.scenario import PARAMETERS, POSITIVE, WAVES, Scenario
from conformance.theory.strict_feedback import Plant, strict_feedback
from conformance.truth.enclosure import Progress
from conformance.truth.setting import setting_of
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, InitialValueProblem, ball_function, enclose

BEYOND = Fraction(101, 100)  # of the horizon: a file's last row may lie half a step behind it
SYMBOLS = tuple(sp.Symbol(name, positive=True) if name in POSITIVE else sp.Symbol(name) for name in PARAMETERS)


@functools.cache
def derived_loop(wave: str) -> ClosedLoop:
    """The closed loop of the lesson's plant (7) under the adaptive controller derived for it, in the PARAMETERS."""
    x1, x2, u, t = sp.symbols("x1 x2 u t")
    theta, k1, k2, gamma, amplitude, omega, phase = SYMBOLS
    plant = strict_feedback(Plant((x1, x2), u, (theta,), (x2 + theta * x1, u)))
    design = tuning_functions(plant, (k1, k2), gamma)
    reference = amplitude * {"sin": sp.sin, "cos": sp.cos}[wave](omega * t + phase)
    return closed_loop(design, [theta], reference, time=t, free=SYMBOLS)


def parameters(scenario: Scenario) -> dict[sp.Symbol, sp.Rational]:
    """The values of the SYMBOLS."""
    return {symbol: sp.Rational(getattr(scenario, symbol.name)) for symbol in SYMBOLS}


@functools.lru_cache(16)
def loop_of(experiment: Scenario | Experiment) -> ClosedLoop:
    """The closed loop of an experiment; of a scenario in the PARAMETERS, else in numbers. Raises DesignError."""
    if isinstance(experiment, Scenario):
        return derived_loop(experiment.wave)
    theta = [parameter.true for parameter in experiment.unknown]
    return closed_loop(design_of(experiment), theta, reference_of(experiment))


def start_of(experiment: Scenario | Experiment) -> tuple[Fraction, ...]:
    """The start of states and estimates."""
    if isinstance(experiment, Scenario):
        return experiment.x1_start, experiment.x2_start, experiment.theta_hat_start
    return (*experiment.start, *(parameter.start for parameter in experiment.unknown))


def problem(experiment: Scenario | Experiment) -> InitialValueProblem:
    """The closed loop of an experiment as an initial-value problem in states and estimates."""
    loop = loop_of(experiment)
    numbers = parameters(experiment) if isinstance(experiment, Scenario) else {}
    return InitialValueProblem(
        loop.time,
        loop.states,
        tuple(e.xreplace(numbers) for e in loop.rhs),
        tuple(map(sp.Rational, start_of(experiment))),
        sp.Rational(experiment.horizon * BEYOND),
        tuple((name, e.xreplace(numbers)) for name, e in loop.definitions),
    )


@functools.cache
def truth(experiment: Scenario | Experiment, target: float = 1e-18, progress: Progress | None = None) -> Enclosure:
    """The proven enclosure of states and estimates, with a radius of at most `target`."""
    return enclose(problem(experiment), target, progress=progress)


def printed_of(experiment: Scenario | Experiment) -> tuple[str, ...]:
    """What a table of the truth holds: states and estimates, z_1 .. z_n, and V."""
    setting = setting_of(experiment)
    return (*setting.names, *(f"z{i}" for i in range(1, setting.n + 1)), "V")


def truth_table(
    experiment: Scenario | Experiment, times: Iterable[Fraction], digits: int, progress: Progress | None = None
) -> Iterator[list[str]]:
    """Rows of text: a header, then per time (s) states, estimates, errors z and V, as value and radius.

    A value has `digits` significant digits; its radius, rounded up, covers the enclosure and the rounding of the value.
    Raises ValueError for a time outside of the enclosure, ProofEnded where there is none.
    """
    enclosed = enclose(problem(experiment), min(1e-18, 10.0**-digits), progress=progress)
    loop = loop_of(experiment)
    errors = ball_function(problem(experiment), [*loop.z, loop.V])
    yield ["t", *(text for name in printed_of(experiment) for text in (name, f"{name}_radius"))]
    for t in times:
        with precision(enclosed.bits):
            states = enclosed.at(t)
            balls = (*states, *errors(t, states))
        yield [_decimal(t), *(text for ball in balls for text in _printed(ball, digits))]


def _decimal(t: Fraction) -> str:
    power = next((k for k in range(40) if (t * 10**k).denominator == 1), None)
    return str(t) if power is None else format(Decimal(int(t * 10**power)).scaleb(-power), "f")


def _printed(ball: arb, digits: int) -> tuple[str, str]:
    with precision(1024):
        value = str(ball.mid().str(digits, radius=False))
        mantissa, exponent = (abs(ball - arb(value))).upper().man_exp()
        radius = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    with localcontext(prec=3, rounding=ROUND_UP):
        return value, f"{Decimal(radius.numerator) / Decimal(radius.denominator):.2e}"


# ---- The closed loop in double precision ----


def module() -> str:
    """The source of `closed_loop`: the derived closed loop as functions, for either wave."""
    head = """# SPDX-License-Identifier: MIT
# Written by: python -m conformance.truth.experiment
\"\"\"The closed loop of the lesson's plant under the controller derived for it; `experiment` derived what stands here.

Each function gives a list of arrays, or numbers, from t (s), the states and the parameters; r is a sine or a cosine.
\"\"\"

from typing import Any

from numpy import cos, sin

from conformance.truth.piecewise import Floats

"""
    text = head + "\n".join(source(wave) for wave in WAVES)
    command = [sys.executable, "-m", "ruff", "format", "--line-length", "120", "-"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


def source(wave: str) -> str:
    """The derived closed loop as Python source, of `reference` in t alone."""
    loop = derived_loop(wave)
    states = (loop.time, *loop.states)
    field = sp.Matrix([loop.explicit(e) for e in loop.rhs])
    z = sp.Matrix([loop.explicit(e) for e in loop.z])
    V, dissipation = (sp.Matrix([loop.explicit(e)]) for e in (loop.V, loop.dissipation))

    def along(quantity: sp.Matrix) -> sp.Matrix:
        """Its derivative along solutions."""
        return quantity.diff(loop.time) + quantity.jacobian(loop.states) * field

    return "\n".join(
        _function(f"{name}_{wave}", arguments, list(expressions))
        for name, arguments, expressions in (
            ("reference", (loop.time,), [loop.explicit(loop.reference)]),
            ("control", states, [loop.explicit(loop.u)]),
            ("first", states, field),
            ("second", states, along(field)),
            ("errors", states, z),
            ("lyapunov", states, V),
            ("dissipation", states, [*dissipation, *along(dissipation)]),
            ("gradients", states, sp.Matrix([*field, *z, *V, *dissipation]).jacobian(loop.states)),
        )
    )


def _function(name: str, arguments: Sequence[sp.Symbol], expressions: list[sp.Expr]) -> str:
    function = sp.lambdify((*arguments, *SYMBOLS), expressions, "numpy", cse=True)
    _, _, body = inspect.getsource(function).partition("\n")
    typed = [*(f"{s}: Floats" for s in arguments), *(f"{s}: float" for s in SYMBOLS)]
    return f"def {name}({', '.join(typed)}) -> list[Any]:\n{body}"


if __name__ == "__main__":
    write_atomically(PACKAGE / "truth" / "closed_loop.py", module())
