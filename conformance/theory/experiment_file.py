# SPDX-License-Identifier: MIT
"""The file that says an experiment, read, checked, and written.

    title = "Two parameters"
    name = "two_parameters"              # stem of programs and CSVs
    source = "ours"

    [plant]                              # rows in order; u is the input, the first state the output
    x1 = "x2 + theta1*x1^3"
    x2 = "u + theta2*x1*x2"

    [constants]                          # known numbers with names, if any
    [unknown]                            # true value (the plant's alone), estimate at t = 0
    theta1 = ["0.5", "0"]
    theta2 = ["0.5", "0"]

    [design]
    k = ["2", "2"]
    Gamma = [["1", "0"], ["0", "1"]]     # or one number, which stands for that number times the identity

    [experiment]
    reference = "0.5*sin(t)"             # its derivatives are taken, never typed
    start = ["0.5", "0"]
    horizon = "10"

Also: `[symbols]` (meaning of a name, or [meaning, unit]), `step` of the fixed-step programs and `tolerance` (of
each state, 1e-6 of its size where it is not said) in [experiment],
`[[fact]]`s (t, values computed independently, their source), `section = "(15)"` where the numbers are those of that
section of the lesson, and `extends = "other.toml"`, a file of the same folder from which all is taken that is not said
anew, but for title, name, section and facts. A file that is extended extends none.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn

from conformance.foreign import kind, plain
from conformance.theory import expressions, reader
from conformance.theory.experiments import (
    INPUT,
    LONGEST_NAME,
    Constant,
    Experiment,
    Fact,
    Meaning,
    Unknown,
    camel,
    refused_name,
    without_accents,
)
from conformance.theory.expressions import (
    FUNCTIONS,
    Expression,
    Name,
    decimal,
    is_decimal,
    walk,
)
from conformance.theory.faults import DesignError, Place, Span, TomlFile, read_toml
from conformance.theory.numbers import double, exact_value
from conformance.theory.reader import Unreadable

MOST_STATES, MOST_UNKNOWN, MOST_CONSTANTS, MOST_FACTS = 8, 10, 30, 100
LONGEST_TEXT = 500  # characters

HEAD = ("title", "name", "source")
SECTION = re.compile(r"\([1-9]\d?\)", re.ASCII)
TABLES: Mapping[str, tuple[str, ...] | None] = {  # the keys of each; None where the file names them
    "plant": None,
    "constants": None,
    "unknown": None,
    "design": ("k", "Gamma"),
    "experiment": ("reference", "start", "horizon", "step", "tolerance"),
    "symbols": None,
}
OPTIONAL = ("constants", "unknown", "symbols")
FILE_NAME = re.compile(r"[\w-]+\.toml", re.ASCII)
STEM = re.compile(r"[A-Za-z]\w*", re.ASCII)
IN_COMMENTS = re.compile(r"[ !&'()+,./0-9:;<=>?@A-Z\[\]^_a-z|~-]*")


def read_experiment(path: Path) -> Experiment:
    """Read an experiment file, and make sure that it can be designed: the plant is in strict-feedback form, (2) to (4),
    the gains are positive, (6), and the reference is smooth and bounded, (3).

    Raises FileFault, with every fault shown at its place. Nothing in the file is executed.
    """
    from conformance.theory.admission import admit  # which needs SymPy

    reading = Reading(path)
    admit(reading)
    return reading.experiment


def as_written(path: Path) -> Experiment:
    """The experiment of a file that is known to be admitted; raises FileFault for what cannot be read."""
    return Reading(path).experiment


def _extended(file: TomlFile) -> Iterator[TomlFile]:
    if "extends" not in file.data:
        return
    name, span = file.data["extends"], file.span(("extends",))
    if name == file.path.name:
        file.refuse(span, "a file cannot extend itself", "name the file that this one extends")
    if not isinstance(name, str) or not FILE_NAME.fullmatch(name):
        file.refuse(span, f"found {kind(name)}, expected the name of a file in this folder", 'such as "wing_rock.toml"')
    other = file.path.parent / name
    if not other.is_file():
        file.refuse(span, f"there is no file {plain(name)} in this folder", "name the file that this one extends")
    base = read_toml(other)
    if "extends" in base.data:
        sentence = f"{plain(name)} extends another file itself, and one step is all there is"
        file.refuse(span, sentence, f"extend {kind(base.data['extends'])} instead")
    yield base


class Reading:
    """A file and the one that it extends, read as one: what the first does not say, the second does."""

    def __init__(self, path: Path) -> None:
        file = read_toml(path)
        self.files = [file, *_extended(file)]
        self.experiment = self.whole()

    # -------------------------------------------------------------- values and their places

    def holder(self, *place: str) -> TomlFile | None:
        """The file that says the value at a place."""
        for file in self.files:
            data: Any = file.data
            for key in place:
                data = data[key] if isinstance(data, dict) and key in data else None
            if data is not None:
                return file
        return None

    def value(self, *place: str) -> Any:
        """The value at a place; raises FileFault if no file says it."""
        file = self.holder(*place)
        if file is None:
            *table, key = place
            where = f"[{table[0]}]" if table else "the head of the file"
            at = next((f for f in self.files if tuple(table) in f.places), self.files[0])
            at.refuse(
                at.span(tuple(table)) if table else (0, 1), f"{key} is missing in {where}", f"write {key} = .. there"
            )
        data: Any = file.data
        for key in place:
            data = data[key]
        return data

    def refuse(self, place: Place, sentence: str, remedy: str, key: bool = False) -> NoReturn:
        """Raise FileFault at a value, or at its key."""
        depth = len(place)
        file = None
        while depth and file is None:
            file = self.holder(*place[: min(depth, 2)])
            depth -= 1
        file = file or self.files[0]
        file.refuse(file.span(("", *place)) if key else file.span(place), sentence, remedy)

    def table(self, name: str) -> dict[str, Any]:
        """The table of that name, its keys in the order of the file that is extended, then of the other."""
        merged: dict[str, Any] = {}
        files = self.files[:1] if name == "plant" and "plant" in self.files[0].data else tuple(reversed(self.files))
        for file in files:
            table = file.data.get(name, {})
            if not isinstance(table, dict):
                file.refuse(
                    file.span((name,)), f"found {kind(table)}, expected a table", f"write [{name}] on its own line"
                )
            merged |= table
        return merged

    # -------------------------------------------------------------- the parts of an experiment

    def whole(self) -> Experiment:
        """The experiment, each part checked by itself."""
        for file in self.files:
            self.check_keys(file)
        title, name, source = (self.text(key, key != "source") for key in HEAD)
        if not STEM.fullmatch(name) or len(name) > 2 * LONGEST_NAME:
            self.refuse(
                ("name",), f"{plain(name, 40)} is no stem of files in every language", "use letters, digits and _"
            )
        states, unknown, constants = self.names("plant"), self.names("unknown"), self.names("constants")
        self.check_names([*states, *unknown, *constants])
        known = [*(name for _, name in constants)]
        n, p = len(states), len(unknown)
        in_rows = [*(name for _, name in (*states, *unknown, *constants)), INPUT]
        rows = tuple(self.expression(("plant", state), in_rows, "a row") for _, state in states)
        reference = self.expression(("experiment", "reference"), ["t", *known], "the reference")
        experiment = Experiment(
            title,
            name,
            source,
            tuple(state for _, state in states),
            rows,
            tuple(Constant(key, self.number("constants", key)) for key in known),
            tuple(Unknown(key, *self.numbers(2, "unknown", key)) for _, key in unknown),
            self.gains(n),
            self.adaptation_gain(p),
            reference,
            self.numbers(n, "experiment", "start"),
            self.positive("experiment", "horizon"),
            step=self.positive("experiment", "step") if self.holder("experiment", "step") else None,
            tolerance=self.positive("experiment", "tolerance") if self.holder("experiment", "tolerance") else None,
            section=self.section(),
        )
        self.check_use(experiment)
        return self.described(experiment)

    def check_use(self, e: Experiment) -> None:
        """Refuse parameters and constants that nothing uses, and a step beyond the horizon."""
        in_rows = {node.name for row in e.rows for node in walk(row) if isinstance(node, Name)}
        used = in_rows | {node.name for node in walk(e.reference) if isinstance(node, Name)}
        for parameter in e.unknown:
            if parameter.name not in in_rows:
                sentence = f"{parameter.name} stands in no row, so nothing can be learnt of it"
                self.refuse(("unknown", parameter.name), sentence, "remove it, or write it in a row", key=True)
        for constant in e.constants:
            if constant.name not in used:
                sentence = f"{constant.name} stands in no row and not in the reference"
                self.refuse(("constants", constant.name), sentence, "remove it", key=True)
        if e.step is not None and e.step > e.horizon:
            self.refuse(("experiment", "step"), "the step is longer than the horizon", "write a shorter step")

    def check_keys(self, file: TomlFile) -> None:
        """Refuse what no experiment file holds."""
        for key, value in file.data.items():
            known = (*HEAD, "section", "extends", *TABLES, "fact")
            if key not in known:
                self.unknown_key(file, (key,), known)
            for inner in value if isinstance(value, dict) else ():
                allowed = TABLES.get(key)
                if allowed is not None and inner not in allowed:
                    self.unknown_key(file, (key, inner), allowed)
        for key in TABLES:
            if key not in OPTIONAL and not self.holder(key):
                file.refuse(None, f"the table [{key}] is missing", f"write [{key}], as the files in plants/ do")

    def unknown_key(self, file: TomlFile, place: Place, known: Sequence[str]) -> NoReturn:
        """Refuse a key, with the one that was perhaps meant."""
        near = difflib.get_close_matches(place[-1], known, 1)
        remedy = f"write {near[0]}" if near else f"the keys here are {', '.join(known)}"
        file.refuse(
            file.span(("", *place)) or file.span(place), f"the key {plain(place[-1], 40)} means nothing here", remedy
        )

    def text(self, key: str, own: bool) -> str:
        """A text of the head; title and name are the file's own. Programs hold the source without its accents."""
        if own and key not in self.files[0].data:
            self.files[0].refuse((0, 1), f"{key} is missing in the head of the file", f'write {key} = ".."')
        value = self.value(key)
        self.plain_text(without_accents(value) if key == "source" and isinstance(value, str) else value, (key,))
        return str(value)

    def section(self) -> str:
        """The section of the lesson that lists the file's own numbers, or nothing."""
        value = self.files[0].data.get("section", "")
        if value != "" and not (isinstance(value, str) and SECTION.fullmatch(value)):
            sentence = f"found {kind(value)}, expected a section of the lesson in brackets"
            self.refuse(("section",), sentence, 'such as "(15)"; leave it out where the numbers are not the lesson\'s')
        return str(value)

    def plain_text(self, value: Any, place: Place) -> str:
        """A text that can stand in a comment of every language."""
        if not isinstance(value, str) or not value.strip():
            self.refuse(place, f"found {kind(value)}, expected a text", "write a line of text in quotes")
        wrong = IN_COMMENTS.match(value)
        end = wrong.end() if wrong else 0
        if end < len(value):
            what = value[end] if value[end].isprintable() else f"U+{ord(value[end]):04X}"
            sentence = f"the character {what} may not stand in a text, which goes to comments of six languages"
            file = self.holder(*place[:2]) or self.files[0]
            start, stop = file.span(place) or (0, 1)
            at = (start + end, start + end + 1) if start + end < stop else (start, stop)
            file.refuse(at, sentence, "write letters, digits and common punctuation")
        if len(value) > LONGEST_TEXT:
            self.refuse(place, f"a text of more than {LONGEST_TEXT} characters", "write a shorter one")
        return value

    def names(self, table: str) -> list[tuple[str, str]]:
        """The pairs (table, name) of what a table declares."""
        found = [(table, name) for name in self.table(table)]
        most = {"plant": MOST_STATES, "unknown": MOST_UNKNOWN}.get(table, MOST_CONSTANTS)
        if table == "plant" and not found:
            self.refuse((table,), "the plant has no rows", 'write one per state, such as x = "u"')
        if len(found) > most:
            self.refuse(
                found[most], f"[{table}] holds {len(found)}, and {most} is the most", "leave some out", key=True
            )
        return found

    def check_names(self, places: Sequence[tuple[str, str]]) -> None:
        """Refuse names that are none, are the design's, or are used twice."""
        spelled: dict[str, str] = {}
        for place in places:
            name = place[1]
            if why := refused_name(name):
                self.refuse(place, why, "choose another name", key=True)
            if name in spelled.values():
                self.refuse(place, f"the name {name} is used twice", "choose another name for one of the two", key=True)
            if camel(name) in spelled:
                sentence = f"{name} and {spelled[camel(name)]} are both {camel(name)} in camel case"
                self.refuse(place, sentence, "choose another name for one of the two", key=True)
            spelled[camel(name)] = name

    def expression(self, place: Place, known: Sequence[str], what: str) -> Expression:
        """The expression at a place, in the known names alone."""
        source = self.value(*place)
        if isinstance(source, int) and not isinstance(source, bool):
            source = str(source)
        if not isinstance(source, str):
            self.refuse(place, f"found {kind(source)}, expected an expression", "write it in quotes")
        try:
            e = reader.read(source)
        except Unreadable as error:
            called = source[slice(*error.span)]
            if source[error.span[1] :].startswith("(t)") and called not in FUNCTIONS:
                what = "the parameter" if called in self.table("unknown") else "the signal"
                sentence = f"{what} {called} varies with time, and only constants can be unknown (4)"
                self.refuse_within(place, error.span, sentence, "leave it out, or model it by states of its own")
            self.refuse_within(place, error.span, error.sentence, error.remedy)
        for node in walk(e):
            if isinstance(node, Name) and node.name not in known:
                self.unknown_name(place, node, known, what)
        return e

    def unknown_name(self, place: Place, node: Name, known: Sequence[str], what: str) -> NoReturn:
        """Refuse a name that is not declared, or may not stand here."""
        if node.name == "t" and what == "a row":
            row = list(self.table("plant")).index(place[1]) + 1
            sentence = (
                f"row {row} depends on the time, and f_{row}, g_{row} and phi_{row} are functions of the state alone"
            )
            self.refuse_within(place, node.span, sentence, "model the signal by states of its own, or leave it out (4)")
        declared = {*self.table("plant"), *self.table("unknown"), INPUT}
        if node.name in declared:
            sentence = f"{what} may use t and constants alone, and {node.name} is none"
            self.refuse_within(place, node.span, sentence, "write r as a function of t")
        near = difflib.get_close_matches(node.name, known, 1)
        meant = f"did you mean {near[0]}? " if near else ""
        remedy = f"{meant}names are declared in [plant], [unknown] and [constants]"
        self.refuse_within(place, node.span, f"the name {node.name} is not declared", remedy)

    def refuse_within(self, place: Place, span: Span, sentence: str, remedy: str) -> NoReturn:
        """Raise FileFault at a part of a text."""
        file = self.holder(*place) or self.files[0]
        file.refuse(self.within(file, place, span), sentence, remedy)

    def within(self, file: TomlFile, place: Place, span: Span) -> Span | None:
        """The span in the file of a span in an expression; the whole, where the file writes it with escapes."""
        whole = file.span(place)
        source = str(self.value(*place))
        if whole is None or file.content[slice(*whole)] != source:
            return whole
        return whole[0] + span[0], whole[0] + min(span[1], len(source) + 1)

    # -------------------------------------------------------------- numbers

    def exact(self, value: Any, place: Place) -> Fraction:
        """A number, exactly as it is written."""
        try:
            result = exact_value(value)
            double(result)
        except ValueError as error:
            self.refuse(place, str(error), 'write a number, such as 0.1 or "1/3"')
        return result

    def number(self, *place: str) -> Fraction:
        """The number at a place."""
        return self.exact(self.value(*place), place)

    def positive(self, *place: str) -> Fraction:
        """The positive number at a place."""
        result = self.number(*place)
        if result <= 0:
            of = "" if place[-1] == "tolerance" else " of s"
            self.refuse(
                place, f"{place[-1]} is {plain(result, 40)}, and must be positive", f"write a positive number{of}"
            )
        return result

    def numbers(self, count: int, *place: str) -> tuple[Fraction, ...]:
        """The list of so many numbers at a place."""
        values = self.value(*place)
        meaning = "the true value and the estimate at t = 0" if place[0] == "unknown" else "one number per state"
        if not isinstance(values, list):
            self.refuse(place, f"found {kind(values)}, expected a list", f"write {meaning}, in square brackets")
        if len(values) != count:
            self.refuse(
                place,
                f"{place[-1]} holds {_counted(len(values))}, and {count} are needed: {meaning}",
                f"write {meaning}",
            )
        return tuple(self.exact(value, (*place, str(i))) for i, value in enumerate(values))

    def gains(self, n: int) -> tuple[Fraction, ...]:
        """The gains k_1 .. k_n, positive (6)."""
        gains = self.numbers(n, "design", "k")
        for i, gain in enumerate(gains):
            if gain <= 0:
                sentence = f"k_{i + 1} = {plain(gain, 40)} is not positive, and z_{i + 1} would not be damped (6)"
                self.refuse(("design", "k", str(i)), sentence, "write a positive gain")
        return gains

    def adaptation_gain(self, p: int) -> tuple[tuple[Fraction, ...], ...]:
        """The adaptation gain Gamma, symmetric and positive definite (6)."""
        place = ("design", "Gamma")
        if not p and not self.holder(*place):
            return ()
        given = self.value(*place)
        if not isinstance(given, list):
            gain = self.exact(given, place)
            if gain <= 0:
                self.refuse(place, f"Gamma = {plain(gain, 40)} is not positive (6)", "write a positive adaptation gain")
            return tuple(tuple(gain if i == j else Fraction(0) for j in range(p)) for i in range(p))
        if len(given) != p or any(not isinstance(row, list) or len(row) != p for row in given):
            sentence = f"Gamma is not {p} x {p}, one row and one column per unknown parameter"
            self.refuse(place, sentence, "write a list of rows, or one number")
        rows = [[self.exact(e, (*place, str(i), str(j))) for j, e in enumerate(row)] for i, row in enumerate(given)]

        from conformance.theory.design import checked_Gamma  # which needs SymPy

        try:
            checked_Gamma(rows, p)
        except DesignError as error:
            remedy = "write a symmetric matrix with positive eigenvalues (6), such as a diagonal of positive numbers"
            self.refuse(place, plain(error, 200), remedy)
        return tuple(map(tuple, rows))

    # -------------------------------------------------------------- meanings and facts

    def described(self, e: Experiment) -> Experiment:
        """The experiment with the meanings of its symbols and its facts."""
        gains = [f"k{i}" for i in range(1, len(e.k) + 1)]
        declared = [*e.states, *(p.name for p in e.unknown), *(c.name for c in e.constants), *e.estimates]
        known = [*declared, *gains, "gamma", INPUT, "t", "r"]
        meanings = []
        for name, value in self.table("symbols").items():
            place = ("symbols", name)
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                remedy = f"did you mean {near[0]}?" if near else "describe names that the file declares"
                self.refuse(place, f"the name {plain(name, 40)} is not declared", remedy, key=True)
            texts = value if isinstance(value, list) else [value]
            if not 1 <= len(texts) <= 2:
                self.refuse(place, "expected a meaning, or a meaning and a unit", f'write {name} = ["angle", "rad"]')
            read = [self.plain_text(t, place if texts is not value else (*place, str(i))) for i, t in enumerate(texts)]
            meanings.append(Meaning(name, read[0], read[1] if len(read) == 2 else ""))
        fields = {**vars(e), "symbols": tuple(meanings), "facts": tuple(self.facts(e))}
        return Experiment(**fields)

    def facts(self, e: Experiment) -> Iterator[Fact]:
        """The facts of the file itself: those of the file that it extends are about another experiment."""
        file = self.files[0]
        facts = file.data.get("fact", [])
        if not isinstance(facts, list) or not all(isinstance(fact, dict) for fact in facts) or len(facts) > MOST_FACTS:
            file.refuse(
                file.span(("fact",)), "facts are tables of a list", f"write [[fact]] before each, {MOST_FACTS} at most"
            )
        names = [*e.states, *e.estimates, *(f"z{i}" for i in range(1, len(e.states) + 1)), "V"]
        for i, fact in enumerate(facts):
            place = ("fact", str(i))
            for key in ("t", "source"):
                if key not in fact:
                    file.refuse(file.span(place), f"the fact has no {key}", f"write {key} = ..")
            for key in fact:
                if key not in (*names, "t", "source"):
                    self.unknown_key(file, (*place, key), ("t", "source", *names))
            t = self.exact(fact["t"], (*place, "t"))
            if not 0 <= t <= e.horizon:
                span = file.span((*place, "t"))
                file.refuse(
                    span, f"the time {plain(t, 40)} is outside of [0, horizon]", "state facts of the experiment"
                )
            values = tuple((k, *self.fact_number(file, fact[k], (*place, k))) for k in fact if k in names)
            yield Fact(t, values, self.plain_text(fact["source"], (*place, "source")))

    def fact_number(self, file: TomlFile, value: Any, place: Place) -> tuple[Fraction, Fraction]:
        """A decimal, and one unit of its last digit."""
        try:
            number = exact_value(value)
            double(number)
            digits = re.fullmatch(r"[-+]?\d*\.?(\d*)(?:[eE]([-+]?\d+))?", str(value).strip())
            if not digits:
                raise ValueError(f"found {kind(value)}, expected a decimal, whose last digit says how exact it is")
        except ValueError as error:
            file.refuse(file.span(place), str(error), "write a decimal in quotes")
        return number, Fraction(10) ** (int(digits[2] or 0) - len(digits[1]))


