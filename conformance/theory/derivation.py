# SPDX-License-Identifier: MIT
"""A design for people: the plant as it was understood, each step of the recursion, V and V', and what was proven."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import sympy as sp

from conformance.theory import expressions
from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.expressions import (
    ZERO,
    Call,
    Expression,
    Name,
    Negative,
    Number,
    Power,
    Product,
    Quotient,
    Sum,
    add,
    is_decimal,
    negative,
    number,
    power,
    precedence,
    product,
    quotient,
)
from conformance.theory.identity import POINTS, WrongStatement, prove
from conformance.theory.statements import (
    PLANT,
    REFERENCE,
    Names,
    Recursion,
    ordered_form,
    recursion_of,
)
from conformance.theory.symbolic import form_of

NARROW, WIDE = 70, 110  # characters: of equations that notes stand beside, of lines


class Equation(NamedTuple):
    """A name, what it is equal to, the lesson's section, and a few words; either of the last two may be empty."""

    name: str
    expression: Expression
    tag: str = ""
    wording: str = ""


class Part(NamedTuple):
    """A heading and the equations under it."""

    heading: str
    equations: tuple[Equation, ...]


@dataclass(frozen=True)
class Derivation:
    """The parts of a derivation in their order, the outcome of its proof, and the assumptions that were not proven.

    `partials` says for a name such as alpha1_x1 what is differentiated, and with respect to which names.
    """

    experiment: Experiment
    parts: tuple[Part, ...]
    holds: bool
    outcome: str
    assumptions: tuple[str, ...]
    partials: dict[str, tuple[str, tuple[str, ...]]]


# ------------------------------------------------------------------ the derivation


def derivation(experiment: Experiment, large: bool = False) -> Derivation:
    """Carry out the design of an experiment, and prove it as it is written.

    Raises TooLarge for more statements than anyone reads, unless `large`; DesignError for names that clash.
    """
    recursion = recursion_of(experiment, large)
    try:
        prove(experiment, recursion.statements)
        holds, outcome = True, f"holds for the equations above, in exact arithmetic, at {POINTS} random rational points"
    except WrongStatement as refuted:
        holds, outcome = False, f"is REFUTED: {refuted}"
    steps = (Part(f"Step {i}", tuple(_step(recursion, i))) for i in range(1, recursion.n + 1))
    return Derivation(
        experiment,
        (
            Part("Plant", tuple(_rows(experiment))),
            Part("In strict-feedback form", tuple(_form(experiment))),
            Part("Reference", tuple(_reference(recursion))),
            *steps,
            Part("Lyapunov function", tuple(_lyapunov(experiment, recursion.tag))),
        ),
        holds,
        outcome,
        form_of(experiment).assumptions,
        recursion.chain.origin,
    )


def _rows(e: Experiment) -> Iterator[Equation]:
    for state, row in zip(e.states, e.rows, strict=True):
        yield Equation(f"{state}_dot", row, "(2)")
    yield Equation("y", Name(e.states[0]), "(2)", "output")


def _form(e: Experiment) -> Iterator[Equation]:
    form, names = ordered_form(e), Names(e)
    for i in range(1, len(e.states) + 1):
        yield Equation(f"f{i}", form.f[i - 1], "(2)")
        yield Equation(f"g{i}", form.g[i - 1], "(2)")
        for j, phi in enumerate(form.phi[i - 1], 1):
            name = names.phi(i, j) if phi != ZERO else names.component("phi", i, j)
            yield Equation(name, phi, "(4)", "" if len(e.unknown) == 1 else f"beside {e.unknown[j - 1].name}")


def _reference(recursion: Recursion) -> Iterator[Equation]:
    return (Equation(s.name, s.expression, s.tag) for s in recursion.statements if s.section == REFERENCE)


def _step(recursion: Recursion, i: int) -> Iterator[Equation]:
    """The statements of a step, with w_i and tau_i, all of them, before what they are needed for."""
    of_step = (s for s in recursion.statements if recursion.chain.step_of.get(s.name) == i and s.section != PLANT)
    written = {s.name: Equation(s.name, *s[1:2], *s[3:5]) for s in of_step if s.name not in recursion.regressors}
    columns = {e.name: written.get(e.name, e) for e in _columns(recursion, i)}
    for name, equation in written.items():
        if name in columns or name in (f"alpha{i - 1}_dot_known", f"alpha{i}", INPUT):
            yield from columns.values()
            columns = {}
        if not _is_column(name, i):
            yield equation


