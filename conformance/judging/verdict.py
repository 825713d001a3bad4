# SPDX-License-Identifier: MIT
"""The verdict on a program or on a file: a status, its reason, and the results it rests on."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from conformance.atomic import write_atomically
from conformance.foreign import plain
from conformance.judging.checks import (
    Check,
    Result,
    Tolerance,
    checks_of,
    checks_of_anyone,
    contract,
    contract_of_ports,
    digit_notes,
    judge,
    programs_agree,
)
from conformance.judging.diagnosis import diagnosis
from conformance.judging.identification import told
from conformance.judging.measured import Measured
from conformance.judging.report import read_report, report_problems
from conformance.judging.trajectory import Array, Trajectory, TrajectoryError, load
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.table import WITHOUT_TEMPLATE, engine_and_version, layout
from conformance.theory.experiments import Experiment
from conformance.truth.exact import TARGET, exact

if TYPE_CHECKING:
    from conformance.truth.enclosure import Progress

EXACT = "-equals-the-exact-solution"  # ends the claims of the comparison with it
CAUSE = "  usual cause: "  # begins a line below that of a check that failed
MOST_COLUMNS = 3  # of a table's states
SAMPLED = "the bounds rest on slopes at samples of the solution: sensitivities could not be proven to the horizon"
STATUSES = ("pass", "fail", "error", "missing", "stale", "left out")


@dataclass(frozen=True)
class Verdict:
    """What was judged (a port or a file), how it fared and why; `engine` is "" for a file.

    `notes` tell what was accepted all the same; `trajectory` is there where the CSV could be read.
    """

    name: str
    status: str
    reason: str = ""
    engine: str = ""
    stand_in: bool = False
    results: tuple[Result, ...] = ()
    notes: tuple[str, ...] = ()
    trajectory: Trajectory | None = field(default=None, repr=False, compare=False)

    @property
    def conforms(self) -> bool:
        return self.status == "pass"

    @property
    def errors(self) -> dict[str, Result]:
        """The comparison with the exact solution, by state; empty where nothing was measured."""
        return {r.claim.removesuffix(EXACT): r for r in self.results if r.claim.endswith(EXACT)}


@dataclass(frozen=True)
class Judgement:
    """The verdicts on all ports, and how every pair of readable trajectories compares, by their names."""

    verdicts: tuple[Verdict, ...]
    pairs: dict[tuple[str, str], Result]

    @property
    def conforms(self) -> bool:
        return all(verdict.conforms or verdict.status == "left out" for verdict in self.verdicts)


# ---- Judging ----


def judge_file(
    path: Path,
    experiment: Experiment,
    stdout: Path | None = None,
    tolerance: Tolerance | None = None,
    target: float = TARGET,
    checks: Sequence[Check] | None = None,
    banners: bool = False,
    diagnose: bool = False,
    progress: Progress | None = None,
) -> Verdict:
    """The verdict on anyone's CSV, and on what its program printed where `stdout` is given.

    `banners`: the engine may print more than the program. `tolerance` is the contract's, and `checks` those of anyone,
    unless given. `target` is the radius of the proof of the exact solution, and `progress` is told how far it is. With
    `diagnose`, the reason begins with the first cause, where one is found. Raises ProofEnded where there is no
    proof, ValueError where `stdout` cannot be read.
    """
    name = plain(path.name)
    try:
        trajectory = load(path, experiment)
    except TrajectoryError as error:
        return Verdict(name, "fail", str(error))
    with np.errstate(all="ignore"):  # of numbers near 1e308
        log = Measured(trajectory, exact(experiment, target, progress))
        tolerance = tolerance or contract(log.exact)
        judged = judge(log, tolerance, checks_of_anyone(experiment) if checks is None else checks)
        failed = [result.claim for _, result in judged if not result.passed]
        problems = [explain(check, result) for check, result in judged if not result.passed]
        if diagnose and failed:
            problems = [*filter(None, [diagnosis(log, tolerance, failed)]), *problems]
        notes = [*trajectory.notes, *(digit_notes(trajectory) if checks is None else ())]
        notes += [] if log.exact.sensitivity.columns.size else [SAMPLED]
        notes += told(log) if diagnose else ()
        if stdout is not None:
            lines, more = read_report(stdout, banners)
            notes += more
            problems += report_problems(lines, trajectory, experiment, path.name)
    results = tuple(result for _, result in judged)
    status = "fail" if problems else "pass"
    return Verdict(name, status, "\n".join(problems), results=results, notes=tuple(notes), trajectory=trajectory)


def judge_port(port: Port, experiment: Experiment, diagnose: bool = False) -> Verdict:
    """The verdict on a port's last run; an error where its record or its output lack.

    The tolerance is its engine's, or for the program of a plant the contract's.
    """
    try:
        return _judge_run(port, experiment, diagnose)
    except (ValueError, OSError) as error:
        return Verdict(port.name, "error", f"{plain(error, 400)}; {_again(port)}")


def _again(port: Port) -> str:
    """What to type where what is there is not what a run leaves."""
    return f"type: rm -r {port.build.relative_to(port.root)}; {port.make}"


def _judge_run(port: Port, experiment: Experiment, diagnose: bool) -> Verdict:
    run = port.run()
    if run is None:
        names = " or ".join(engine.name for engine in port.engines)
        there = any(engine.found(ROOT) for engine in port.engines)
        why = "it did not run" if there else f"{names} not found"
        return Verdict(port.name, "missing", f"{why}; type: {port.make}")
    engine = engine_and_version(run)
    stand_in = any(other.proprietary for other in port.engines) and not run["proprietary"]
    if run["source_sha256"] != port.source_hash():
        return Verdict(port.name, "stale", f"the source has changed since; type: {port.make}", engine, stand_in)
    if run["exit_status"] != 0:
        return Verdict(port.name, "error", f"it ended with status {run['exit_status']}", engine, stand_in)
    again, ran = _again(port), port.ran_engine(run)
    if run["command"] != port.in_place(ran.command):
        reason = f"run.json tells of another command than port.toml; {again}"
        return Verdict(port.name, "stale", reason, engine, stand_in)
    if run["csv_sha256"] != port.csv_hash():
        reason = f"{port.csv.name} is not the file that the run wrote; {again}"
        return Verdict(port.name, "stale", reason, engine, stand_in)
    judged = judge_file(
        port.csv, experiment, port.stdout, None if port.plant else ran.tolerance,
        checks=checks_of(experiment), banners=ran.proprietary, diagnose=diagnose,
    )  # fmt: skip
    return replace(judged, name=port.name, engine=engine, stand_in=stand_in)


def explain(check: Check, result: Result) -> str:
    """A result that failed, in words, with its usual cause."""
    return f"{result}\n{CAUSE}{check.cause}"


def _with_contract(port: Port, verdict: Verdict, t: Array, tolerance: Tolerance, horizon: float) -> Verdict:
    """The verdict, with what the contract asks of a port on the lesson's own experiment beyond its trajectory."""
    figures = [result.figure for result in verdict.errors.values()]
    more = contract_of_ports(tolerance, figures, t, horizon, port.rows)
    problems = [str(result) for result in more if not result.passed]
    reason = "\n".join(filter(None, (verdict.reason, *problems)))
    status = "fail" if problems else verdict.status
    return replace(verdict, status=status, reason=reason, results=(*verdict.results, *more))


