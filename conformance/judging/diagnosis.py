# SPDX-License-Identifier: MIT
"""The first cause of a trajectory that does not conform, in one line: a statement, the method, or the log itself.

A hypothesis is a closed loop with one statement changed. The one whose equations the log obeys names the cause: its
Hermite-Simpson defects along the log vanish. It is a guess that is checked, and no part of the verdict.
"""

import ast
import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise, permutations
from keyword import iskeyword
from types import CodeType

import numpy as np

from conformance.judging.checks import DOUBLE, Tolerance
from conformance.judging.measured import Measured
from conformance.judging.trajectory import Array, number
from conformance.places import PLANTS
from conformance.theory.experiment_file import as_written
from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.expressions import Name
from conformance.theory.expressions import text as written_as
from conformance.theory.reader import read
from conformance.theory.statements import parameters_of, statements_of
from conformance.truth.exact import exact
from conformance.truth.rounding import FUNCTIONS_OF_ARRAYS

STEPS = 1200  # of the log that are looked at, half of them the first
HUGE = 1e6  # states beyond are not looked at
RELATIVE = 1e-4  # of a step's move: what the rule itself may miss of it
EXPLAINED = 0.03  # share of the defects that a hypothesis may leave
ROUGH = (
    0.3  # share of its move by which a step may differ from the next; the rule fails beyond, as near a division by 0
)
MOST = 1000.0  # times what is allowed, a tenth of its move, that a hypothesis may leave of the median step
FLOOR = 1e-3  # of what is allowed: defects below tell nothing
FEWEST = 40  # steps
NEAR = 0.1  # of the exact solution, where the rule misses of the log what it misses of that
NATURAL = 2e-3  # how near a factor is to 0 or -1 that is said to be it
MOST_ORDERS = 720  # of columns that are tried
HIDDEN = "second_estimate"  # of a loop that has two
WINDOWS = 20
SMALL = 0.03  # share of the way, in any window, that a method may miss; a wrong term misses more

# ---- The closed loop, as the programs state it ----

Statements = tuple[tuple[str, str], ...]
NAME = re.compile(r"\b[A-Za-z]\w*\b(?!\()")
REFERENCE = re.compile(r"r(_d+ot)?")
CONTROL = re.compile(rf"{INPUT}|alpha\d\w*")
SHORTENED = re.compile(
    r"tau\d\w*|alpha\d+_(?!dot_known)\w+"
)  # names that may be taken for the first term they stand for


@dataclass(frozen=True)
class Loop:
    """The closed loop of an experiment in the statements that programs have, as names and Python expressions.

    `states` are those of the plant and behind them the estimates, `numbers` what the statements use by name.
    """

    experiment: Experiment
    states: tuple[str, ...]
    statements: Statements
    sections: Mapping[str, str]
    numbers: Mapping[str, float]

    @property
    def rates(self) -> tuple[str, ...]:
        """The names of the derivatives of the states."""
        return tuple(f"{name}_dot" for name in self.states)

    @property
    def reference(self) -> Statements:
        """The statements of r and its derivatives."""
        return tuple((name, text) for name, text in self.statements if REFERENCE.fullmatch(name))

    @property
    def whole_reference(self) -> str:
        """The names of r and its derivatives."""
        return " ".join(name for name, _ in self.reference)

    @property
    def of_reference(self) -> set[str]:
        """The constants that stand in the reference."""
        return {name for _, text in self.reference for name in NAME.findall(text)} & self.numbers.keys()

    def readable(self, text: str) -> str:
        """An expression in the listings' names."""
        primed = dict(zip(self.rates, (f"{name}'" for name in self.states), strict=True))
        return NAME.sub(lambda match: primed.get(match[0], match[0]), text).replace("**", "^")


@functools.lru_cache(maxsize=64)
def loop_of(experiment: Experiment) -> Loop:
    """The loop as it should be; raises TooLarge."""
    written = statements_of(experiment)
    numbers = {parameter.name: float(parameter.value) for parameter in parameters_of(experiment)}
    return Loop(
        experiment,
        experiment.names,
        tuple((s.name, written_as(s.expression).replace("^", "**")) for s in written),
        {s.name: s.tag for s in written},
        {name: value for name, value in numbers.items() if not re.fullmatch(r"\w+_start|final_time", name)},
    )


