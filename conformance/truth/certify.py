# SPDX-License-Identifier: MIT
"""Certificates, checked: the solution of x' = f(t, x) is within the stated radii of the stated polynomials.

On one step, 0 <= s <= h, let p be the polynomials, d = p' - f(t, p) their defect, e = x - p, and J the Jacobian of f,
averaged from p to x: e' = J e - d. The file gives a frame Phi, and Psi near its inverse, matrices of polynomials. With
H = Psi Phi - I and |H| < 1, Phi^-1 = (I + H)^-1 Psi, so in the maximum norm, every norm the largest over the step,

    w = Phi^-1 e,  w' = M w - Phi^-1 d,  M = Phi^-1 (J Phi - Phi'),  |w|' <= mu(M) |w| + |Phi^-1 d|,  mu(M) <= |M|,
    |w| <= W = (|Psi(0) e(0)| + h |Psi d|) / (1 - |H|) exp(h |Psi (J Phi - Phi')| / (1 - |H|)),  |e| <= |Phi| W

with the logarithmic norm mu (Dahlquist 1958, Lozinskii 1958). J is bounded for all x within the stated radius: while x
is there, |Phi| W bounds e, and as that is less, x never leaves. All bounds are balls; python-flint alone is needed.

The file is canonical JSON sealed by a digest, every number exact: a rational such as 6/5, or a dyadic such as 0x3p-1.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import reduce
from operator import add, mul, sub
from pathlib import Path
from typing import Any, NamedTuple

from flint import arb, arb_poly, arb_series, ctx, fmpq

FORMAT = "conformance certificate 2"
KEYS = ("format", "states", "program", "rhs", "start", "horizon", "bits", "steps", "sha256")
STEP_KEYS = dict(start=(0, 1), width=(0, 1), polynomial=(1, 1000), radius=(1, 1), frame=(2, 100), inverse=(2, 100))
LARGEST, MOST = 50_000_000, {"states": 64, "lines": 20_000, "steps": 100_000}  # bytes; entries
DYADIC = re.compile(r"0x0p0|-?0x(?:[1-9a-f][0-9a-f]{0,998})?[13579bdf]p(?:0|-?[1-9][0-9]{0,3})")
LINE = re.compile(
    r"time|state \d\d?|constant \S+|(add|mul|div)( \d{1,5}){2}|(exp|log|atan|(sin|cos|tan)h?) \d{1,5}", re.A
)
NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]{0,99}")
RATIONAL = re.compile(r"-?[0-9]{1,1000}(/[1-9][0-9]{0,999})?")
BEYOND = 4  # orders to which the defect is expanded beyond the degree of the polynomials
Matrix = list[list[Any]]  # of balls, polynomials or power series
Spread = tuple[list[arb], Matrix]  # middle and edges: all x = middle + edges w, |w| <= 1 in the maximum norm


class NoCertificate(ValueError):
    """What was read is no certificate; the message says where and why."""


class NotProven(ArithmeticError):
    """The claim does not hold, or this way cannot show that it does."""


class Step(NamedTuple):
    """|x_i(start + s) - polynomial[i](s)| <= radius[i] for 0 <= s <= width, all exact; frame: Phi, inverse: Psi."""

    start: fmpq
    width: fmpq
    polynomial: list[arb_poly]
    radius: list[arb]
    frame: Matrix
    inverse: Matrix


class Certificate(NamedTuple):
    """The claim that x' = f(t, x), f the lines `rhs` of a straight-line program, is solved as the steps say."""

    names: list[str]
    program: list[str]
    rhs: list[int]
    start: list[tuple[fmpq, fmpq]]  # of each state: middle and radius
    horizon: fmpq
    bits: int  # to compute with
    steps: list[Step]


