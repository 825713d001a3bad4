# SPDX-License-Identifier: MIT
"""Edits of a program's text: replacements, constants by name, and another experiment, in every port's own spelling."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction

from conformance.programs.ports import Port
from conformance.programs.sources import source, spaced
from conformance.programs.spelling import parameters, spelled, spelled_name
from conformance.theory.experiments import HORIZON, Experiment, values_of
from conformance.theory.expressions import Number, substitute
from conformance.theory.lesson import LESSON
from conformance.theory.statements import statements_of

NUMBER = r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?"


@dataclass(frozen=True)
class Edit:
    """A text that must occur exactly once, and what takes its place; `loose`: however it is spaced, as in z1=x1 - r."""

    old: str
    new: str
    loose: bool = False


def edited(text: str, edits: Iterable[Edit]) -> str:
    """The text after the edits, one after another; raises ValueError unless each finds its old text exactly once."""
    for edit in edits:
        found = list(re.finditer(spaced(edit.old) if edit.loose else re.escape(edit.old), text))
        if len(found) != 1:
            raise ValueError(f"found {edit.old!r} {len(found)} times, expected once")
        text = text[: found[0].start()] + edit.new + text[found[0].end() :]
    return text


def spelled_edit(port: Port, old: str, new: str) -> Edit:
    """An edit of a statement that every program has, as this port spells it, and whatever its spacing."""
    return Edit(spelled(port, old), spelled(port, new), loose=True)


def constant_value(port: Port, text: str, name: str) -> str | None:
    """A constant as the section Parameters states it; None where the program has none of that name."""
    before, after = map(spaced, port.constant.format(name=spelled_name(port, name), value="\0").split("\0"))
    found = re.findall(rf"(?<!\w){before}[ \t]*({NUMBER})(?![\w.])[ \t]*{after}", parameters(port, text))
    return found[0] if len(found) == 1 else None


def constant_edit(port: Port, text: str, name: str, value: str) -> Edit:
    """The edit that gives a constant (named in snake_case) another value; raises ValueError where there is none."""
    old = constant_value(port, text, name)
    if old is None:
        raise ValueError(f"no constant {spelled_name(port, name)!r} in the section Parameters")
    before, after = (port.constant.format(name=spelled_name(port, name), value=number) for number in (old, value))
    return Edit(before, after, loose=True)


def decimal(value: Fraction) -> str:
    """The nearest double without an exponent, which every language reads alike: 20.0, -0.5, 0.00001."""
    text = format(Decimal(repr(float(value))), "f")
    return text if "." in text else text + ".0"


def experiment_edits(port: Port, text: str, experiment: Experiment) -> list[Edit]:
    """What turns the lesson's program into that of another experiment; logged times keep their distance."""
    lesson, values = values_of(LESSON), values_of(experiment)
    spelling = {HORIZON: "final_time"} | {parameter: f"{parameter}_true" for parameter in LESSON.parameters}
    edits = [
        constant_edit(port, text, spelling.get(name, name), decimal(values[name]))
        for name, number in lesson.items()
        if values[name] != number
    ]
    intervals = constant_value(port, text, "intervals")
    if intervals and experiment.horizon != LESSON.horizon:
        count = max(1, round(int(intervals) * experiment.horizon / LESSON.horizon))
        edits.append(constant_edit(port, text, "intervals", str(count)))
    more = {name: Number(number) for name, number in experiment.constants if name not in lesson}
    reference = replace(LESSON, reference=substitute(experiment.reference, more))
    pairs = zip(statements_of(LESSON), statements_of(reference), strict=True)
    edits += [spelled_edit(port, str(old), str(new)) for old, new in pairs if str(old) != str(new)]
    return edits


def in_experiment(port: Port, experiment: Experiment) -> str:
    """The lesson's program turned into that of another experiment; raises ValueError where an edit does not apply."""
    text = source(port)
    return edited(text, experiment_edits(port, text, experiment))


def without_drawing(port: Port, text: str) -> list[Edit]:
    """What leaves out the figure of a program of this port, which costs more time than the rest of it.

    Raises ValueError for a statement outside of the section Figures, an import apart: there it would hide what it does.
    """
    _, _, figures = text.partition(port.section.format("Figures"))
    edits = []
    for opening in port.drawing:
        statement = rf"^ *{re.escape(opening)}(?:.*(?:\.\.\.|[,(])\n)*.*\n"  # which may go on in further lines
        found = re.findall(statement, text, flags=re.MULTILINE)
        if len(found) != 1 or not (found[0] in figures or found[0].startswith("import ")):
            raise ValueError(
                f"{port.name}, drawing: {opening!r} begins no statement of the section Figures, or several"
            )
        edits.append(Edit(found[0], ""))
    return edits
