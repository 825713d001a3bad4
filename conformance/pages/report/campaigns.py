# SPDX-License-Identifier: MIT
"""What is kept of campaigns: on how many random experiments and plants each program conforms, and what failed."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from conformance.judging.verdict import EXACT
from conformance.pages.report.evidence import Cell, Line, weight
from conformance.programs.ports import ROOT, Port
from conformance.trials import campaign
from conformance.trials.campaign import kept_outcomes
from conformance.trials.coverage import own_seed
from conformance.trials.random_plants import kept_plants
from conformance.truth.exact import CONTRACT

MOST_FAILURES = 12  # that are told
NOT_RUN = Cell("none", "", "not run")


class Run(NamedTuple):
    """A program on a random experiment or plant: of which line, whether it conforms, its largest share of a tolerance.

    Where it does not conform, `what` it ran on, the reason, and the command that has it again.
    """

    line: str
    port: str
    conforms: bool
    share: float
    what: str
    reason: str
    command: str


class Campaigns(NamedTuple):
    """What the page says of campaigns: a line for each, and the runs that failed, of which `more` are not told.

    `earlier` runs are kept of another state of programs, engines or harness; `command` is what to type for more.
    """

    lines: list[Line]
    failures: list[Run]
    more: int
    earlier: int
    command: str


def campaigns(ports: Mapping[str, Port], lesson: bool, build: Path = ROOT / "build") -> Campaigns:
    """What is kept in the build folder: random plants, and where these are the lesson's programs random experiments."""
    found = [*(experiments(ports, build) if lesson else ()), *plants(ports, build)]
    now = [run for holds, run in found if holds]
    names = dict.fromkeys(run.line for run in now)
    failures = [run for run in now if not run.conforms]
    return Campaigns(
        [line(name, [run for run in now if run.line == name], ports) for name in names],
        failures[:MOST_FAILURES],
        len(failures[MOST_FAILURES:]),
        len(found) - len(now),
        f"conformance campaign {'--count 100' if lesson else '--plants --count 20'} --seed 1",
    )


def line(name: str, runs: Iterable[Run], ports: Iterable[str]) -> Line:
    """A line of the table: how many of its runs conform."""
    by_port = {port: [run for run in runs if run.port == port] for port in ports}
    return Line(name, "", [counted(own) if own else NOT_RUN for own in by_port.values()])


def counted(runs: list[Run]) -> Cell:
    """The runs of one program."""
    conform, share = sum(run.conforms for run in runs), max(run.share for run in runs)
    count = f"{conform} of {len(runs)}"
    words = f"{count} conform; the largest error is {share:.2g} of its tolerance"
    return Cell("pass" if conform == len(runs) else "fail", count, words, weight(share))


def experiments(ports: Mapping[str, Port], build: Path) -> Iterator[tuple[bool, Run]]:
    """Every run on an experiment of the lesson's plant that is kept, and whether it is of things as they are now."""
    folder = build / campaign.FOLDER.name
    own = {name: own_seed(port) for name, port in ports.items()}
    for seed, number, holds, outcome in kept_outcomes(ports.values(), folder):
        line = "experiments of its own" if own[outcome.port] == seed else f"experiments of the seed {seed}"
        csv = folder.relative_to(build.parent) / outcome.scenario / outcome.port / ports[outcome.port].csv.name
        toml = csv.parents[1] / "experiment.toml"
        yield holds, Run(
            line, outcome.port, outcome.status == "pass", outcome.error / CONTRACT,
            f"number {number} of the seed {seed}", outcome.reason, f"conformance validate {csv} --plant {toml}",
        )  # fmt: skip


def plants(ports: Mapping[str, Port], build: Path) -> Iterator[tuple[bool, Run]]:
    """Every run of a program that was written for a random plant."""
    for seed, number, path, verdicts, holds in kept_plants(build):
        for port, verdict in verdicts.items():
            if port in ports and verdict["status"] != "left out":
                errors = [r for r in verdict["results"] if r["claim"].endswith(EXACT) and r["figure"]]
                share = max((r["figure"] / r["bound"] for r in errors), default=0.0)
                yield holds, Run(
                    f"plants of the seed {seed}", port, verdict["status"] == "pass", share,
                    f"plant {number} of the seed {seed}", verdict["reason"],
                    f"make check PLANT={path.relative_to(build.parent)}",
                )  # fmt: skip
