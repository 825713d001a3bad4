# SPDX-License-Identifier: MIT
"""How far a port has come: stage by stage what holds, and what to do next, with the text to paste."""

import json
import math
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from conformance.judging.measured import Measured
from conformance.judging.report import read_report, report_problems
from conformance.judging.trajectory import TrajectoryError, load
from conformance.judging.verdict import Judgement, judge_file, judge_port
from conformance.programs.new_port import AWK
from conformance.programs.ports import MODEL, ROOT, SIX, Port, read_ports
from conformance.programs.run import as_a_user, choose_engine, engine_version
from conformance.programs.sources import SECTIONS, WORKS, cut, frame, sections, source, statements
from conformance.programs.spelling import spelled
from conformance.theory.lesson import LESSON
from conformance.trials.coverage import with_own_experiments
from conformance.trials.kill_matrix import outcomes, prepare
from conformance.trials.variant import OWN, UNWRITTEN, Variant, read_variants
from conformance.truth.exact import exact

MEASURED_TIMES = 5  # of what is measured, for the tolerance that is proposed


class Unmet(Exception):
    """A stage does not hold; the message says what to do next."""


@dataclass(frozen=True)
class Stage:
    """One stage: `holds` gives what holds, in words, or raises Unmet."""

    name: str
    holds: Callable[[Port], str]


def guide(port: Port) -> Iterator[tuple[bool, str]]:
    """Whether a stage holds, and its line or lines, up to the first that does not hold; the others rest on it."""
    for number, stage in enumerate(STAGES):
        try:
            yield True, f"{stage.name}: {stage.holds(port)}"
        except Unmet as obstacle:
            waiting = ", ".join(later.name for later in STAGES[number + 1 :])
            yield False, f"{stage.name}, next: {obstacle}" + (f"\nthen: {waiting}" if waiting else "")
            return


# ---- Stages ----


def engine(port: Port) -> str:
    """An engine of port.toml is here, and tells its version."""
    try:
        chosen = choose_engine(port)
        port.build.mkdir(parents=True, exist_ok=True)
        return f"{chosen.name}, {engine_version(chosen, port)}"
    except SystemExit as error:
        raise Unmet(f"{error}; `program` and `version` of {_facts(port)} say what is looked for and asked") from None
    except OSError as error:
        raise Unmet(f"{error}; `version` of {_facts(port)} is a command that prints the engine's version") from None


def program(port: Port) -> str:
    """make builds and runs the program that port.toml names, to its end."""
    if port.source == AWK and port.language.lower() != "awk":
        raise Unmet(
            f"{port.folder.name}/{AWK} is still the skeleton's, in AWK. Write it in your language: the same\n"
            f"sections, statements, tags and comments, in the same order. {_first().source} has them too;\n"
            f"then set language, source, comment, section, constant, definition, functions and the engine in\n"
            f"{_facts(port)}, and the program's file in {port.folder.name}/port.mk"
        )
    if not port.source_path.is_file():
        raise Unmet(f"{port.folder.name}/{port.source} is not there, which `source` of {_facts(port)} names")
    answer = subprocess.run(["make", port.name], cwd=ROOT, env=as_a_user(), capture_output=True, text=True)
    if answer.returncode:
        raise Unmet(f"make {port.name} says\n{answer.stderr.strip()[-2000:]}")
    return f"make {port.name} runs it"


def csv(port: Port) -> str:
    """The CSV can be read."""
    try:
        trajectory = load(port.csv, LESSON)
    except TrajectoryError as error:
        raise Unmet(str(error)) from None
    if port.rows and trajectory.t.size != port.rows:
        raise Unmet(f"found {trajectory.t.size} rows, expected {port.rows}; `rows` of {_facts(port)}, or the last row")
    return f"{trajectory.t.size} rows"


def stdout(port: Port) -> str:
    """The four lines are printed, and say what the CSV says."""
    trajectory = load(port.csv, LESSON)
    lines, _ = read_report(port.stdout)
    problems = report_problems(lines, trajectory, LESSON, port.csv.name)
    if problems:
        raise Unmet("\n".join(problems))
    return "the four lines say what the CSV says"


def same_statements(port: Port) -> str:
    """Sections and tagged statements are those of the other programs."""
    found = [title for title in sections(port) if title != "Figures"]
    for title in SECTIONS:
        if title not in found:
            raise Unmet(f"there is no section {title}; paste the line\n{port.section.format(title)}")
    if found != list(SECTIONS):
        raise Unmet(f"found the sections {', '.join(found)}, expected {', '.join(SECTIONS)}")
    wanted, own = statements(_first(), source(_first())), statements(port, source(port))
    for number, (tag, wording, text) in enumerate(wanted):
        if number >= len(own) or own[number] != (tag, wording, text):
            there = "nothing more" if number >= len(own) else "{2}  {0} {1}".format(*own[number])
            raise Unmet(f"statement {number + 1}: found {there}\nexpected, by {_facts(port)}\n{_line(port, number)}")
    if len(own) > len(wanted):
        raise Unmet(f"found a tagged statement more than the others have: {own[len(wanted)]}")
    if frame(port) != list(port.frame):
        lines = "\n".join(f"    {json.dumps(line)}," for line in frame(port))
        raise Unmet(
            f"the core has other lines beside the statements than `frame` of {_facts(port)} says. Leave out what\n"
            f"computes or decides; then it is\nframe = [\n{lines}\n]"
        )
    at_work = [line for line in port.frame if port.name not in SIX and WORKS.search(line)]
    if at_work:
        raise Unmet(f"the core computes or decides beside the statements: {at_work[0]!r}; leave it out")
    try:
        cut(port)
    except ValueError as error:
        raise Unmet(str(error)) from None
    return f"{len(own)} statements are those of the other programs"


