# SPDX-License-Identifier: MIT
"""What the printer writes is worth the same in every language: each expression is run in every engine, not compared as
text. One program per language holds all of them.
"""

import functools
import os
import random
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import mpmath
import pytest

from conformance.programs.ports import Port, read_ports
from conformance.programs.spelling import Spelling
from conformance.theory import expressions
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
from conformance.theory.reader import read

pytestmark = pytest.mark.beyond

RANDOM = int(os.environ.get("EXPRESSIONS", "300"))  # trees of each language's own, besides the cases below
SAME = 1e-13  # relative difference
PORTS = read_ports()
LANGUAGES = [name for name, port in PORTS.items() if port.template and name != "simulink"]  # which is MATLAB's

CASES = """
-x - y; x - (y - z); x - (y + z); -(x - y); x - -y; -(-x); x + -(y * z); -x * y; x * -y; x * (-y); (-x) * (-y)
x * (y + z); (x + y) * z; x * (y - z) * x; x - y * z; (x - y) * (x + z); -(x + y) * z; 2 * (x + 1) - 3 * (y - 1)
x / y / z; x / (y / z); x / (y * z); x * y / z; x / y * z; x * (y / z); x / (y + z); (x + y) / z; -x / y; -(x / y)
(x / y) / (z / x); x / -y; 1 / (x / y); x - y / z; (x - y) / (z - 4 * x); 1 / (1 + 1 / (1 + 1 / x)); 2 / x / 3
1/2; 1 / 2 * x; x * (1 / 2); 3 / 2; x / 2 / 3; (1 / 3) * (2 / 7); 1 / 3 + x; 7 / 2 - 5 / 2 * x; 2 / 3 / 4; x + 1 / 2
(1 + 2) / (3 + 4) * x; (5 - 3) / 4 + x; 100000 * 100000 * x; 3000000000 * x; 2 * 3 / 4 * x; x * 3 / 4; 1 - 1 / 2
x^2; x^3; x^4; x^5; -x^2; (-x)^2; x^2 * y; y * x^2; y / x^2; x^2 / y; x^2 / y^2; -x^3 / y^2; (x + y)^2; (x * y)^3
(x^2)^3; (x / y)^2; 2^3; 2^3 * x; x^-1; x^-2; x^(1/2); x^(3/2); x^(1/3); x^(-1/2); (1/2)^2; (x + 1)^-3; 2 * x^2 - 1
2^(1/2); (2 / 3)^2 * x; x * y^2 * z; x - y^2; (x - y)^4; 1 / x^2 - 1 / x^3; (1 + x^2)^(3/2) / (1 + y^2)
sin(x); cos(x); tan(x); exp(x); log(x); sqrt(x); sinh(x); cosh(x); tanh(x); atan(x); -sin(x); sin(-x); sin(x)^2
sin(1); sqrt(2); exp(1/2); log(3/2); sin(x + y) - sin(x) * cos(y); exp(-x^2); 1 - tanh(x)^2; sqrt(x^2 + y^2)
cos(2 * x) / (1 + sin(y)); atan(x / y); sin(sin(sin(x))); 1 / cosh(x)^2; x * exp(-x / 2); log(1 + exp(-x)); sin(x / 2)
lambda + gamma; i * j; pi - eps; C + D * E; I - K; N * O / y0; y1 * beta; end / 2; x_value - x; log(lambda) * time
r_ddot + theta_hat * alpha1_x1; K_B * i - I; lambda^2 - lambda_value; index + class; 0.1 + 0.2 * x; 1.5e-20 * exp(46)
0.000001234 * x; 12345678.9 * x; 0.1; 25; x + 1000000; 1000000000000000000000 * x
"""
NAMES = [
    "x", "y", "z", "lambda", "gamma", "i", "j", "pi", "eps", "C", "D", "E", "I", "K", "N", "O", "y0", "y1", "beta",
    "end", "x_value", "time", "r_ddot", "theta_hat", "alpha1_x1", "K_B", "lambda_value", "index", "class", "k_gain",
]  # fmt: skip
CONSTANTS = ["gamma", "K_B", "y0", "k_gain", "beta"]
VALUES = {name: Fraction(3 * i + 5, 16) for i, name in enumerate(NAMES)}


def suite() -> list[Expression]:
    return [read(case.strip()) for line in CASES.strip().splitlines() for case in line.split(";") if case]


# ------------------------------------------------------------------ exact values