def _counted(count: int) -> str:
    return "1 number" if count == 1 else f"{count} numbers"


# ------------------------------------------------------------------ writing a file


def to_toml(experiment: Experiment) -> str:
    """The experiment as a file that `read_experiment` reads back exactly."""
    e = experiment
    lines = [f'{key} = "{getattr(e, key)}"' for key in (*HEAD, *(["section"] if e.section else []))]
    lines += [
        "",
        "[plant]",
        *(f'{name} = "{expressions.text(row)}"' for name, row in zip(e.states, e.rows, strict=True)),
    ]
    if e.constants:
        lines += ["", "[constants]", *(f"{name} = {_quoted(value)}" for name, value in e.constants)]
    if e.unknown:
        lines += ["", "[unknown]", *(f"{name} = {_listed((true, start))}" for name, true, start in e.unknown)]
    lines += ["", "[design]", f"k = {_listed(e.k)}"]
    if e.unknown:
        lines.append(f"Gamma = [{', '.join(map(_listed, e.Gamma))}]")
    lines += ["", "[experiment]", f'reference = "{expressions.text(e.reference)}"', f"start = {_listed(e.start)}"]
    numbers = {key: getattr(e, key) for key in ("horizon", "step", "tolerance")}
    lines += [f"{key} = {_quoted(value)}" for key, value in numbers.items() if value is not None]
    if e.symbols:
        lines += [
            "",
            "[symbols]",
            *(f"{m.name} = {_texts([m.text, m.unit] if m.unit else [m.text])}" for m in e.symbols),
        ]
    for fact in e.facts:
        lines += ["", "[[fact]]", f"t = {_quoted(fact.t)}", f'source = "{fact.source}"']
        lines += [f'{name} = "{_with_unit(value, unit)}"' for name, value, unit in fact.values]
    return "\n".join(lines) + "\n"


def _quoted(number: Fraction) -> str:
    return f'"{decimal(number) if is_decimal(number) else number}"'


def _listed(numbers: Sequence[Fraction]) -> str:
    return f"[{', '.join(map(_quoted, numbers))}]"


def _texts(texts: Sequence[str]) -> str:
    return "[" + ", ".join(f'"{text}"' for text in texts) + "]"


def _with_unit(value: Fraction, unit: Fraction) -> str:
    """A decimal whose last digit counts units."""
    return f"{value / unit}e{len(str(unit.numerator)) - len(str(unit.denominator))}"