def judge_all(selected: Mapping[str, Port], experiment: Experiment) -> Judgement:
    """The verdicts on every port there is: left out where not selected, failed where it disagrees with another.

    A port that fails by itself is compared with the others too, but does not make them fail.
    """
    verdicts = {name: judge_port(port, experiment, diagnose=True) for name, port in selected.items()}
    trajectories = {name: v.trajectory for name, v in verdicts.items() if v.trajectory is not None}
    solved = exact(experiment)
    tolerances = dict.fromkeys(trajectories, contract(solved))
    for name, trajectory in trajectories.items():
        port = selected[name]
        if not port.plant:
            own = tolerances[name] = port.ran_engine(port.run() or {}).tolerance
            verdicts[name] = _with_contract(port, verdicts[name], trajectory.t, own, float(experiment.horizon))
    pairs = programs_agree(trajectories, solved, tolerances)
    by_itself = {name for name, verdict in verdicts.items() if verdict.conforms}
    for pair, result in pairs.items():
        if not result.passed and by_itself.issuperset(pair):
            for name in pair:
                reason = f"{verdicts[name].reason}\n{result}".strip()
                verdicts[name] = replace(verdicts[name], status="fail", reason=reason)
    of_a_plant = any(port.plant for port in selected.values())
    every = (verdicts.get(name) or _left_out(port, of_a_plant) for name, port in read_ports().items())
    return Judgement(tuple(every), pairs)


