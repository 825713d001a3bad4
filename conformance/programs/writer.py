# SPDX-License-Identifier: MIT
"""The writer: an experiment as a program of each language, by the language's template and its facts in port.toml.

A template is the program as its author wrote it, with « » around what depends on the experiment, and § before lines
that say which others are written. It sees the methods of `Program`.
"""

import functools
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import zip_longest
from pathlib import Path

from jinja2 import Environment, FunctionLoader, StrictUndefined

from conformance.atomic import write_atomically
from conformance.programs.layout import WIDTH, Line, aligned, broken, filled, listed
from conformance.programs.ports import Port
from conformance.programs.sources import statements
from conformance.programs.spelling import Spelling
from conformance.programs.step import intervals_of, step_of
from conformance.theory import expressions
from conformance.theory.derivation import letter
from conformance.theory.experiments import INPUT, Experiment, without_accents
from conformance.theory.expressions import ONE, ZERO, Expression, names_in
from conformance.theory.identity import prove
from conformance.theory.reader import read
from conformance.theory.statements import (
    CONTROLLER,
    OWN,
    PLANT,
    REFERENCE,
    REGRESSOR,
    Statement,
    ordered_form,
    parameters_of,
    statements_of,
)

HEAD_WIDTH = 100  # columns of the head
MOST_NAMES, LONGEST_LIST = 4, 30  # names that are listed one by one, and their characters
SECTION = "section n of the lesson, A. Mohammadijoo's Chapter 17, Lesson 1"  # which a tag (n) names
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")

Kind = tuple[list[str], str]


def write(experiment: Experiment, port: Port) -> str:
    """The program of an experiment in a port's language; its statements, read back from the text, are proven.

    Raises ValueError where the port has no template, or the language cannot have a program of that name.
    """
    if not port.template:
        raise ValueError(f"{port.name}: found no template, expected one to write a program by; see docs/porting.md")
    program = Program(experiment, port, statements_of(experiment))
    if experiment.name in stems_taken(port) or (port.named_by_stem and experiment.name in program.spelling.common):
        raise ValueError(
            f'name: found "{experiment.name}", which {port.language}, or the program itself, has for something else; '
            "choose another name"
        )
    text = rendered(program)
    prove(experiment, read_back(program, text))
    return text


def rendered(program: "Program") -> str:
    """The text of a program, whatever its statements say."""
    return templates(program.port).get_template(program.port.template).render(program=program, **program.given())


def read_back(program: "Program", text: str) -> list[Statement]:
    """The statements of a program, read from its text; raises ValueError where these are others than its own."""
    found = statements(program.port, text, program.spelling.common)
    tagged = {name: expression for name, _, expression in (s.partition("=") for _, _, s in found)}
    names = [s.name for s in program.statements]
    written = [name for name in tagged if name in names]
    for name, found_there in zip_longest(names, written):
        if name != found_there:
            raise ValueError(f"{program.port.name}: found {found_there or 'nothing'}, expected the statement of {name}")
    return [s._replace(expression=read(tagged[s.name])) for s in program.statements]


def write_programs(experiment: Experiment, ports: Iterable[Port], folder: Path, force: bool = False) -> list[Path]:
    """Write the programs below a folder, each with the files that it needs to run; returns the programs.

    Nothing is written, and ValueError raised, where a port has no template, or where a file is there that says another
    thing, unless `force`.
    """
    asked = tuple(ports)
    texts = {folder / path: text for port in asked for path, text in files_of(experiment, port).items()}
    edited = [path for path, text in texts.items() if path.exists() and path.read_bytes() != text.encode()]
    if edited and not force:
        raise ValueError(
            f"{edited[0]}: found a file that says another thing, nothing is written; --force overwrites it"
        )
    for path, text in texts.items():
        if not path.exists() or path in edited:
            write_atomically(path, text)
    return [folder / port.folder.name / file_name(port, experiment.name) for port in asked]


