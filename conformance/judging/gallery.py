# SPDX-License-Identifier: MIT
"""The programs that are written for plants, judged: of one plant in full, of several with a line for each."""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

from conformance.atomic import withdraw, write_atomically
from conformance.judging.verdict import Judgement, conforming, judge_all, summary, to_junit, write_result
from conformance.programs.ports import ROOT, selected_ports
from conformance.programs.table import layout
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment


class Judged(NamedTuple):
    """How the programs of a plant fared: whether all conform, a row of a table, and the whole in words."""

    conforms: bool
    row: tuple[str, ...]
    summary: str


def judge_plants(paths: Sequence[Path], names: Sequence[str] | None, jobs: int) -> list[Judged]:
    """Judge what the programs of each plant left in build/<name>, by its own proof, as many at a time.

    `names` are those of the ports. Raises FileFault or ValueError for a file that is no experiment.
    """
    experiments = [read_experiment(path) for path in paths]
    if len(experiments) == 1:
        return [judge_plant(experiments[0], names)]
    with ProcessPoolExecutor(jobs) as executor:
        return list(executor.map(partial(judge_plant, names=names), experiments))


def judge_plant(experiment: Experiment, names: Sequence[str] | None = None) -> Judged:
    """Judge what the programs of a plant left; leaves result.json, junit.xml and the badges in build/<name>."""
    folder = ROOT / "build" / experiment.name
    withdraw(folder / "result.json")
    judgement = judge_all(selected_ports(names, plant=experiment.name), experiment)
    write_result(judgement, folder)
    write_atomically(folder / "junit.xml", to_junit(judgement, experiment.name))
    return Judged(judgement.conforms, _row(experiment, judgement), summary(judgement))


def _row(experiment: Experiment, judgement: Judgement) -> tuple[str, ...]:
    shares = [r.figure / r.bound for verdict in judgement.verdicts for r in verdict.errors.values()]
    largest = f"{max(shares):.2g}" if shares else ""
    count = conforming(judgement.verdicts)
    return experiment.name, str(len(experiment.states)), str(len(experiment.unknown)), count, largest


def told(judged: Sequence[Judged]) -> str:
    """The verdicts in words: one in full; of several a table, in full those that do not conform, and the count."""
    if len(judged) == 1:
        return judged[0].summary
    rows = [("plant", "n", "p", "programs", "largest error, of tolerance"), *(one.row for one in judged)]
    failed = [f"{one.row[0]}\n{one.summary}\n" for one in judged if not one.conforms]
    return "\n".join([layout(rows), "", *failed, f"{len(judged) - len(failed)} of {len(judged)} plants conform"])