def _is_column(name: str, i: int) -> bool:
    return re.fullmatch(rf"(w|tau){i}(_\d+)?", name) is not None


def _columns(recursion: Recursion, i: int) -> Iterator[Equation]:
    """w_i and tau_i as the recursion made them."""
    for kind, column in (("w", recursion.w[i]), ("tau", recursion.tau[i])):
        for j, e in enumerate(column, 1):
            name = recursion.names.component(kind, i, j)
            definition = recursion.chain.definitions.get(name, e)
            yield Equation(name, definition, *recursion.chain.notes.get(name, (recursion.tag, "")))


def _lyapunov(e: Experiment, tag: str) -> Iterator[Equation]:
    n, two = len(e.states), Fraction(2)
    for parameter in e.unknown:
        error = add(Name(parameter.estimate), negative(Name(parameter.name)))
        yield Equation(f"{parameter.name}_tilde", error, "(5)", "parameter error")
    squares = [power(Name(f"z{i}"), two) for i in range(1, n + 1)]
    halves = [quotient(square, number(2)) for square in squares]
    yield Equation("V", add(*halves, *_parameter_errors(e)), tag)
    losses = (negative(product(Name(f"k{i}"), square)) for i, square in enumerate(squares, 1))
    yield Equation("V_dot", add(*losses), tag, "so V never grows")


def _parameter_errors(e: Experiment) -> Iterator[Expression]:
    """theta_tilde' Gamma^-1 theta_tilde / 2, term by term; of a full Gamma the inverse is in numbers."""
    errors = [Name(f"{p.name}_tilde") for p in e.unknown]
    p, two = len(errors), Fraction(2)
    if not any(e.Gamma[i][j] for i in range(p) for j in range(p) if i != j):
        for i, error in enumerate(errors, 1):
            yield quotient(power(error, two), product(number(2), Name(e.gamma(i, i))))
        return
    inverse = sp.Matrix(p, p, [sp.Rational(v) for row in e.Gamma for v in row]).inv()
    for i in range(p):
        for j in range(i, p):
            entry = Fraction(int(inverse[i, j].p), int(inverse[i, j].q)) / (2 if i == j else 1)
            both = power(errors[i], two) if i == j else product(errors[i], errors[j])
            yield product(number(entry), both)


# ------------------------------------------------------------------ as text


def to_text(d: Derivation) -> str:
    """The derivation for a terminal, in the notation of the lesson: x1' for the derivative of x1."""
    lines = [d.experiment.title, d.experiment.source]
    name = spoken(d)
    for part in d.parts:
        equations = [_broken(f"{name(e.name)} = ", e.expression, name) for e in part.equations]
        width = max(
            (len(line) for lines_of_one in equations for line in lines_of_one if len(line) <= NARROW), default=0
        )
        lines += ["", part.heading, ""]
        for equation, e in zip(equations, part.equations, strict=True):
            notes = " ".join(filter(None, (e.tag, e.wording)))
            lines += [f"    {equation[0].ljust(width)}  {notes}".rstrip(), *(f"    {line}" for line in equation[1:])]
    lines += ["", "Proof", "", f"    V' + {' + '.join(_losses(d))} = 0", f"    {d.outcome}"]
    lines += ["", "Assumptions (3) not proven", ""]
    lines += [f"    {assumption}" for assumption in d.assumptions] or ["    none"]
    return "\n".join(lines) + "\n"


def _losses(d: Derivation) -> list[str]:
    return [f"k{i} z{i}^2" for i in range(1, len(d.experiment.states) + 1)]


def spoken(d: Derivation) -> Callable[[str], str]:
    """How each name of a derivation is written in the lesson's notation: r_ddot is r'', x1_dot is x1'."""

    def name(text: str) -> str:
        return text if text in d.partials else re.sub(r"_(d+)ot$", lambda found: "'" * len(found[1]), text)

    return name


