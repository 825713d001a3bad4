# SPDX-License-Identifier: MIT
"""The page of exercises: each variant as a diff in every language, and which check refuses which mistake."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace
from difflib import unified_diff

from conformance.programs.ports import ROOT, Port
from conformance.programs.sources import source as original
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.trials.kill_matrix import CSV, END, OUTPUT, Outcome
from conformance.trials.variant import Variant, source

PAGE = ROOT / "docs" / "exercises.md"
HEAD = """\
# Exercises

Each is an edit of the programs, run and judged by `make check`: an experiment conforms, a mistake is refused by the
check it names. `.venv/bin/conformance variants NAME` leaves the edited tree in `build/variants/NAME/`, over a shorter
horizon and without the figure. `.venv/bin/conformance exercises` writes this page, from `conformance/trials/variants/`.
"""
MATRIX = "## Which check refuses which mistake"


def page(variants: Collection[Variant], ports: Sequence[Port], found: Iterable[Outcome]) -> str:
    """The whole page, in Markdown."""
    experiments = [variant for variant in variants if not variant.refused_by]
    mistakes = [variant for variant in variants if variant.refused_by]
    parts = [HEAD, "## Experiments\n", *(exercise(variant, ports) for variant in experiments)]
    parts += ["## Mistakes\n", *(exercise(variant, ports) for variant in mistakes)]
    return "\n".join([*parts, MATRIX + "\n", matrix(mistakes, list(found))])


def exercise(variant: Variant, ports: Iterable[Port]) -> str:
    """One variant: what it shows, what refuses it, and its diff in every language."""
    refused = f" Refused by `{variant.refused_by}`." if variant.refused_by else ""
    lines = [f"### {variant.title} {variant.section}\n", variant.shows + refused + "\n"]
    for port in ports:
        if variant.has(port):
            lines.append(
                f"<details><summary>{port.language}</summary>\n\n```diff\n{diff(variant, port)}```\n</details>"
            )
    for reason in dict.fromkeys(reason for _, reason in variant.without):
        names = ", ".join(port.language for port in ports if dict(variant.without).get(port.name) == reason)
        lines.append(f"\nNot in {names}: {reason}.")
    return "\n".join([*lines, ""])


def diff(variant: Variant, port: Port, form: Callable[[Port, str], str] = lambda port, text: text) -> str:
    """The unified diff of the program, over the lesson's horizon, both texts in the given form."""
    whole = replace(variant, experiment=with_values(variant.experiment, {"horizon": LESSON.horizon}))
    old, new = (form(port, text).splitlines(keepends=True) for text in (original(port), source(whole, port)))
    return "".join([line for line in unified_diff(old, new, n=1) if not line.startswith(("---", "+++"))])


def matrix(mistakes: Iterable[Variant], found: Sequence[Outcome]) -> str:
    """The kill matrix: per mistake and check in how many ports it refuses, bold where the mistake names it."""
    claims = [r.claim for o in found for r in o.verdict.results] + [CSV, OUTPUT, END]
    refusing = {claim for o in found if o.wanted for claim in o.refusals}
    columns = [claim for claim in dict.fromkeys(claims) if claim in refusing]
    numbers = [str(n) for n in range(1, len(columns) + 1)]
    legend = "\n".join(f"{number}. `{claim}`" for number, claim in zip(numbers, columns, strict=True))
    rows = [["mistake", "programs", *numbers], ["---"] * (len(columns) + 2)]
    for variant in mistakes:
        here = [o for o in found if o.variant == variant.name]
        rows.append([variant.name, str(len(here)), *(_count(claim, variant, here) for claim in columns)])
    return f"{legend}\n\n" + "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _count(claim: str, variant: Variant, here: Iterable[Outcome]) -> str:
    count = sum(claim in outcome.refusals for outcome in here)
    return f"**{count}**" if claim == variant.refused_by else str(count or "")