@functools.lru_cache(64)
def files_of(experiment: Experiment, port: Port) -> dict[Path, str]:
    """What a port's program of an experiment consists of, by its place: the program, then what it needs to run."""
    folder = Path(port.folder.name)
    texts = {folder / file_name(port, experiment.name): write(experiment, port)}
    lesson = port.source.removesuffix(file_name(port, ""))
    for path in (path for pattern in port.needs for path in sorted(port.folder.glob(pattern))):
        text = path.read_text(encoding="utf-8").replace(lesson, experiment.name)
        texts[folder / path.relative_to(port.folder)] = text
    return texts


def file_name(port: Port, stem: str) -> str:
    """The name of a port's program of that stem: that of its template, with the stem in the place of `program`."""
    return port.template.removesuffix(".jinja").replace("program", stem, 1)


@functools.cache
def templates(port: Port) -> Environment:
    """The environment of a port's templates."""

    def text(name: str) -> str:
        lines = (port.folder / name).read_text(encoding="utf-8")
        return re.sub(r"^ *§ (.*)$", r"«%\1%»", lines, flags=re.MULTILINE)

    return Environment(
        loader=FunctionLoader(text),
        block_start_string="«%",
        block_end_string="%»",
        comment_start_string="«#",
        comment_end_string="#»",
        variable_start_string="«",
        variable_end_string="»",
        trim_blocks=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        autoescape=False,
    )


@functools.cache
def reserved_names(port: Port) -> frozenset[str]:
    """The names that an experiment may not use as they are: those of the language, and those of the template."""
    text = (port.folder / port.template).read_text(encoding="utf-8")
    text = re.sub(r"«[^»]*»|^ *§.*", "", text, flags=re.MULTILINE)
    return frozenset([*port.reserved.split(), *re.findall(r"[A-Za-z]\w*", text)])


@functools.cache
def stems_taken(port: Port) -> frozenset[str]:
    """The stems that no program can have in this language."""
    if not port.named_by_stem:
        return frozenset(port.taken.split())
    opening, closing = (re.escape(part.strip()) for part in port.comment)
    text = (port.folder / port.template).read_text(encoding="utf-8")
    code = re.sub(rf"«[^»]*»|^ *§.*|^ *\*.*|{opening}.*?(?:{closing or '$'})", "", text, flags=re.MULTILINE)
    return frozenset([*port.taken.split(), *port.reserved.split(), *re.findall(r"[A-Za-z]\w*", code)])