def _broken(start: str, e: Expression, name: Callable[[str], str]) -> list[str]:
    """An equation in lines that are not too wide, broken before signs."""
    first, *others = re.split(r" (?=[+-] )", juxtaposed(e, name))
    lines = [start + first]
    for piece in others:
        if len(lines[-1]) + len(piece) < WIDE:
            lines[-1] += f" {piece}"
        else:
            lines.append(" " * (len(start) - 2) + piece)
    return lines


def juxtaposed(e: Expression, name: Callable[[str], str] = str) -> str:
    """The expression in one line, products without a sign, as the lesson writes them."""

    def within(part: Expression, strength: int) -> str:
        return _enclosed(part, strength, name)

    match e:
        case Number(value):
            return expressions.text(e) if is_decimal(value) else f"{value}"
        case Name(symbol):
            return name(symbol)
        case Negative(of):
            return f"-{within(of, 2)}"
        case Sum((first, *others)):
            signs = ((" - ", t.of) if isinstance(t, Negative) else (" + ", t) for t in others)
            return juxtaposed(first, name) + "".join(sign + within(t, 2) for sign, t in signs)
        case Product((first, *others)):
            return " ".join([within(first, 2), *(within(f, 3) for f in others)])
        case Quotient(over, under):
            return f"{within(over, 2)}/{within(under, 3)}"
        case Power(base, exponent):
            simple = exponent.denominator == 1 and exponent > 0
            return f"{within(base, 4)}^{exponent if simple else f'({exponent})'}"
        case Call(function, argument):
            return f"{function}({juxtaposed(argument, name)})"
    raise AssertionError(e)


def _enclosed(e: Expression, strength: int, name: Callable[[str], str]) -> str:
    text = juxtaposed(e, name)
    return text if precedence(e) >= strength else f"({text})"


# ------------------------------------------------------------------ as LaTeX and Markdown

GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu", "nu", "xi",
    "pi", "rho", "sigma", "tau", "phi", "chi", "psi", "omega", "Gamma", "Delta", "Theta", "Lambda", "Xi", "Pi", "Sigma",
    "Phi", "Psi", "Omega",
)  # fmt: skip


def to_latex(d: Derivation) -> str:
    """The derivation as the body of a LaTeX document; it needs amsmath."""
    lines = [f"\\section*{{{_escaped(d.experiment.title)}}}", _escaped(d.experiment.source)]
    for part in d.parts:
        lines += ["", f"\\subsection*{{{part.heading}}}", *_aligned(d, part)]
    lines += ["", "\\subsection*{Proof}", f"${_identity(d)}$ {_escaped(d.outcome)}.", ""]
    lines += [
        "\\subsection*{Assumptions (3) not proven}",
        *(map(_escaped, d.assumptions) if d.assumptions else ["None."]),
    ]
    return "\n".join(lines) + "\n"


def to_markdown(d: Derivation) -> str:
    """The derivation as Markdown with LaTeX between dollars."""
    lines = [f"# {d.experiment.title}", "", d.experiment.source]
    for part in d.parts:
        lines += ["", f"## {part.heading}", "", "$$", *_aligned(d, part, "aligned"), "$$"]
    lines += ["", "## Proof", "", f"${_identity(d)}$ {d.outcome}.", "", "## Assumptions (3) not proven", ""]
    lines += [f"- {assumption}" for assumption in d.assumptions] or ["None."]
    return "\n".join(lines) + "\n"


def _aligned(d: Derivation, part: Part, environment: str = "align*") -> list[str]:
    name = symbols(d)
    rows = []
    for e in part.equations:
        notes = " ".join(filter(None, (e.tag, e.wording)))
        note = f" && \\text{{{_escaped(notes)}}}" if notes else ""
        rows.append(f"{name(e.name)} &= {latex(e.expression, name)}{note}")
    return [f"\\begin{{{environment}}}", " \\\\\n".join(rows), f"\\end{{{environment}}}"]


def _identity(d: Derivation) -> str:
    losses = " + ".join(f"k_{{{i}}} z_{{{i}}}^{{2}}" for i in range(1, len(d.experiment.states) + 1))
    return f"\\dot{{V}} + {losses} = 0"


