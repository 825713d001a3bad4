# SPDX-License-Identifier: MIT
"""A text is the number that it says, exactly, or is refused in one short line, at once."""

from fractions import Fraction

import pytest

from conformance.theory.numbers import double, exact_number, exact_value

NUMBERS = {
    "0.1": Fraction(1, 10),
    "-1/3": Fraction(-1, 3),
    "+.5": Fraction(1, 2),
    "5.": Fraction(5),
    "1e-400": Fraction(1, 10**400),
    "1.5E2": Fraction(150),
    " 2 ": Fraction(2),
}
NONE = [
    "", "now", "1/0", "1e999999999", "1e-99999999", "1e401", "9" * 401, "1/" + "9" * 5000, "nan", "inf", "1_000",
    "0x10", "1e5.5", "1.5/2", "1 / 2", "\u0661\u0662", "\uff11.\uff15", "1+2j",
    "True", "1,5", "--1", "1\n", "\x1b[31m1", "1e",
]  # fmt: skip


@pytest.mark.parametrize("text", NUMBERS)
def test_number_is_what_it_says(text: str) -> None:
    assert exact_number(text) == NUMBERS[text]


@pytest.mark.parametrize("text", NONE)
def test_what_is_no_number_or_beyond_bounds_is_refused_in_one_short_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"^found .*, expected ") as refusal:
        exact_number(text)
    assert str(refusal.value).isprintable() and len(str(refusal.value)) < 200


def test_value_of_a_file_is_a_number_or_refused() -> None:
    assert exact_value(3) == 3 and exact_value("0.1") == Fraction(1, 10)
    for value in (True, None, [1], {"a": 1}, 10**5000, "x"):
        with pytest.raises(ValueError, match=r"^found .*, expected "):
            exact_value(value)


def test_number_that_no_double_holds_is_refused() -> None:
    assert double(Fraction(1, 10)) == 0.1
    for text in ("1e400", "-1e309", "1e-400"):
        with pytest.raises(ValueError, match="beyond what a double holds"):
            double(exact_number(text))
