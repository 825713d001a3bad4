# SPDX-License-Identifier: MIT
"""Taylor coefficients of the solution of x' = f(t, x), in ball arithmetic.

The right-hand sides become a straight-line program of a few kinds of node, and every node is carried
coefficient by coefficient (Moore 1966; Griewank & Walther 2008, section 13):

    v = a + b       v_k = a_k + b_k
    v = a b         v_k = sum_{i=0..k} a_i b_{k-i}
    v = a / b       v_k = (a_k - sum_{i=1..k} b_i v_{k-i}) / b_0
    v = F(u)        v_k = (1/k) sum_{i=1..k} i u_i w_{k-i},  w = F'(u), since v' = w u'
    x' = f          x_{k+1} = f_k / (k + 1)

One rule serves every elementary function F, because w is itself a node: w = v for exp, w = cos u for sin.
The same nodes differentiate symbolically, which gives the variational equation Y' = (df/dx) Y.
All numbers are balls (Johansson 2017): each result contains the exact result for all points of its arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import reduce
from operator import mul
from types import MappingProxyType
from typing import Any, NamedTuple

import sympy as sp
from flint import arb, ctx, fmpq

from conformance.theory.program import needed

Definition = tuple[sp.Symbol, sp.Expr]
Coefficients = list[arb]  # [k] is the coefficient of s^k; a constant keeps its first entry only


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Sets the working precision of ball arithmetic, which is global to python-flint, and restores it."""
    before = ctx.prec
    ctx.prec = bits
    try:
        yield
    finally:
        ctx.prec = before


def exact(value: fmpq | sp.Rational) -> arb:
    """The ball of a rational number: exact where it is dyadic and short, else rounded outwards."""
    return arb(fmpq(int(value.p), int(value.q)))


# --- Program -------------------------------------------------------------------------------------


class Node(NamedTuple):
    """One operation: its kind, the nodes it reads, and the number, index or name that completes it."""

    kind: str
    args: tuple[int, ...] = ()
    value: str | int | sp.Rational = 0


class Function(NamedTuple):
    """An elementary function F: its value on a ball, and w = F'(u) as a node, from (program, v = F(u), u)."""

    value: Callable[[arb], arb]
    derivative: Callable[[Program, int, int], int]
    domain: str = ""


FUNCTIONS: dict[str, Function] = {
    "exp": Function(lambda u: u.exp(), lambda p, v, u: v),
    "log": Function(
        lambda u: u.log(), lambda p, v, u: p.div(p.one(), u), "logarithm of an interval that is not positive"
    ),
    "sin": Function(lambda u: u.sin(), lambda p, v, u: p.apply("cos", u)),
    "cos": Function(lambda u: u.cos(), lambda p, v, u: p.neg(p.apply("sin", u))),
    "tan": Function(lambda u: u.tan(), lambda p, v, u: p.add(p.one(), p.mul(v, v)), "tangent across a pole"),
    "sinh": Function(lambda u: u.sinh(), lambda p, v, u: p.apply("cosh", u)),
    "cosh": Function(lambda u: u.cosh(), lambda p, v, u: p.apply("sinh", u)),
    "tanh": Function(lambda u: u.tanh(), lambda p, v, u: p.add(p.one(), p.neg(p.mul(v, v)))),
    "atan": Function(lambda u: u.atan(), lambda p, v, u: p.div(p.one(), p.add(p.one(), p.mul(u, u)))),
}


def _power(exponent: sp.Rational) -> Function:
    """u -> u^exponent on u > 0, whose derivative is exponent v / u."""

    def value(u: arb) -> arb:
        return u.sqrt() if exponent == sp.S.Half else u ** exact(exponent)

    return Function(
        value,
        lambda p, v, u: p.mul(p.constant(exponent), p.div(v, u)),
        f"power {exponent} of an interval that is not positive",
    )


