# SPDX-License-Identifier: MIT
"""Which experiments can be designed: plants in strict-feedback form, (2) to (4), and smooth, bounded references, (3).

What an experiment file breaks of that is shown at its place.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import NoReturn

import sympy as sp

from conformance.foreign import plain
from conformance.theory.experiment_file import LONGEST_TEXT, Reading
from conformance.theory.expressions import Expression, Negative, Quotient, walk
from conformance.theory.faults import Fault, FileFault, Place, Span
from conformance.theory.nonzero import is_bounded, singularities
from conformance.theory.strict_feedback import TIME, Rule, Violation, classify
from conformance.theory.symbolic import plant_of, reference_of, symbols_of, to_sympy

LONGEST_TIME = 3  # s of the processor, to classify; plants of the gallery take 0.1 s


def admit(reading: Reading) -> None:
    """Make sure that plant and reference of what was read can be designed; raises FileFault."""
    try:
        with user_time(LONGEST_TIME):
            _check_plant(reading)
            _check_reference(reading)
    except OutOfTime:
        sentence = f"it takes more than {LONGEST_TIME} s to decide whether (2) and (3) hold for plant and reference"
        file = reading.files[0]
        file.refuse(file.span(("plant",)), sentence, "write rows and reference with fewer functions within functions")


class OutOfTime(BaseException):
    """The time that something may take is over; no Exception, so that nobody takes it for an error of his own."""


@contextmanager
def user_time(seconds: float) -> Iterator[None]:
    """Raise OutOfTime in what takes more seconds of the processor; in the main thread alone, where signals arrive."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def over(*_: object) -> NoReturn:
        raise OutOfTime

    before = signal.signal(signal.SIGVTALRM, over)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds, 0.1)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def _check_plant(reading: Reading) -> None:
    """Refuse a plant that is not in strict-feedback form, with each rule that a row breaks at its place."""
    experiment = reading.experiment
    for state, row in zip(experiment.states, experiment.rows, strict=True):
        _check_real(reading, ("plant", state), row)
    violations = classify(plant_of(experiment)).violations
    if violations:
        raise FileFault([_violation(reading, violation) for violation in violations])


def _check_real(reading: Reading, place: Place, e: Expression) -> None:
    """Refuse a part of an expression that is no real number, whatever the states are."""
    symbols = symbols_of(reading.experiment)
    for node in reversed(list(walk(e))):
        worth = to_sympy(node, symbols)
        if worth.has(sp.nan, sp.zoo, sp.oo, sp.I) or worth.is_extended_real is False:
            divided = worth.has(sp.nan, sp.zoo, sp.oo)
            what = "has no value: something is divided by 0" if divided else "is no real number"
            reading.refuse_within(place, node.span, f"this {what}", "write what has a real value for every state")


def _violation(reading: Reading, violation: Violation) -> Fault:
    """A broken rule as a fault at the term that breaks it."""
    experiment = reading.experiment
    place = ("plant", experiment.states[violation.row - 1])
    file = reading.holder(*place) or reading.files[0]
    row = experiment.rows[violation.row - 1]
    span = reading.within(file, place, _span_of(row, violation.term, symbols_of(experiment)))
    sentence = f"row {violation.row}: {plain(violation.reason, 200)}"
    return file.fault(span, sentence, REMEDIES[violation.rule])


def _check_reference(reading: Reading) -> None:
    """Refuse a reference that is not smooth, or not bounded with its first n derivatives (3)."""
    experiment, place = reading.experiment, ("experiment", "reference")
    _check_real(reading, place, experiment.reference)
    e = reference_of(experiment)
    for part, _ in singularities(e, (TIME,)):
        span = _span_of(experiment.reference, part, symbols_of(experiment))
        remedy = "write a reference that is smooth for all t"
        reading.refuse_within(place, span, f"{plain(part)} is not smooth, or not known to be (3)", remedy)
    for order in range(len(experiment.states) + 1):
        if not is_bounded(sp.diff(e, TIME, order), TIME):
            what = "the reference" if not order else f"derivative {order} of the reference"
            remedy = "write a bounded reference, such as sines, a constant, or one that settles"
            reading.refuse_within(place, (0, LONGEST_TEXT), f"{what} is not bounded, or not known to be (3)", remedy)


REMEDIES: Mapping[Rule, str] = {
    Rule.PURE_FEEDBACK: "choose states so that the next one enters linearly; pure feedback is another design (16)",
    Rule.STATE_AHEAD: "order the states so that each row looks at those before it and the next one alone (2)",
    Rule.INPUT_EARLY: "order the states so that the input enters the last row alone (2)",
    Rule.INPUT_NOT_AFFINE: "take what the input does, such as u^2, as the input itself, if it can have both signs",
    Rule.NEXT_STATE_ABSENT: "order the states as a chain: each row holds the next state, the last one the input",
    Rule.NONLINEAR_IN_PARAMETERS: "take the function of the parameters as a parameter of its own: theta^2 as theta2",
    Rule.PARAMETER_IN_GAIN: "an unknown gain is outside of this design; state its value in [constants] if it is known",
    Rule.GAIN_VANISHES: "this design divides by g_i; restrict the plant to where it has one sign, by another model",
    Rule.GAIN_SIGN_UNKNOWN: "state constants such that the sign of g_i is known",
    Rule.TIME_VARYING_PARAMETER: "parameters are constant in this theory (4)",
    Rule.TIME_VARYING_ROW: "rows are functions of the state alone (4)",
    Rule.UNMODELLED_SIGNAL: "signals without a model cannot be folded into theta (4)",
    Rule.HIDDEN_STATE: "the full state must be measured (3)",
    Rule.UNDECLARED_SYMBOL: "declare it in [constants] or [unknown]",
    Rule.NOT_SMOOTH: "use functions that are smooth for every state, such as x*tanh(x/eps) in place of |x| (3)",
}


def _span_of(row: Expression, term: sp.Expr, symbols: Callable[[str], sp.Expr]) -> Span:
    """Where a term stands in the expression that SymPy was given; the whole, if nothing there is equal to it."""
    for node in walk(row):
        e = to_sympy(node, symbols)
        if isinstance(node, Quotient) and to_sympy(node.under, symbols) == 1 / term:
            return node.under.span
        if e in (term, -term):
            return node.of.span if isinstance(node, Negative) and e == -term else node.span
    return row.span
