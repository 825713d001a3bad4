# SPDX-License-Identifier: MIT
"""Certificates, written: a proven enclosure as data that `certify` checks by another way."""

from __future__ import annotations

from typing import Any

from flint import arb

from conformance.truth.certify import FORMAT, Certificate, bits, parse, written
from conformance.truth.deviation import Line, NotProven, deviations
from conformance.truth.taylor import Program, compile_program
from conformance.truth.truth import Ball, Enclosure, InitialValueProblem

WIDER = (1.0, 2.0**8, 2.0**16, 2.0**32)  # than the radii of the enclosure: what the second way may need to confirm


def certificate(problem: InitialValueProblem, enclosed: Enclosure) -> str:
    """The certificate of an enclosure of this problem, as text.

    Its radii are those of the enclosure, or where the second way gives larger ones, these. Raises NotProven where that
    way gives none.
    """
    obstacle = NotProven()
    for factor in WIDER:
        text = written(content(problem, enclosed, factor))
        found = parse(text)
        try:
            for _ in deviations(found.claim, bits(found.claim)):
                pass
            return text
        except NotProven as reason:
            obstacle = reason
    raise obstacle


def content(problem: InitialValueProblem, enclosed: Enclosure, factor: float = 1.0) -> dict[str, Any]:
    """What the certificate says, with the radii of the enclosure times a factor."""
    program, rhs = straight_line(compile_program(problem.time, problem.states, problem.rhs, problem.definitions))
    ends = [*enclosed.starts[1:].tolist(), enclosed.end]
    steps = zip(enclosed.starts.tolist(), ends, enclosed.polynomials, enclosed.radius.tolist(), strict=True)
    return {
        "format": FORMAT,
        "states": list(problem.names),
        "program": [" ".join(filter(None, (line.op, line.value, *map(str, line.reads)))) for line in program],
        "rhs": rhs,
        "start": list(map(list, _starts(problem))),
        "horizon": str(problem.horizon),
        "steps": [
            {
                "start": dyadic(arb(start)),
                "width": dyadic(arb(end) - arb(start)),
                "polynomial": [_numbers(text) for text in polynomial],
                "radius": [dyadic(arb(factor * max(r, enclosed.largest_radius * 2.0**-20))) for r in radius],
            }
            for start, end, polynomial, radius in steps
        ],
    }


def same_problem(problem: InitialValueProblem, found: Certificate) -> bool:
    """Whether a certificate is of this problem, line by line as it is derived here."""
    program, rhs = straight_line(compile_program(problem.time, problem.states, problem.rhs, problem.definitions))
    claim = found.claim
    given = (found.names, claim.program, claim.rhs, [tuple(map(str, pair)) for pair in claim.start])
    return given == (problem.names, tuple(program), tuple(rhs), _starts(problem)) and found.horizon >= problem.horizon


def _starts(problem: InitialValueProblem) -> list[tuple[str, str]]:
    """Middle and radius of each start value."""
    return [(str(v.middle), str(v.radius)) if isinstance(v, Ball) else (str(v), "0") for v in problem.start]


def straight_line(program: Program) -> tuple[list[Line], list[int]]:
    """A compiled program as lines, and the lines of the right-hand sides."""
    lines: list[Line] = []
    where: dict[int, int] = {}
    for i, node in enumerate(program.nodes):
        if node.kind == "slope":  # which Taylor coefficients need, and values do not
            continue
        op, value, reads = node.kind, "", node.args
        if op == "function":
            op, exponent = str(node.value).split()
            value, reads = exponent if op == "power" else "", node.args[:1]
        elif op in ("constant", "state"):
            value = str(node.value)
        where[i] = len(lines)
        lines.append(Line(op, tuple(where[j] for j in reads), value))
    return lines, [where[i] for i in program.rhs]


def dyadic(exact: arb) -> str:
    """An exact ball as hexadecimal mantissa and exponent of 2: 0x3p-1 is 1.5."""
    mantissa, exponent = (int(part) for part in exact.man_exp())
    return f"{mantissa:#x}p{exponent if mantissa else 0}"


def _numbers(text: str) -> list[str]:
    """The coefficients of a polynomial as an Enclosure keeps them."""
    words = text.split()
    return [dyadic(arb((int(m, 16), int(e)))) for m, e in zip(words[::2], words[1::2], strict=True)]
