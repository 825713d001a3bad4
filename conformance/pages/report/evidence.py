# SPDX-License-Identifier: MIT
"""The evidence in tables: every check of every program, each program against each other, each mistake refused."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import log10
from typing import Any, NamedTuple

from conformance.judging.checks import Result
from conformance.judging.verdict import Verdict
from conformance.pages.report.exercises import kill_matrix
from conformance.trials.variant import Variant


@dataclass(frozen=True)
class Cell:
    """A result of one program: its figure, short and in words."""

    status: str  # pass, fail or none; of a mistake that is refused as it must be, caught
    figure: str
    words: str
    weight: float = 0.0  # how far the figure is on the way to its bound, on a logarithmic scale from 0 to 1


@dataclass(frozen=True)
class Error:
    """The error of a state on the logarithmic axis of DECADES: where it and its tolerance stand, from 0 to 1."""

    state: str
    place: float
    bound: float
    words: str


class Line(NamedTuple):
    """A line of a table: what it is about, the lesson's section, one cell per program, and where its head leads."""

    head: str
    section: str
    cells: list[Cell]
    address: str = ""


DECADES = (-12, -5)  # of the axis of errors
NOTHING = Cell("none", "", "not measured")


def claims(verdicts: Sequence[Verdict]) -> list[Line]:
    """A line for every claim that was measured."""
    order = {result.claim: result.section for verdict in verdicts for result in verdict.results}
    measured = [{result.claim: cell(result) for result in verdict.results} for verdict in verdicts]
    return [
        Line(said(claim), section, [results.get(claim, NOTHING) for results in measured])
        for claim, section in order.items()
    ]


def said(claim: str) -> str:
    """A claim as a sentence."""
    return claim.replace("-", " ").replace("lyapunov", "Lyapunov")


def errors(verdict: Verdict) -> list[Error]:
    """The largest error of each state, and its tolerance."""

    def place(value: float) -> float:
        low, high = DECADES
        return min(1.0, max(0.0, (log10(value) - low) / (high - low))) if value > 0 else 0.0

    return [
        Error(state, place(r.figure), place(r.bound), f"{state}: {r.figure:.1e}, tolerance {r.bound:.1e}")
        for state, r in verdict.errors.items()
    ]


def in_words(headline: str, languages: Mapping[str, str]) -> str:
    """A headline with the languages in the place of the ports' names."""
    names = "|".join(sorted(map(re.escape, languages), key=len, reverse=True))
    return re.sub(rf"\b({names})\b", lambda name: languages[name[1]], headline) if names else headline


def cell(result: Result) -> Cell:
    """A result as a cell; it weighs 1 at its bound, and 0 six decades below."""
    share = result.figure / result.bound if result.bound else float(not result.passed)
    weight = 1 + log10(share) / 6 if 0 < share < 1 else float(share > 0)
    words = f"{result.figure:.3g}, bound {result.bound:.3g} ({result.bound_from}); {result.where}"
    return Cell(
        "pass" if result.passed else "fail",
        f"{result.figure:.1g}",
        words,
        round(max(0.0, weight), 2),
    )


def against(languages: Mapping[str, str], pairs: Mapping[tuple[str, str], Result]) -> list[Line]:
    """A line for every language: how far each two ports are apart, over all states and times."""
    cells = {frozenset(names): cell(result) for names, result in pairs.items()}
    itself = Cell("self", "", "itself")
    return [
        Line(language, "", [itself if a == b else cells.get(frozenset((a, b)), NOTHING) for b in languages])
        for a, language in languages.items()
    ]


def outcomes(variants: Iterable[Variant], ports: Iterable[str]) -> list[Line]:
    """A line for every variant: how many checks refuse it, as it must be or not."""
    found = kill_matrix()
    return [
        Line(
            variant.title,
            variant.section,
            [outcome(variant, found.get((variant.name, port))) for port in ports],
            f"#exercise-{variant.name}",
        )
        for variant in variants
        if any((variant.name, port) in found for port in ports)
    ]


def outcome(variant: Variant, row: Mapping[str, Any] | None) -> Cell:
    """What became of a variant in one program: a mistake must be refused by its check, an experiment conform."""
    if row is None:
        return Cell("none", "", "the program has no such text")
    refusals = row["refusals"]
    as_wanted = variant.refused_by in refusals if variant.refused_by else row["status"] == "pass"
    wanted = "caught" if variant.refused_by else "pass"
    without = "conforms" if row["status"] == "pass" else row["status"]
    words = f"refused by: {', '.join(map(said, refusals))}" if refusals else without
    figure = f"refused {len(refusals)}" if refusals else without
    return Cell(wanted if as_wanted else "fail", figure, words)
