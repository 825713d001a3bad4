# SPDX-License-Identifier: MIT
"""The symbols of an experiment: how each is typeset, what it means, and where the lesson defines it."""

import re
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from conformance.theory.derivation import Derivation, Equation, latex, symbols
from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.expressions import Expression
from conformance.theory.statements import REFERENCE, cited, parameters_of, recursion_of, statements_of

EXPONENT = r"(\\htmlData\{symbol=\w+\}\{(?:[^{}]|\{[^{}]*\})*)\}(\^\{\d+\})"


class Symbol(NamedTuple):
    """A name, its LaTeX, what it means, and the lesson's section; `main` are those that a reader meets in the text."""

    name: str
    latex: str
    meaning: str
    section: str
    main: bool


class Notation:
    """LaTeX in which every symbol knows its name, so that pointing at one finds all others."""

    def __init__(self, derivation: Derivation) -> None:
        self.lesson = symbols(derivation)

    def plain(self, name: str) -> str:
        """The symbol of a name alone; x1_start is x1(0), and the horizon T."""
        if name == "final_time":
            return "T"
        return f"{self.lesson(name.removesuffix('_start'))}(0)" if name.endswith("_start") else self.lesson(name)

    def name(self, name: str) -> str:
        """The symbol of a name; the true value of a parameter has the parameter's."""
        common = name.removesuffix("_true")
        return rf"\htmlData{{symbol={common}}}{{{self.plain(common)}}}"

    def rate(self, name: str) -> str:
        """The derivative of what a name stands for, which is linked as the name is."""
        return rf"\htmlData{{symbol={name}}}{{{self.plain(f'{name}_dot')}}}"

    def expression(self, e: Expression) -> str:
        """An expression, in its order."""
        return re.sub(EXPONENT, r"\1\2}", latex(e, self.name))

    def equation(self, name: str, e: Expression) -> str:
        """An equation that defines a name."""
        return f"{self.name(name)} = {self.expression(e)}"

    def equations(self, equations: tuple[Equation, ...]) -> list[str]:
        """The equations of a part of a derivation."""
        return [self.equation(e.name, e.expression) for e in equations]


def linker(symbols: Iterable[Symbol]) -> Callable[[str], str]:
    """A function that gives each of the symbols its name in LaTeX that was written by hand: z_1 or z_{1}, \\hat\\theta.

    Dots above and an exponent go with the symbol. What is text, or has its name already, is left.
    """
    names = {_bare(symbol.latex): symbol.name for symbol in symbols}
    bare = "|".join(re.escape(text) for text in sorted(names, key=len, reverse=True))
    pattern = re.compile(
        rf"\\text\{{[^{{}}]*\}}|(?<![\\A-Za-z^_])((?:\\d+ot ?)??({bare})(?:(?<=\d)|(?![A-Za-z]))(?:\^\d)?)"
    )

    def named(found: re.Match[str]) -> str:
        return rf"\htmlData{{symbol={names[found[2]]}}}{{{found[1]}}}" if found[2] else found[0]

    def link(latex: str) -> str:
        return pattern.sub(named, _bare(latex)) if names and r"\htmlData" not in latex else latex

    return link


def _bare(latex: str) -> str:
    """Without the braces around a digit, a letter or a Greek letter."""
    latex = re.sub(r"\{(\d|\\[a-z]+)\}|\{([A-Za-z])\}", lambda found: found[1] or f" {found[2]}", latex)
    return re.sub(r"\\partial (?=\\)", r"\\partial", latex)


def symbols_of(experiment: Experiment, notation: Notation) -> list[Symbol]:
    """Every symbol of the experiment, those of the text first in the order in which it defines them."""
    found: dict[str, Symbol] = {}
    for name, meaning, section, main in _meanings(experiment):
        found.setdefault(name, Symbol(name, notation.plain(name), meaning, section, main))
    return sorted(found.values(), key=lambda symbol: not symbol.main)


def _meanings(e: Experiment) -> Iterator[tuple[str, str, str, bool]]:
    """(name, meaning, section, whether a reader meets it in the text)."""
    for i, state in enumerate(e.states):
        yield state, "state and output" if i == 0 else "state", "(2)", True
    yield INPUT, "input: the control", "(7)", True
    for p in e.unknown:
        yield p.name, "unknown parameter", "(4)", True
        yield p.estimate, f"estimate of {p.name}", "(6)", True
        yield f"{p.name}_tilde", f"parameter error, {p.estimate} \N{MINUS SIGN} {p.name}", "(5)", True
    written = statements_of(e)
    for s in written:
        derived = "partial derivative" in s.wording or (s.section == REFERENCE and s.name != "r")
        known = s.name.endswith("_dot_known")
        meaning = f"what is known of {s.name.removesuffix('_dot_known')}'" if known else s.wording
        yield s.name, meaning, s.tag, not derived and not s.name.endswith("_dot")
    yield "V", "Lyapunov function", "(7)", True
    yield "t", "time", "(10)", False
    for name, (tag, wording) in recursion_of(e).chain.notes.items():
        yield name, wording, tag, False  # with those that are written where they are used
    for name, _, tag, wording, _ in parameters_of(e):
        yield name.removesuffix("_true"), wording, cited(tag), re.fullmatch(r"(k|gamma)\d*", name) is not None
