# SPDX-License-Identifier: MIT
"""Certificates, written: a proven enclosure as data, with the frames by which `certify` checks it another way."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import sympy as sp
from flint import arb, arb_poly, fmpq

from conformance.truth import certify
from conformance.truth.certify import FORMAT, Certificate, Matrix, NotProven, Spread, Step, upper
from conformance.truth.piecewise import Floats
from conformance.truth.taylor import Program, coefficients, precision, variational
from conformance.truth.truth import Ball, Enclosure, InitialValueProblem, compiled

ORDER = 12  # of the frames
DIGITS = 16  # bits of their coefficients: any frames do, if they nearly solve the variational equation
PARTS = 32  # into which a step of the enclosure is cut at most
WIDER, WIDEST = 4, 32  # log2 of the factors of the radii, where the second way needs larger ones
LEAST = 2.0**-20  # of the largest radius: the smallest stated
FLATTEST = 2.0**-5  # of the longest axis of a frame: its shortest
TINY = 1e-300
LOWEST, GUARD_BITS = 64, 24  # of the precision: bits at least, and beyond the smallest radius
Flow = tuple[Program, list[tuple[int, int]]]  # the variational equation, as `variational` gives it


def certificate(problem: InitialValueProblem, enclosed: Enclosure) -> str:
    """The certificate of an enclosure of this problem, as text, proven while it is written.

    Its radii are those of the enclosure, or where the second way gives larger ones, these. Raises NotProven where that
    way gives none.
    """
    of, flow = claim(problem, enclosed), variational(compiled(problem))
    done, wider = list[Step](), 0
    with certify.series(of.bits):
        x: Spread = (
            [arb(middle) + arb(0, arb(radius).abs_upper()) for middle, radius in of.start],
            [[] for _ in of.start],
        )
        for step in of.steps:
            while True:
                radius = [r * 2**wider for r in step.radius]
                try:
                    parts, x = proven(of, flow, step._replace(radius=radius), x, PARTS)
                    break
                except NotProven as reason:
                    wider += WIDER
                    if wider > WIDEST:
                        raise NotProven(f"in the step from t = {float(step.start):.9g} {reason}") from None
            done += parts
    return certify.written(content(of._replace(steps=done)))


def claim(problem: InitialValueProblem, enclosed: Enclosure) -> Certificate:
    """What an enclosure claims, without frames."""
    program, rhs = straight_line(compiled(problem))
    least, found = arb(enclosed.largest_radius * LEAST), steps(enclosed)
    found = [step._replace(radius=[r.max(least) for r in step.radius]) for step in found]
    size = max(abs(float(p[0])) for step in found for p in step.polynomial)
    smallest = min(float(r) for step in found for r in step.radius)
    bits = max(LOWEST, math.ceil(math.log2(max(size, 1)) - math.log2(smallest)) + GUARD_BITS)
    return Certificate(list(problem.names), program, rhs, _starts(problem), rational(problem.horizon), bits, found)


def steps(enclosed: Enclosure) -> list[Step]:
    """The steps of an enclosure, without frames."""
    spans = pairwise(map(_exact, enclosed.edges.tolist()))
    return [
        Step(start, end - start, [arb_poly(_numbers(text)) for text in texts], list(map(arb, radii)), [], [])
        for (start, end), texts, radii in zip(spans, enclosed.polynomials, enclosed.radius.tolist(), strict=True)
    ]


def proven(of: Certificate, flow: Flow, step: Step, before: Spread, parts: int) -> tuple[list[Step], Spread]:
    """The step with frames, in so many parts at most, and x at its end; raises NotProven."""
    framed = with_frames(flow, step, before)
    try:
        return [framed], certify.advance(of, framed, before)[1]
    except NotProven:
        if parts == 1:
            raise
    done = []
    for half in halves(step):
        found, before = proven(of, flow, half, before, parts // 2)
        done += found
    return done, before


def halves(step: Step) -> tuple[Step, Step]:
    """The two halves of a step; the polynomials of the later one are rounded."""
    half = step.width / 2
    moved = [p(arb_poly([arb(half), 1])) for p in step.polynomial]
    later = [arb_poly([c.mid() for c in p.coeffs()]) for p in moved]
    return step._replace(width=half), step._replace(start=step.start + half, width=half, polynomial=later)


def with_frames(flow: Flow, step: Step, before: Spread) -> Step:
    """The step with Phi and its inverse, guessed in doubles: any would do.

    Phi solves the variational equation; Phi(0) has orthogonal axes, in units of the radii, along the longest edges of e
    (Lohner 1987).
    """
    program, entries = flow
    n = len(step.polynomial)
    with precision(64):
        middle = [p[0].mid() for p in step.polynomial]
        found = coefficients(program, arb(step.start), middle + [arb(i == j) for i, j in entries], ORDER - 1)
    Y = np.zeros((ORDER, n, n))
    for (i, j), state in zip(entries, program.states[n:], strict=True):
        Y[: len(found[state]), i, j] = [float(c.mid()) for c in found[state]]
    scale = np.array([[float(r)] for r in step.radius])
    jumps = np.array([float(upper(x - p[0])) for x, p in zip(before[0], step.polynomial, strict=True)])
    edges = np.array([[float(v.mid()) for v in row] for row in before[1]])
    sides = np.hstack([edges, np.diag(jumps)]) / scale
    sides /= np.abs(sides).max() + TINY
    axes = np.linalg.qr(sides[:, np.argsort(-np.linalg.norm(sides, axis=0))])[0]
    lengths = np.abs(axes.T @ sides).sum(axis=1)
    start = axes * np.maximum(lengths, (lengths.max() or 1) * FLATTEST) * scale
    phi = Y @ start
    try:
        psi = [np.linalg.inv(start)]
    except np.linalg.LinAlgError:
        raise NotProven("no frame was found") from None
    for k in range(1, ORDER):
        psi.append(-sum(psi[k - i] @ phi[i] for i in range(1, k + 1)) @ psi[0])
    return step._replace(frame=_exactly(phi), inverse=_exactly(np.array(psi)))


def _exactly(matrix: Floats) -> Matrix:
    """A matrix of polynomials, (order, n, n), with coefficients of few digits."""
    mantissa, exponent = np.frexp(matrix)
    short = np.ldexp(np.round(np.ldexp(mantissa, DIGITS)), exponent - DIGITS)
    return [[arb_poly(list(map(arb, c))) for c in row] for row in short.transpose(1, 2, 0).tolist()]


def content(of: Certificate) -> dict[str, Any]:
    """A certificate as JSON has it."""
    return {
        "format": FORMAT,
        "states": of.names,
        "program": of.program,
        "rhs": of.rhs,
        "start": [[str(number) for number in pair] for pair in of.start],
        "horizon": str(of.horizon),
        "bits": of.bits,
        "steps": [
            {
                "start": dyadic(step.start),
                "width": dyadic(step.width),
                "polynomial": list(map(_text, step.polynomial)),
                "radius": [dyadic(r.fmpq()) for r in step.radius],
                "frame": [_text(p) for row in step.frame for p in row],
                "inverse": [_text(p) for row in step.inverse for p in row],
            }
            for step in of.steps
        ],
    }


def _text(p: arb_poly) -> str:
    return " ".join(dyadic(c.fmpq()) for c in p.coeffs() or [arb(0)])


def dyadic(number: fmpq) -> str:
    """A dyadic number as hexadecimal mantissa and exponent of 2: 0x3p-1 is 1.5."""
    mantissa, exponent = (int(part) for part in arb((int(number.p), 1 - int(number.q).bit_length())).man_exp())
    return f"{mantissa:#x}p{exponent}"


def same_problem(problem: InitialValueProblem, found: Certificate) -> bool:
    """Whether a certificate is of this problem, line by line as it is derived here."""
    program, rhs = straight_line(compiled(problem))
    wanted = (list(problem.names), program, rhs, _starts(problem))
    return (found.names, found.program, found.rhs, found.start) == wanted and found.horizon >= rational(problem.horizon)


def _starts(problem: InitialValueProblem) -> list[tuple[fmpq, fmpq]]:
    """Middle and radius of each start value."""
    balls = (v if isinstance(v, Ball) else Ball(v, sp.S.Zero) for v in problem.start)
    return [(rational(middle), rational(radius)) for middle, radius in balls]


def rational(number: sp.Rational) -> fmpq:
    """A rational number of SymPy's."""
    number = sp.Rational(number)
    return fmpq(int(number.p), int(number.q))