def worth(e: Expression, values: Mapping[str, mpmath.mpf]) -> mpmath.mpf:
    """The value of an expression to 40 digits."""

    def w(part: Expression) -> mpmath.mpf:
        return worth(part, values)

    match e:
        case Number(value):
            return mpmath.mpf(value.numerator) / value.denominator
        case Name(name):
            return values[name]
        case Negative(of):
            return -w(of)
        case Sum(terms):
            return mpmath.fsum(map(w, terms))
        case Product(factors):
            return mpmath.fprod(map(w, factors))
        case Quotient(over, under):
            return w(over) / w(under)
        case Power(base, exponent):
            return w(base) ** (mpmath.mpf(exponent.numerator) / exponent.denominator)
        case Call(function, argument):
            return getattr(mpmath, function)(w(argument))
    raise AssertionError(e)


def exactly(e: Expression) -> mpmath.mpf:
    with mpmath.workdps(40):
        return worth(e, {name: mpmath.mpf(v.numerator) / v.denominator for name, v in VALUES.items()})


# ------------------------------------------------------------------ random trees


def tree(draw: random.Random, depth: int) -> Expression:
    """A random tree, with whatever bracket, sign and power comes."""
    kind = draw.choice("nnnvv" if depth == 0 else "nvvs-p*/^cSM")
    if kind == "n":
        value = draw.choice([draw.randint(0, 12), Fraction(draw.randint(1, 99), 10), Fraction(draw.randint(1, 9), 7)])
        return Number(Fraction(value))
    if kind == "v":
        return Name(draw.choice(NAMES))
    if kind == "-":
        return Negative(tree(draw, depth - 1))
    if kind in "sS":
        terms = [tree(draw, depth - 1) for _ in range(draw.randint(2, 4))]
        return Sum(tuple(Negative(t) if draw.random() < 0.5 else t for t in terms))
    if kind in "pM*":
        return Product(tuple(tree(draw, depth - 1) for _ in range(draw.randint(2, 3))))
    if kind == "/":
        return Quotient(tree(draw, depth - 1), tree(draw, depth - 1))
    if kind == "^":
        return Power(
            tree(draw, depth - 1), Fraction(draw.choice(["2", "3", "4", "5", "-1", "-2", "1/2", "3/2", "-1/3"]))
        )
    return Call(draw.choice([*FUNCTIONS]), tree(draw, depth - 1))


def is_tame(e: Expression) -> bool:
    """True for a real tree whose value, and each within it, is of ordinary size and is not made of cancellation."""
    try:
        with mpmath.workdps(40):
            values = {name: mpmath.mpf(v.numerator) / v.denominator for name, v in VALUES.items()}
            parts = [(part, worth(part, values)) for part in expressions.walk(e)]
            if any(isinstance(v, mpmath.mpc) or not 1e-3 < abs(v) < 1e3 for _, v in parts if v != 0):
                return False
            sums = [(part, v) for part, v in parts if isinstance(part, Sum)]
            steep = [part.argument for part, _ in parts if isinstance(part, Call)]
            return all(abs(v) > 0.05 * sum(abs(worth(t, values)) for t in part.terms) for part, v in sums) and all(
                abs(worth(a, values)) < 5 for a in steep
            )
    except (ValueError, ZeroDivisionError, OverflowError, TypeError):
        return False


@functools.cache
def random_trees(count: int, seed: int) -> list[Expression]:
    draw, found = random.Random(seed), list[Expression]()
    while len(found) < count:
        e = tree(draw, draw.randint(1, 4))
        if not isinstance(e, (Number, Name)) and is_tame(e) and abs(exactly(e)) > 1e-3:
            found.append(e)
    return found


# ------------------------------------------------------------------ one program per language


@dataclass(frozen=True)
class Batch:
    """How a language's batch is written and run; `block` stands around the lines that print."""

    file: str
    frame: str
    constant: str
    signal: str
    line: str
    commands: tuple[tuple[str, ...], ...]
    block: str = "{}"


PYTHON = sys.executable
BATCHES = {
    "python": Batch(
        "batch.py", "import numpy as np\n{}", "{} = {}", "{} = np.float64({})", "print(repr(float({})))",
        ((PYTHON, "batch.py"),),
    ),
    "cpp": Batch(
        "batch.cpp", "#include <cmath>\n#include <cstdio>\nnamespace {{\n{}\n}}\nint main() {{ all(); }}",
        "constexpr double {} = {};", "const double {} = {};",
        'std::printf("%.17g\\n", static_cast<double>({}));', (("g++", "-std=c++17", "-O0", "batch.cpp"), ("./a.out",)),
        "void all() {{\n{}\n}}",
    ),
    "java": Batch(
        "Batch.java", "class Batch {{\n{}\npublic static void main(String[] arguments) {{ all(); }}\n}}",
        "static final double {} = {};", "static double {} = {};",
        "System.out.println((double) ({}));", (("java", "-XX:TieredStopAtLevel=1", "Batch.java"),),
        "static void all() {{\n{}\n}}",
    ),
    "matlab": Batch(
        "batch.m", "1;\n{}", "{} = {};", "{} = {};", "printf('%.17g\\n', {});",
        (("octave-cli", "--norc", "--quiet", "batch.m"),),
    ),
    "mathematica": Batch(
        "batch.wls", "{}", "{} = {};", "{}[t_] := {};", "Print[ToString[N[{}], CForm]];",
        ((PYTHON, "-m", "woxi", "run", "batch.wls"),),
    ),
}  # fmt: skip