def exchanged(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """Gains that may be taken for each other."""
    yield from pairwise(f"k{i}" for i in range(1, len(experiment.k) + 1))


def substitutes(loop: Loop) -> dict[str, list[str]]:
    """What each name may be taken for."""
    e = loop.experiment
    found: dict[str, list[str]] = {}
    for estimate, parameter in zip(e.estimates, e.parameters, strict=True):
        found |= {estimate: [f"{parameter}_true"], f"{parameter}_true": [estimate]}
    for name in e.states:
        found[name] = [f"sin({name})", *(other for other in e.states if other != name)]
    for letter in "kz":
        names = [f"{letter}{i}" for i in range(1, len(e.k) + 1)]
        found |= {name: [other for other in names if other != name] for name in names}
    derivatives = [name for name, _ in loop.reference]
    for a, b in pairwise(derivatives):
        found.setdefault(a, []).append(b)
        found.setdefault(b, []).append(a)
    for name, text in loop.statements:
        if name.startswith("phi") and loop.sections[name] == "(4)":
            found[name] = ["1", *(state for state in e.states if state != text)]
        first = next(iter(summands(text)))
        if SHORTENED.fullmatch(name) and first != text:
            errors = [other for other in found if re.fullmatch(r"z\d+", other)]
            found[name] = [*(errors if name.startswith("tau") else ()), f"({first})"]
    return found


STAGES = (  # of classical RK4, (11)
    ("s2", "f(t + h / 2, y + h / 2 * s1)"),
    ("s3", "f(t + h / 2, y + h / 2 * s2)"),
    ("s4", "f(t + h, y + h * s3)"),
    ("next", "y + h / 6 * (s1 + 2 * s2 + 2 * s3 + s4)"),
)
METHODS = {
    "Euler's method": (("next", "y + h * s1"),),
    "the midpoint rule": (("s2", "f(t + h / 2, y + h / 2 * s1)"), ("next", "y + h * s2")),
    "Heun's method": (("s2", "f(t + h, y + h * s1)"), ("next", "y + h / 2 * (s1 + s2)")),
    "classical Runge-Kutta": STAGES,
}

Point = tuple[Array, Array]  # times (rows,) and states (m, rows)


@functools.lru_cache(maxsize=1024)
def code(some: Statements) -> CodeType:
    """The statements, to be executed in the names that they use. They are ours, never a file's."""
    return compile("\n".join(f"{name} = {text}" for name, text in some), "statements", "exec")


def rates(
    loop: Loop, program: CodeType, numbers: Mapping[str, float], t: Array, states: Array, **hidden: Array
) -> Array:
    """The derivatives of states and estimates by the statements, shape (m, rows)."""
    names: dict[str, object] = {**FUNCTIONS_OF_ARRAYS, "t": t, **numbers, **hidden}
    names |= dict(zip(loop.states, states, strict=True))
    exec(program, names)
    return np.stack([np.broadcast_to(np.asarray(names[rate], dtype=np.float64), t.shape) for rate in loop.rates])


# ---- Hypotheses ----


@dataclass(frozen=True)
class Hypothesis:
    """One change of the statements, and its words, given the number that is free in it.

    `free` names that number, to be fitted from `start`; `plain` is a usual mistake, preferred where two explain the log
    as well; `numbers` replace the experiment's.
    """

    statement: str
    some: Statements
    say: Callable[[float], str]
    free: str = ""
    start: float = 1.0
    plain: bool = False
    numbers: Mapping[str, float] = field(default_factory=dict)


def replaced(some: Statements, name: str, text: str) -> Statements:
    return tuple((each, text if each == name else old) for each, old in some)


def summands(text: str) -> list[str]:
    """The terms of the sum that an expression is, without their signs but for that of the first."""
    node, found = ast.parse(text, mode="eval").body, list[str]()
    while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
        found.insert(0, ast.unparse(node.right))
        node = node.left
    return [ast.unparse(node), *found]


def terms(text: str) -> Iterator[tuple[str, str, str, str]]:
    """Every term of the sums in an expression: what stands before, its sign, itself without, and what stands after."""
    tree = ast.parse(text, mode="eval").body
    sums = [node for node in ast.walk(tree) if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)]
    nodes: list[tuple[ast.expr, str]] = [] if tree in sums else [(tree, "+")]
    for one in sums:
        nodes.append((one.right, "-" if isinstance(one.op, ast.Sub) else "+"))
        if one.left not in sums:
            nodes.append((one.left, "+"))
    for node, sign in nodes:
        begin, end = node.col_offset, node.end_col_offset or 0
        while isinstance(node, ast.BinOp) and text[begin - 1 : begin] == "(" and text[end : end + 1] == ")":
            begin, end = begin - 1, end + 1
        if text[begin] == "-":
            sign, begin = "-", begin + 1
        yield text[:begin], sign, text[begin:end], text[end:]


