# SPDX-License-Identifier: MIT
"""Which check refuses which mistake in which port: the verdicts on the variants."""

import json
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from conformance.judging.verdict import Verdict, judge_port
from conformance.programs.ports import Port
from conformance.programs.table import layout
from conformance.trials.variant import Variant, in_tree, job, run_all, source

CSV, OUTPUT, END = "valid-csv", "standard-output", "program-ends"  # refusals that are no figure


@dataclass(frozen=True)
class Outcome:
    """The verdict on one variant in one port; `wanted` is the check that must refuse it, "" where it must conform."""

    variant: str
    port: str
    wanted: str
    verdict: Verdict

    @property
    def refusals(self) -> tuple[str, ...]:
        """The names of the checks that refuse it."""
        return refusals(self.verdict)

    @property
    def as_wanted(self) -> bool:
        """A mistake is refused by its check; anything else conforms."""
        return self.wanted in self.refusals if self.wanted else self.verdict.conforms


def refusals(verdict: Verdict) -> tuple[str, ...]:
    """The names of the checks that a verdict failed; a program that never ran was refused by none."""
    named = [result.claim for result in verdict.results if not result.passed]
    if verdict.status == "error":
        named.append(END)
    if verdict.status == "fail" and not verdict.results:
        named.append(CSV)
    if "standard output" in verdict.reason:
        named.append(OUTPUT)
    return tuple(named)


def prepare(variants: Iterable[Variant], ports: Sequence[Port]) -> None:
    """Run every variant in every port that has its text, where the result is not up to date.

    What cannot be edited does not run, which its outcome tells.
    """
    jobs = []
    for variant in variants:
        for port in filter(variant.has, ports):
            with suppress(ValueError):
                jobs.append(job(variant.tree, port, source(variant, port)))
    run_all(jobs)


def outcome(variant: Variant, port: Port) -> Outcome:
    """Judge one variant as one port left it."""
    try:
        source(variant, port)
        verdict = judge_port(in_tree(port, variant.tree), variant.experiment)
    except ValueError as error:
        verdict = Verdict(port.name, "missing", str(error))
    return Outcome(variant.name, port.name, variant.refused_by, verdict)


def outcomes(variants: Iterable[Variant], ports: Sequence[Port]) -> list[Outcome]:
    """Judge every variant in every port that has its text."""
    return [outcome(variant, port) for variant in variants for port in ports if variant.has(port)]


# ---- Telling ----


def to_json(found: Iterable[Outcome]) -> str:
    """The matrix as JSON: per variant and port the status, the check that must refuse it, and those that do."""
    rows = [
        {
            "variant": o.variant,
            "port": o.port,
            "status": o.verdict.status,
            "refused_by": o.wanted,
            "refusals": o.refusals,
        }
        for o in found
    ]
    return json.dumps(rows, indent=1) + "\n"


def table(found: Sequence[Outcome]) -> str:
    """One row per variant, one column per port: how many checks refuse it; then whether it is as it must be."""
    ports = list(dict.fromkeys(o.port for o in found))
    rows: list[tuple[str, ...]] = [("variant", *ports, "wanted")]
    for name in dict.fromkeys(o.variant for o in found):
        here = {o.port: o for o in found if o.variant == name}
        wanted = next(iter(here.values())).wanted
        rows.append((name, *(_cell(here.get(port)) for port in ports), wanted or "conforms"))
    wrong = [f"{o.variant}, {o.port}: {_wrong(o)}" for o in found if not o.as_wanted]
    mistakes = [o for o in found if o.wanted]
    killed = sum(o.as_wanted for o in mistakes)
    right = sum(o.as_wanted for o in found) - killed
    counts = (
        f"{killed} of {len(mistakes)} mistakes refused; {right} of {len(found) - len(mistakes)} experiments conform"
    )
    return "\n".join([layout(rows), *wrong, counts])


def _cell(one: Outcome | None) -> str:
    if one is None:
        return "-"
    if not one.wanted:
        return "conforms" if one.as_wanted else one.verdict.status
    return f"refused {len(one.refusals)}" if one.as_wanted else "SURVIVES"


def _wrong(one: Outcome) -> str:
    if one.wanted:
        return f"found {' '.join(one.refusals) or 'no refusal'} ({one.verdict.status}), expected {one.wanted}"
    return f"{one.verdict.status}: {one.verdict.reason}"
