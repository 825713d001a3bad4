# SPDX-License-Identifier: MIT
"""Whether the first line of a verdict names what was broken in a program: the statement, or the section it is in."""

import re
from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher

from conformance.judging.verdict import Verdict, judge_port
from conformance.programs.ports import Port
from conformance.trials import mutants
from conformance.trials.edits import in_experiment
from conformance.trials.variant import Variant, in_tree, job, run_all, source

ASSIGNED = re.compile(r"(\w+)('?)(?:\[\w+\])?(?:\(\w+\))?\s*(?::?=|(?<=\] )==)")
OTHERWISE = {  # words that name a section's own part: the method and the rows, the file, the report
    "Integrate": r"step|method|times and states|row",
    "Write CSV": r"row|column|times and states",
    "Report": r"standard output",
}
SPELLED = {"gamma_gain": "gamma", "control": "u", "final_time": "last row", "time_span": "last row"}


def snake(name: str) -> str:
    """A name of any port as the statements of the diagnosis have it."""
    spaced = name if name.isupper() else re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name)
    return SPELLED.get(spaced.lower(), spaced.lower())


def changed_lines(before: str, after: str) -> Iterator[int]:
    """The lines of `before`, from 0, that `after` has otherwise."""
    old, new = before.splitlines(), after.splitlines()
    for what, first, last, _, _ in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if what != "equal":
            yield from range(first, max(last, first + 1))


def words(port: Port, before: str, after: str) -> set[str]:
    """Patterns any of which names a change of a program: what is assigned there, and the section's own words."""
    lines, found = before.splitlines(), set[str]()
    titles = {
        place: title for title in OTHERWISE for place, line in enumerate(lines) if port.section.format(title) in line
    }
    for number in changed_lines(before, after):
        assigned = ASSIGNED.search(lines[number]) if number < len(lines) else None
        if assigned:
            name = snake(assigned[1]) + "_dot" * bool(assigned[2])
            found.add(rf"\b{re.escape(name)}\b")
        section = max((place for place in titles if place <= number), default=None)
        if section is not None:
            found.add(OTHERWISE[titles[section]])
    return found


def is_named(verdict: Verdict, wanted: set[str]) -> bool:
    """Whether the first line of the reason says one of these."""
    first = verdict.reason.partition("\n")[0].replace("'", "_dot").replace("_starts", "_start")
    return any(re.search(word, first) for word in wanted)


def mistakes(variants: Sequence[Variant], ports: Sequence[Port]) -> list[bool]:
    """For every mistake in every port whether it is named; what is not up to date is run."""
    cases = [(v, port) for v in variants if v.refused_by for port in ports if v.has(port)]
    run_all(job(v.tree, port, source(v, port)) for v, port in cases)
    return [
        is_named(
            judge_port(in_tree(port, v.tree), v.experiment, diagnose=True),
            words(port, in_experiment(port, v.experiment), source(v, port)),
        )
        for v, port in cases
    ]


def of_mutants(made: Sequence[mutants.Mutant]) -> list[bool]:
    """For every mutant that a check of its trajectory refuses whether it is named; what is not up to date is run."""
    found = []
    for mutant, one in mutants.run(made):
        verdict = judge_port(in_tree(mutant.port, one.tree), mutants.EXPERIMENT, diagnose=True)
        if verdict.results and not verdict.conforms:
            right = in_experiment(mutant.port, mutants.EXPERIMENT)
            found.append(is_named(verdict, words(mutant.port, right, mutant.text)))
    return found