def spelling(port: Port) -> Spelling:
    reserved = port.reserved.split()
    return Spelling(port, CONSTANTS, NAMES, lambda name: reserved)


def run_batch(port: Port, trees: list[Expression], folder: Path) -> list[float]:
    """The values of expressions as the port's engine computes them."""
    batch, own = BATCHES[port.name], spelling(port)
    stated = [
        (batch.constant if name in CONSTANTS else batch.signal).format(own.name(name), own.number(VALUES[name]))
        for name in NAMES
    ]
    lines = [batch.line.format(own.expression(e)) for e in trees]
    (folder / batch.file).write_text(batch.frame.format("\n".join([*stated, batch.block.format("\n".join(lines))])))
    for command in batch.commands:
        answer = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if answer.returncode:
            raise ArithmeticError((answer.stdout + answer.stderr)[-2000:])
    return [float(line.replace("*^", "e")) for line in answer.stdout.split()]


def differing(port: Port, trees: list[Expression], folder: Path) -> list[str]:
    """The expressions that an engine gives another value; all of them where its program does not run."""
    try:
        found = run_batch(port, trees, folder)
    except (ArithmeticError, ValueError) as error:
        return [str(error)]
    assert len(found) == len(trees)
    pairs = zip(trees, found, map(exactly, trees), strict=True)
    own = spelling(port)
    return [f"{own.expression(e)}: {a}, not {float(b)}" for e, a, b in pairs if not abs(a - b) <= SAME * abs(b)]


@pytest.mark.parametrize("name", LANGUAGES)
def test_every_engine_gives_the_exact_values(name: str, tmp_path: Path) -> None:
    trees = random_trees(RANDOM, seed=20 + LANGUAGES.index(name))
    assert differing(PORTS[name], suite() + trees, tmp_path) == []


def test_there_are_a_thousand_random_trees() -> None:
    trees = [e for seed in range(20, 20 + len(LANGUAGES)) for e in random_trees(RANDOM, seed)]
    assert len(set(trees)) >= 1000 or RANDOM < 300


def test_the_block_of_simulink_is_spelled_as_matlab() -> None:
    for e in suite():
        assert spelling(PORTS["simulink"]).expression(e) == spelling(PORTS["matlab"]).expression(e)


# ------------------------------------------------------------------ the printer's own rules, each broken


def signs_lost(text: Callable[..., str]) -> Callable[..., str]:
    return lambda *arguments: text(*arguments).replace(" - ", " + ")


def brackets_lost(text: Callable[..., str]) -> Callable[..., str]:
    def bare(self: Spelling, e: Expression, strength: int, exact: bool) -> str:
        return self.text(e, exact)

    return bare


def term_dropped(text: Callable[..., str]) -> Callable[..., str]:
    return lambda self, terms, exact: text(self, terms[:-1], exact)


def whole_numbers(text: Callable[..., str]) -> Callable[..., str]:
    return lambda self, value, whole=False: text(self, value, True)


def another_name(text: Callable[..., str]) -> Callable[..., str]:
    return lambda self, name: text(self, "y" if name == "x" else name)


def no_respelling(text: Callable[..., str]) -> Callable[..., str]:
    return lambda self, name: self.cased(name, name in self.constants)


BROKEN = {
    "a sign": ("sum", signs_lost, "cpp"),
    "a bracket": ("within", brackets_lost, "cpp"),
    "a dropped term": ("sum", term_dropped, "cpp"),
    "a division of integers": ("number", whole_numbers, "cpp"),
    "a wrong name": ("signal", another_name, "cpp"),
    "a reserved name": ("name", no_respelling, "python"),
}


@pytest.mark.parametrize("rule", BROKEN)
def test_a_broken_rule_is_noticed_by_running_it(rule: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    method, broken, name = BROKEN[rule]
    monkeypatch.setattr(Spelling, method, broken(getattr(Spelling, method)))
    own = spelling(PORTS[name])
    trees = [e for e in suite() if "--" not in own.expression(e)]  # which C++ would not compile
    found = differing(PORTS[name], trees, tmp_path)
    assert found != []
    if rule != "a reserved name":  # with which no program runs
        assert all(", not " in line for line in found)
