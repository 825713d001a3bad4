# SPDX-License-Identifier: MIT
"""The programs as text: their sections, their tagged statements, and the lesson's steps that these mark."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import dedent
from typing import NamedTuple

from conformance.programs.ports import Port

SECTIONS = ("Parameters", "Reference", "Controller", "Closed loop", "Integrate", "Write CSV", "Report")
NOTEBOOK_SECTION = "(* ---- {} ---- *)"


@dataclass(frozen=True)
class Step:
    """One of the steps of every program, which begins at the heading of its section; the first has none."""

    key: str
    title: str
    section: str = ""
    optional: bool = False


STEPS = (
    Step("notation", "Plant, task and notation"),
    *(Step(title.lower().replace(" ", "-"), title, title) for title in SECTIONS),
    Step("figures", "Figures", "Figures", optional=True),
)


def source(port: Port) -> str:
    """The file as it stands."""
    return port.source_path.read_text(encoding="utf-8")


def sections(port: Port) -> list[str]:
    """The titles of the sections, in order."""
    pattern = re.escape(port.section).replace(re.escape("{}"), "([A-Z][A-Za-z ]+)")
    return re.findall(f"^ *{pattern},?$", source(port), flags=re.MULTILINE)


def snake(text: str) -> str:
    """camelCase names as snake_case: theta_hat, and r_ddot for rDDot."""
    return re.sub(r"(?<=[a-z0-9])(DD|[A-Z])", lambda m: "_" + m[1].lower(), text)


def spaced(text: str) -> str:
    """A pattern for the text with any spaces or none between its words and signs, as formatters set them."""
    return r"[ \t]*".join(map(re.escape, re.findall(r"\w+|\n|[^\w\s]", text)))


def statement(port: Port, text: str, names: Mapping[str, str] | None = None) -> str:
    """A tagged statement in the words that all programs share, without spaces and what is the language's own.

    `names` are the common names by the program's; without them, names follow the rule of the language's case.
    """
    text = _defined(port, text)
    text = re.sub(r"\b(constexpr|const|static|final|double|return)\b", "", text)
    text = re.sub(r'^ *Cell\["', "", text)
    for common, own in (*port.functions, ("pow", port.power)):
        opening = own.partition("{}")[0]
        if opening:
            text = re.sub(rf"(?<![\w.]){spaced(opening)}", f"{common}(", text)
    if port.signal != "{name}":  # the notebook's functions of t
        text = re.sub(r"\[t_?\]", "", text).replace(":=", "=").replace("]", ")")
    text = " ".join(_powers(text).strip(" ;,'").split())
    if names is not None:
        text = re.sub(r"(?<![\w.])[A-Za-z]\w*", lambda m: names.get(m[0], m[0]), text)
        return re.sub(r"\s+", "", text)
    if port.constants == "upper":
        text = re.sub(r"\b[A-Z][A-Z0-9_]*\b", lambda m: m[0].lower(), text)
    text = snake(text)
    for common, own in port.exceptions:
        text = re.sub(rf"\b{own}\b", common, text)
    return re.sub(r"\s+", "", text)


def _defined(port: Port, text: str) -> str:
    """name = expression, of a constant or definition as port.toml says that they are written."""
    for pattern in (port.constant, port.definition):
        begin, middle, end = re.split(r"\{name\}|\{value\}|\{expression\}", pattern)
        found = re.fullmatch(rf"\s*{spaced(begin)}\s*(\w+)\s*{spaced(middle)}\s*(.*?)\s*{spaced(end)}\s*", text)
        if found and "=" in middle:
            return f"{found[1]} = {found[2]}"
    return text


def _powers(text: str) -> str:
    """A text with x^2 in the place of pow(x, 2), from the last on, so that each is found after those within it."""
    while (start := text.rfind("pow(")) >= 0:
        depth, comma = 0, 0
        for end in range(start + len("pow"), len(text)):
            depth += {"(": 1, ")": -1}.get(text[end], 0)
            comma = end if text[end] == "," and depth == 1 else comma
            if depth == 0:
                break
        base, exponent = text[start + len("pow(") : comma], text[comma + 1 : end].strip()
        text = f"{text[:start]}({base})^({exponent}){text[end + 1 :]}"
    return text


CONTINUED = re.compile(r"(?: \.\.\.)?'?\n *'? *(?=[-+*/] )")  # a line that goes on with an operator


def statements(port: Port, text: str, names: Mapping[str, str] | None = None) -> list[tuple[str, str, str]]:
    """(tag, wording, statement) of every tagged line of a text in the port's language, in order; see `statement`."""
    leader, end = (re.escape(part.strip()) for part in port.comment)
    pattern = rf"^(.*?) *{leader} *(\(\d+\)) (.*?){' *' + end if end else ''}(?:[\"'])?(?:, \"Input\"\],)?$"
    found = re.findall(pattern, CONTINUED.sub(" ", text), flags=re.MULTILINE)
    return [(tag, snake(wording), statement(port, text, names)) for text, tag, wording in found if text.strip(" %")]