def _exact(double: float) -> fmpq:
    return fmpq(*double.as_integer_ratio())


def straight_line(program: Program) -> tuple[list[str], list[int]]:
    """A compiled program as lines, and the lines of the right-hand sides; a power is an exponential of a logarithm."""
    lines: list[str] = []
    where: dict[int, int] = {}

    def line(op: str, *reads: object) -> int:
        lines.append(" ".join(map(str, (op, *reads))))
        return len(lines) - 1

    for i, node in enumerate(program.nodes):
        reads = [where[j] for j in node.args if j in where]
        op, *exponent = str(node.value).split() if node.kind == "function" else [node.kind]
        if op == "power":
            scaled = line("mul", line("constant", exponent[0]), line("log", *reads))
            where[i] = line("exp", scaled)
        elif op in ("constant", "state"):
            where[i] = line(op, str(node.value).rpartition("=")[2])
        elif op != "slope":  # which Taylor coefficients need, and values do not
            where[i] = line(op, *reads)
    return lines, [where[i] for i in program.rhs]


def _numbers(text: str) -> list[arb]:
    """The coefficients of a polynomial as an Enclosure keeps them."""
    words = text.split()
    return [arb((int(m, 16), int(e))) for m, e in zip(words[::2], words[1::2], strict=True)]
