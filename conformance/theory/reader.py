# SPDX-License-Identifier: MIT
"""The reader of expressions: a text becomes a tree, or is refused at its place; nothing of it is executed.

The grammar, with ^ above the sign, so that -x^2 is -(x^2):

    sum    = ["-"] term {("+" | "-") term}        term  = factor {("*" | "/") factor}
    factor = ["-"] power                          power = atom ["^" exponent]
    atom   = number | name | function "(" sum ")" | "(" sum ")"

An exponent is a whole number or a fraction, with its sign: x^2, x^-1, x^(3/2).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction

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
    Span,
    Sum,
    children,
    value,
)
from conformance.theory.numbers import double, exact_number

LONGEST = 1000  # characters of an expression
DEEPEST = 20  # parentheses and functions within each other
HIGHEST = 20  # exponent
LARGEST_DEGREE = 200  # of the whole, a number of 20 digits counting as one name
MOST = 1000  # terms, if all were multiplied out


class Unreadable(ValueError):
    """A text that is no expression: the span at fault, a sentence, and what to do."""

    def __init__(self, span: Span, sentence: str, remedy: str) -> None:
        super().__init__(sentence)
        self.span = span
        self.sentence = sentence
        self.remedy = remedy


TOKEN = re.compile(
    r"(?P<space>\s+)|(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)|(?P<name>[A-Za-z_]\w*)|(?P<sign>\*\*|[-+*/^()])",
    re.ASCII,
)
NOT_SMOOTH = ("abs", "sign", "sgn", "sat", "max", "min", "floor", "ceil", "round", "mod", "heaviside", "step")
CHARACTERS = {
    "|": "write a smooth function in place of |x|, such as x*tanh(x/eps) or sqrt(x^2 + eps^2)",
    "'": "write the right-hand sides alone; derivatives are taken, never typed",
    "=": "write the right-hand side alone",
    "\N{MINUS SIGN}": "write the minus sign of the keyboard, -",
    "\N{EN DASH}": "write the minus sign of the keyboard, -",
    "\N{MIDDLE DOT}": "write * for a product",
    "\N{MULTIPLICATION SIGN}": "write * for a product",
    "²": "write ^2",
    "³": "write ^3",
    ",": "write decimals with a point; every function here takes one argument",
    "[": "write round brackets",
    "{": "write round brackets",
}


@dataclass(frozen=True)
class Token:
    """A piece of the text: its kind, what stands there, and where."""

    kind: str
    text: str
    span: Span


def read(source: str) -> Expression:
    """Read an expression; nothing of the text is executed. Raises Unreadable."""
    if len(source) > LONGEST:
        raise Unreadable((0, 1), f"an expression of more than {LONGEST} characters", "give parts of it as constants")
    reader = _Reader(source)
    e = reader.sum()
    if reader.at().kind != "end":
        raise reader.unexpected()
    if _degree(e) > LARGEST_DEGREE:
        raise Unreadable((0, len(source)), f"this is of a degree beyond {LARGEST_DEGREE}", "lower the exponents")
    if _multiplied_out(e) > MOST:
        sentence = f"multiplied out, this has more than {MOST} terms"
        raise Unreadable((0, len(source)), sentence, "lower the exponents, or give known parts as constants")
    return e


def _tokens(source: str) -> Iterator[Token]:
    position = 0
    while position < len(source):
        found = TOKEN.match(source, position)
        if not found:
            character = source[position]
            shown = character if character.isprintable() else f"U+{ord(character):04X}"
            remedy = CHARACTERS.get(character, "use numbers, names, + - * / ^ and round brackets")
            raise Unreadable((position, position + 1), f"the character {shown} has no meaning here", remedy)
        if found.lastgroup != "space":
            yield Token(str(found.lastgroup), found[0], found.span())
        position = found.end()
    yield Token("end", "", (position, position + 1))


class _Reader:
    """Recursive descent over the grammar above."""

    def __init__(self, source: str) -> None:
        self.tokens = list(_tokens(source))
        self.next = 0
        self.depth = 0

    def at(self) -> Token:
        """The token that comes next."""
        return self.tokens[self.next]

    def take(self, *signs: str) -> Token | None:
        """The next token, if it is one of the signs, and go past it."""
        token = self.at()
        if token.kind == "sign" and token.text in signs:
            self.next += 1
            return token
        return None

    def unexpected(self) -> Unreadable:
        """The error that the next token stands where none like it may."""
        token, before = self.at(), self.tokens[self.next - 1] if self.next else None
        if (before and before.kind in ("number", "name") and token.kind in ("number", "name")) or token.text == "(":
            sentence = f"a sign is missing between {before.text if before else ''} and {token.text}"
            return Unreadable(token.span, sentence, "write * for a product")
        if token.kind == "end":
            return Unreadable(token.span, "the expression ends too early", "write what is missing")
        if token.text == ")" and not self.depth:
            return Unreadable(token.span, "this bracket closes none", "remove it, or open one before it")
        if self.depth and before and before.kind in ("number", "name"):
            return Unreadable(token.span, f"found {token.text} where a bracket should close", "write ) first")
        return Unreadable(token.span, f"found {token.text} where a number, a name or ( is expected", "check this sign")

    def sum(self) -> Expression:
        """A sum of the grammar; each method below reads what its name says there."""
        minus = self.take("-", "+")
        terms = [self.signed(minus, self.term())]
        while sign := self.take("+", "-"):
            terms.append(self.signed(sign, self.term()))
        return terms[0] if len(terms) == 1 else Sum(tuple(terms), span=(terms[0].span[0], terms[-1].span[1]))

    def signed(self, sign: Token | None, e: Expression) -> Expression:
        return Negative(e, span=(sign.span[0], e.span[1])) if sign and sign.text == "-" else e

    def term(self) -> Expression:
        e = self.factor()
        while sign := self.take("*", "/"):
            other = self.factor()
            span = e.span[0], other.span[1]
            if sign.text == "/":
                e = Quotient(e, other, span=span)
            else:
                e = Product((*e.factors, other) if isinstance(e, Product) else (e, other), span=span)
        return e

    def factor(self) -> Expression:
        sign = self.take("-", "+")
        return self.signed(sign, self.power())

    def power(self) -> Expression:
        base = self.atom()
        if not self.take("^", "**"):
            return base
        start = self.at().span[0]
        exponent = self.exponent()
        end = self.tokens[self.next - 1].span[1]
        if abs(exponent) > HIGHEST or exponent.denominator > HIGHEST:
            raise Unreadable(
                (start, end), f"an exponent beyond {HIGHEST}", f"use exponents from -{HIGHEST} to {HIGHEST}"
            )
        if self.at().text in ("^", "**"):
            raise Unreadable(self.at().span, "a power of a power", "write brackets: (x^2)^3")
        return Power(base, exponent, span=(base.span[0], end))

    def exponent(self) -> Fraction:
        start = self.at().span[0]
        sign = self.take("-", "+")
        e = self.signed(sign, self.atom())
        if _degree(e) <= HIGHEST:
            with suppress(KeyError, ValueError, ZeroDivisionError):
                return value(e, {})
        span = start, self.tokens[self.next - 1].span[1]
        raise Unreadable(span, "the exponent is not a number", "write exp(y*log(x)) for x^y with x > 0")

    def atom(self) -> Expression:
        token = self.at()
        if token.kind == "number":
            self.next += 1
            return Number(self.exact(token), span=token.span)
        if token.kind == "name":
            self.next += 1
            return self.call(token) if self.at().text == "(" else self.name(token)
        if self.take("("):
            inside = self.bracketed(token)
            return replace(inside, span=(token.span[0], self.tokens[self.next - 1].span[1]))
        raise self.unexpected()

    def exact(self, token: Token) -> Fraction:
        try:
            number = exact_number(token.text)
            double(number)
        except ValueError as error:
            raise Unreadable(token.span, str(error), "write a number of the size that a double holds") from None
        return number

    def name(self, token: Token) -> Expression:
        if token.text in FUNCTIONS:
            raise Unreadable(token.span, f"the function {token.text} has no argument", f"write {token.text}(..)")
        return Name(token.text, span=token.span)

    def call(self, token: Token) -> Expression:
        if token.text.lower() in NOT_SMOOTH:
            remedy = "use a smooth function, such as x*tanh(x/eps) or sqrt(x^2 + eps^2) in place of abs(x)"
            raise Unreadable(
                token.span, f"{token.text} is not smooth, and the recursion differentiates its rows", remedy
            )
        if token.text not in FUNCTIONS:
            known = ", ".join(FUNCTIONS)
            remedy = f"the functions are {known}; for a product write {token.text}*(..)"
            raise Unreadable(token.span, f"{token.text} is not a function that is known here", remedy)
        opened = self.at()
        self.next += 1
        argument = self.bracketed(opened)
        return Call(token.text, argument, span=(token.span[0], self.tokens[self.next - 1].span[1]))

    def bracketed(self, opened: Token) -> Expression:
        self.depth += 1
        if self.depth > DEEPEST:
            raise Unreadable(opened.span, f"brackets more than {DEEPEST} deep", "multiply some of them out")
        inside = self.sum()
        if not self.take(")"):
            if self.at().kind == "end":
                raise Unreadable(opened.span, "this bracket is never closed", "write the ) that belongs to it")
            raise self.unexpected()
        self.depth -= 1
        return inside


def _degree(e: Expression) -> int:
    """A bound on the degree of an expression, and so on the digits of its exact values."""
    degrees = list(map(_degree, children(e)))
    match e:
        case Number(given):
            return 1 + max(given.numerator.bit_length(), given.denominator.bit_length()) // 66
        case Product() | Quotient():
            return sum(degrees)
        case Power(_, exponent):
            return degrees[0] * max(1, abs(exponent.numerator))
    return max(degrees, default=1)


def _multiplied_out(e: Expression) -> int:
    """About how many terms an expression has when all is multiplied out, which is what its classification costs."""
    sizes = list(map(_multiplied_out, children(e)))
    match e:
        case Sum():
            return sum(sizes)
        case Product():
            return math.prod(sizes)
        case Quotient():
            return sizes[0] * sizes[1]
        case Power(_, exponent):
            count = max(1, abs(exponent.numerator))
            return math.comb(min(sizes[0], MOST) + count - 1, count)
    return sizes[0] if sizes else 1