def first_line(lines: Sequence[str], number: int) -> int:
    """Where a statement begins whose last line this is: each line but the first begins with an operator."""
    while re.match(r" *'? *[-+*/] ", lines[number]):
        number -= 1
    return number


class Tagged(NamedTuple):
    """A tagged statement as it stands in a program, without its comment: section, a few words, and the code."""

    tag: str
    wording: str
    text: str


def tagged(port: Port) -> list[Tagged]:
    """The tagged statements of a program, in order; one of several lines keeps them."""
    leader, end = (re.escape(part.strip()) for part in port.comment)
    pattern = re.compile(rf"(?P<text>.*[^ %].*?) *{leader} *(?P<tag>\(\d+\)) (?P<wording>.*?) *{end}")
    lines, found = list(map(_unquoted, code(port).splitlines())), []
    for i, line in enumerate(lines):
        if match := pattern.fullmatch(line):
            start = first_line(lines, i)
            text = dedent("\n".join([*lines[start:i], match["text"]])).rstrip()
            found.append(Tagged(match["tag"], snake(match["wording"]), text))
    return found


def _unquoted(line: str) -> str:
    """A line without the quotes that make it a text, as in the block of a Simulink model."""
    quoted = re.fullmatch(r"( *)'(.*)'", line)
    return quoted[1] + quoted[2].replace("''", "'") if quoted else line


FRAMED = ("Reference", "Controller", "Closed loop")  # the mathematical core
WORKS = re.compile(  # what computes, decides, or asks the world
    r"(?<!-)[-+*/^?](?!>)|\b(if|else|while|for|switch|match|case|min|max|f?min|f?max|clamp|abs|time|clock|now|rand\w*)\b"
    r"|\d\.\d|[<>]=? *\d"
)


def frame(port: Port) -> list[str]:
    """What stands in the sections Reference, Controller and Closed loop beside the tagged statements: its own lines.

    Comments and blank lines are left out, as are Python's docstrings; spaces are as one.
    """
    leader, end = (re.escape(part.strip()) for part in port.comment)
    if port.source_path.suffix == ".nb":
        leader, end = r"\(\*", r"\*\)"
    lines, inside = [], False
    for line in code(port).splitlines():
        title = next((t for t in SECTIONS if line.strip() in (port.section.format(t), NOTEBOOK_SECTION.format(t))), "")
        inside = title in FRAMED if title else inside
        tagged = re.search(rf"\S.*{leader} *\(\d+\) ", line)
        if not title and inside and not tagged:
            plain = " ".join(re.sub(rf"(^|(?<=[\s;,'])){leader}(?!#).*{f'?{end}' if end else '$'}", "", line).split())
            if plain and plain not in ("'", "''") and not re.fullmatch('""".*"""', plain):
                lines.append(plain)
    return lines


def code(port: Port) -> str:
    """The program as code."""
    return as_code(port, source(port))


def as_code(port: Port, text: str) -> str:
    """A source as code: the text itself; of a notebook that of its cells, what is not input as comments."""
    if port.source_path.suffix != ".nb":
        return text
    cells = re.findall(r'Cell\["((?:[^"\\]|\\.)*)", "(\w+)"\]', text)
    return "\n\n".join(_cell(re.sub(r'\\(["\\])', r"\1", content), style) for content, style in cells) + "\n"


def _cell(content: str, style: str) -> str:
    if style == "Input":
        return content
    return NOTEBOOK_SECTION.format(content) if style == "Section" else f"(* {content} *)"


def cut(port: Port) -> Mapping[str, str]:
    """The code of each step, by the step's key; joined, they are the whole of `code`.

    Raises ValueError where a step is missing, stands twice, or stands before the one it follows.
    """
    lines = code(port).splitlines(keepends=True)
    heading = NOTEBOOK_SECTION if port.source_path.suffix == ".nb" else port.section
    begins = {STEPS[0].key: 0}
    for step in STEPS[1:]:
        mark = heading.format(step.section)
        found = [i for i, line in enumerate(lines) if line.strip() == mark]
        if len(found) == 1 and found[0] > max(begins.values()):
            begins[step.key] = found[0]
        elif found or not step.optional:
            raise ValueError(f"{port.source}: found {mark!r} in lines {found}, expected it once, after the step before")
    ends = [*list(begins.values())[1:], len(lines)]
    return {key: "".join(lines[i:j]) for (key, i), j in zip(begins.items(), ends, strict=True)}
