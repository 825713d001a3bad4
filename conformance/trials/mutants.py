# SPDX-License-Identifier: MIT
"""Systematic mutation: each operator and each number of a program's arithmetic changed in turn, and the checks asked.

A mutant is killed when a check refuses it, or when its program fails or does not end. One that survives has a proof in
equivalent_mutants.toml that it computes the same, or is a hole in the checks.
"""

import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import unified_diff
from fractions import Fraction
from functools import partial
from pathlib import Path

from conformance.judging.verdict import judge_port
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.sources import first_line
from conformance.programs.table import layout
from conformance.programs.writer import write
from conformance.theory.experiments import Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.trials.edits import in_experiment
from conformance.trials.kill_matrix import refusals
from conformance.trials.variant import Job, copy_what_runs, copy_with_programs, in_tree, job, run_all

HORIZON = Fraction(1)  # s: the transient, where every term counts
EXPERIMENT = with_values(LESSON, {"horizon": HORIZON})
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.toml")
OPPOSITE = {"+": "-", "-": "+", "*": "/", "/": "*"}
SITE = re.compile(
    r"(?P<operator>(?<= )[-+*/](?= )|(?<=[\w)\]])(?<!\de)[-+*/](?=[\w(]))"  # between operands
    r"|(?<== )(?P<minus>-)(?=[A-Za-z])"  # of a first operand
    r"|(?<![\w.\[])(?P<number>\d+(?:\.\d+)?)(?![\w.\]])"  # but no index
)


@dataclass(frozen=True)
class Mutant:
    """One change of one line of a port; `text` is the whole program."""

    port: Port
    line: int
    old: str
    new: str
    text: str

    @property
    def name(self) -> str:
        return f"{self.port.name}, line {self.line}: {self.old} -> {self.new}"


@dataclass(frozen=True)
class Fate:
    """How a mutant fared: killed (by which checks), survived, or invalid, where it does not compile."""

    mutant: Mutant
    status: str
    by: tuple[str, ...] = ()


# ---- Making ----


def mutants(port: Port) -> list[Mutant]:
    """Every mutant of a port's program, over the short horizon."""
    return mutants_of(port, in_experiment(port, EXPERIMENT))


def mutants_of(port: Port, text: str) -> list[Mutant]:
    """Every mutant of a text in a port's language."""
    lines = text.splitlines(keepends=True)
    made = []
    for number in _arithmetic(port, text):
        line = lines[number]
        code = line.partition(port.comment[0])[0]
        for new in changes(code):
            changed = [*lines[:number], new + line[len(code) :], *lines[number + 1 :]]
            made.append(Mutant(port, number + 1, code.strip(), new.strip(), "".join(changed)))
    return made


def _arithmetic(port: Port, text: str) -> Iterator[int]:
    """The lines, from 0, of the tagged statements and of a step that is written out."""
    tagged = re.compile(rf"\S.*{re.escape(port.comment[0])}\(\d+\) ")
    step = re.compile(r"\b([hH]|step)\b")
    begin, end = (text.index(port.section.format(title)) for title in ("Parameters", "Write CSV"))
    integrate = text.index(port.section.format("Integrate"))
    place = 0
    lines = text.splitlines(keepends=True)
    for number, line in enumerate(lines):
        if begin <= place < integrate and tagged.search(line):
            yield from range(first_line(lines, number), number + 1)
        if integrate <= place < end and step.search(line.partition(port.comment[0])[0]):
            yield number
        place += len(line)


def changes(code: str) -> Iterator[str]:
    """The statement with one operator, sign or number changed: + and -, * and / exchanged, 1 % or 1 more."""
    for site in SITE.finditer(code):
        before, after = code[: site.start()], code[site.end() :]
        if site["operator"]:
            yield before + OPPOSITE[site["operator"]] + after
        elif site["minus"]:
            yield before + after
        else:
            yield before + _other(site["number"]) + after


def _other(number: str) -> str:
    if "." not in number:
        return str(int(number) + 1)
    return repr(round(float(number) * 1.01, 6) or 0.01)


# ---- Judging ----


def fates(
    made: Sequence[Mutant],
    folder: Path = ROOT / "build" / "mutants",
    experiment: Experiment = EXPERIMENT,
    copy: Callable[[Path], None] = copy_what_runs,
) -> list[Fate]:
    """Run what is not up to date, and judge every mutant."""
    return [_fate(mutant, one, experiment) for mutant, one in run(made, folder, copy)]