def solution(port: Port) -> str:
    """The states are the exact solution's, within the contract."""
    verdict = judge_file(port.csv, LESSON, port.stdout)
    if not verdict.conforms:
        raise Unmet(f"{verdict.reason}\nevery figure: .venv/bin/conformance validate {port.csv.relative_to(ROOT)}")
    return "within the contract of the exact solution"


def tolerance(port: Port) -> str:
    """The engine's tolerance is at most 10 times what is measured, and said where it comes from."""
    chosen = choose_engine(port)
    log = Measured(load(port.csv, LESSON), exact(LESSON))
    largest = np.abs(log.deviation).max(axis=1)
    line = ", ".join(f"{s} = {_rounded(MEASURED_TIMES * e):.0e}" for s, e in zip(LESSON.names, largest, strict=True))
    ratios = np.array(chosen.tolerance) / largest
    if not ((ratios >= 1) & (ratios <= 10)).all():
        raise Unmet(
            f"errors are at most {', '.join(f'{e:.1e}' for e in largest)}; a tolerance is 1 to 10 times that. In "
            f"{_facts(port)}\ntolerance = {{{line}}}\nand say in tolerance_from what bounds it"
        )
    verdict = judge_port(port, LESSON)
    if not verdict.conforms:
        raise Unmet(verdict.reason)
    return f"{', '.join(f'{ratio:.1f}' for ratio in ratios)} times what is measured"


def own_experiments(port: Port) -> str:
    """It conforms on experiments that follow from its source."""
    if port.name in SIX:
        return "in make check"
    (verdict,) = with_own_experiments(Judgement((judge_port(port, LESSON),), {}), {port.name: port}).verdicts
    if not verdict.conforms:
        raise Unmet(verdict.reason)
    return "it conforms on those that follow from its source"


def variants(port: Port) -> str:
    """Every experiment and mistake is edited in, and has its verdict."""
    known = read_variants()
    unwritten = [variant for variant in known.values() if _lacks(variant, port, known)]
    if unwritten:
        raise Unmet(
            f"{port.folder.name}/{OWN} says nothing of {', '.join(v.name for v in unwritten)}; paste and fill in\n"
            + "\n".join(_own_edit(variant, port) for variant in unwritten)
        )
    try:
        prepare(known.values(), [port])
        found = outcomes(known.values(), [port])
    except ValueError as error:
        raise Unmet(f"{error}; see {port.folder.name}/{OWN}") from None
    wrong = [
        f"{o.variant}: {o.verdict.status}: {o.verdict.reason.partition(chr(10))[0]}" for o in found if not o.as_wanted
    ]
    if wrong:
        raise Unmet("not as they must be\n" + "\n".join(wrong))
    return f"{len(found)} edited programs have the verdicts that they must have"


STAGES = (
    Stage("engine", engine),
    Stage("program", program),
    Stage("CSV", csv),
    Stage("stdout", stdout),
    Stage("statements", same_statements),
    Stage("solution", solution),
    Stage("tolerance", tolerance),
    Stage("experiments of its own", own_experiments),
    Stage("variants", variants),
)


# ---- Words ----


def _first() -> Port:
    return read_ports()[MODEL]


def _facts(port: Port) -> str:
    return f"{port.folder.name}/port.toml"


def _rounded(value: float) -> float:
    """Up to one digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit) * unit


def _line(port: Port, number: int) -> str:
    """A tagged statement as the port would write it, with its comment."""
    first = _first()
    tag, wording, _ = statements(first, source(first))[number]
    marked = next(line for line in source(first).splitlines() if f"{tag} {wording}" in line)
    code = marked.partition(first.comment[0].strip())[0].replace("std::", "")
    words = code.replace("constexpr", "").replace("const ", "").replace("double ", "").strip(" ;")
    for common, own in first.exceptions:
        words = words.replace(own, common)
    return f"{spelled(port, words)}  {port.comment[0]}{tag} {wording}{port.comment[1]}"


def _lacks(variant: Variant, port: Port, known: Mapping[str, Variant]) -> bool:
    """Whether a variant waits for what the port must say of it, as every one of the six does."""
    named = {name for name, _ in (*variant.edits, *variant.without)}
    if dict(variant.without).get(port.name) == UNWRITTEN:
        return True
    return bool(named & set(SIX)) and _first().name in named and port.name not in named


def _own_edit(variant: Variant, port: Port) -> str:
    """A skeleton of an edit, with that of the first program as its example."""
    example = next(edit for name, edit in variant.edits if name == _first().name) if _has(variant) else None
    lines = [f"# {variant.title}", f"[[{port.name}.{variant.name}.edits]]", "old = '''", "'''", "new = '''", "'''"]
    if example:
        lines.insert(1, f"# in {_first().language}: {example.old.strip()!r} becomes {example.new.strip()!r}"[:300])
    return "\n".join(lines)


def _has(variant: Variant) -> bool:
    return any(name == _first().name for name, _ in variant.edits)
