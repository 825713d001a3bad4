# SPDX-License-Identifier: MIT
"""How each language spells names, numbers, expressions and statements: one printer, and the facts of port.toml.

Names are common to all programs in snake case; a language spells them in its own case, constants in capitals where it
has them so. What a language reserves, or its program uses itself, gets the suffix `_value`: lambda is lambda_value.
Whole powers of a name up to the fourth are products, in every language alike; other powers are the language's own.
"""

import functools
import re
from collections.abc import Callable, Collection, Iterable
from fractions import Fraction

from conformance.programs.ports import Port
from conformance.programs.sources import snake, source, spaced
from conformance.theory import expressions
from conformance.theory.experiments import camel
from conformance.theory.expressions import (
    Call,
    Expression,
    Name,
    Negative,
    Number,
    Power,
    Product,
    Quotient,
    Sum,
    is_decimal,
    names_in,
)
from conformance.theory.reader import read

SUFFIX = "_value"
HIGHEST_PRODUCT = 4  # a power of a name up to this one is written as a product
LARGEST_INTEGER = 10**9  # beyond, a whole number is written as a decimal, as int holds no more
OPERAND, FACTOR, ALONE = 2, 3, 4  # how strongly an operand has to bind: as a term, as a factor, as a base


class Spelling:
    """The spelling of a program's names in a port's language, and of all that is made of them.

    `constants` are those that the section Parameters states; `names` are all of the program, which stay different from
    each other, and `reserved` says for each what it may not be.
    """

    def __init__(
        self,
        port: Port,
        constants: Collection[str],
        names: Iterable[str] = (),
        reserved: Callable[[str], Collection[str]] = lambda name: (),
    ) -> None:
        self.port = port
        self.constants = frozenset(constants)
        self.own: dict[str, str] = {}
        self.common: dict[str, str] = {}
        for name in names:
            own, long = self.cased(name, name in self.constants), name
            while own in self.common or own in reserved(name):
                long += SUFFIX
                own = self.cased(long, name in self.constants)
            self.own[name] = own
            self.common[own] = name

    def cased(self, name: str, constant: bool) -> str:
        """A name in the language's case, or by its exception."""
        if constant and self.port.constants == "upper":
            return name.upper()
        return dict(self.port.exceptions).get(name, camel(name) if self.port.names == "camel" else name)

    def name(self, name: str) -> str:
        """A name alone, as where it is defined."""
        return self.own.get(name) or self.cased(name, name in self.constants)

    def signal(self, name: str) -> str:
        """A name as an operand: a constant, the time, or the value of a signal."""
        own = self.name(name)
        return own if name in self.constants or name == "t" else self.port.signal.format(name=own)

    # -------------------------------------------------------------- numbers

    def number(self, value: Fraction, whole: bool = False) -> str:
        """A number of either sign, as a double; a whole one without a point if `whole`; a fraction as a quotient."""
        if not is_decimal(value):
            return f"{self.number(Fraction(value.numerator))} / {self.number(Fraction(value.denominator))}"
        digits, e, exponent = expressions.decimal(value).partition("e")
        if e:
            return self.port.exponent.format(digits, exponent)
        return digits if "." in digits or (whole and abs(value) < LARGEST_INTEGER) else digits + ".0"

    # -------------------------------------------------------------- expressions

    def expression(self, e: Expression) -> str:
        """An expression in the language, in the order of its tree."""
        return self.text(e, is_numeric(e))

    def text(self, e: Expression, exact: bool) -> str:
        """An expression; `exact` where whole numbers meet each other alone, and int would divide or overflow."""
        exact = exact or (is_numeric(e) and not is_literal(e))
        match e:
            case Number(value):
                return self.number(value, whole=not exact)
            case Name(name):
                return self.signal(name)
            case Negative(of):
                return f"-{self.within(of, OPERAND, exact)}"
            case Sum(terms):
                return self.sum(terms, exact or several_numeric(terms))
            case Product(factors):
                return self.product(factors, exact or several_numeric(factors))
            case Quotient(over, under):
                return f"{self.within(over, OPERAND, exact)} / {self.within(under, FACTOR, exact)}"
            case Power(Name(name), exponent) if is_product(exponent):
                return " * ".join([self.signal(name)] * int(exponent))
            case Power(base, exponent):
                return self.power(base, exponent, exact)
            case Call(function, argument):
                return dict(self.port.functions)[function].format(self.text(argument, exact))
        raise AssertionError(e)

    def sum(self, terms: tuple[Expression, ...], exact: bool) -> str:
        first, *others = terms
        signs = ((" - ", t.of) if isinstance(t, Negative) else (" + ", t) for t in others)
        return self.text(first, exact) + "".join(sign + self.within(t, OPERAND, exact) for sign, t in signs)

    def product(self, factors: tuple[Expression, ...], exact: bool) -> str:
        first, *others = factors
        merged = (OPERAND if isinstance(f, Power) else FACTOR for f in others)  # x * (y * y) is x * y * y
        return " * ".join(
            [
                self.within(first, OPERAND, exact),
                *(self.within(f, s, exact) for f, s in zip(others, merged, strict=True)),
            ]
        )

    def power(self, base: Expression, exponent: Fraction, exact: bool) -> str:
        if not self.port.power.startswith("{"):  # a function
            return self.port.power.format(self.text(base, exact), self.number(exponent, whole=True))
        size = self.number(exponent, whole=True)
        size = size if exponent >= 0 and is_decimal(exponent) else f"({size})"
        return self.port.power.format(self.within(base, ALONE, exact), size)

    def within(self, e: Expression, strength: int, exact: bool) -> str:
        """An operand, in brackets unless it binds as strongly as that."""
        text = self.text(e, exact)
        return text if self.precedence(e) >= strength else f"({text})"

    def precedence(self, e: Expression) -> int:
        """How strongly an expression binds as it is written here."""
        if isinstance(e, Power) and isinstance(e.base, Name) and is_product(e.exponent):
            return OPERAND
        return expressions.precedence(e)

    # -------------------------------------------------------------- statements

    def definition(self, name: str, e: Expression) -> str:
        """What defines a name."""
        return self.port.definition.format(name=self.name(name), expression=self.expression(e))

    def spelled(self, text: str) -> str:
        """A statement in the common spelling, such as "z1 = x1 - r", or an expression, in the language."""
        name, equals, e = text.partition(" = ")
        return self.definition(name, read(e)) if equals else self.text(read(text), False)

    def prose(self, text: str) -> str:
        """A text in words, with the program's names as the language spells them."""
        return re.sub(r"(?<![\w.])[A-Za-z]\w*", lambda m: self.own.get(m[0], m[0]), text)


