# SPDX-License-Identifier: MIT
"""Plants in the lesson's terms, and the question whether they are in parametric strict-feedback form, (2) to (4).

    dx_i/dt = f_i(xbar_i) + g_i(xbar_i) x_{i+1} + phi_i(xbar_i)' theta      i = 1 .. n,   x_{n+1} = u

`classify` answers it row by row, with the rule that a row breaks, the term that breaks it, and a sentence saying why.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from .faults import DesignError
from .nonzero import Sign, Verdict, sign_of, singularities

TIME = sp.Symbol("t")


class Rule(Enum):
    """The rules of strict-feedback form, each named by what breaks it."""

    PURE_FEEDBACK = "the next state is not affine in its row"
    STATE_AHEAD = "a state ahead of its row"
    INPUT_EARLY = "the input before the last row"
    INPUT_NOT_AFFINE = "the input is not affine in the last row"
    NEXT_STATE_ABSENT = "the next state is absent, g_i = 0"
    NONLINEAR_IN_PARAMETERS = "not linear in the parameters"
    PARAMETER_IN_GAIN = "a parameter multiplies the next state"
    GAIN_VANISHES = "g_i is not bounded away from 0"
    GAIN_SIGN_UNKNOWN = "the sign of g_i is unknown"
    TIME_VARYING_PARAMETER = "a parameter varies with time"
    TIME_VARYING_ROW = "the row depends on time"
    UNMODELLED_SIGNAL = "a signal without a parameterised model"
    HIDDEN_STATE = "a state that is not measured"
    UNDECLARED_SYMBOL = "an undeclared symbol"
    NOT_SMOOTH = "not smooth"


@dataclass(frozen=True)
class Violation:
    """One broken rule: the row (from 1), the rule, the offending term, a sentence, and a point if one is named."""

    row: int
    rule: Rule
    term: sp.Expr
    reason: str
    point: Mapping[sp.Symbol, sp.Expr] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"row {self.row}: {self.term}: {self.reason}"


class NotStrictFeedback(DesignError):
    """A plant outside the class (2); `violations` says where and why."""

    def __init__(self, violations: tuple[Violation, ...]) -> None:
        super().__init__("; ".join(map(str, violations)))
        self.violations = violations


@dataclass(frozen=True)
class Plant:
    """A single-input plant dx_i/dt = rhs_i, as it is written down before anyone asks for its form.

    `states` (x_1 .. x_n), `input` (u) and `parameters` (the unknown theta_1 .. theta_p) are symbols, `rhs` has n rows.
    `constants` are known real numbers with a name; their SymPy assumptions, such as positive=True, are used. `hidden`
    are states, listed or not, that are not measured. A parameter written theta(t) varies with time.
    Raises DesignError for wrong lengths, repeated symbols and anything that is no SymPy expression.
    """

    states: tuple[sp.Symbol, ...]
    input: sp.Symbol
    parameters: tuple[sp.Expr, ...]
    rhs: tuple[sp.Expr, ...]
    constants: tuple[sp.Symbol, ...] = ()
    hidden: tuple[sp.Symbol, ...] = ()
    time: sp.Symbol = TIME

    def __post_init__(self) -> None:
        _freeze(self, "states", "parameters", "rhs", "constants", "hidden")
        _check_symbols(self.states, self.input, self.parameters, self.constants)
        _check_kind("hidden state", self.hidden)
        _check_length("the right-hand side", self.rhs, "row", len(self.states), "state")
        object.__setattr__(self, "rhs", tuple(expression(e, f"row {i}") for i, e in enumerate(self.rhs, 1)))

    def next_state(self, row: int) -> sp.Symbol:
        """Return x_{i+1} for row i (counted from 1), which is u in the last row."""
        return (*self.states, self.input)[row]


@dataclass(frozen=True)
class StrictFeedback:
    """A plant in strict-feedback form (2), by its f_i, g_i and phi_i.

    `f` and `g` hold n expressions, `phi` holds n rows of p expressions; row i may use x_1 .. x_i and the constants.
    `assumptions` are the sentences of (3) that could be neither proven nor refuted for this plant.
    Raises DesignError for wrong lengths, NotStrictFeedback for an entry that breaks a rule.
    """

    states: tuple[sp.Symbol, ...]
    input: sp.Symbol
    parameters: tuple[sp.Symbol, ...]
    f: tuple[sp.Expr, ...]
    g: tuple[sp.Expr, ...]
    phi: tuple[tuple[sp.Expr, ...], ...]
    constants: tuple[sp.Symbol, ...] = ()
    assumptions: tuple[str, ...] = field(init=False, default=(), compare=False)

    def __post_init__(self) -> None:
        _freeze(self, "states", "parameters", "f", "g", "phi", "constants")
        _check_symbols(self.states, self.input, self.parameters, self.constants)
        n, p = len(self.states), len(self.parameters)
        for name in ("f", "g", "phi"):
            _check_length(name, getattr(self, name), "row", n, "state")
        for i, row in enumerate(self.phi, 1):
            _check_length(f"row {i}: phi_{i}", row, "entry", p, "parameter")
        object.__setattr__(self, "f", tuple(expression(e, f"row {i}: f_{i}") for i, e in enumerate(self.f, 1)))
        object.__setattr__(self, "g", tuple(expression(e, f"row {i}: g_{i}") for i, e in enumerate(self.g, 1)))
        phi = tuple(tuple(expression(e, f"row {i}: phi_{i}") for e in row) for i, row in enumerate(self.phi, 1))
        object.__setattr__(self, "phi", phi)
        found = list(_entry_findings(self))
        violations = tuple(v for v in found if isinstance(v, Violation))
        if violations:
            raise NotStrictFeedback(violations)
        object.__setattr__(self, "assumptions", tuple(v for v in found if isinstance(v, str)))

    @property
    def rhs(self) -> tuple[sp.Expr, ...]:
        """The n right-hand sides f_i + g_i x_{i+1} + phi_i' theta, (2)."""
        rows = []
        for f, g, phi, following in zip(self.f, self.g, self.phi, (*self.states[1:], self.input), strict=True):
            rows.append(f + g * following + sum(a * b for a, b in zip(phi, self.parameters, strict=True)))
        return tuple(rows)


