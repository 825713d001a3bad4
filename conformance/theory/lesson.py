# SPDX-License-Identifier: MIT
"""The lesson: its experiment, (10), as its file has it, and its sections."""

from typing import NamedTuple

from conformance.places import LESSON as FILE
from conformance.theory.experiment_file import as_written

LESSON = as_written(FILE)


class Section(NamedTuple):
    """A section of the lesson, or several: their numbers, which stand in brackets everywhere, and what they hold."""

    numbers: range
    words: str

    def __str__(self) -> str:
        first, last = self.numbers[0], self.numbers[-1]
        return f"({first})" if first == last else f"({first}) to ({last})"


SECTIONS = (
    Section(range(2, 3), "the class of plants: strict-feedback form"),
    Section(range(3, 4), "what is assumed of functions, gains, state and reference"),
    Section(range(4, 5), "what is unknown: constant parameters, linear in every row"),
    Section(range(5, 6), "the error coordinates, and the error of the estimate"),
    Section(range(6, 7), "the first step, for any first row"),
    Section(range(7, 8), "the worked example: two states, one unknown parameter"),
    Section(range(8, 9), "the recursion, for any number of states"),
    Section(range(9, 10), "tracking does not identify the parameter, excitation does"),
    Section(range(10, 15), "the experiment, and its program in each language"),
    Section(range(15, 16), "the experiment's numbers, and what a correct run shows"),
    Section(range(16, 17), "common errors"),
    Section(range(17, 18), "problems"),
)