def lively(experiment: Experiment) -> Experiment:
    """The plant with starts, gains and estimates that differ from each other, from 0 and from 1, over the transient.

    So every term counts: where a gain is 1, to multiply by it and to divide by it are the same.
    """
    unknown = [q._replace(start=Fraction(3 + j, 10)) for j, q in enumerate(experiment.unknown)]
    return replace(
        experiment,
        horizon=HORIZON,
        start=tuple(Fraction((5 + i) * (-1) ** i, 10) for i in range(len(experiment.states))),
        unknown=tuple(unknown),
        k=tuple(gain * Fraction(11 + i, 10) for i, gain in enumerate(experiment.k)),
        Gamma=tuple(tuple(gain * Fraction(13, 10) for gain in row) for row in experiment.Gamma),
        facts=(),
    )


def fates_of_plant(experiment: Experiment, ports: Iterable[Port]) -> list[Fate]:
    """Every mutant of the programs that are written for a plant, made `lively`; as `fates`."""
    short = lively(experiment)
    own = read_ports(plant=short.name)
    made = [mutant for port in ports for mutant in mutants_of(own[port.name], write(short, port))]
    return fates_of(made, short)


def fates_of(made: Sequence[Mutant], experiment: Experiment) -> list[Fate]:
    """The fates of mutants of a plant's programs."""
    folder = ROOT / "build" / "mutants" / experiment.name
    return fates(made, folder, experiment, partial(copy_with_programs, experiment))


def run(
    made: Sequence[Mutant], folder: Path = ROOT / "build" / "mutants", copy: Callable[[Path], None] = copy_what_runs
) -> list[tuple[Mutant, Job]]:
    """Run what is not up to date; returns each mutant with the job that ran it."""
    jobs = [job(folder / f"{m.port.name}-{number}", m.port, m.text) for number, m in enumerate(made)]
    run_all(jobs, copy=copy)
    return list(zip(made, jobs, strict=True))


def _fate(mutant: Mutant, one: Job, experiment: Experiment) -> Fate:
    if one.timed_out:
        return Fate(mutant, "killed", ("does not end",))
    verdict = judge_port(in_tree(mutant.port, one.tree), experiment)
    by = refusals(verdict)
    return Fate(mutant, "survived" if verdict.conforms else "killed" if by else "invalid", by)


# ---- Telling ----


def equivalents(path: Path = EQUIVALENT) -> dict[tuple[str, str, str], str]:
    """(port, old statement, new statement) of the mutants known to compute the same, and why."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))["equivalent"]
    return {(port, each["old"], each["new"]): each["why"] for each in table for port in each["ports"]}


def unexplained(found: Iterable[Fate]) -> list[Fate]:
    """The survivors that nothing excuses."""
    known = equivalents()
    return [
        fate
        for fate in found
        if fate.status == "survived" and (fate.mutant.port.name, fate.mutant.old, fate.mutant.new) not in known
    ]


def summary(found: Sequence[Fate]) -> str:
    """Made, killed, survived and invalid per port; then the survivors with diff and reason."""
    statuses = ("killed", "survived", "invalid")
    rows: list[tuple[str, ...]] = [("port", "made", *statuses)]
    for name in dict.fromkeys(fate.mutant.port.name for fate in found):
        here = [fate.status for fate in found if fate.mutant.port.name == name]
        rows.append((name, str(len(here)), *(str(here.count(status)) for status in statuses)))
    known = equivalents()
    lines = [layout(rows)]
    for fate in found:
        if fate.status == "survived":
            mutant = fate.mutant
            why = known.get((mutant.port.name, mutant.old, mutant.new), "UNEXPLAINED")
            lines += [mutant.name, diff(mutant), f"  {why}"]
        elif fate.status == "invalid":
            lines.append(f"no program: {fate.mutant.name}")
    killed = sum(fate.status == "killed" for fate in found)
    return "\n".join([*lines, f"{killed} killed of {len(found)} made; {len(unexplained(found))} unexplained"])


def diff(mutant: Mutant) -> str:
    """The change, as a unified diff without context."""
    return "\n".join([*unified_diff([mutant.old], [mutant.new], n=0, lineterm="")][3:])
