# SPDX-License-Identifier: MIT
"""The programs side by side, statement by statement: each in every language on one row, under its equation."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby

from markupsafe import Markup

from conformance.pages.report.listing import highlighted, highlighted_lines, listing
from conformance.pages.report.symbols import Notation
from conformance.programs.ports import Port, read_ports
from conformance.programs.sources import STEPS, Tagged, tagged
from conformance.programs.writer import Program
from conformance.theory.experiments import Experiment
from conformance.theory.expressions import number
from conformance.theory.statements import (
    PLANT,
    REFERENCE,
    REGRESSOR,
    Parameter,
    Statement,
    cited,
    parameters_of,
    recursion_of,
    statements_of,
)


@dataclass(frozen=True)
class Row:
    """A statement: its name, what its comment says, its equation (LaTeX), and its code by port."""

    name: str
    tag: str
    wording: str
    remark: str
    equation: str
    cells: Mapping[str, Markup]


@dataclass(frozen=True)
class Part:
    """A part of the programs: its rows, under headings that may be empty, and the whole of it by port."""

    key: str
    title: str
    groups: tuple[tuple[str, tuple[Row, ...]], ...]
    whole: Mapping[str, Markup]


def parts(experiment: Experiment, notation: Notation, ports: Iterable[Port]) -> tuple[Part, ...]:
    """The parts of the programs in their order; a port that is not cut into them shows none."""
    ports = tuple(ports)
    names = {port.name: spellings(experiment, port) for port in ports}
    whole = {port.name: highlighted(port, names[port.name]) for port in ports}
    rows = _by_part(experiment, _rows(experiment, notation, [port for port in ports if whole[port.name]], names))
    return tuple(
        Part(
            step.key,
            step.title,
            tuple(rows.get(step.key, {}).items()),
            {name: code[step.key] for name, code in whole.items() if step.key in code},
        )
        for step in STEPS
    )


def spellings(experiment: Experiment, port: Port) -> dict[str, str]:
    """The common names, by those of the port's language; none where they are not known, as of a port without template.

    The true value of a parameter has the parameter's name.
    """
    if not port.template:
        return {}
    language = read_ports(port.root)[port.name] if port.plant else port  # whose folder has the template
    common = Program(experiment, language, statements_of(experiment)).spelling.common
    return {own: name.removesuffix("_true") for own, name in common.items()}


def _rows(
    experiment: Experiment, notation: Notation, ports: Iterable[Port], names: Mapping[str, Mapping[str, str]]
) -> Iterator[Row]:
    """The rows of all statements, the constants first."""
    statements: list[Parameter | Statement] = [*parameters_of(experiment), *statements_of(experiment)]
    found = {port: _matched(statements, tagged(port)) for port in ports}
    for i, s in enumerate(statements):
        cells = {
            port.name: _cell(code.text, port, names[port.name])
            for port, matched in found.items()
            if (code := matched[i]) is not None
        }
        if isinstance(s, Parameter):
            words = re.sub(r"\^(-?\d+)", r"$^{\1}$", s.unit)  # s^2 as text
            unit = rf"\ \text{{{words}}}" if words else ""
            equation = f"{notation.name(s.name)} = {notation.expression(number(s.value))}{unit}"
            yield Row(s.name, cited(s.tag), s.by_itself, "", equation, cells)
        else:
            yield Row(s.name, s.tag, s.wording, s.remark, notation.equation(s.name, s.expression), cells)


def _matched(statements: Iterable[Parameter | Statement], found: list[Tagged]) -> list[Tagged | None]:
    """What a program has for each statement, in order; None where it lacks it."""
    waiting = list(found)
    matched: list[Tagged | None] = []
    for s in statements:
        words = f"{s.wording}, {s.unit}" if isinstance(s, Parameter) and s.unit else s.wording
        at = next((i for i, t in enumerate(waiting) if (t.tag, t.wording) == (s.tag, words)), None)
        matched.append(None if at is None else waiting[at])
        waiting = waiting if at is None else waiting[at + 1 :]
    return matched


def _cell(text: str, port: Port, names: Mapping[str, str]) -> Markup:
    return listing(text + "\n", highlighted_lines(text + "\n", port.source, names))


def _by_part(experiment: Experiment, rows: Iterable[Row]) -> dict[str, dict[str, tuple[Row, ...]]]:
    """The rows by part and heading."""
    step_of = recursion_of(experiment).chain.step_of
    sections = {s.name: s.section for s in statements_of(experiment)}

    def place(row: Row) -> tuple[str, str]:
        section = sections.get(row.name, "parameters")
        if section in ("parameters", REFERENCE, PLANT):
            return {PLANT: "closed-loop"}.get(section, section), ""
        return "controller", "Regressor" if section == REGRESSOR else f"Step {step_of[row.name]}"

    found: dict[str, dict[str, tuple[Row, ...]]] = {}
    for (part, heading), some in groupby(rows, key=place):
        found.setdefault(part, {})[heading] = tuple(some)
    return found