@dataclass(frozen=True)
class Classification:
    """The answer of `classify`: the form, or None and the violations, in the order of the rows."""

    form: StrictFeedback | None
    violations: tuple[Violation, ...]

    @property
    def accepted(self) -> bool:
        """True if the plant is in strict-feedback form."""
        return self.form is not None


def classify(plant: Plant) -> Classification:
    """Say whether a plant is in strict-feedback form: its f_i, g_i, phi_i, or each rule a row breaks; (2) to (4)."""
    violations = tuple(v for i in range(1, len(plant.states) + 1) for v in _row_violations(plant, i))
    if violations:
        return Classification(None, violations)
    try:
        return Classification(_extract(plant), ())
    except NotStrictFeedback as refused:
        return Classification(None, refused.violations)


def strict_feedback(plant: Plant) -> StrictFeedback:
    """Return the strict-feedback form of a plant; raises NotStrictFeedback if it has none; (2)."""
    result = classify(plant)
    if result.form is None:
        raise NotStrictFeedback(result.violations)
    return result.form


# ------------------------------------------------------------------ the rules, row by row


def _row_violations(plant: Plant, i: int) -> Iterator[Violation]:
    """Yield what row i breaks: first its symbols, and only if those are known, its structure."""
    foreign = list(_foreign_symbols(plant, i))
    yield from foreign
    if not foreign:
        structure = [*_order_violations(plant, i), *_affine_violations(plant, i), *_parameter_violations(plant, i)]
        yield from structure
        if structure:
            yield from (v for v in _smoothness(plant.rhs[i - 1], i, plant.states) if isinstance(v, Violation))