def _escaped(text: str) -> str:
    return re.sub(r"([_#&%$])", r"\\\1", text).replace("^", "\\^{}").replace("~", "\\~{}")


def symbols(d: Derivation) -> Callable[[str], str]:
    """How each name of a derivation is set in LaTeX."""

    def name(text: str) -> str:
        if text in d.partials:
            base, by = d.partials[text]
            order = f"^{{{len(by)}}}" if len(by) > 1 else ""
            variables = " ".join("\\partial " + name(v) for v in by)
            return f"\\frac{{\\partial{order} {name(base)}}}{{{variables}}}"
        return letter(text)

    return name


def letter(name: str) -> str:
    """A name in LaTeX: theta1_hat is a theta with a hat and an index, r_ddot an r with two dots."""
    marks: list[str] = []
    while found := re.fullmatch(r"(.+)_(hat|tilde|d+ot|known)", name):
        name, mark = found[1], found[2]
        marks.insert(0, mark)
    stem = re.sub(r"(_|\d).*", "", name)
    head = f"\\{stem}" if stem in GREEK else stem if len(stem) == 1 else f"\\mathrm{{{stem}}}"
    index = [part for part in name[len(stem) :].split("_") if part]
    for mark in marks:
        if mark == "known":
            index.append(mark)
        elif len(mark) <= len("ddddot") or mark == "tilde":
            head = f"\\{mark}{{{head}}}"
        else:
            head = f"{head}^{{({len(mark) - 2})}}"
    subscript = ",".join(part if part.isdecimal() or len(part) == 1 else f"\\text{{{part}}}" for part in index)
    return f"{head}_{{{subscript}}}" if subscript else head


def latex(e: Expression, name: Callable[[str], str]) -> str:
    """An expression in LaTeX, in its order."""

    def within(part: Expression, strength: int) -> str:
        text = latex(part, name)
        return text if precedence(part) >= strength or isinstance(part, Quotient) else f"\\left({text}\\right)"

    match e:
        case Number(value):
            whole = is_decimal(value)
            return expressions.text(e) if whole else f"\\frac{{{value.numerator}}}{{{value.denominator}}}"
        case Name(symbol):
            return name(symbol)
        case Negative(of):
            return f"-{within(of, 2)}"
        case Sum((first, *others)):
            signs = ((" - ", t.of) if isinstance(t, Negative) else (" + ", t) for t in others)
            return latex(first, name) + "".join(sign + within(t, 2) for sign, t in signs)
        case Product((first, *others)):
            return " \\, ".join([within(first, 2), *(within(f, 3) for f in others)])
        case Quotient(over, under):
            return f"\\frac{{{latex(over, name)}}}{{{latex(under, name)}}}"
        case Power(base, exponent):
            simple = isinstance(base, (Name, Number)) and "\\frac" not in latex(base, name)
            text = latex(base, name) if simple else f"\\left({latex(base, name)}\\right)"
            return f"{text}^{{{exponent}}}"
        case Call("sqrt", argument):
            return f"\\sqrt{{{latex(argument, name)}}}"
        case Call("atan", argument):
            return f"\\arctan\\left({latex(argument, name)}\\right)"
        case Call(function, argument):
            return f"\\{function}\\left({latex(argument, name)}\\right)"
    raise AssertionError(e)


# ------------------------------------------------------------------ as JSON


def to_json(d: Derivation) -> str:
    """The derivation as JSON; expressions are texts that `expressions.read` reads."""
    parts = [
        {
            "heading": part.heading,
            "equations": [
                {"name": e.name, "expression": expressions.text(e.expression), "section": e.tag, "wording": e.wording}
                for e in part.equations
            ],
        }
        for part in d.parts
    ]
    answer = {
        "title": d.experiment.title,
        "name": d.experiment.name,
        "source": d.experiment.source,
        "parts": parts,
        "identity": {"holds": d.holds, "outcome": d.outcome},
        "assumptions": list(d.assumptions),
    }
    return json.dumps(answer, indent=1) + "\n"


FORMATS: dict[str, Callable[[Derivation], str]] = {
    "text": to_text,
    "markdown": to_markdown,
    "latex": to_latex,
    "json": to_json,
}