ELEMENTARY: dict[str, tuple[Callable[[Any], Any], Callable[[Any, Any], Any]]] = {  # F(u), and F'(u) from u and v = F(u)
    "exp": (arb_series.exp, lambda u, v: v),
    "log": (arb_series.log, lambda u, v: 1 / u),
    "sin": (arb_series.sin, lambda u, v: u.cos()),
    "cos": (arb_series.cos, lambda u, v: -u.sin()),
    "tan": (arb_series.tan, lambda u, v: 1 + v * v),
    "atan": (arb_series.atan, lambda u, v: 1 / (1 + u * u)),
    "sinh": (lambda u: (u.exp() - (-u).exp()) / 2, lambda u, v: (u.exp() + (-u).exp()) / 2),
    "cosh": (lambda u: (u.exp() + (-u).exp()) / 2, lambda u, v: (u.exp() - (-u).exp()) / 2),
    "tanh": (lambda u: 1 - 2 / ((2 * u).exp() + 1), lambda u, v: 1 - v * v),
}
NAMED = {"pi": arb.pi, "E": arb.const_e}


def run(program: list[str], outputs: list[int], t: arb_series, x: Matrix) -> Matrix:
    """The outputs, each with its derivatives in the directions that follow the value of every state in x."""
    zeros, found = [arb_series([0])] * (len(x[0]) - 1), list[list[Any]]()
    for op, *words in map(str.split, program):
        match op, *(found[int(word)] for word in words if op not in ("state", "constant")):
            case ["time"]:
                made = [t, *zeros]
            case ["state"]:
                made = x[int(words[0])]
            case ["constant"]:
                made = [arb_series([NAMED[words[0]]() if words[0] in NAMED else arb(rational(words[0]))]), *zeros]
            case ["add", a, b]:
                made = list(map(add, a, b))
            case ["mul", (a, *da), (b, *db)]:
                made = [a * b, *(a * v + b * u for u, v in zip(da, db, strict=True))]
            case ["div", (a, *da), (b, *db)]:
                made = [a / b, *((u - a / b * v) / b for u, v in zip(da, db, strict=True))]
            case [_, (u, *du)]:
                v, slope = ELEMENTARY[op][0](u), ELEMENTARY[op][1]
                made = [v, *(slope(u, v) * w for w in du)]
        checked = [*made, 1 / found[int(words[1])][0]] if op == "div" else made  # 0 / b is 0 without a look at b
        if not all(c.is_finite() for one in checked for c in one):
            raise ValueError("not defined on all of the set")
        found.append(made)
    return [found[i] for i in outputs]


@contextmanager
def series(bits: int, length: int = 1) -> Iterator[None]:
    """Sets the precision and the length of series, which are global to python-flint, and restores them."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = bits, length
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


def upper(ball: arb) -> arb:
    """A bound of the absolute value, exact; what is not a number stays."""
    return arb(ball.abs_upper())


def bounds(matrix: Callable[[arb_poly], Matrix], h: arb, order: int) -> Matrix:
    """Bounds of |entries| on [0, h] by Taylor's theorem, from power series about h / 2 and about all of that."""
    half = upper(h / 2)
    with series(ctx.prec, order + 1):
        try:
            both = [matrix(arb_poly([h / 2 + arb(0, radius), 1])) for radius in (0, half)]
        except (ValueError, ZeroDivisionError):
            raise NotProven("there may be a division by 0") from None
        if min(one.prec for rows in both for row in rows for one in row) <= order:
            raise NotProven("a power series is not known far enough")
        return each(lambda a, b: upper(arb_poly([*(abs(a[k]) for k in range(order)), abs(b[order])])(half)), *both)


def at(polynomials: Matrix, s: arb_poly) -> Matrix:
    """Polynomials as power series about s."""
    return [[arb_series(p(s)) for p in row] for row in polynomials]


def product(a: Matrix, b: Matrix) -> Matrix:
    """The product of matrices."""
    return [[sum(map(mul, row, column)) for column in zip(*b, strict=True)] for row in a]


def each(operation: Callable[[Any, Any], Any], a: Matrix, b: Matrix) -> Matrix:
    """An operation on the entries of two matrices."""
    return [list(map(operation, *rows)) for rows in zip(a, b, strict=True)]


def norm(matrix: Matrix) -> arb:
    """The norm that belongs to the maximum norm, from entries or their bounds."""
    return upper(reduce(arb.max, (sum(map(abs, row)) for row in matrix)))