@dataclass
class Program:
    """A straight-line program for f(t, x).

    nodes[i] reads nodes of smaller index only (F(u) also reads its factor F'(u), one coefficient late).
    states[i], rhs[i]: the nodes of x_i and of f_i. parameters: constants with a name, such as "gamma=3".
    """

    nodes: list[Node] = field(default_factory=list)
    index: dict[Node, int] = field(default_factory=dict)
    degree: list[float] = field(default_factory=list)  # as a polynomial in t: 0, 1, or inf for "anything else"
    function: dict[int, Function] = field(default_factory=dict)
    factor: dict[int, int] = field(default_factory=dict)  # node of F(u) -> node of F'(u)
    states: list[int] = field(default_factory=list)
    rhs: list[int] = field(default_factory=list)
    parameters: list[int] = field(default_factory=list)
    rates: dict[int, int] = field(default_factory=dict)  # node of a state or function -> node of its derivative
    run: Callable[..., list[Coefficients]] | None = None  # the compiled form
    balls: dict[int, dict[int, arb]] = field(default_factory=dict)  # constants, by precision

    def listed(self) -> set[int]:
        """The nodes that keep all their coefficients: states, right-hand sides, and what a convolution reads."""
        found = {*self.states, *self.rhs, *self.factor.values(), *self.rates, *self.rates.values()}
        for i, node in enumerate(self.nodes):
            if node.kind in ("div", "function"):
                found.add(i)
            if node.kind == "slope":
                found.add(i)
            elif node.kind in ("div", "mul"):
                found.update(
                    a for a in node.args if node.kind == "div" or self.degree[node.args[0]] > 0 or a == node.args[0]
                )
        return found

    def constants(self, bits: int) -> dict[int, arb]:
        """The balls of the constants at the current precision, which is `bits`."""
        if bits not in self.balls:
            self.balls[bits] = {i: _constant(n.value) for i, n in enumerate(self.nodes) if n.kind == "constant"}
        return self.balls[bits]

    def node(self, kind: str, *args: int, value: str | int | sp.Rational = 0, degree: float = float("inf")) -> int:
        """The index of this node, appended unless it is there already."""
        key = Node(kind, args, value)
        if key not in self.index:
            self.index[key] = len(self.nodes)
            self.nodes.append(key)
            self.degree.append(degree)
        return self.index[key]

    def constant(self, value: str | sp.Rational) -> int:
        return self.node("constant", value=value, degree=0)

    def one(self) -> int:
        return self.constant(sp.S.One)

    def time(self) -> int:
        return self.node("time", degree=1)

    def state(self) -> int:
        """The node of one more state."""
        self.states.append(self.node("state", value=len(self.states)))
        return self.states[-1]

    def add(self, a: int, b: int) -> int:
        a, b = sorted((a, b), key=lambda i: (self.degree[i] > 0, i))  # a constant stands first
        if self.nodes[a] == Node("constant", (), sp.S.Zero):
            return b
        return self.node("add", a, b, degree=max(self.degree[a], self.degree[b]))

    def mul(self, a: int, b: int) -> int:
        a, b = sorted((a, b), key=lambda i: (self.degree[i] > 0, i))
        if self.nodes[a] == Node("constant", (), sp.S.One):
            return b
        degree = self.degree[a] + self.degree[b]
        return self.node("mul", a, b, degree=degree if degree <= 1 else float("inf"))

    def neg(self, a: int) -> int:
        return self.mul(self.constant(sp.S.NegativeOne), a)

    def div(self, a: int, b: int) -> int:
        return self.node("div", a, b, degree=0 if self.degree[a] == self.degree[b] == 0 else float("inf"))

    def power(self, a: int, exponent: int) -> int:
        """a^exponent for an integer exponent >= 1, by squaring."""
        half = self.power(a, exponent // 2) if exponent > 1 else a
        if exponent == 1:
            return a
        square = self.mul(half, half)
        return self.mul(square, a) if exponent % 2 else square

    def apply(self, name: str, u: int, exponent: sp.Rational = sp.S.Zero) -> int:
        """F(u): the node of i u_i, the node itself, and (afterwards) the factor F'(u) of the chain rule."""
        constant = self.degree[u] == 0
        slope = self.node("slope", u, degree=self.degree[u])
        v = self.node("function", u, slope, value=f"{name} {exponent}", degree=0 if constant else float("inf"))
        if v not in self.function:
            self.function[v] = _power(exponent) if name == "power" else FUNCTIONS[name]
            if not constant:
                self.factor[v] = self.function[v].derivative(self, v, u)
        return v

    def trouble(self, values: list[Coefficients]) -> str:
        """Why these coefficients are not finite, in words: the first node that is not."""
        for i, node in enumerate(self.nodes):
            if all(c.is_finite() for c in values[i]):
                continue
            if node.kind == "div" and not values[node.args[1]][0].abs_lower() > 0:
                return "division by an interval that contains 0"
            if node.kind == "function" and self.function[i].domain:
                return self.function[i].domain
        return "a value grows without bound"


# --- From SymPy ----------------------------------------------------------------------------------


def compile_program(
    time: sp.Symbol,
    states: Sequence[sp.Symbol],
    rhs: Sequence[sp.Expr],
    definitions: Sequence[Definition] = (),
    parameters: Mapping[sp.Symbol, sp.Rational] = MappingProxyType({}),
) -> Program:
    """The program of x' = rhs(t, x); definitions name what is computed once, in terms of t, x and earlier names.

    parameters: symbols that stand for numbers, by which `variational` may differentiate.
    Raises ValueError for a floating-point number, a free symbol, or a function without a rule here.
    """
    program = Program()
    known: dict[sp.Expr, int] = {time: program.time()}
    known.update({symbol: program.state() for symbol in states})
    known.update({symbol: program.constant(f"{symbol.name}={value}") for symbol, value in parameters.items()})
    program.parameters = [known[symbol] for symbol in parameters]
    named, rows = {s: sp.sympify(e) for s, e in definitions}, [sp.sympify(e) for e in rhs]
    used = needed(rows, named)
    for name, expression in named.items():
        if name in used:
            known[name] = _node(program, known, expression)
    program.rhs = [_node(program, known, expression) for expression in rows]
    return program


def with_rates(program: Program) -> Program:
    """The same program with the derivatives of its functions along solutions, as `tails` needs them, as nodes."""
    program = _copy(program)
    program.rates = dict(zip(program.states, program.rhs, strict=True))
    along: dict[int, int | None] = {**program.rates, program.time(): program.one()}
    for i in range(len(program.nodes)):
        if program.nodes[i].kind == "function" and program.degree[i] > 0:
            _along(program, i, along)
    for i, rate in along.items():
        if program.nodes[i].kind == "function" and rate is not None:
            program.rates[i] = rate
    return program


def _along(program: Program, i: int, along: dict[int, int | None]) -> int | None:
    """The node of the derivative of node i along solutions, appended where it is not there; None for 0."""
    if i not in along:
        for a in program.nodes[i].args:
            if program.nodes[a].kind != "slope":
                _along(program, a, along)
        along[i] = _tangent(program, i, along) if program.degree[i] > 0 else None
    return along[i]


def _copy(base: Program) -> Program:
    return Program(
        list(base.nodes), dict(base.index), list(base.degree), dict(base.function), dict(base.factor),
        list(base.states), list(base.rhs), list(base.parameters), dict(base.rates),
    )  # fmt: skip


def _node(program: Program, known: dict[sp.Expr, int], e: sp.Expr) -> int:
    if e not in known:
        known[e] = _new_node(program, known, e)
    return known[e]


def _new_node(program: Program, known: dict[sp.Expr, int], e: sp.Expr) -> int:
    def sub(part: sp.Expr) -> int:
        return _node(program, known, part)

    if isinstance(e, sp.Rational):
        return program.constant(e)
    if e in (sp.pi, sp.E):
        return program.constant(str(e))
    if isinstance(e, sp.Float):
        raise ValueError(f"{e} is a floating-point number: give it as an exact Rational, such as 6/5 for 1.2")
    if isinstance(e, sp.Add):
        return reduce(program.add, map(sub, e.args))
    if isinstance(e, sp.Mul):
        numerator, denominator = e.as_numer_denom() if any(_is_inverse(a) for a in e.args) else (e, sp.S.One)
        if denominator != 1:
            return program.div(sub(numerator), sub(denominator))
        return reduce(program.mul, map(sub, e.args))
    if isinstance(e, sp.Pow):
        return _power_node(program, sub, e)
    if isinstance(e, sp.Function) and e.func.__name__ in FUNCTIONS and len(e.args) == 1:
        return program.apply(e.func.__name__, sub(e.args[0]))
    raise ValueError(f"no Taylor rule for {e}" if e.args else f"{e} is neither the time, nor a state, nor a number")


def _is_inverse(e: sp.Expr) -> bool:
    return isinstance(e, sp.Pow) and bool(e.exp.is_Integer) and bool(e.exp.is_negative)


def _power_node(program: Program, sub: Callable[[sp.Expr], int], e: sp.Pow) -> int:
    base, exponent = e.base, e.exp
    if isinstance(exponent, sp.Integer):
        power = program.power(sub(base), abs(int(exponent)))
        return power if exponent > 0 else program.div(program.one(), power)
    if isinstance(exponent, sp.Rational):
        return program.apply("power", sub(base), exponent)
    return program.apply("exp", program.mul(sub(exponent), program.apply("log", sub(base))))


# --- Variational equation ------------------------------------------------------------------------


def variational(base: Program) -> tuple[Program, list[tuple[int, int]]]:
    """The program extended by Y' = (df/dx) Y + df/dp, and which entries (i, j) of Y its further states are.

    Column j of Y is the derivative by state j, or behind them by a parameter. An entry is left out where it is 0 at all
    times: x_i does not rest on what column j is the derivative by, however indirectly.
    """
    program, n = _copy(base), len(base.states)
    columns = [_derivatives(program, base, node) for node in (*base.states, *base.parameters)]
    gradients = [{j: column[f] for j, column in enumerate(columns) if f in column} for f in base.rhs]
    reached = _reached(gradients, len(columns))
    Y = {(i, j): program.state() for i in range(n) for j in sorted(reached[i])}
    for i, j in Y:
        terms = [program.mul(d, Y[k, j]) for k, d in gradients[i].items() if (k, j) in Y]
        terms += [gradients[i][j]] if j >= n and j in gradients[i] else []
        program.rhs.append(reduce(program.add, terms) if terms else program.constant(sp.S.Zero))
    program.rates |= zip(program.states, program.rhs, strict=True)
    return program, list(Y)


def _reached(gradients: Sequence[Mapping[int, int]], columns: int) -> list[set[int]]:
    """For each state itself and all that its derivative rests on, directly or through others; a parameter: itself."""
    reached = [{i, *gradient} for i, gradient in enumerate(gradients)]
    reached += [{j} for j in range(len(gradients), columns)]
    for _ in gradients:
        reached = [set().union(*(reached[k] for k in found)) for found in reached]
    return reached


def _derivatives(program: Program, base: Program, x: int) -> dict[int, int]:
    """Appends the derivatives by a state of what the right-hand sides use, each by its node; zeros are left out."""
    tangent = {x: program.one()}
    for i in sorted(_used(base)):
        derivative = _tangent(program, i, tangent)
        if derivative is not None:
            tangent[i] = derivative
    return tangent


def _used(program: Program) -> set[int]:
    """The nodes that the right-hand sides are made of."""
    found: set[int] = set()
    waiting = list(program.rhs)
    while waiting:
        i = waiting.pop()
        if i not in found:
            found.add(i)
            waiting.extend(program.nodes[i].args)
    return found


def _tangent(program: Program, i: int, tangent: Mapping[int, int | None]) -> int | None:
    """The derivative of node i from those of its arguments: the sum, product, quotient and chain rules."""
    node = program.nodes[i]
    parts = [tangent.get(a) for a in node.args]
    if all(part is None for part in parts) or node.kind == "slope":
        return None
    a, b = node.args
    da, db = parts
    if node.kind == "add":
        terms = [d for d in (da, db) if d is not None]
    elif node.kind == "mul":
        terms = [program.mul(x, d) for x, d in ((b, da), (a, db)) if d is not None]
    elif node.kind == "div":
        terms = [program.div(da, b)] if da is not None else []
        if db is not None:
            terms.append(program.neg(program.div(program.mul(i, db), b)))
    else:
        assert da is not None
        terms = [program.mul(program.factor[i], da)]
    return reduce(program.add, terms)


# --- Coefficients --------------------------------------------------------------------------------

ZERO, ONE = arb(0), arb(1)


def convolve(a: Sequence[arb], b: Sequence[arb]) -> arb:
    """sum_i a[i] b[-1-i], over the shorter of the two."""
    return sum(map(mul, a, reversed(b)), ZERO)


def square(a: Sequence[arb]) -> arb:
    """convolve(a, a), at half its cost."""
    half, odd = divmod(len(a), 2)
    total = convolve(a[:half], a)
    return total + total + a[half] * a[half] if odd else total + total


# The rules of the head of this module as Python statements. x{i} is the newest coefficient of node i, v{i} the list of
# those so far, which lacks the newest until the statement is through; w is the node of F'(u).
RULES = {
    "time": "x{i} = ONE if k == 1 else ZERO",
    "add": "x{i} = x{a} + x{b}",
    "add constant": "x{i} = x{b}",
    "mul": "x{i} = sum(map(mul, v{a}, reversed(v{b})), ZERO)",
    "mul square": "x{i} = square(v{a})",
    "mul constant": "x{i} = x{a} * x{b}",
    "div": "x{i} = (x{a} - convolve(v{b}[1:], v{i})) / v{b}[0]",
    "div constant": "x{i} = -convolve(v{b}[1:], v{i}) / v{b}[0]",
    "slope": "x{i} = x{a} * k",
    "function": "x{i} = convolve(v{b}, v{w}[:k]) / k",
}
AT_START = {
    "time": "x{i} = t",
    "state": "x{i} = x[{value}]",
    "constant": "x{i} = constants[{i}]",
    "add": "x{i} = x{a} + x{b}",
    "mul": "x{i} = x{a} * x{b}",
    "div": "x{i} = x{a} / x{b}",
    "function": "x{i} = functions[{i}].value(x{a})",
}


def source(program: Program) -> str:
    """The Python function taylor(t, x, order, constants, functions), which carries all nodes in one loop."""
    lines = ["def taylor(t, x, order, constants, functions):"]
    for i, node in enumerate(program.nodes):
        if node.kind in AT_START:
            lines.append("    " + _statement(program, AT_START[node.kind], i))
    listed = sorted(program.listed())
    lines += [f"    v{i} = [{'' if program.nodes[i].kind == 'slope' else f'x{i}'}]" for i in listed]
    lines.append("    for k in range(1, order + 1):")
    flow = [f"x{f} / k" if program.degree[f] else f"x{f} if k == 1 else ZERO" for f in program.rhs]
    lines.append(f"        {', '.join(f'x{s}' for s in program.states)}, = {', '.join(flow)},")
    lines += [f"        v{s}.append(x{s})" for s in program.states if s in listed]
    for i, node in enumerate(program.nodes):
        if program.degree[i] == 0 or node.kind == "state":
            continue
        lines.append("        " + _statement(program, RULES[_rule(program, node)], i))
        if i in listed:
            once = "if k == 1: " if node.kind == "slope" and program.degree[i] == 1 else ""  # u' is constant then
            lines.append(f"        {once}v{i}.append(x{i})")
    lines.append(f"    return [{', '.join(f'v{i}' if i in listed else '()' for i in range(len(program.nodes)))}]")
    return "\n".join(lines)


def _rule(program: Program, node: Node) -> str:
    if node.kind in ("add", "mul", "div") and program.degree[node.args[0]] == 0:
        return f"{node.kind} constant"
    return "mul square" if node.kind == "mul" and node.args[0] == node.args[1] else node.kind


def _statement(program: Program, rule: str, i: int) -> str:
    node = program.nodes[i]
    a, b = (node.args[0], node.args[-1]) if node.args else (i, i)
    return rule.format(i=i, a=a, b=b, w=program.factor.get(i, i), value=node.value)


def coefficients(program: Program, t: arb, x: Sequence[arb], order: int) -> list[Coefficients]:
    """Taylor coefficients 0 .. order of the nodes along the solutions through (t, x).

    t, x: balls, one per state. Entry [i][k] contains the coefficient of s^k of node i, as a function of the
    time s since the start, for every start in the balls; [i] is empty for nodes that nobody asks for
    (`Program.listed`). Not finite where an operation leaves its domain.
    """
    if program.run is None:
        scope: dict[str, Any] = {"mul": mul, "convolve": convolve, "square": square, "ZERO": ZERO, "ONE": ONE}
        exec(source(program), scope)
        program.run = scope["taylor"]
    assert program.run is not None
    return program.run(t, x, order, program.constants(ctx.prec), program.function)


def _constant(value: str | int | sp.Rational) -> arb:
    if value in ("pi", "E"):
        return arb.pi() if value == "pi" else arb.const_e()
    return exact(sp.Rational(str(value).rpartition("=")[2]))