def _foreign_symbols(plant: Plant, i: int) -> Iterator[Violation]:
    """(4): what must not be folded into theta."""
    row, t = plant.rhs[i - 1], plant.time
    signals = {a for a in row.atoms(AppliedUndef) if t in a.free_symbols}
    names = {_name(p) for p in plant.parameters}
    for s in sorted(signals, key=str):
        if s.func.__name__ in names:
            yield Violation(i, Rule.TIME_VARYING_PARAMETER, _term(row, s), f"the parameter {s} varies with time")
        else:
            why = f"the signal {s} has no parameterised model and cannot be folded into theta"
            yield Violation(i, Rule.UNMODELLED_SIGNAL, _term(row, s), why)
    rest = row.xreplace({s: sp.Dummy() for s in signals})
    known = {*plant.states, plant.input, *plant.parameters, *plant.constants}
    for s in sorted(rest.free_symbols & row.free_symbols, key=str):
        if s in plant.hidden:
            why = f"the state {s} is not measured, and the design needs it"
            yield Violation(i, Rule.HIDDEN_STATE, _term(row, s), why)
        elif s == t and s not in known:
            why = "f_i, g_i and phi_i are functions of the state alone"
            yield Violation(i, Rule.TIME_VARYING_ROW, _term(row, s), why)
        elif s not in known:
            why = f"{s} is declared neither as state, input or parameter nor as a known constant"
            yield Violation(i, Rule.UNDECLARED_SYMBOL, _term(row, s), why)


def _order_violations(plant: Plant, i: int) -> Iterator[Violation]:
    """(2): row i looks at x_1 .. x_{i+1} alone, and u enters the last row alone."""
    row, n = plant.rhs[i - 1], len(plant.states)
    for j in range(i + 2, n + 1):
        x = plant.states[j - 1]
        if not is_zero(sp.diff(row, x)):
            why = f"row {i} may look at {_listed(plant.states[: i + 1])} alone, and {x} lies ahead"
            yield Violation(i, Rule.STATE_AHEAD, _term(row, x), why)
    if i < n and not is_zero(sp.diff(row, plant.input)):
        why = f"the input {plant.input} may enter the last row alone"
        yield Violation(i, Rule.INPUT_EARLY, _term(row, plant.input), why)


def _affine_violations(plant: Plant, i: int) -> Iterator[Violation]:
    """(2): x_{i+1} enters row i affinely, and does enter it."""
    row, following = plant.rhs[i - 1], plant.next_state(i)
    slope = sp.diff(row, following)
    last = i == len(plant.states)
    if not is_zero(sp.diff(slope, following)):
        rule = Rule.INPUT_NOT_AFFINE if last else Rule.PURE_FEEDBACK
        why = f"{following} does not enter row {i} affinely" + ("" if last else " (pure feedback)")
        yield Violation(i, rule, _term(row, following, following), why)
    elif is_zero(slope):
        why = f"{following} does not enter row {i}, so g_{i} = 0 and the row cannot be controlled through it"
        yield Violation(i, Rule.NEXT_STATE_ABSENT, row, why)


def _parameter_violations(plant: Plant, i: int) -> Iterator[Violation]:
    """(2), (4): theta enters linearly, and not together with x_{i+1}; nothing is asked of the states beside it."""
    row, following = plant.rhs[i - 1], plant.next_state(i)
    pairs = [(a, b) for k, a in enumerate(plant.parameters) for b in plant.parameters[k:]]
    for a, b in pairs:
        if not is_zero(sp.diff(row, a, b)):
            how = f"{a} enters nonlinearly" if a == b else f"{a} and {b} enter as a product"
            why = f"{how}, and the row must be linear in theta"
            yield Violation(i, Rule.NONLINEAR_IN_PARAMETERS, _term(row, a, b), why)
    slope = sp.diff(row, following)
    for a in plant.parameters:
        if not is_zero(sp.diff(slope, a)) and is_zero(sp.diff(slope, following)):
            why = f"the unknown {a} multiplies {following}, so g_{i} and its sign are not known"
            yield Violation(i, Rule.PARAMETER_IN_GAIN, _term(row, following, a), why)


def _extract(plant: Plant) -> StrictFeedback:
    """Read f_i, g_i, phi_i off rows that are affine in x_{i+1} and linear in theta."""
    f, g, phi = [], [], []
    for i, row in enumerate(plant.rhs, 1):
        origin = dict.fromkeys((plant.next_state(i), *plant.parameters), 0)
        allowed = {*origin, *plant.states[:i], *plant.constants}
        tidy = row if row.free_symbols <= allowed else sp.simplify(row)
        f.append(tidy.subs(origin))
        g.append(sp.diff(tidy, plant.next_state(i)).subs(origin))
        phi.append(tuple(sp.diff(tidy, theta).subs(origin) for theta in plant.parameters))
    return StrictFeedback(plant.states, plant.input, plant.parameters, tuple(f), tuple(g), tuple(phi), plant.constants)