def advance(of: Certificate, step: Step, before: Spread) -> tuple[list[arb], Spread]:
    """Bounds of |e| on a step, and x at its end; raises NotProven where one is not below the stated radius."""
    h, Phi, Psi, p, n = arb(step.width), step.frame, step.inverse, step.polynomial, len(step.polynomial)
    short, long = max(one.length() for row in Phi for one in row), max(one.length() for one in p)
    unit = [[int(i == j) for j in range(n)] for i in range(n)]

    def residue(s: arb_poly, x: Matrix) -> Matrix:  # Psi (f - x'), of x and of its derivatives in all directions
        f = run(of.program, of.rhs, arb_series(s + arb(step.start)), at(x, s))
        return product(at(Psi, s), each(sub, f, at([[one.derivative() for one in row] for row in x], s)))

    H = norm(bounds(lambda s: each(sub, product(at(Psi, s), at(Phi, s)), unit), h, short))
    # J at every time, for each constant shift within the radius, e at that time among them
    tube = [[one + arb(0, r), *directions] for one, r, directions in zip(p, step.radius, Phi, strict=True)]
    growth = norm([slopes for _, *slopes in bounds(lambda s: residue(s, tube), h, short)])
    defect = norm(bounds(lambda s: residue(s, [[one] for one in p]), h, long + BEYOND))
    jumps = [upper(middle - one[0]) for middle, one in zip(before[0], p, strict=True)]
    edges = [[*row, *(jump * i for i in units)] for row, jump, units in zip(before[1], jumps, unit, strict=True)]
    start = norm(product([[one[0] for one in row] for row in Psi], edges))
    if not H < 1:
        raise NotProven("the frame has no inverse")
    W = upper((start + h * defect) / (1 - H) * (h * growth / (1 - H)).exp())
    found = [upper(sum(row) * W) for row in bounds(lambda s: at(Phi, s), h, short)]
    for i, (bound, radius) in enumerate(zip(found, step.radius, strict=True), 1):
        if not bound < radius:
            raise NotProven(f"row {i} may be {float(bound):.2e} away, stated is {float(radius):.2e}")
    return found, ([one(h) for one in p], [[one(h) * W for one in row] for row in Phi])


def certify(of: Certificate) -> list[list[arb]]:
    """Per step: proven bounds of |x_i - p_i|, each below its stated radius; raises NotProven where one is not."""
    found = []
    with series(of.bits):
        x: Spread = [arb(middle) + arb(0, upper(arb(r))) for middle, r in of.start], [[] for _ in of.start]
        for step in of.steps:
            try:
                bound, x = advance(of, step, x)
            except NotProven as reason:
                raise NotProven(f"in the step from t = {float(step.start):.9g} {reason}") from None
            found.append(bound)
    return found


def read(path: Path) -> Certificate:
    """The certificate in a file; raises NoCertificate, or OSError."""
    try:
        expect(path.is_file() and path.stat().st_size <= LARGEST, "the path", path, f"a file up to {LARGEST} bytes")
        return parse(path.read_bytes().decode("latin-1"))
    except NoCertificate as reason:
        raise NoCertificate(f"{path}: {reason}") from None