def operators(text: str) -> Iterator[str]:
    """The expression with one operator exchanged, + and -, * and /, sine and cosine, or a leading sign dropped."""
    opposite = {"+": "-", "-": "+", "*": "/", "/": "*"}
    for match in re.finditer(r" ([-+*/]) |^-", text):
        if match[1]:
            yield f"{text[: match.start()]} {opposite[match[1]]} {text[match.end() :]}"
        else:
            yield text[1:]
    for match in re.finditer(r"\b(sin|cos)\(", text):
        other = "cos(" if match[1] == "sin" else "sin("
        yield f"{text[: match.start()]}{other}{text[match.end() :]}"


def numbers_changed(text: str) -> Iterator[str]:
    """The expression with one whole number more by one."""
    for match in re.finditer(r"(?<![\w.])\d+(?![\w.])", text):
        yield f"{text[: match.start()]}{int(match[0]) + 1}{text[match.end() :]}"


def hypotheses(loop: Loop) -> Iterator[Hypothesis]:
    """The mistakes that are known: terms, operators, names, constants, references."""
    right, names = loop.statements, substitutes(loop)
    known = {"sin", "t", *loop.states, *loop.numbers}
    for name, text in right:
        where = f"{loop.readable(name)} {loop.sections[name]}"
        for before, sign, bare, after in terms(text):
            some = replaced(right, name, f"{before}(factor * ({bare})){after}")
            yield Hypothesis(name, some, _say_term(loop, name, where, sign, bare), "factor")
        for changed in operators(text):
            yield Hypothesis(name, replaced(right, name, changed), _say_other(loop, name, text, changed))
        for changed in _substituted(text, known, names):
            yield Hypothesis(name, replaced(right, name, changed), _say_other(loop, name, text, changed), plain=True)
        known.add(name)
    for name, value in loop.numbers.items():
        yield Hypothesis(name, right, _say_parameter(name, value), name, value, plain=True)
    for a, b in exchanged(loop.experiment):
        values = {a: loop.numbers[b], b: loop.numbers[a]}
        yield Hypothesis(a, right, _say(f"{a} and {b} are exchanged (15)"), plain=True, numbers=values)
    for p in loop.experiment.unknown:
        by_theta = tuple(
            (n, re.sub(rf"\b{p.estimate}\b", f"{p.name}_true", t) if CONTROL.fullmatch(n) else t) for n, t in right
        )
        sentence = f"{p.name}_true, which is unknown, stands in the control for {p.estimate} (16)"
        yield Hypothesis(INPUT, by_theta, _say(sentence), plain=True)
    yield from _other_references(loop)
    apart = tuple((name, re.sub(r"\bt\b", "(t + apart)", text)) for name, text in right)
    yield Hypothesis(loop.whole_reference, apart, _say_apart, "apart", 0.0, plain=True)


