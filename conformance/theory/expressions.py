# SPDX-License-Identifier: MIT
"""Expressions as their author wrote them: an ordered tree, its derivatives, and its exact values.

SymPy sorts sums and products; here every operand stays where it was written, and a derivative keeps that order, so that
a program reads as the textbook does. The constructors `add`, `product`, `quotient` and `power` leave out terms of 0 and
factors of 1; what `reader.read` returns is not touched by them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "sinh", "cosh", "tanh", "atan")

Span = tuple[int, int]  # of the text that was read, from and up to


@dataclass(frozen=True)
class Node:
    """What all expressions have: where they stand in the text that was read; (0, 0) for what was derived."""

    span: Span = field(default=(0, 0), compare=False, repr=False, kw_only=True)


@dataclass(frozen=True)
class Number(Node):
    """A number that is not negative, as what it says: 0.1 is 1/10."""

    value: Fraction


@dataclass(frozen=True)
class Name(Node):
    """A symbol."""

    name: str


@dataclass(frozen=True)
class Negative(Node):
    """Minus an expression; within a sum, a term that is subtracted."""

    of: Expression


@dataclass(frozen=True)
class Sum(Node):
    """Two or more terms."""

    terms: tuple[Expression, ...]


@dataclass(frozen=True)
class Product(Node):
    """Two or more factors."""

    factors: tuple[Expression, ...]


@dataclass(frozen=True)
class Quotient(Node):
    """A numerator over a denominator."""

    over: Expression
    under: Expression


@dataclass(frozen=True)
class Power(Node):
    """A base with a constant exponent."""

    base: Expression
    exponent: Fraction


@dataclass(frozen=True)
class Call(Node):
    """One of the FUNCTIONS of an argument."""

    function: str
    argument: Expression


Expression = Number | Name | Negative | Sum | Product | Quotient | Power | Call

ZERO, ONE = Number(Fraction(0)), Number(Fraction(1))


# ------------------------------------------------------------------ looking at expressions


def children(e: Expression) -> tuple[Expression, ...]:
    """The operands of an expression, in order."""
    match e:
        case Negative(of):
            return (of,)
        case Sum(parts) | Product(parts):
            return parts
        case Quotient(over, under):
            return over, under
        case Power(base, _):
            return (base,)
        case Call(_, argument):
            return (argument,)
    return ()


def walk(e: Expression) -> Iterator[Expression]:
    """The expression and all within it, each before its operands."""
    yield e
    for child in children(e):
        yield from walk(child)


def names_in(e: Expression) -> Iterator[str]:
    """The names in an expression, as often as they stand there."""
    return (node.name for node in walk(e) if isinstance(node, Name))


def operations(e: Expression) -> int:
    """The number of signs, operators and functions."""
    own = {Sum: len(children(e)) - 1, Product: len(children(e)) - 1, Number: 0, Name: 0}.get(type(e), 1)
    return (
        own
        - sum(isinstance(c, Negative) for c in children(e)[1:] if isinstance(e, Sum))
        + sum(map(operations, children(e)))
    )


def terms_of(e: Expression) -> tuple[Expression, ...]:
    """The terms of a sum, or the expression as the only one."""
    return e.terms if isinstance(e, Sum) else (e,)


# ------------------------------------------------------------------ constructors that leave out 0 and 1


def number(value: Fraction | int) -> Expression:
    """A number of either sign."""
    return Negative(Number(Fraction(-value))) if value < 0 else Number(Fraction(value))


def negative(e: Expression) -> Expression:
    """Minus an expression; of a sum, the sum of the negative terms."""
    match e:
        case Number(value) if value == 0:
            return e
        case Negative(of):
            return of
        case Sum(terms):
            return Sum(tuple(map(negative, terms)))
    return Negative(e)


def add(*terms: Expression) -> Expression:
    """The sum of terms; like terms meet where the first of them stands."""
    coefficients: dict[Expression, Fraction] = {}
    first: dict[Expression, tuple[Expression, Fraction]] = {}
    for term in _flattened(terms):
        coefficient, core = split_number(term)
        if not coefficient:
            continue
        coefficients[core] = coefficients.get(core, Fraction(0)) + coefficient
        first.setdefault(core, (term, coefficient))
    kept = [
        first[core][0] if coefficient == first[core][1] else product(number(coefficient), core)
        for core, coefficient in coefficients.items()
        if coefficient
    ]
    return Sum(tuple(kept)) if len(kept) > 1 else kept[0] if kept else ZERO


def product(*factors: Expression) -> Expression:
    """The product of factors: signs and numbers go to the front, denominators to the end."""
    coefficient, over, under = Fraction(1), list[Expression](), list[Expression]()
    waiting = list(reversed(factors))
    while waiting:
        match waiting.pop():
            case Number(value):
                coefficient *= value
            case Negative(of):
                coefficient = -coefficient
                waiting.append(of)
            case Product(parts):
                waiting.extend(reversed(parts))
            case Quotient(numerator, denominator):
                under.append(denominator)
                waiting.append(numerator)
            case Sum() as total if _all_negative(total):
                coefficient = -coefficient
                over.append(negative(total))
            case factor:
                over.append(factor)
    if coefficient == 0:
        return ZERO
    if under:
        return quotient(product(number(coefficient), *over), product(*under))
    return _signed(coefficient, _multiplied(abs(coefficient), over))


def quotient(over: Expression, under: Expression) -> Expression:
    """The quotient of two expressions; raises ZeroDivisionError where the denominator is the number 0."""
    if isinstance(under, Quotient):
        return quotient(product(over, under.under), under.over)
    above, numerator = split_number(over) if not isinstance(over, Sum) else (Fraction(1), over)
    below, denominator = split_number(under)
    if isinstance(numerator, Quotient):
        return quotient(product(number(above), numerator.over), product(numerator.under, under))
    if below == 0:
        raise ZeroDivisionError("the denominator is 0")
    coefficient = above / below
    if coefficient == 0:
        return ZERO
    if denominator == ONE and numerator == ONE:
        return number(coefficient)
    if numerator == denominator:
        return number(coefficient)
    if isinstance(numerator, Sum) and (coefficient < 0 or _all_negative(numerator)):
        numerator, coefficient = negative(numerator), -coefficient
    size = abs(coefficient)
    top = _multiplied(Fraction(size.numerator), [] if numerator == ONE else [numerator])
    bottom = _multiplied(Fraction(size.denominator), [] if denominator == ONE else [denominator])
    return _signed(coefficient, top if bottom == ONE else Quotient(top, bottom))


def power(base: Expression, exponent: Fraction) -> Expression:
    """A power; of exponent 0 and 1 none."""
    if exponent == 0 or base == ONE:
        return ONE
    if isinstance(base, Number) and exponent.denominator == 1:
        return Number(base.value ** int(exponent))
    return base if exponent == 1 else Power(base, exponent)


def _multiplied(coefficient: Fraction, factors: list[Expression]) -> Expression:
    """A number that is not negative times factors; a fraction that is no decimal divides."""
    if not is_decimal(coefficient) and factors:
        return Quotient(
            _multiplied(Fraction(coefficient.numerator), factors), Number(Fraction(coefficient.denominator))
        )
    front: list[Expression] = [] if coefficient == 1 and factors else [Number(coefficient)]
    whole = (*front, *factors)
    return whole[0] if len(whole) == 1 else Product(whole)


def _all_negative(e: Sum) -> bool:
    return all(isinstance(term, Negative) for term in e.terms)


def _signed(sign: Fraction, e: Expression) -> Expression:
    return negative(e) if sign < 0 else e


def _flattened(terms: tuple[Expression, ...]) -> Iterator[Expression]:
    for term in terms:
        if isinstance(term, Sum):
            yield from _flattened(term.terms)
        elif isinstance(term, Negative) and isinstance(term.of, Sum):
            yield from _flattened(tuple(map(negative, term.of.terms)))
        else:
            yield term


def split_number(e: Expression) -> tuple[Fraction, Expression]:
    """An expression as a number times the rest; the rest of a number is 1."""
    match e:
        case Number(value):
            return value, ONE
        case Negative(of):
            value, rest = split_number(of)
            return -value, rest
        case Product((Number(value), second, *others)):
            return value, Product((second, *others)) if others else second
    return Fraction(1), e


def is_decimal(value: Fraction) -> bool:
    """True if a number has a finite decimal form."""
    rest = value.denominator
    for prime in (2, 5):
        while rest % prime == 0:
            rest //= prime
    return rest == 1


# ------------------------------------------------------------------ replacing and differentiating


def substitute(e: Expression, values: Mapping[str, Expression]) -> Expression:
    """Put expressions in the place of names; what holds none of them stays as it is."""
    if isinstance(e, Name):
        return values.get(e.name, e)
    old = children(e)
    new = tuple(substitute(child, values) for child in old)
    if all(a is b for a, b in zip(old, new, strict=True)):
        return e
    match e:
        case Negative():
            return negative(*new)
        case Sum():
            return add(*new)
        case Product():
            return product(*new)
        case Quotient():
            return quotient(*new)
        case Power(_, exponent):
            return power(new[0], exponent)
        case Call(function, _):
            return Call(function, new[0])
    return e


def rebuilt(e: Expression, names: Callable[[str], Expression]) -> Expression:
    """Put expressions in the place of names, and leave all else as it was written, terms of 0 included."""
    if isinstance(e, Name):
        return names(e.name)
    new = tuple(rebuilt(child, names) for child in children(e))
    match e:
        case Negative():
            return Negative(*new)
        case Sum():
            return Sum(new)
        case Product():
            return Product(new)
        case Quotient():
            return Quotient(*new)
        case Power(_, exponent):
            return Power(new[0], exponent)
        case Call(function, _):
            return Call(function, new[0])
    return e


def derivative(e: Expression, rate: Callable[[str], Expression]) -> Expression:
    """The derivative of an expression by the chain rule, where `rate` gives that of each name."""

    def d(part: Expression) -> Expression:
        return derivative(part, rate)

    match e:
        case Number():
            return ZERO
        case Name(name):
            return rate(name)
        case Negative(of):
            return negative(d(of))
        case Sum(terms):
            return add(*map(d, terms))
        case Product(factors):
            return add(*(product(*factors[:i], d(f), *factors[i + 1 :]) for i, f in enumerate(factors)))
        case Quotient(over, under):
            return _rate_of_quotient(over, under, d(over), d(under))
        case Power(base, exponent):
            return product(number(exponent), power(base, exponent - 1), d(base))
        case Call(function, argument):
            inner = d(argument)
            return ZERO if inner == ZERO else _rate_of_call(function, argument, inner)


def _rate_of_quotient(over: Expression, under: Expression, over_rate: Expression, under_rate: Expression) -> Expression:
    if under_rate == ZERO:
        return quotient(over_rate, under)
    change = add(product(over_rate, under), negative(product(over, under_rate)))
    return quotient(change, power(under, Fraction(2)))


def _rate_of_call(function: str, a: Expression, inner: Expression) -> Expression:
    two = Fraction(2)
    match function:
        case "sin":
            return product(inner, Call("cos", a))
        case "cos":
            return negative(product(inner, Call("sin", a)))
        case "tan":
            return product(inner, add(ONE, Power(Call("tan", a), two)))
        case "exp":
            return product(inner, Call("exp", a))
        case "log":
            return quotient(inner, a)
        case "sqrt":
            return quotient(inner, product(number(2), Call("sqrt", a)))
        case "sinh":
            return product(inner, Call("cosh", a))
        case "cosh":
            return product(inner, Call("sinh", a))
        case "tanh":
            return product(inner, add(ONE, negative(Power(Call("tanh", a), two))))
        case "atan":
            return quotient(inner, add(ONE, power(a, two)))
    raise AssertionError(function)


# ------------------------------------------------------------------ what expressions are worth


def value(e: Expression, values: Mapping[str, Fraction]) -> Fraction:
    """The exact value of an expression; raises ValueError for one with functions, ZeroDivisionError at a pole."""
    match e:
        case Number(given):
            return given
        case Name(name):
            return values[name]
        case Negative(of):
            return -value(of, values)
        case Sum(terms):
            return sum((value(term, values) for term in terms), Fraction(0))
        case Product(factors):
            return math.prod((value(factor, values) for factor in factors), start=Fraction(1))
        case Quotient(over, under):
            return value(over, values) / value(under, values)
        case Power(base, exponent) if exponent.denominator == 1:
            return value(base, values) ** int(exponent)
    raise ValueError(f"{text(e)} has no exact value")


# ------------------------------------------------------------------ as text


def text(e: Expression) -> str:
    """The expression in one line, as `reader.read` reads it back."""
    match e:
        case Number(given):
            return decimal(given) if is_decimal(given) else f"{given.numerator} / {given.denominator}"
        case Name(name):
            return name
        case Negative(of):
            return f"-{_within(of, 2)}"
        case Sum((first, *others)):
            signs = ((" - ", t.of) if isinstance(t, Negative) else (" + ", t) for t in others)
            return text(first) + "".join(sign + _within(t, 2) for sign, t in signs)
        case Product((first, *others)):
            return " * ".join([_within(first, 2), *(_within(f, 3) for f in others)])
        case Quotient(over, under):
            return f"{_within(over, 2)} / {_within(under, 3)}"
        case Power(base, exponent):
            whole = exponent.denominator == 1 and exponent > 0
            return f"{_within(base, 4)}^{exponent if whole else f'({exponent})'}"
        case Call(function, argument):
            return f"{function}({text(argument)})"
    raise AssertionError(e)


def precedence(e: Expression) -> int:
    """How strongly an expression binds: 1 for sums and signs, 2 for products, 3 for powers, 4 for what stands alone."""
    if isinstance(e, Number):
        return 4 if is_decimal(e.value) else 2
    return {Sum: 1, Negative: 1, Product: 2, Quotient: 2, Power: 3}.get(type(e), 4)


def decimal(number: Fraction) -> str:
    """The shortest decimal that is exactly a number which has one; with an exponent where that is shorter by far."""
    places = 0
    while (number * 10**places).denominator != 1:
        places += 1
    digits = str(abs(number.numerator) * 10**places // number.denominator)
    sign = "-" if number < 0 else ""
    zeros = len(digits) - len(digits.rstrip("0"))
    if places > 12 and len(digits) < places - 3:
        return f"{sign}{digits}e-{places}"
    if not places and zeros > 12:
        return f"{sign}{digits[:-zeros]}e{zeros}"
    digits = digits.rjust(places + 1, "0")
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)


def _within(e: Expression, strength: int) -> str:
    return text(e) if precedence(e) >= strength else f"({text(e)})"