class Program:
    """What a template says of an experiment; names are spelled as the language spells them."""

    def __init__(self, experiment: Experiment, port: Port, statements: Sequence[Statement]) -> None:
        self.experiment, self.port, self.statements = experiment, port, statements
        self.constants = parameters_of(experiment)
        e = experiment
        constants = [c.name for c in self.constants]
        names = [*e.states, *(c.name for c in e.constants), *e.estimates, INPUT, *constants]
        names += [s.name for s in self.statements]
        reserved = reserved_names(port)
        ours = {*constants, *(s.name for s in self.statements), *e.estimates, INPUT} - {c.name for c in e.constants}
        self.spelling = Spelling(port, constants, dict.fromkeys(names), lambda name: () if name in ours else reserved)

    def given(self) -> dict[str, object]:
        """The names of the template."""
        e, own = self.experiment, self.own
        return {
            "stem": e.name,
            "title": e.title,
            "headline": f"{e.title.partition(': ')[0]}: {self.kind}",
            "kind": self.kind[0].upper() + self.kind[1:],
            "n": len(e.states),
            "p": len(e.unknown),
            "x": own(e.states),
            "theta_hat": own(e.estimates),
            "theta_true": own(f"{q.name}_true" for q in e.unknown),
            "theta": [self.word(q.name) for q in e.unknown],
            "state": own(e.names),
            "starts": own(f"{name}_start" for name in e.names),
            "state_dot": own(f"{name}_dot" for name in e.names),
            "theta_hat_dot": own(f"{name}_dot" for name in e.estimates),
            "control": own([INPUT, *(f"{name}_dot" for name in e.estimates)]),
            "r": own(s.name for s in self.of(REFERENCE)),
            "r_is_constant": not any("t" in names_in(s.expression) for s in self.of(REFERENCE)),
            "signals": own(s.name for s in self.statements),
            "phi": own(s.name for s in self.of(REGRESSOR)),
            "phi_of": own(self.states_of_regressor()),
            "phi_in_plant": own(self.regressors_in(PLANT)),
            "unpacked": [own([s.name])[0] if s.name in self.regressors_in(PLANT) else "_" for s in self.of(REGRESSOR)],
            "phi_rows": [
                str(i) for i, row in enumerate(ordered_form(e).phi, 1) if any(a not in (ZERO, ONE) for a in row)
            ],
            "block_constants": own(c.name for c in self.constants if not re.search("_start$|^final_time$", c.name)),
            "csv_header": ["t", *e.states, *e.estimates, "reference", "tracking_error"],
            "step": self.spelling.number(step_of(e)),
            "unit_of_output": self.unit([e.states[0]]),
            "unit_of_theta": self.unit([q.name for q in e.unknown]),
            **self.helpers(),
            "x_tex": list(map(tex, e.states)),
            "theta_tex": [tex(q.name) for q in e.unknown],
            "theta_hat_tex": list(map(tex, e.estimates)),
        }

    def helpers(self) -> dict[str, Callable[..., object]]:
        """The functions that templates use: on lists of names, and on lines that are too long."""
        ends = self.port.broken[1]
        return {
            "formatted": lambda pattern, names: [pattern.format(name, i) for i, name in enumerate(names, 1)],
            "primed": lambda names: several([re.sub("_(d+)ot$", lambda m: "'" * len(m[1]), s) for s in names], " and "),
            "plural": lambda text: text if len(self.experiment.unknown) == 1 else f"{text}s",
            "several": several,
            "tex": tex,
            "listed": functools.partial(listed, ends=ends),
            "broken": lambda code, start: "\n".join(broken(code, start, ends=ends)),
            "filled": lambda opening, words, indent: "\n".join(filled(opening, words, WIDTH, indent)),
        }

    @property
    def kind(self) -> str:
        """What is done here, in words."""
        ordinal = ORDINALS[len(self.experiment.states) - 1]
        if not self.experiment.unknown:
            return f"backstepping on {'an' if ordinal == 'eighth' else 'a'} {ordinal}-order plant"
        return f"adaptive backstepping on an uncertain {ordinal}-order plant"

    # -------------------------------------------------------------- names

    def own(self, names: Iterable[str]) -> list[str]:
        """Names as the language spells them."""
        return [self.spelling.name(name) for name in names]

    def word(self, name: str) -> str:
        """A name in a text: as in the program, but for the exceptions of the language."""
        return name if name in dict(self.port.exceptions) else self.spelling.name(name)

    def of(self, *sections: str) -> list[Statement]:
        """The statements of the sections."""
        return [s for s in self.statements if s.section in sections]

    def states_of_regressor(self) -> list[str]:
        """The states that the regressors are functions of."""
        used = {name for s in self.of(REGRESSOR) for name in names_in(s.expression)}
        return [state for state in self.experiment.states if state in used]

    def regressors_in(self, section: str) -> list[str]:
        """The regressors that the statements of a section use."""
        used = {name for s in self.of(section) for name in names_in(s.expression)}
        return [s.name for s in self.of(REGRESSOR) if s.name in used]

    def unit(self, names: Sequence[str]) -> str:
        """The unit that all these have, in brackets behind a space, or nothing."""
        units = {m.name: m.unit for m in self.experiment.symbols}
        found = {units.get(name, "") for name in names}
        unit = found.pop() if len(found) == 1 else ""
        return f" ({unit})" if unit else ""

    # -------------------------------------------------------------- statements

    def block(self, sections: str, indent: int, quoted: bool = False) -> str:
        """The statements of sections, with their tags; `quoted` as texts of MATLAB, one for each line."""
        lines = []
        for s in self.of(*sections.split()):
            if s.remark:
                lines += [Line((remark,)) for remark in self.remarks(s.remark, indent + quoted, WIDTH - quoted)]
            lines.append(self.statement(s, indent + quoted, WIDTH - quoted))
        text = aligned(lines, self.port.aligned, WIDTH - quoted)
        return "\n".join(self.quoted(line, indent) for line in text) if quoted else "\n".join(text)

    @staticmethod
    def quoted(line: str, indent: int) -> str:
        within = line[indent + 1 :].replace("'", "''")
        return f"{' ' * indent}'{within}'"

    def remarks(self, text: str, indent: int, width: int) -> list[str]:
        """A sentence as comments."""
        opening, closing = self.port.comment
        start = " " * indent + opening
        words = self.spelling.prose(text).split()
        return [line + closing for line in filled(start, words, width - len(closing), start)]

    def statement(self, s: Statement, indent: int, width: int) -> Line:
        """A statement with its tag and wording behind it, in several lines if one is too long."""
        comment = self.comment(f"{s.tag} {s.wording}")
        code = " " * indent + self.port.statement.format(self.spelling.definition(s.name, s.expression))
        value = self.spelling.expression(s.expression)
        start = code.rindex(value)
        opening, ends, closing = self.port.broken
        if len(code) + 2 + len(comment) > width and opening:
            code = f"{code[:start]}{opening}{value}{closing}{code[start + len(value) :]}"
            start += len(opening)
        return Line(broken(code, start, width, 2 + len(comment), ends), comment)

    def comment(self, text: str) -> str:
        return self.port.comment[0] + self.spelling.prose(text) + self.port.comment[1]

    def stated(self, settings: Sequence[tuple[str, str, str]] = (), indent: int = 0) -> str:
        """The constants of the experiment, and the settings of the method: name, value, and a few words."""
        lines = []
        for c in self.constants:
            words = f"{c.tag} {c.wording}" + (f", {c.unit}" if c.unit else "")
            lines.append(self.constant(self.spelling.name(c.name), self.spelling.number(c.value), words, indent))
        for name, value, words in settings:
            lines.append(self.constant(name, value, words, indent))
        return "\n".join(aligned(lines, self.port.aligned))

    def constant(self, own: str, value: str, words: str, indent: int) -> Line:
        code = " " * indent + self.port.constant.format(name=own, value=value).strip()
        return Line((code,), self.comment(words))

    def intervals(self, spacing: str) -> str:
        """How many intervals of about that length (s), or of less where need be, the horizon has."""
        return str(intervals_of(self.experiment, Fraction(spacing)))

    # -------------------------------------------------------------- the head

    def head(self, start: str, labelled: str = "{:<10}", hanging: bool = True) -> str:
        """Plant, task, notation, and what the tags say, each line after `start`."""
        text = []
        parts_of = {
            "plant": self.plant(),
            "task": [f"{self.word(self.experiment.states[0])} follows r(t), and every signal stays bounded"],
            "notation": [p.replace(" ", "\0") for p in self.notation()],
            OWN: [] if self.experiment.section else without_accents(self.experiment.source).split(),
            "(n)": SECTION.split(),
        }
        for label, parts in parts_of.items():
            opening = start + labelled.format(label)
            indent = " " * len(opening) if hanging else start
            indent = start + indent[len(start) :]
            if label in ("plant", "task"):
                text += [opening + parts[0], *(indent + part for part in parts[1:])]
            elif parts:
                text += filled(opening, parts, HEAD_WIDTH, indent)
        return "\n".join(line.replace("\0", " ").rstrip() for line in text)

    def plant(self) -> list[str]:
        """The rows as a textbook writes them: in one line, or each in its own where there are three, or long ones."""
        e = self.experiment
        output = f"y = {self.word(e.states[0])}"
        if e.unknown:
            output += f";  the controller does not know {several([self.word(q.name) for q in e.unknown])}"
        rows = [f"{self.word(x)}' = {self.textbook(row)}" for x, row in zip(e.states, e.rows, strict=True)]
        whole = ",  ".join([*rows, output])
        if len(rows) < 3 and len(whole) <= HEAD_WIDTH - 10:
            return [whole]
        lines = [line for row in rows for line in broken(row + ",", row.index("=") + 2, HEAD_WIDTH - 10)]
        if len(lines[-1]) + 2 + len(output) <= HEAD_WIDTH - 10:
            return [*lines[:-1], f"{lines[-1]}  {output}"]
        return [*lines, output]

    def textbook(self, e: Expression) -> str:
        text = expressions.text(e).replace(" * ", " ")
        return re.sub(r"(?<![\w.])[A-Za-z]\w*", lambda m: self.word(m[0]) if m[0] in self.spelling.own else m[0], text)

    def notation(self) -> Iterator[str]:
        """Every kind of name that occurs, explained; each part but the last ends with a semicolon."""
        parts = [f"{several(self.own(names))}: {words}" for names, words in self.kinds()]
        yield from (f"{part}; " for part in parts[:-1])
        yield parts[-1]

    def kinds(self) -> Iterator[Kind]:
        """Names of a kind, and what they are."""
        e = self.experiment
        wording = {s.name: s.wording for s in self.of(CONTROLLER)}

        def kind(pattern: str, one: str, many: str, of: str = CONTROLLER, index: str = "step") -> Iterator[Kind]:
            found = [s.name for s in self.of(of) if re.fullmatch(pattern, s.name)]
            if found:
                indices = re.fullmatch(r"[a-z]+(\d*)_\d+", found[0])
                by = f", by {index} and parameter" if indices and indices[1] else ", by parameter" if indices else ""
                yield found, (one if len(found) == 1 else many) + by

        yield from kind(r"z\d+", "error coordinate", "error coordinates")
        yield from kind(r"alpha\d+", "virtual control", "virtual controls")
        yield from kind(r"tau\d+(_\d+)?", "tuning function", "tuning functions")
        yield from kind(r"phi\d*(_\d+)?", "regressor", "regressors", REGRESSOR, "row")
        yield from kind(r"w\d+(_\d+)?", "regressor of an error coordinate", "regressors of the error coordinates")
        yield from kind(r"f\d+", "known part of a row", "known parts of the rows")
        yield from kind(r"g\d+", "gain of a row", "gains of the rows")
        unknown = [q.name for q in e.unknown]
        for m in e.symbols:
            if m.name in (*e.states, INPUT, *unknown):
                yield [m.name], m.text + (f" ({m.unit})" if m.unit else "")
        if e.unknown:
            which = several([self.word(name) for name in unknown])
            yield list(e.estimates), f"estimate{'s' if len(unknown) > 1 else ''} of {which}"
        yield ["x_dot"], "time derivative of x"
        if any(name.endswith("_dot_known") for name in wording):
            put = ("the estimates", "the parameters")
            if len(e.unknown) == 1:
                put = (self.spelling.name(e.unknown[0].estimate), self.word(e.unknown[0].name))
            estimated = " with {} in the place of {}, as if constant".format(*put) if e.unknown else ""
            yield ["x_dot_known"], self.spelling.name("x_dot") + estimated
        if any(re.search(r" by r(_|\b)", words) for words in wording.values()):
            yield ["partial derivatives"], "with states, estimates, r and its derivatives as variables"
        for order in ("", "second ", "third "):
            found = {name: w for name, w in wording.items() if w.startswith(f"{order}partial derivative of")}
            shown = next((name for name in found if name.startswith("alpha")), next(iter(found), None))
            if shown:
                yield [shown], self.spelling.prose(found[shown].replace(" by ", " with respect to "))


def several(names: Sequence[str], last: str = ", ") -> str:
    """Names in a text: all of them where they are few, else the first and the last."""
    if len(names) > MOST_NAMES or len(", ".join(names)) > LONGEST_LIST:
        return f"{names[0]}, .., {names[-1]}"
    return last.join(filter(None, (", ".join(names[:-1]), names[-1])))


def tex(name: str) -> str:
    """A name as TeX sets it, in a figure."""
    return re.sub(r"_\{(\w)\}", r"_\1", letter(name))