def _substituted(text: str, known: set[str], names: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """The expression with one name for another, of those that are known before it."""
    for match in NAME.finditer(text):
        for other in names.get(match[0], ()):
            if set(re.findall(r"[A-Za-z]\w*", other)) <= known:
                yield text[: match.start()] + other + text[match.end() :]


def _other_references(loop: Loop) -> Iterator[Hypothesis]:
    """The derivatives of another reference, or another reference whole: of the other wave, and of other experiments."""
    others = {
        f"the reference of the experiment {other.name}": _in_numbers(loop_of(other))
        for other in known_experiments(loop.experiment)
    }
    for old, new in (("sin", "cos"), ("cos", "sin")):
        waved = read(written_as(loop.experiment.reference).replace(f"{old}(", f"{new}("))
        if waved != loop.experiment.reference:
            others[f"a {new} of this size"] = dict(loop_of(replace(loop.experiment, reference=waved)).reference)
    names = [name for name, _ in loop.reference]
    for said, texts in others.items():
        for some in (names[1:], names, *([name] for name in names)):
            changed = tuple((name, texts.get(name, "0") if name in some else text) for name, text in loop.statements)
            sentence = f"{', '.join(some)} {'is that' if len(some) == 1 else 'are those'} of {said} (17)"
            if changed != loop.statements:
                yield Hypothesis(" ".join(some), changed, _say(sentence), plain=True)


def _in_numbers(loop: Loop) -> dict[str, str]:
    """The statements of a loop's reference, its numbers in place of their names."""
    numbers = {name: f"({value!r})" for name, value in loop.numbers.items()}
    return {name: NAME.sub(lambda match: numbers.get(match[0], match[0]), text) for name, text in loop.reference}


def known_experiments(experiment: Experiment) -> list[Experiment]:
    """Other experiments of the same plant in the gallery."""
    found = [as_written(path) for path in sorted(PLANTS.glob("*.toml"))]
    return [other for other in found if other.rows == experiment.rows and other.name != experiment.name]


def _say(sentence: str) -> Callable[[float], str]:
    return lambda _: sentence


def _say_term(loop: Loop, name: str, where: str, sign: str, bare: str) -> Callable[[float], str]:
    """How far a row is off, where the term stands in it as it is; then what is wrong with the term."""
    row = row_of(loop, name)
    term = "that term" if row else f"the term {sign} {loop.readable(bare)}"

    def say(factor: float) -> str:
        what = f"{term} stands {factor:.4g} times in {where}"
        if abs(factor) < NATURAL:
            what = f"{term} is missing from {where}"
        elif abs(factor + 1) < NATURAL:
            what = f"{term} has the wrong sign in {where}"
        if not row:
            return what
        scale = (factor - 1) * (-1 if sign == "-" else 1)
        gamma = "gamma * " if name.startswith("tau") else ""
        return f"row {row} is off by {scale:+.3g} {gamma}{loop.readable(bare)}: {what}"

    return say


def row_of(loop: Loop, name: str) -> int:
    """The row, from 1, in which the terms of a statement stand as they are; 0 where there is none."""
    n = len(loop.experiment.states)
    rows = {rate: i for i, rate in enumerate(loop.rates, 1)} | {INPUT: n}
    if "gamma" in loop.numbers:
        p = len(loop.experiment.unknown)
        rows |= {f"tau{n}" + (f"_{j}" if p > 1 else ""): n + j for j in range(1, p + 1)}
    return rows.get(name, 0)


def _say_other(loop: Loop, name: str, text: str, changed: str) -> Callable[[float], str]:
    where, r = f"{loop.readable(name)} {loop.sections[name]}", loop.readable
    return _say(f"in {where}, the log obeys {r(name)} = {r(changed)}, where {r(text)} belongs")


def _say_apart(time: float) -> str:
    side = "ahead of" if time > 0 else "behind"
    return f"times and states are apart: the loop takes its reference {abs(time):.3g} s {side} the state's time (12)"


def _say_parameter(name: str, value: float) -> Callable[[float], str]:
    return lambda fitted: f"{name} is {fitted:.6g}, where the experiment has {number(value)} (15)"


# ---- Defects along the log ----


@dataclass(frozen=True)
class Steps:
    """Some steps of the log: times and states at both ends, and how much of a defect is none, (m, steps)."""

    loop: Loop
    t: Array
    h: Array
    left: Array
    right: Array
    allowed: Array
    at: Array  # their row
    own: Array  # the rule's own defect, that of the exact solution, where the log is near it

    def defect(
        self, program: CodeType, numbers: Mapping[str, float], hidden: tuple[Array, Array, Array] | None
    ) -> Array:
        """Hermite-Simpson's, over what is allowed; `hidden` is another state at the left ends, middles, right ends."""
        more = [{HIDDEN: value} for value in hidden] if hidden else [{}, {}, {}]
        a = rates(self.loop, program, numbers, self.t, self.left, **more[0])
        b = rates(self.loop, program, numbers, self.t + self.h, self.right, **more[2])
        middle = (self.left + self.right) / 2 + self.h / 8 * (a - b)
        m = rates(self.loop, program, numbers, self.t + self.h / 2, middle, **more[1])
        scaled: Array = (self.right - self.left - self.h / 6 * (a + 4 * m + b) - self.own) / self.allowed
        return np.nan_to_num(scaled, nan=1e9, posinf=1e9, neginf=-1e9).clip(-1e9, 1e9)


def chosen_steps(log: Measured, tolerance: Tolerance) -> Steps:
    """The first steps of the log and others all along it, as far as the states are of a size that can be looked at."""
    t, states = log.trajectory.t, log.trajectory.states
    sane = np.abs(states).max(axis=0) < HUGE
    end = int(np.argmin(sane)) if not sane.all() else t.size
    count = max(end - 1, 1)
    at = np.unique(np.r_[np.arange(min(STEPS // 2, count)), np.linspace(0, count - 1, STEPS // 2).astype(int)])
    h = np.diff(t)[at]
    e = np.array(tolerance)
    bound = 2 * e + float(h.max()) * log.exact.gains.field @ e
    moved = np.abs(states[:, at + 1] - states[:, at])
    nearby = np.abs(states[:, np.minimum(at + 2, t.size - 1)] - 2 * states[:, at + 1] + states[:, at]) * (
        at + 2 < t.size
    )
    smooth = (nearby <= ROUGH * moved.max(axis=0) + 1e-9 * (1 + np.abs(states[:, at]))).all(axis=0)
    rounding = 8 * DOUBLE * np.abs(states[:, at])
    allowed = np.minimum(bound[:, None], 1e-9 + RELATIVE * moved.mean(axis=1)[:, None]) + RELATIVE * moved + rounding
    if smooth.sum() >= FEWEST:
        at, h, allowed = at[smooth], h[smooth], allowed[:, smooth]
    return Steps(
        loop_of(log.exact.experiment), t[at], h, states[:, at], states[:, at + 1], allowed, at, _own_defect(log, at, h)
    )


def _own_defect(log: Measured, at: Array, h: Array) -> Array:
    """Hermite-Simpson's defect of the exact solution in these steps, 0 where the log has left it; shape (m, steps)."""
    t, off = log.trajectory.t, log.deviation
    ends = [(t[rows], log.trajectory.states[:, rows] - off[:, rows]) for rows in (at, at + 1)]
    (t_a, a), (t_b, b) = ends
    f = log.exact.first
    slope_a, slope_b = f(t_a, a), f(t_b, b)
    middle = f(t_a + h / 2, (a + b) / 2 + h / 8 * (slope_a - slope_b))
    own: Array = b - a - h / 6 * (slope_a + 4 * middle + slope_b)
    near = np.abs(off[:, at]).max(axis=0) < NEAR
    return np.where(near, own, 0.0)


def size(defect: Array) -> float:
    """The root of the mean square."""
    return float(np.sqrt(np.mean(defect**2)))


def fitted(steps: Steps, one: Hypothesis, numbers: Mapping[str, float]) -> tuple[float, float]:
    """The size of the defects that the hypothesis leaves, and the number that is free in it, by Gauss and Newton."""
    program = code(one.some)
    given = {**numbers, **one.numbers}
    if not one.free:
        return size(steps.defect(program, given, None)), 0.0
    value, best = one.start, (np.inf, one.start)
    for _ in range(6):
        here = steps.defect(program, {**given, one.free: value}, None)
        best = min(best, (size(here), value))
        shift = 1e-5 * max(abs(value), 1e-2)
        slope = (steps.defect(program, {**given, one.free: value + shift}, None) - here) / shift
        square = float(np.sum(slope**2))
        if square == 0 or not np.isfinite(square):
            break
        change = -float(np.sum(slope * here)) / square
        value += change
        if abs(change) < 1e-10 * max(abs(value), 1e-3):
            break
    return best


def by_statements(log: Measured, steps: Steps, before: float, reference_holds: bool) -> str:
    """The hypothesis whose equations the log obeys, in words; "" where there is none.

    One in another statement that they obey as well is named too. Where the column reference holds, r itself is right.
    """
    loop, found = steps.loop, []
    numbers, right = loop.numbers, dict(loop.statements)
    for one in hypotheses(loop):
        of_r = one.statement in loop.of_reference or dict(one.some)["r"] != right["r"]
        if reference_holds and of_r and one.statement != loop.whole_reference:
            continue
        left, value = fitted(steps, one, numbers)
        natural = one.plain or not one.free or min(abs(value), abs(value + 1)) < NATURAL
        found.append((max(left, 1e-6 * before, FLOOR) * (1 if natural else 1.5), value, one))
    found.sort(key=lambda each: each[0])
    left, value, best = found[0]
    given = {**numbers, **best.numbers} | ({best.free: value} if best.free else {})
    usual = float(np.median(np.abs(steps.defect(code(best.some), given, None)).max(axis=0)))
    if left > EXPLAINED * before or before < FLOOR or usual > MOST:
        return two_estimates(log, steps, numbers, before)
    others = [
        (value, one) for other, value, one in found[1:] if other <= 1.01 * left and one.statement != best.statement
    ]
    return "; or, which comes to the same, ".join([best.say(value), *(one.say(v) for v, one in others[:1])])


def two_estimates(log: Measured, steps: Steps, numbers: Mapping[str, float], before: float) -> str:
    """Whether each step of the design has an estimate of its own, the second of which is not logged, (16)."""
    loop, e = steps.loop, log.exact.experiment
    right, t, states = dict(loop.statements), log.trajectory.t, log.trajectory.states
    parts = summands(right.get("tau2", "0"))
    if len(e.states) != 2 or len(e.unknown) != 1 or len(parts) != 2:
        return ""
    (estimate,) = e.estimates
    rate = right[f"{estimate}_dot"]
    right["alpha1_dot_known"] = re.sub(rf"\b{estimate}\b", HIDDEN, right["alpha1_dot_known"])
    right["tau2"] = right["tau2"].removeprefix(parts[0]).removeprefix(" + ")
    second = code(tuple(right.items()))
    right[f"{estimate}_dot"] = re.sub(r"\btau2\b", f"({parts[0]})", rate)
    slope = rates(loop, second, numbers, t, states, **{HIDDEN: states[2]})[2]
    h = np.diff(t)
    curvature = np.gradient(slope, t)
    area = h / 2 * (slope[:-1] + slope[1:]) + h**2 / 12 * (curvature[:-1] - curvature[1:])
    whole = log.exact.setting.start[2] + np.r_[0, np.cumsum(area)]
    middle = (whole[:-1] + whole[1:]) / 2 + h / 8 * (slope[:-1] - slope[1:])
    hidden = whole[steps.at], middle[steps.at], whole[steps.at + 1]
    left = size(steps.defect(code(tuple(right.items())), numbers, hidden))
    said = (
        f"each step has an estimate of {e.parameters[0]} of its own, so that tau2 and {estimate}' lack a term each (16)"
    )
    return said if left <= EXPLAINED * before else ""


# ---- The method ----


def one_step(
    stages: Statements, f: Callable[[Array, Array], Array], t: Array, y: Array, h: Array, count: int = 1
) -> Array:
    """The states a step later, in `count` parts, from each row; shape (3, rows)."""
    program = code(stages)
    names: dict[str, object] = {"f": f}
    for part in range(count):
        names |= {"t": t + part * h / count, "y": y, "h": h / count}
        names["s1"] = f(t + part * h / count, y)
        exec(program, names)
        y = np.asarray(names["next"])
    return y


def by_method(log: Measured, steps: Steps) -> str:
    """The method by which each row follows from the one before; "" where it is none of those known."""
    f = log.exact.first
    moved = np.abs(steps.right - steps.left)
    near = 64 * DOUBLE * (1 + np.abs(steps.left) + np.abs(steps.right))
    missed = np.abs(steps.right - one_step(STAGES, f, steps.t, steps.left, steps.h, 8))

    def follows(stages: Statements, count: int) -> bool:
        gap = np.abs(steps.right - one_step(stages, f, steps.t, steps.left, steps.h, count))
        return bool(np.mean(gap <= np.maximum(near, 1e-4 * np.minimum(missed, moved))) > 0.98)

    h = float(np.median(steps.h))
    for name, stages in METHODS.items():
        for count in (1, 2, 4, 5, 10, 20):
            if follows(stages, count):
                why = "of order 1" if len(stages) == 1 else "too long for it"
                step = f"{h / count:.4g}"
                return f"each row follows from the one before by {name} with the step {step} s, which is {why} (11)"
    for place, (name, text) in enumerate(STAGES):
        for changed in (*operators(text), *numbers_changed(text)):
            if follows((*STAGES[:place], (name, changed), *STAGES[place + 1 :]), 1):
                return f"the Runge-Kutta step is wrong: the log obeys {name} = {changed}, where {text} belongs (11)"
    return held_control(log)


def held_control(log: Measured) -> str:
    """Whether u is that of a sampled instant, held, while the plant moves on."""
    t, n, name = log.trajectory.t, log.exact.setting.n, log.exact.setting.states[-1]
    if log.exact.experiment.rows[-1] != Name(INPUT):
        return ""
    states = log.trajectory.states
    rows = min(t.size - 1, 4000)
    h, u = np.diff(t)[:rows], log.exact.control(t, states)[:rows]
    moved = np.diff(states[n - 1])[:rows]
    near = 1e-6 * np.abs(moved) + 64 * DOUBLE * (1 + np.abs(states[n - 1][:rows]))
    index = np.arange(rows)
    for period in range(1, min(rows // 4, 400) + 1):
        held = index // period * period
        for late in (0, period):
            of = np.maximum(held - late, 0)
            if np.mean(np.abs(moved - h * u[of]) <= near) > 0.98:
                delay = " and used a sample late" if late else ""
                said = f"{name}' is constant over {period * float(np.median(h)):.4g} s: u is sampled and held{delay}"
                return f"{said}; the lesson's control is continuous, evaluate u at every stage of the method (7)"
    return ""


# ---- The log itself ----


def by_log(log: Measured, tolerance: Tolerance) -> str:
    """What is wrong with columns or rows of a solution that is right; "" where nothing is."""
    e = np.array(tolerance)[:, None]
    t, states, off = log.trajectory.t, log.trajectory.states, log.deviation
    true, names = states - off, log.exact.setting.names
    for order in islice(permutations(range(len(names))), 1, MOST_ORDERS):
        if (np.abs(states[list(order)] - true) <= e).all():
            found = ", ".join(names[i] for i in order)
            return f"the columns are exchanged: {found} stand for {', '.join(names)} (12)"
    for rows in (1, 2, 3):
        for later, earlier, said in (
            (states[:, rows:], true[:, :-rows], "late"),
            (states[:, :-rows], true[:, rows:], "early"),
        ):
            if later.size and (np.abs(later - earlier) <= e).all():
                return f"times and states are apart: each state stands {rows} row{'s' * (rows > 1)} too {said} (12)"
    beyond = (~(np.abs(off) <= e)).any(axis=0)
    share = float(np.mean(beyond))
    if 0 < share <= 0.05:
        first, last = (int(i) for i in np.flatnonzero(beyond)[[0, -1]])
        spread = (last - first + 1) / t.size
        states_off = [name for i, name in enumerate(names) if not (np.abs(off[i]) <= e[i]).all()]
        if spread <= 0.05 and last < t.size - 1 and first > 0:
            return (
                f"{', '.join(states_off)}: the rows from t = {number(t[first])} to {number(t[last])} alone are off (12)"
            )
    for i, name in enumerate(names):
        others = [j for j in range(len(names)) if j != i]
        if (np.abs(off[others]) <= e[others]).all():
            said = _one_column(log, i, name, float(tolerance[i]))
            if said:
                return said
    start = off[:, 0]
    if (np.abs(start) > e[:, 0]).any():
        true_start = log.exact.setting.start.tolist()
        wrong = [
            f"{name} starts at {number(states[i, 0])}, where {name}_start is {number(true_start[i])}"
            for i, name in enumerate(names)
            if abs(start[i]) > e[i, 0]
        ]
        return f"{', '.join(wrong)} (15)"
    return ""


def _one_column(log: Measured, i: int, name: str, tolerance: float) -> str:
    """A column that is wrong by itself: scaled, shifted, or of another experiment."""
    logged, off = log.trajectory.states[i], log.deviation[i]
    true = logged - off
    constant = float(np.mean(off))
    if np.abs(off - constant).max() <= tolerance < abs(constant):
        return f"{name} is off by {constant:.4g} in every row: the column, not its equation (12)"
    scale = float(true @ logged / (true @ true)) if true.any() else 1.0
    if np.abs(logged - scale * true).max() <= tolerance < np.abs(off).max():
        return f"{name} is {scale:.4g} times what it should be in every row: the column, not its equation (12)"
    horizon = log.exact.setting.horizon
    for other in known_experiments(log.exact.experiment):
        if float(other.horizon) >= horizon:
            states = exact(other).evaluate(np.minimum(log.trajectory.t, float(other.horizon)))
            if np.abs(logged - states[i]).max() <= 10 * tolerance:
                return f"{name} is that of another experiment, {other.name} (15)"
    return ""


# ---- The diagnosis ----


def diagnosis(log: Measured, tolerance: Tolerance, failed: Iterable[str]) -> str:
    """The first cause, in one line; "" where none of those known explains what failed, claims of `checks`."""
    claims, e = set(failed), log.exact.experiment
    if not claims or any(map(iskeyword, (*e.states, *e.parameters, *dict(e.constants)))):
        return ""
    with np.errstate(all="ignore"):
        return _first_cause(log, tolerance, claims)


def _first_cause(log: Measured, tolerance: Tolerance, claims: set[str]) -> str:
    steps = chosen_steps(log, tolerance)
    right, numbers = code(steps.loop.statements), steps.loop.numbers
    before = size(steps.defect(right, numbers, None))
    said = by_log(log, tolerance)
    if said:
        return said
    if claims == {"reference-is-that-of-the-experiment"}:
        return "the column reference is not r(t), though the states are those of r: the column, not the control (12)"
    if claims == {"rows-are-close-enough"}:
        return "the rows are too far apart to be judged between them: log at least every 0.02 s (12)"
    said = by_method(log, steps)
    if said:
        return said
    said = by_statements(log, steps, before, "reference-is-that-of-the-experiment" not in claims)
    if said:
        return said
    lag = _lag(log, tolerance)
    if lag:
        return lag
    return small_defects(log, steps, right, numbers)


def _lag(log: Measured, tolerance: Tolerance) -> str:
    """Whether every state is late or early by the same time."""
    slope, off = log.exact.first(log.trajectory.t, log.trajectory.states - log.deviation), log.deviation
    lag = -float(np.sum(slope * off) / np.sum(slope**2))
    if np.abs(off + lag * slope).max() <= max(tolerance) < np.abs(off).max():
        return f"the states are {'late' if lag > 0 else 'early'} by {abs(lag):.3g} s: the times, not the equations (11)"
    return ""


def small_defects(log: Measured, steps: Steps, right: CodeType, numbers: Mapping[str, float]) -> str:
    """Where the defects are small against every step's move: the method, its step or its tolerance."""
    defect = steps.defect(right, numbers, None) * steps.allowed
    moved = np.abs(steps.right - steps.left).max(axis=0)
    parts = [part for part in np.array_split(np.arange(steps.h.size), WINDOWS) if part.size]
    shares = [np.abs(defect[:, part].sum(axis=1)).max() / max(float(moved[part].sum()), DOUBLE) for part in parts]
    share = float(max(shares))
    if not share < SMALL:
        return ""
    second = steps.h / 2 * log.exact.second(steps.t + steps.h / 2, (steps.left + steps.right) / 2)
    step = -float(np.sum(defect * second) / np.sum(second**2))
    if size(defect + step * second) < 0.3 * size(defect):
        return f"the method is of order 1, as Euler's, with a step of about {abs(step):.2g} s: no term is wrong (11)"
    return (
        f"the method, its step or its tolerance (11): the defects are small, {share:.1g} of the way, and no term "
        "explains them; shorten the step, or tighten the tolerance: a solver's default is too loose"
    )
