# SPDX-License-Identifier: MIT
"""The evidence in tables: every check of every program, each program against each other, each mistake refused."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import log10
from typing import Any

from conformance.judging.checks import Result
from conformance.judging.verdict import Verdict
from conformance.pages.report.exercises import kill_matrix
from conformance.trials.variant import Variant


@dataclass(frozen=True)
class Cell:
    """A result of one program: its figure, short and in words."""

    status: str  # pass, fail or none
    figure: str
    words: str
    weight: float = 0.0  # how near the figure is to its bound, on a logarithmic scale from 0 to 1


NOTHING = Cell("none", "", "not measured")


def claims(verdicts: Sequence[Verdict]) -> list[tuple[str, str, list[Cell]]]:
    """(claim, section, one cell per program) of every claim that was measured."""
    order = {result.claim: result.section for verdict in verdicts for result in verdict.results}
    measured = [{result.claim: cell(result) for result in verdict.results} for verdict in verdicts]
    return [
        (claim.replace("-", " "), section, [results.get(claim, NOTHING) for results in measured])
        for claim, section in order.items()
    ]


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


def against(ports: Iterable[str], pairs: Mapping[tuple[str, str], Result]) -> list[tuple[str, str, list[Cell]]]:
    """(port, "", one cell per port): how far each two are apart, over all states and times."""
    cells = {frozenset(names): cell(result) for names, result in pairs.items()}
    itself = Cell("self", "", "itself")
    return [(a, "", [itself if a == b else cells.get(frozenset((a, b)), NOTHING) for b in ports]) for a in ports]


def outcomes(variants: Iterable[Variant], ports: Iterable[str]) -> list[tuple[str, str, list[Cell]]]:
    """(variant, section, one cell per port): how many checks refuse it, as it must be or not."""
    found = kill_matrix()
    return [
        (variant.title, variant.section, [outcome(variant, found.get((variant.name, port))) for port in ports])
        for variant in variants
        if any((variant.name, port) in found for port in ports)
    ]


def outcome(variant: Variant, row: Mapping[str, Any] | None) -> Cell:
    """What became of a variant in one program: a mistake must be refused by its check, an experiment conform."""
    if row is None:
        return Cell("none", "", "the program has no such text")
    refusals = row["refusals"]
    as_wanted = variant.refused_by in refusals if variant.refused_by else row["status"] == "pass"
    words = f"refused by {', '.join(refusals)}" if refusals else "conforms"
    figure = f"refused {len(refusals)}" if refusals else "conforms"
    return Cell("pass" if as_wanted else "fail", figure, words)