# ------------------------------------------------------------------ the assumptions (3) on f_i, g_i, phi_i


def _entry_findings(form: StrictFeedback) -> Iterator[Violation | str]:
    """Yield the violations and the undecided assumptions of the entries f_i, g_i, phi_i."""
    for i, (f, g, phi) in enumerate(zip(form.f, form.g, form.phi, strict=True), 1):
        for name, entry in ((f"f_{i}", f), (f"g_{i}", g), *((f"phi_{i}", e) for e in phi)):
            for s in sorted(entry.free_symbols - {*form.states[:i], *form.constants}, key=str):
                yield _misplaced(form, i, name, entry, s)
            yield from _smoothness(entry, i, form.states[:i])
        yield from _gain_findings(form, i, g)


def _misplaced(form: StrictFeedback, i: int, name: str, entry: sp.Expr, s: sp.Symbol) -> Violation:
    if s in form.states:
        rule, what = Rule.STATE_AHEAD, "lies ahead"
    elif s in form.parameters:
        rule, what = (Rule.PARAMETER_IN_GAIN if name[0] == "g" else Rule.NONLINEAR_IN_PARAMETERS), "is unknown"
    elif s == form.input:
        rule, what = (Rule.INPUT_NOT_AFFINE if i == len(form.states) else Rule.INPUT_EARLY), "is the input"
    else:
        rule, what = Rule.UNDECLARED_SYMBOL, "is not declared"
    return Violation(i, rule, _term(entry, s), f"{name} may use {_listed(form.states[:i])} alone, and {s} {what}")


def _gain_findings(form: StrictFeedback, i: int, g: sp.Expr) -> Iterator[Violation | str]:
    """(3): every g_i is bounded away from 0, with known sign."""
    verdict = sign_of(g, form.states)
    if is_zero(g):
        why = f"g_{i} is 0, so row {i} cannot be controlled through the next state"
        yield Violation(i, Rule.NEXT_STATE_ABSENT, g, why)
    elif verdict.sign in (Sign.VANISHES, Sign.TENDS_TO_ZERO):
        how = "vanishes at" if verdict.sign is Sign.VANISHES else "tends to 0 as"
        yield Violation(i, Rule.GAIN_VANISHES, g, f"g_{i} {how} {verdict}", verdict.point)
    elif verdict.sign is Sign.UNKNOWN_SIGN:
        yield Violation(i, Rule.GAIN_SIGN_UNKNOWN, g, f"nothing says whether g_{i} is positive or negative")
    elif verdict.sign is Sign.UNDECIDED:
        yield f"g_{i} = {g} is bounded away from 0 (no zero found, none excluded)"


def _smoothness(entry: sp.Expr, i: int, states: Sequence[sp.Symbol]) -> Iterator[Violation | str]:
    """(3): f_i, g_i and phi_i are smooth."""
    for e, verdict in singularities(entry, states):
        if verdict.sign is Sign.UNDECIDED:
            yield f"{e} in row {i} is known and smooth"
        else:
            yield Violation(i, Rule.NOT_SMOOTH, e, _why_not_smooth(verdict), verdict.point)


def _why_not_smooth(verdict: Verdict) -> str:
    return f"not smooth at {verdict}" if verdict.point else "not smooth on the whole state space, or not known to be"


# ------------------------------------------------------------------ helpers


def is_zero(e: sp.Expr) -> bool:
    """Return True if an expression is identically 0, by expansion and then by simplification.

    Simplification can take minutes, so it is left to what is not seen to differ from 0 at a point.
    """
    expanded = sp.expand(e)
    if expanded.is_Number or expanded.is_Symbol:
        return bool(expanded == 0)
    return not _differs_from_0(expanded) and bool(sp.simplify(expanded) == 0)


