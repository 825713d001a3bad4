# SPDX-License-Identifier: MIT
"""Straight-line programs over SymPy: named intermediate values, exact derivatives, exact rational evaluation.

Written out in full, the virtual controls of backstepping grow beyond use at the fourth step, because every step
contains the derivatives of the one before. Here each intermediate value has a name, later values refer to it by that
name, and a derivative is taken by the chain rule through the names, each partial derivative being named in turn and
kept. The size then grows with the number of distinct partial derivatives, and the whole design can be evaluated exactly
in rationals.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction

import sympy as sp

Opaque = Callable[[sp.Expr], Fraction]


class Program:
    """Definitions `name = expression`, each in terms of the variables and of earlier names only; append-only.

    `variables` are the symbols with respect to which derivatives are taken; any other symbol is a constant.
    """

    def __init__(self, variables: Sequence[sp.Symbol]) -> None:
        self._order = {v: position for position, v in enumerate(variables)}
        self._definitions: dict[sp.Symbol, sp.Expr] = {}
        self._depends: dict[sp.Symbol, frozenset[sp.Symbol]] = {v: frozenset([v]) for v in variables}
        self._partials: dict[tuple[sp.Symbol, tuple[sp.Symbol, ...]], sp.Expr] = {}
        self._origin: dict[sp.Symbol, tuple[sp.Symbol, tuple[sp.Symbol, ...]]] = {}

    @property
    def definitions(self) -> Mapping[sp.Symbol, sp.Expr]:
        """The definitions in an order in which they can be computed."""
        return dict(self._definitions)

    def let(self, name: str, expression: sp.Expr) -> sp.Expr:
        """Name an expression and return the name; a symbol or a number needs none and is returned as it is.

        Raises ValueError if the name is taken.
        """
        expression = sp.sympify(expression)
        if expression.is_Atom:
            return expression
        symbol = sp.Symbol(name)
        if symbol in self._depends:
            raise ValueError(f"the name {name} is taken")
        self._definitions[symbol] = expression
        self._depends[symbol] = self.depends(expression)
        return symbol

    def depends(self, expression: sp.Expr) -> frozenset[sp.Symbol]:
        """Return the variables that an expression depends on, through names or directly."""
        nothing: frozenset[sp.Symbol] = frozenset()
        return nothing.union(*(self._depends.get(s, nothing) for s in expression.free_symbols))

    def diff(self, expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
        """Return the partial derivative with respect to a variable, by the chain rule through the names."""
        terms = [held_partial(expression, variable)]
        for s in sorted(expression.free_symbols & self._definitions.keys(), key=str):
            if variable in self._depends[s]:
                terms.append(held_partial(expression, s) * self._partial(s, variable))
        return sp.Add(*terms)

    def gradient(self, expression: sp.Expr, variables: Iterable[sp.Symbol]) -> sp.Matrix:
        """Return the row of partial derivatives with respect to the variables, of shape (1, number of variables)."""
        return sp.Matrix([[self.diff(expression, v) for v in variables]])

    def derivative_along(self, expression: sp.Expr, field: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
        """Return the sum of (d expression / d v) v' over the pairs v: v' of a vector field."""
        return sp.Add(*(self.diff(expression, v) * rate for v, rate in field.items()))

    def explicit(self, expression: sp.Expr) -> sp.Expr:
        """Return an expression (or a matrix of them) with every name replaced by what it stands for."""
        return explicit(expression, self._definitions)

    def _partial(self, name: sp.Symbol, variable: sp.Symbol) -> sp.Expr:
        """Return the named partial derivative of a name; a mixed one is kept once, whatever the order."""
        base, orders = self._origin.get(name, (name, ()))
        key = tuple(sorted((*orders, variable), key=self._order.__getitem__))
        return self._mixed(base, key)

    def _mixed(self, base: sp.Symbol, key: tuple[sp.Symbol, ...]) -> sp.Expr:
        if not key:
            return base
        if (base, key) not in self._partials:
            lower = self._mixed(base, key[:-1])
            named_here = lower == base or lower in self._origin
            derivative = self.diff(self._definitions[lower] if named_here else lower, key[-1])
            name = f"{base}__" + "_".join(str(v) for v in key)
            result = self._partials[base, key] = self.let(name, derivative)
            if str(result) == name:  # and not a number, a variable, or the name of something else
                self._origin[result] = (base, key)
        return self._partials[base, key]


def held_partial(e: sp.Expr, s: sp.Symbol) -> sp.Expr:
    """Return d e / d s with all other symbols held, as SymPy's diff does, which is slow on long sums."""
    if s not in e.free_symbols:
        return sp.S.Zero
    if e.is_Add:
        return sp.Add(*(held_partial(a, s) for a in e.args))
    if e.is_Mul:
        others = [e.args[:i] + e.args[i + 1 :] for i in range(len(e.args))]
        return sp.Add(*(sp.Mul(held_partial(a, s), *rest) for a, rest in zip(e.args, others, strict=True)))
    return sp.diff(e, s)


def explicit(expression: sp.Expr, definitions: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Return an expression (or a matrix of them) with every defined name replaced by its definition, to the bottom."""
    done: dict[sp.Symbol, sp.Expr] = {}

    def replaced(e: sp.Expr) -> sp.Expr:
        names = e.free_symbols & definitions.keys()
        for s in names - done.keys():
            done[s] = replaced(definitions[s])
        return e.xreplace({s: done[s] for s in names})

    return replaced(expression)


def needed(expressions: Iterable[sp.Expr], definitions: Mapping[sp.Symbol, sp.Expr]) -> set[sp.Symbol]:
    """Return the symbols that the expressions use, directly or through the definitions."""
    seen: set[sp.Symbol] = set()
    waiting = [s for e in expressions for s in e.free_symbols]
    while waiting:
        s = waiting.pop()
        if s not in seen:
            seen.add(s)
            waiting.extend(definitions[s].free_symbols if s in definitions else ())
    return seen


def evaluate(
    expression: sp.Expr,
    point: Mapping[sp.Symbol, Fraction],
    definitions: Mapping[sp.Symbol, sp.Expr] | None = None,
    opaque: Opaque | None = None,
) -> Fraction:
    """Return the exact value of an expression at a rational point.

    Sums, products and integer powers are computed in rationals; anything else, such as sin(x1), goes to `opaque`.
    Raises ValueError if a symbol has no value or `opaque` is missing, ZeroDivisionError at a pole.
    """
    values: dict[sp.Expr, Fraction] = dict(point)
    known = definitions or {}

    def value(e: sp.Expr) -> Fraction:
        if e not in values:
            values[e] = compute(e)
        return values[e]

    def compute(e: sp.Expr) -> Fraction:
        if e.is_Rational:
            return Fraction(int(e.p), int(e.q))
        if e in known:
            return value(known[e])
        if e.is_Add:
            return sum((value(a) for a in e.args), Fraction(0))
        if e.is_Mul:
            product = Fraction(1)
            for a in e.args:
                product *= value(a)
            return product
        if e.is_Pow and e.exp.is_Integer:
            return value(e.base) ** int(e.exp)
        if opaque is None or e.is_Symbol:
            raise ValueError(f"{e} has no value at this point")
        return opaque(e)

    return value(sp.sympify(expression))