def _left_out(port: Port, of_a_plant: bool) -> Verdict:
    lacks = of_a_plant and not port.template
    why = f"it {WITHOUT_TEMPLATE}" if lacks else "PORTS does not name it"
    return Verdict(port.name, "left out", why)


# ---- Telling ----


def conforming(verdicts: Sequence[Verdict]) -> str:
    """How many conform, of those that were asked for."""
    asked = sum(verdict.status != "left out" for verdict in verdicts)
    return f"{sum(verdict.conforms for verdict in verdicts)} of {asked} conform"


def headline(verdicts: Sequence[Verdict]) -> str:
    """The count, honestly: what conforms, what does not and why not, and which engine stood in for which."""
    counts = Counter(verdict.status for verdict in verdicts)
    parts = [conforming(verdicts)]
    for status in STATUSES[1:-1]:
        if counts[status]:
            named = ", ".join(_named(verdict) for verdict in verdicts if verdict.status == status)
            parts.append(f"{counts[status]} {status}: {named}")
    if counts["left out"]:
        parts.append(f"{counts['left out']} left out")
    stood_in = [verdict.name for verdict in verdicts if verdict.stand_in]
    if stood_in:
        parts.append(f"{', '.join(stood_in)} on an open engine in place of the proprietary one")
    return "; ".join(parts)


def _named(verdict: Verdict) -> str:
    """A port's name, and what it lacks where it is missing."""
    return f"{verdict.name} ({verdict.reason.partition(';')[0]})" if verdict.status == "missing" else verdict.name


def table_rows(verdicts: Sequence[Verdict]) -> list[tuple[str, ...]]:
    """One row per verdict: each state's largest error against the exact solution, and its share of the tolerance.

    Of more than MOST_COLUMNS states the one with the largest share is told.
    """
    states = list(dict.fromkeys(state for verdict in verdicts for state in verdict.errors))
    few = len(states) <= MOST_COLUMNS
    heads = [f"{state}: error, of tolerance" for state in states] if few else ["largest error, of tolerance"]
    rows: list[tuple[str, ...]] = [("port", "status", "engine and version", *heads)]
    for verdict in verdicts:
        told = verdict.errors
        if not few and told:
            worst = max(told, key=lambda state: told[state].figure / told[state].bound)
            told = {f"{worst}: ": told[worst]}
        cells = [
            f"{'' if few else state}{result.figure:.1e}  {result.figure / result.bound:.2g}"
            for state, result in told.items()
        ]
        rows.append((verdict.name, verdict.status, verdict.engine, *(cells or [""] * len(heads))))
    return rows


def pair_rows(pairs: Mapping[tuple[str, str], Result]) -> list[tuple[str, ...]]:
    """The matrix of all pairs: the largest difference, over its bound where that is exceeded."""
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    rows: list[tuple[str, ...]] = [("largest difference", *names[1:])]
    for a in names[:-1]:
        cells = []
        for b in names[1:]:
            result = pairs.get((a, b))
            excess = f" > {result.bound:.1e}" if result and not result.passed else ""
            cells.append(f"{result.figure:.1e}{excess}" if result else "")
        rows.append((a, *cells))
    return rows


def summary(judgement: Judgement) -> str:
    """The table, the matrix of pairs, the reasons, and the headline last."""
    verdicts = judgement.verdicts
    tables = [layout(table_rows(verdicts))]
    tables += ["", layout(pair_rows(judgement.pairs))] if judgement.pairs else []
    reasons = [f"{verdict.name}: {verdict.reason}" for verdict in verdicts if verdict.reason]
    return "\n".join([*tables, "", *reasons, headline(verdicts)])


