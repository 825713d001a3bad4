# SPDX-License-Identifier: MIT
"""Lines of programs: long ones broken before operators or after commas, and comments that trail them aligned."""

import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

WIDTH = 120  # columns of a line
ALIGNED = 76  # columns of code up to which the comment that trails it is aligned with its neighbours'
FAR = 72  # columns before a list
HANGING = 8  # columns by which a line goes on behind the beginning of the statement, where it has to
PRODUCT = 100  # levels by which it is worse to break a product than a sum
OPERATOR = re.compile(r" [-+*/] ")
OF_PRODUCT = re.compile(r" *[*/] ")


class Line(NamedTuple):
    """One statement, of one line or more, and the comment that trails it, or none."""

    code: tuple[str, ...]
    comment: str = ""


class Break(NamedTuple):
    """Where a line may be broken: how deep within the statement, before which character, and where to go on."""

    level: int
    at: int
    column: int


def broken(code: str, start: int, width: int = WIDTH, last: int = 0, ends: str = "") -> tuple[str, ...]:
    """Code of at most so many columns a line, broken before the outermost operators of sums that allow it.

    What stands before `start` stays whole; the lines go on below it, or where that is too far right, below the line's
    first word, and in brackets below the innermost of them. `last` columns of the last line are kept free, and all
    lines but the last end with `ends`.
    """
    below = broken_at(code, start, start, width, last, ends)
    hanging = len(code) - len(code.lstrip()) + HANGING
    if sum(map(len, below[1:])) and (len(below[-1]) > width - last or any(OF_PRODUCT.match(s) for s in below[1:])):
        return broken_at(code, start, hanging, width, last, ends)
    return below


def broken_at(code: str, start: int, column: int, width: int, last: int, ends: str) -> tuple[str, ...]:
    """Code that is broken and goes on at a column, where no bracket is open."""
    lines: list[str] = []
    while len(code) > width - last:
        fitting = [b for b in breaks(code, start, column) if b.at <= width - len(ends)]
        if not fitting:
            break
        level = min(b.level for b in fitting)
        chosen = [b for b in fitting if b.level == level][-1]
        lines.append(code[: chosen.at].rstrip() + ends)
        code = " " * chosen.column + code[chosen.at :].lstrip()
        start, column = chosen.column + 2, chosen.column  # behind the operator
    return (*lines, code)


def breaks(code: str, start: int, column: int) -> Iterator[Break]:
    """The operators from `start` on before which code may be broken; those of products come after all of sums."""
    columns = [column]
    for i in range(start, len(code)):
        if code[i] in "([{":
            columns.append(i + 1)
        elif code[i] in ")]}" and len(columns) > 1:
            columns.pop()
        elif found := OPERATOR.match(code, i):
            yield Break(len(columns) + (PRODUCT if found[0] in (" * ", " / ") else 0), i + 1, columns[-1])


def listed(
    opening: str, items: Sequence[str], closing: str, ends: str = "", between: str = ", ", again: str = ""
) -> str:
    """Items between brackets, in as many lines as they need, each below the first item.

    Where that is far to the right they stand behind the first line's beginning. All lines but the last end with
    `ends`, and all but the first begin with `again`, which is the whole indent where it begins with a space.
    """
    indent = again if again.startswith(" ") else " " * (len(opening) - len(again)) + again
    lines, line = list[str](), opening
    if len(opening) > FAR and len(opening + between.join(items) + closing) > WIDTH:
        indent = " " * (len(opening) - len(opening.lstrip()) + HANGING)
        lines, line = [opening.rstrip() + ends], indent
    for i, item in enumerate(items):
        is_last = i == len(items) - 1
        more = item + (closing if is_last else between)
        if len((line + more).rstrip()) + (0 if is_last else len(ends)) > WIDTH and line not in (opening, indent):
            lines.append(line.rstrip() + ends)
            line = indent
        line += more
    return "\n".join([*lines, line if items else opening + closing])


def filled(opening: str, words: Sequence[str], width: int, indent: str) -> list[str]:
    """Words in as many lines of at most so many columns as they need, all but the first after an indent.

    A word may hold line ends, which part it.
    """
    parts = "\n".join(words).split("\n")
    lines = [opening + parts[0]]
    for word in parts[1:]:
        if len(lines[-1]) + 1 + len(word.rstrip()) > width:
            lines.append(indent + word)
        else:
            lines[-1] += " " + word
    return lines


def aligned(lines: Sequence[Line], align: bool = True, width: int = WIDTH) -> list[str]:
    """The lines with their comments, two spaces behind the code; neighbours' comments stand below each other."""
    found = []
    for has_comment, run in groupby(lines, lambda line: bool(line.comment and len(line.code) == 1)):
        group = list(run)
        short = [len(line.code[0]) for line in group if len(line.code[0]) <= ALIGNED]
        column = max(short, default=0) if has_comment and align else 0
        for *before, code in (line.code for line in group):
            found.append((before, code, column if len(code) <= ALIGNED else 0))
    text = []
    for line, (before, code, column) in zip(lines, found, strict=True):
        place = column if column + len(line.comment) + 2 <= width else 0
        text += [*before, f"{code:<{place}}  {line.comment}" if line.comment else code]
    return text