def parse(text: str) -> Certificate:
    """The certificate that a text is; raises NoCertificate."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise NoCertificate("expected JSON, as conformance truth --certificate writes it") from None
    expect(isinstance(content, dict) and tuple(content) == KEYS, "the file", content, f"the keys {', '.join(KEYS)}")
    expect(content["format"] == FORMAT, "format", content["format"], FORMAT)
    names = listed(content["states"], "states", 1, MOST["states"])
    expect(len({n for n in names if isinstance(n, str) and NAME.fullmatch(n)}) == len(names), "states", names, "names")
    program = listed(content["program"], "program", 1, MOST["lines"])
    for i, line in enumerate(program):
        good = isinstance(line, str) and bool(LINE.fullmatch(line))
        expect(good, f"program, line {i}", line, "an operation, and as many numbers as it reads")
        op, *words = line.split(" ")
        if op == "constant":
            rational("0" if words[0] in NAMED else words[0])
        else:
            below = len(names) if op == "state" else i
            expect(all(int(word) < below for word in words), f"program, line {i}", line, f"whole numbers below {below}")
    rhs, bits = listed(content["rhs"], "rhs", len(names)), content["bits"]
    expect(all(type(i) is int and 0 <= i < len(program) for i in rhs), "rhs", rhs, f"numbers below {len(program)}")
    expect(type(bits) is int and 2 <= bits <= 10_000, "bits", bits, "a whole number from 2 to 10000")
    pairs = [listed(pair, "start", 2) for pair in listed(content["start"], "start", len(names))]
    start = [(rational(middle), rational(radius)) for middle, radius in pairs]
    expect(all(radius >= 0 for _, radius in start), "start", pairs, "radii that are not negative")
    steps, end, horizon = [], fmpq(0), rational(content["horizon"])
    for i, step in enumerate(listed(content["steps"], "steps", 1, MOST["steps"]), 1):
        steps.append(read_step(step, f"step {i}", len(names), end))
        end += steps[-1].width
    expect(0 < horizon <= end, "horizon", horizon, "a positive time that the steps reach")
    expect(text == written(content), "the text", "another form", "the canonical one, sealed by its sha256")
    return Certificate(names, program, rhs, start, horizon, bits, steps)


def written(content: dict[str, Any]) -> str:
    """The canonical text of a content, with its digest."""
    plain = {key: content[key] for key in KEYS[:-1]}
    digest = hashlib.sha256(json.dumps(plain).encode()).hexdigest()
    return json.dumps(plain | {KEYS[-1]: digest}, indent=1) + "\n"


def read_step(step: Any, where: str, n: int, end: fmpq) -> Step:
    """A step of n states that starts where the last one ended; raises NoCertificate."""
    expect(isinstance(step, dict) and tuple(step) == tuple(STEP_KEYS), where, step, f"the keys {', '.join(STEP_KEYS)}")
    start, width, polynomial, radius, frame, inverse = (
        polynomials(step[key], f"{where}, {key}", n**power, most) for key, (power, most) in STEP_KEYS.items()
    )
    expect(start[0][0].fmpq() == end, f"{where}, start", step["start"], "where the step before ends")
    for key, found in ("width", width), ("radius", radius):
        expect(all(one[0] > 0 for one in found), f"{where}, {key}", step[key], "positive numbers")
    matrices = ([rows[i : i + n] for i in range(0, n * n, n)] for rows in (frame, inverse))
    return Step(start[0][0].fmpq(), width[0][0].fmpq(), polynomial, [r[0] for r in radius], *matrices)


def polynomials(value: Any, where: str, count: int, most: int) -> list[arb_poly]:
    """So many polynomials, each of at most so many dyadic coefficients; raises NoCertificate."""
    texts = listed([value] if isinstance(value, str) else value, where, count)
    for text in texts:
        words = text.split(" ") if isinstance(text, str) else []
        good = 0 < len(words) <= most and all(map(DYADIC.fullmatch, words))
        expect(good, where, text, f"1 to {most} dyadics with an odd mantissa, such as 0x3p-1")
    return [
        arb_poly([arb((int(m, 16), int(e))) for m, _, e in (c.partition("p") for c in text.split())]) for text in texts
    ]


def rational(text: Any) -> fmpq:
    """A rational number such as 6/5, in lowest terms; raises NoCertificate."""
    number = fmpq(*map(int, text.split("/"))) if isinstance(text, str) and RATIONAL.fullmatch(text) else fmpq(0)
    expect(str(number) == text, "a number", text, "a fraction in lowest terms")
    return number


def expect(condition: bool, where: str, found: object, expected: str) -> None:
    """Raises NoCertificate unless the condition holds."""
    if not condition:
        raise NoCertificate(f"{where}: found {str(found)[:60]!r}, expected {expected}")


def listed(value: Any, where: str, least: int, most: int = 0) -> list[Any]:
    """A list of so many; raises NoCertificate where it is none."""
    good = isinstance(value, list) and least <= len(value) <= max(least, most)
    expect(good, where, value, f"a list of {least}" + (f" to {most}" if most else ""))
    return list(value)