def to_json(verdicts: Sequence[Verdict], pairs: Mapping[tuple[str, str], Result] | None = None) -> str:
    """The verdicts as JSON, in the form of result.schema.json; figures that are not finite are null."""
    whole = {
        "headline": headline(verdicts),
        "verdicts": [
            {
                "name": verdict.name,
                "status": verdict.status,
                "reason": verdict.reason,
                "engine": verdict.engine,
                "stand_in": verdict.stand_in,
                "notes": list(verdict.notes),
                "results": [_plain(result) for result in verdict.results],
            }
            for verdict in verdicts
        ],
        "pairs": [_plain(result) for result in (pairs or {}).values()],
    }
    return json.dumps(whole, indent=2, allow_nan=False) + "\n"


def _plain(result: Result) -> dict[str, Any]:
    finite = abs(result.figure) < float("inf")
    return {
        **asdict(result),
        "figure": float(result.figure) if finite else None,
        "bound": float(result.bound),
        "passed": result.passed,
    }


def to_junit(judgement: Judgement, suite: str) -> str:
    """The results as JUnit's XML: one case for each program and check, and one for each program that has none."""
    top = ElementTree.Element("testsuites")
    cases = ElementTree.SubElement(top, "testsuite", name=suite)
    for verdict in judgement.verdicts:
        named = [(r.claim, None if r.passed else str(r)) for r in verdict.results]
        if verdict.status in ("error", "missing", "stale") or not named:
            named = [("status", None if verdict.status == "left out" else f"{verdict.status}: {verdict.reason}")]
        elif not verdict.conforms and all(failure is None for _, failure in named):
            named.append(("status", f"{verdict.status}: {verdict.reason}"))
        for claim, failure in named:
            case = ElementTree.SubElement(cases, "testcase", classname=f"{suite}.{verdict.name}", name=claim)
            if verdict.status == "left out":
                ElementTree.SubElement(case, "skipped", message=verdict.reason)
            if failure is not None:
                ElementTree.SubElement(case, "failure", message=plain(failure, 4000))
    for of in (top, cases):
        of.set("tests", str(len(cases)))
        of.set("failures", str(len([*cases.iter("failure")])))
    ElementTree.indent(top)
    return ElementTree.tostring(top, encoding="unicode", xml_declaration=True) + "\n"


def write_result(judgement: Judgement, folder: Path = ROOT / "build") -> None:
    """Leave result.json, and in badges/ a badge for every port in the form of Shields' endpoint."""
    write_atomically(folder / "result.json", to_json(judgement.verdicts, judgement.pairs))
    for verdict in judgement.verdicts:
        write_atomically(folder / "badges" / f"{verdict.name}.json", json.dumps(badge(verdict), indent=2) + "\n")


def badge(verdict: Verdict) -> dict[str, Any]:
    """What a badge on a verdict says."""
    said = {"pass": ("conforms", "brightgreen"), "fail": ("does not conform", "red"), "error": ("error", "red")}
    message, colour = said.get(verdict.status, (verdict.status, "lightgrey"))
    return {"schemaVersion": 1, "label": verdict.name, "message": message, "color": colour}


OTHER_CHECKS = (  # id, meaning
    ("valid-csv", "The CSV has the header and six finite numbers a row, from t = 0 to the horizon."),
    ("standard-output", "Standard output is the four lines of the contract, and says what the CSV says."),
    ("program-ends", "A port's program ends with status 0 and leaves its record."),
    ("tolerance-keeps-the-contract", "A port's tolerance in port.toml is at most the contract's, 1e-6."),
    ("tolerance-is-tight", "A port's tolerance is at most 10 times its largest error."),
    ("rows-are-those-of-the-contract", "A port logs as many rows as port.toml says."),
    ("times-are-counted-not-summed", "A port whose rows port.toml counts logs row i at t = i h, to rounding."),
    ("PORT-agrees-with-PORT", "Two ports' states differ by no more than both tolerances, on a common grid."),
)


def list_of_checks(experiment: Experiment) -> str:
    """Every check's id, which later versions keep, and what it means; PORT stands for a port's name."""
    checks = checks_of(experiment)
    lines = [
        f"{claim}\n    {check.meaning}\n    usual cause: {check.cause}" for check in checks for claim in check.claims
    ]
    lines += [f"{claim}\n    {meaning}" for claim, meaning in OTHER_CHECKS]
    return "\n".join(lines)
