# SPDX-License-Identifier: MIT
"""Exact numbers from text: 0.1 is 1/10. Bounded, so that no text makes a number that takes long or fills the memory."""

import re
from fractions import Fraction

from conformance.foreign import kind, shown

EXACT = "a finite decimal, such as 0.1, or a fraction, such as 1/3"
LONGEST = 400  # characters of a number
EXPONENT = 400  # of ten, at most and, negative, at least: more than a double spans

DECIMAL = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE]([-+]?\d+))?", re.ASCII)
FRACTION = re.compile(r"[-+]?\d+/\d+", re.ASCII)


def exact_number(text: str) -> Fraction:
    """A decimal or a fraction as what it says; spaces around it do not matter.

    Raises ValueError, in one line, for what is neither, and for more than 400 characters or an exponent beyond 400.
    """
    number = text.strip(" \t")
    decimal = DECIMAL.fullmatch(number) if len(number) <= LONGEST else None
    if len(number) > LONGEST:
        raise ValueError(f"found {shown(number, 40)}, expected at most {LONGEST} characters")
    if decimal and decimal[1] and abs(int(decimal[1])) > EXPONENT:
        raise ValueError(f"found {shown(number, 40)}, expected an exponent from -{EXPONENT} to {EXPONENT}")
    if decimal or (FRACTION.fullmatch(number) and int(number.partition("/")[2])):
        return Fraction(number)
    raise ValueError(f"found {shown(number, 40)}, expected {EXACT}")


def exact_value(value: object) -> Fraction:
    """The number that a TOML or JSON value stands for: an integer, a decimal kept as text, or a text as above.

    Raises ValueError as `exact_number` does, and for a boolean, a date, a list or a table.
    """
    if isinstance(value, int) and not isinstance(value, bool):
        if value.bit_length() > 3 * LONGEST:
            raise ValueError(f"found {kind(value)}, expected at most {LONGEST} characters")
        return Fraction(value)
    if isinstance(value, str):
        return exact_number(value)
    raise ValueError(f"found {kind(value)}, expected {EXACT}")


def double(value: Fraction) -> float:
    """The nearest double; raises ValueError where that is infinite, or 0 for a number that is not."""
    try:
        nearest = float(value)
    except OverflowError:
        nearest = float("inf")
    if nearest == float("inf") or (nearest == 0 and value):
        raise ValueError("found a number beyond what a double holds, expected 2.2e-308 to 1.8e308 in size, or 0")
    return nearest