def _differs_from_0(e: sp.Expr) -> bool:
    """True if an expression is far from 0 at a rational point; nothing is known where it is not."""
    if e.atoms(AppliedUndef):
        return False
    names = sorted(e.free_symbols, key=str)
    value = e.evalf(20, subs={s: sp.Rational(37 + 11 * k, 41 + 7 * k) for k, s in enumerate(names)})
    return bool(value.is_number and value.is_finite and abs(value) > 1e-6)


def expression(value: Any, where: str) -> sp.Expr:
    """Return an exact SymPy expression; raises DesignError, naming `where`, for a float and for anything else.

    Accepts SymPy expressions, int and Fraction; decimals are written as strings or rationals, since 1.2 is no double.
    Numbers in it must be real.
    """
    if not isinstance(value, (sp.Expr, int, Fraction)) or isinstance(value, bool):
        raise DesignError(f"{where}: {value!r} is not a SymPy expression")
    result = sp.sympify(value)
    if result.atoms(sp.Float) or result.is_finite is False or result.has(sp.nan, sp.zoo, sp.oo):
        raise DesignError(f"{where}: {value} is not exact and finite; write decimals as rationals, 6/5 for 1.2")
    if any(e.is_extended_real is False for e in sp.preorder_traversal(result) if e.is_number):
        raise DesignError(f"{where}: {value} is not real")
    return result


def _freeze(target: object, *names: str) -> None:
    """Turn the sequences of a frozen dataclass into tuples; a matrix row counts as a sequence."""
    for name in names:
        value = getattr(target, name)
        if isinstance(value, (str, sp.Basic)) or not hasattr(value, "__iter__"):
            raise DesignError(f"{name} must be a sequence, not {value!r}")
        rows = value.tolist() if isinstance(value, sp.MatrixBase) and name == "phi" else value
        frozen = tuple(tuple(v) if isinstance(v, (list, tuple, sp.MatrixBase)) else v for v in rows)
        object.__setattr__(target, name, frozen)


def _check_symbols(states: tuple[Any, ...], u: Any, parameters: tuple[Any, ...], constants: tuple[Any, ...]) -> None:
    if not states:
        raise DesignError("states: a plant has at least one state")
    for kind, symbols in (("state", states), ("input", (u,)), ("parameter", parameters), ("constant", constants)):
        _check_kind(kind, symbols)
        for s in symbols:
            if s.is_extended_real is False:
                raise DesignError(f"the {kind} {s} is not a real number")
    names = [_name(s) for s in (*states, u, *parameters, *constants)]
    repeated = [name for k, name in enumerate(names) if name in names[:k]]
    if repeated:
        raise DesignError(f"the symbol {repeated[0]} is declared twice")


def _check_kind(kind: str, symbols: tuple[Any, ...]) -> None:
    for s in symbols:
        if not isinstance(s, sp.Symbol) and not (kind == "parameter" and isinstance(s, AppliedUndef)):
            raise DesignError(f"the {kind} {s!r} is not a SymPy symbol")


def _check_length(what: str, values: Any, unit: str, wanted: int, per: str) -> None:
    if not isinstance(values, tuple):
        raise DesignError(f"{what}: {values!r} is not a sequence, one {unit} per {per}")
    if len(values) != wanted:
        raise DesignError(f"{what}: {len(values)} given, {wanted} needed, one {unit} per {per}")


def _name(symbol: sp.Expr) -> str:
    return str(symbol.func.__name__ if isinstance(symbol, AppliedUndef) else symbol.name)


def _listed(symbols: Sequence[sp.Symbol]) -> str:
    return ", ".join(map(str, symbols))


def _term(row: sp.Expr, *by: sp.Expr) -> sp.Expr:
    """Return the first term of a row whose derivative with respect to all of `by` is not 0, or else the row itself."""
    dummies = {s: sp.Dummy() for s in by}

    def depends(term: sp.Expr) -> bool:
        derivative = term.xreplace(dummies)
        for s in by:
            derivative = sp.diff(derivative, dummies[s])
        return not is_zero(derivative)

    return _first(depends, sp.Add.make_args(row)) or _first(depends, sp.Add.make_args(sp.expand(row))) or row


def _first(condition: Callable[[sp.Expr], bool], terms: Sequence[sp.Expr]) -> sp.Expr | None:
    return next((e for e in terms if condition(e)), None)
