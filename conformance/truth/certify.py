# SPDX-License-Identifier: MIT
"""Certificates: the claim that polynomials are near the solution of x' = f(t, x), read from a file and checked.

The file is JSON in one canonical form, every number exact: a rational such as 6/5, or a dyadic such as 0x3p-1 for 1.5.
It is checked by `deviation`, by another way than the polynomials were found, and sealed by a digest, so that a digit
which the theorem does not depend on cannot be changed either. It is read as data, within bounds, and never executed.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from flint import arb

from conformance.truth.deviation import NAMED, READS, Claim, Line, Step, deviations

FORMAT = "conformance certificate 1"
KEYS = ("format", "states", "program", "rhs", "start", "horizon", "steps", "sha256")
STEP_KEYS = ("start", "width", "polynomial", "radius")
LARGEST = 50_000_000  # bytes
MOST = {"states": 64, "lines": 20_000, "steps": 100_000, "coefficients": 1000}
DYADIC = re.compile(r"(-?)0x([1-9a-f][0-9a-f]{0,999})p(-?[0-9]{1,4})")
RATIONAL = re.compile(r"-?[0-9]{1,1000}(/[0-9]{1,1000})?")
NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]{0,99}")
GUARD_BITS = 24


class NoCertificate(ValueError):
    """What was read is no certificate; the message says where and why."""


class Certificate(NamedTuple):
    """What a file claims: `claim`, of the states with these names, up to the horizon (s)."""

    names: tuple[str, ...]
    claim: Claim
    horizon: Fraction

    @property
    def radius(self) -> float:
        """The largest radius stated."""
        return max(float(radius) for step in self.claim.steps for radius in step.radius)


def certify(certificate: Certificate) -> arb:
    """The largest radius that this way gives; raises NotProven where a stated radius is not confirmed."""
    return max(
        (bound for bounds in deviations(certificate.claim, bits(certificate.claim)) for bound in bounds), key=float
    )


def bits(claim: Claim) -> int:
    """A precision at which rounding is far below the smallest stated radius."""
    smallest = min(magnitude(radius) for step in claim.steps for radius in step.radius)
    largest = max(magnitude(c) for step in claim.steps for p in step.polynomial for c in p[:1])
    return max(64, GUARD_BITS + max(largest, 0) - smallest)


def magnitude(exact: arb) -> int:
    """The e of m 2^e, 1/2 <= |m| < 1; 0 has that of 2^-10000."""
    mantissa, exponent = (int(part) for part in exact.man_exp())
    return mantissa.bit_length() + exponent if mantissa else -10000


# ---- Reading ----


def read(path: Path) -> Certificate:
    """The certificate in a file; raises NoCertificate, or OSError."""
    if not path.is_file():
        raise NoCertificate(f"{path}: expected a file")
    if path.stat().st_size > LARGEST:
        raise NoCertificate(f"{path}: found {path.stat().st_size} bytes, expected at most {LARGEST}")
    try:
        return parse(path.read_bytes().decode("ascii"))
    except UnicodeDecodeError:
        raise NoCertificate(f"{path}: found bytes that are not ASCII, expected a certificate") from None
    except NoCertificate as reason:
        raise NoCertificate(f"{path}: {reason}") from None


def parse(text: str) -> Certificate:
    """The certificate that a text is; raises NoCertificate."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise NoCertificate("expected JSON, as conformance truth --certificate writes it") from None
    _keys(content, KEYS, "the file")
    _expect(content["format"] == FORMAT, "format", content["format"], FORMAT)
    names = tuple(_matched(name, NAME, "states")[0] for name in _listed(content["states"], 1, MOST["states"], "states"))
    _expect(len(set(names)) == len(names), "states", names, "names that differ")
    lines = _listed(content["program"], 1, MOST["lines"], "program")
    program = tuple(_line(line, i, len(names)) for i, line in enumerate(lines))
    rhs = tuple(_index(i, len(program), "rhs") for i in _listed(content["rhs"], len(names), len(names), "rhs"))
    start = [_listed(pair, 2, 2, "start") for pair in _listed(content["start"], len(names), len(names), "start")]
    balls = [(_fraction(middle, "start"), _fraction(radius, "start")) for middle, radius in start]
    _expect(all(radius >= 0 for _, radius in balls), "start", content["start"], "radii that are not negative")
    horizon = _fraction(content["horizon"], "horizon")
    steps = tuple(_steps(_listed(content["steps"], 1, MOST["steps"], "steps"), len(names), horizon))
    _expect(text == written(content), "the text", "another form", "the canonical one, sealed by its sha256")
    return Certificate(names, Claim(program, rhs, tuple(balls), steps), horizon)


