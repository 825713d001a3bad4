# SPDX-License-Identifier: MIT
"""The ways in: what a reader asks first, and the place of the page that answers it in words."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from conformance.judging.verdict import Verdict
from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.lesson import LESSON
from conformance.theory.statements import statements_of

BESIDE = ("java", "matlab")  # the first to be compared, of the ports that are there
EXERCISE, PORT = "problem-6", "mathematica"  # the first to be looked up


class Way(NamedTuple):
    """A question, in which symbols have their names, and where it is answered: what is set, and the place."""

    question: str
    address: str


def ways(
    e: Experiment,
    languages: Mapping[str, str],
    shown: Collection[str],
    verdicts: Sequence[Verdict],
    exercises: Collection[str],
) -> Iterator[Way]:
    """The ways into the page of an experiment; `shown` are the ports whose code it shows, `languages` those of all."""
    statements = {s.name: s.wording for s in statements_of(e)}
    row = next((name for name in reversed(statements) if statements[name].startswith("tuning function")), INPUT)
    pair = sorted(shown, key=lambda port: port not in BESIDE)[:2]
    if len(pair) == 2:
        one, other = (languages[port] for port in pair)
        question = f"How does {one} write the {statements[row]}, against {other}?"
        yield Way(question, f"?compare={','.join(pair)}#row-{row}")
    if EXERCISE in exercises and shown:
        port = PORT if PORT in shown else pair[0]
        yield Way(f"What is Problem 6's edit in {languages[port]}?", f"?in={port}#exercise-{EXERCISE}")
    if e.unknown:
        estimate = e.estimates[0]
        asked = f"does {estimate} not converge with r = 0" if e == LESSON else f"need {estimate} not converge"
        yield Way(f"Why {asked}?", "#why-no-convergence")
        yield Way("What does gamma do?" if "gamma" in e.gammas else "What do the adaptation gains do?", "#effect-gamma")
    if len(e.states) > 1:
        yield Way("Where does the cross term of step 2 cancel?", "#cross-2")
    if all(verdict.conforms for verdict in verdicts):  # or the first screen says which is refused, and why
        yield Way("When is a program refused?", "#when-refused")
