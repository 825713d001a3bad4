# SPDX-License-Identifier: MIT
"""The derivation on the page: each step's terms of V', beside the statements that take them away."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction

from conformance.pages.report.rows import Part, Row
from conformance.pages.report.symbols import Notation
from conformance.theory.cancellation import Term, cancellation
from conformance.theory.derivation import Derivation
from conformance.theory.expressions import (
    ZERO,
    Expression,
    Name,
    Negative,
    add,
    names_in,
    number,
    power,
    quotient,
    terms_of,
)


@dataclass(frozen=True)
class ShownTerm:
    """A term of V': its LaTeX, where it comes from, what is put against it (LaTeX, or nothing), and what becomes of it.

    `by` is the name of the statement that answers it, or of what it joins; "" where there is none. One that is
    `collected` is the sum of others.
    """

    latex: str
    cause: str
    answer: str
    fate: str
    by: str
    collected: bool


@dataclass(frozen=True)
class ShownStep:
    """A step: its number, its V, the rate of its error and what is put in there (LaTeX), its terms, what it leaves and
    its tuning function (LaTeX), and its rows."""

    i: int
    last: bool
    lyapunov: str
    rate: str
    put_in: tuple[str, ...]
    terms: tuple[ShownTerm, ...]
    left: str
    tuning: tuple[str, ...]
    rows: tuple[Row, ...]


def steps(derivation: Derivation, notation: Notation, parts: Iterable[Part]) -> list[ShownStep]:
    """The steps of a derivation, with the rows of their statements."""
    experiment = derivation.experiment
    groups = {heading: rows for part in parts for heading, rows in part.groups}
    n = len(experiment.states)
    equations = {i: part.equations for i in range(1, n + 1) for part in derivation.parts if part.heading == f"Step {i}"}
    return [
        ShownStep(
            step.i,
            step.i == n,
            _lyapunov(derivation, notation, step.i),
            _rate(derivation, notation, step.i),
            tuple(_put_in(derivation, notation, step.i)),
            tuple(_shown(term, notation) for term in step.terms),
            rf"\dot{{V}}_{{{step.i}}} = {notation.expression(step.left)}",
            tuple(
                notation.equation(*e[:2]) for e in equations[step.i] if re.match(rf"tau{step.i}\b|tau{step.i}_", e.name)
            ),
            groups.get(f"Step {step.i}", ()),
        )
        for step in cancellation(experiment)
    ]


def _lyapunov(derivation: Derivation, notation: Notation, i: int) -> str:
    if i > 1:
        square = notation.expression(quotient(power(Name(f"z{i}"), Fraction(2)), number(2)))
        return f"V_{{{i}}} = V_{{{i - 1}}} + {square}"
    whole = next(e for part in derivation.parts for e in part.equations if e.name == "V")
    own = (term for term in terms_of(whole.expression) if not any(re.fullmatch("z[2-9]", s) for s in names_in(term)))
    return f"V_1 = {notation.expression(add(*own))}"


def _rate(derivation: Derivation, notation: Notation, i: int) -> str:
    """The derivative of z_i, by the row of the plant and of what z_i is measured from."""
    row = notation.expression(derivation.experiment.rows[i - 1])
    return f"{notation.rate(f'z{i}')} = {row} - {notation.rate(f'alpha{i - 1}' if i > 1 else 'r')}"


def _put_in(derivation: Derivation, notation: Notation, i: int) -> Iterator[str]:
    """By what the next state, and the unknown parameters of the row, are written there."""
    experiment, name = derivation.experiment, notation.name
    if i < len(experiment.states):
        yield f"{name(experiment.states[i])} = {name(f'alpha{i}')} + {name(f'z{i + 1}')}"
    there = set(names_in(experiment.rows[i - 1]))
    for p in experiment.unknown:
        if p.name in there:
            yield f"{name(p.name)} = {name(p.estimate)} - {name(f'{p.name}_tilde')}"


def _shown(term: Term, notation: Notation) -> ShownTerm:
    return ShownTerm(
        _signed(term.term, notation),
        term.cause,
        _signed(term.answer, notation) if term.answer != ZERO else "",
        term.fate.value,
        term.by,
        term.collected,
    )


def _signed(e: Expression, notation: Notation) -> str:
    """An expression as it stands among others, with its sign."""
    sign = "" if isinstance(e, Negative) else "+"
    return rf"\displaystyle {sign}{notation.expression(e)}"