def written(content: dict[str, Any]) -> str:
    """The canonical text of a content, with its digest."""
    plain = {key: content[key] for key in KEYS[:-1]}
    digest = hashlib.sha256(json.dumps(plain).encode()).hexdigest()
    return json.dumps(plain | {KEYS[-1]: digest}, indent=1) + "\n"


def _steps(found: list[Any], states: int, horizon: Fraction) -> Iterator[Step]:
    end = Fraction(0)
    for number, step in enumerate(found, 1):
        where = f"step {number}"
        _keys(step, STEP_KEYS, where)
        start, width = (_exactly(_dyadic(step[key], f"{where}, {key}")) for key in STEP_KEYS[:2])
        _expect(start == end, f"{where}, start", step["start"], "where the step before ends")
        _expect(width > 0, f"{where}, width", step["width"], "a positive number")
        rows = _listed(step["polynomial"], states, states, f"{where}, polynomial")
        polynomial = [_listed(row, 1, MOST["coefficients"], f"{where}, polynomial") for row in rows]
        radius = [_dyadic(r, f"{where}, radius") for r in _listed(step["radius"], states, states, f"{where}, radius")]
        _expect(all(r > 0 for r in radius), f"{where}, radius", step["radius"], "positive numbers")
        yield Step(start, width, [[_dyadic(c, f"{where}, polynomial") for c in row] for row in polynomial], radius)
        end = start + width
    _expect(end >= horizon, "horizon", str(horizon), "a time that the steps reach")


def _line(text: Any, i: int, states: int) -> Line:
    where = f"program, line {i}"
    op, *words = _matched(text, re.compile(r"[a-z]{1,9}( [-/0-9A-Za-z]{1,2001}){0,2}"), where)[0].split(" ")
    _expect(op in READS, where, op, f"one of {', '.join(READS)}")
    completed = op in ("state", "constant", "power")
    _expect(len(words) == READS[op] + completed, where, text, "as many words as the operation has")
    value = words.pop(0) if completed else ""
    if op == "state":
        _index(int(value) if re.fullmatch("[0-9]{1,4}", value) else value, states, where)
    elif completed and not (op == "constant" and value in NAMED):
        _fraction(value, where)
    return Line(op, tuple(_index(int(w) if re.fullmatch("[0-9]{1,6}", w) else w, i, where) for w in words), value)


def _expect(condition: bool, where: str, found: object, expected: str) -> None:
    if not condition:
        raise NoCertificate(f"{where}: found {str(found)[:60]!r}, expected {expected}")


def _keys(value: Any, keys: tuple[str, ...], where: str) -> None:
    good = isinstance(value, dict) and tuple(value) == keys
    _expect(good, where, list(value) if isinstance(value, dict) else value, f"the keys {', '.join(keys)}")


def _listed(value: Any, least: int, most: int, where: str) -> list[Any]:
    size = str(least) if least == most else f"{least} to {most}"
    _expect(isinstance(value, list) and least <= len(value) <= most, where, value, f"a list of {size}")
    return list(value)


def _matched(value: Any, pattern: re.Pattern[str], where: str) -> re.Match[str]:
    match = pattern.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise NoCertificate(f"{where}: found {str(value)[:60]!r}, expected a text of the form {pattern.pattern[:60]}")
    return match


def _index(value: Any, below: int, where: str) -> int:
    _expect(type(value) is int and 0 <= value < below, where, value, f"a whole number below {below}")
    return int(value)


def _fraction(value: Any, where: str) -> Fraction:
    text = _matched(value, RATIONAL, where)[0]
    _expect(not re.search("/0+$", text) and str(Fraction(text)) == text, where, text, "a fraction in lowest terms")
    return Fraction(text)


def _dyadic(value: Any, where: str) -> arb:
    """An exact ball."""
    if value == "0x0p0":
        return arb(0)
    sign, digits, exponent = _matched(value, DYADIC, where).groups()
    _expect(
        digits[-1] in "13579bdf" and str(int(exponent)) == exponent, where, value, "an odd mantissa, a plain exponent"
    )
    return arb((int(sign + digits, 16), int(exponent)))


def _exactly(ball: arb) -> Fraction:
    mantissa, exponent = (int(part) for part in ball.man_exp())
    return mantissa * Fraction(2) ** exponent