def is_product(exponent: Fraction) -> bool:
    """True for the exponents of a name that is multiplied by itself."""
    return exponent.denominator == 1 and 2 <= exponent <= HIGHEST_PRODUCT


def is_numeric(e: Expression) -> bool:
    """True for an expression without names."""
    return next(names_in(e), None) is None


def is_literal(e: Expression) -> bool:
    """True for a number of either sign."""
    return isinstance(e, Number) or (isinstance(e, Negative) and isinstance(e.of, Number))


def several_numeric(parts: tuple[Expression, ...]) -> bool:
    return sum(map(is_numeric, parts)) > 1


# ------------------------------------------------------------------ texts in the common spelling


def spelled(port: Port, text: str) -> str:
    """A statement in the common spelling, such as "z1 = x1 - r", or an expression, as the port's program spells it."""
    return spelling_of(port).spelled(text)


def spelled_name(port: Port, name: str) -> str:
    """A name in the common spelling as the port's program spells it."""
    return spelling_of(port).name(name)


@functools.cache
def spelling_of(port: Port) -> Spelling:
    """The spelling of a port's program as it stands in the tree."""
    pattern = spaced(port.constant.partition("{value}")[0].replace("{name}", "\0")).replace(re.escape("\0"), r"(\w+)")
    stated = re.findall(rf"^[ \t]*(?:Cell\[\")?{pattern}", parameters(port, source(port)), flags=re.MULTILINE)
    exceptions = {own: common for common, own in port.exceptions}
    lower = port.constants == "upper"
    return Spelling(port, [exceptions.get(own) or (own.lower() if lower else snake(own)) for own in stated])


def parameters(port: Port, text: str) -> str:
    """The section Parameters of a program."""
    _, _, rest = text.partition(port.section.format("Parameters"))
    return rest.partition(port.section.format("Reference"))[0]
