# SPDX-License-Identifier: MIT
"""The evidence in tables: every check of every program, each program against each other, each mistake refused."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_UP, Context
from itertools import pairwise
from math import log10
from typing import Any, NamedTuple

from conformance.judging.checks import Result, told_apart
from conformance.judging.difference import Change, by_name, changes, counted
from conformance.judging.verdict import CAUSE, Judgement, Verdict, to_json
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


class Fault(NamedTuple):
    """A check that failed, in words: its claim, the lesson's section, figure and bound, where, and the usual cause."""

    claim: str
    section: str
    figure: str
    bound: str
    bound_from: str
    where: str
    cause: str


class Refusal(NamedTuple):
    """Why a program does not conform: what was found, the first cause before all, and the checks that failed."""

    found: list[str]
    faults: list[Fault]

    @property
    def first(self) -> str:
        """The first of it, in one line."""
        return self.found[0] if self.found else f"{self.faults[0].claim} {self.faults[0].section}: it does not"


class Changes(NamedTuple):
    """What changed since an earlier result, and how much of it for the worse and the better, in words."""

    since: str
    changes: list[Change]
    counted: str


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


def rounded_up(figure: float) -> str:
    """A figure to one significant digit, not below what it is."""
    return f"{Context(prec=1, rounding=ROUND_UP).create_decimal(repr(float(figure))):.0e}"


def errors(verdict: Verdict) -> list[Error]:
    """The largest error of each state, and its tolerance."""

    def place(value: float) -> float:
        low, high = DECADES
        return min(1.0, max(0.0, (log10(value) - low) / (high - low))) if value > 0 else 0.0

    return [
        Error(state, place(r.figure), place(r.bound), f"{state}: {r.figure:.1e}, tolerance {r.bound:.1e}")
        for state, r in verdict.errors.items()
    ]


def refusal(verdict: Verdict) -> Refusal | None:
    """Why it does not conform, None where it does."""
    if verdict.conforms:
        return None
    lines = verdict.reason.splitlines()
    causes = {line: after.removeprefix(CAUSE) for line, after in pairwise([*lines, ""]) if after.startswith(CAUSE)}
    failed = {str(result): result for result in verdict.results if not result.passed}
    faults = [
        Fault(said(r.claim), r.section, *told_apart(r.figure, r.bound), r.bound_from, r.where, causes.get(line, ""))
        for line, r in failed.items()
    ]
    return Refusal([line for line in lines if line not in failed and not line.startswith(CAUSE)], faults)


def changed(since: str, earlier: Mapping[str, Any], judgement: Judgement) -> Changes:
    """What changed since an earlier result, which is called `since`."""
    found = changes(earlier, by_name(json.loads(to_json(judgement.verdicts))))
    return Changes(since, found, counted(found))


def in_words(headline: str, languages: Mapping[str, str]) -> str:
    """A headline with the languages in the place of the ports' names."""
    names = "|".join(sorted(map(re.escape, languages), key=len, reverse=True))
    return re.sub(rf"\b({names})\b", lambda name: languages[name[1]], headline) if names else headline


def cell(result: Result) -> Cell:
    """A result as a cell."""
    share = result.figure / result.bound if result.bound else float(not result.passed)
    words = f"{result.figure:.3g}, bound {result.bound:.3g} ({result.bound_from}); {result.where}"
    return Cell(
        "pass" if result.passed else "fail",
        f"{result.figure:.1g}",
        words,
        weight(share),
    )


def weight(share: float) -> float:
    """That of a share of a bound: 1 at its bound, 0 six decades below."""
    return round(max(0.0, 1 + log10(share) / 6), 2) if 0 < share < 1 else float(share > 0)


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
