# SPDX-License-Identifier: MIT
"""Faults of a TOML file, shown as a good compiler shows them: place, line, caret, one sentence, what to do."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

from conformance.foreign import plain, read_bytes

LARGEST = 1 << 15  # bytes of a file
WIDEST = 1000  # characters of a line
WINDOW = 120  # of them shown

Place = tuple[
    str, ...
]  # of a value: the keys that lead to it, an index of a list as its digits; of a key: "" before it
Span = tuple[int, int]  # of the text, from and up to


class DesignError(ValueError):
    """An input from which no design can be made; the message is one line that names the row and the term."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong: where (line and column from 1, 0 for the whole file), a sentence, and what to do."""

    path: str
    line: int
    column: int
    width: int
    shown: str
    sentence: str
    remedy: str

    def __str__(self) -> str:
        if not self.line:
            return f"{self.path}: {self.sentence}\n  help: {self.remedy}"
        left = max(0, self.column - WINDOW // 2) if len(self.shown) > WINDOW else 0
        shown = "".join(c if c.isprintable() else "?" for c in self.shown[left : left + WINDOW])
        number = f"{self.line:4}"
        width = max(1, min(self.width, len(shown) - (self.column - 1 - left)))
        caret = " " * (self.column - 1 - left) + "^" * width
        place = f"{self.path}:{self.line}:{self.column}"
        return f"{place}: {self.sentence}\n{number} | {shown}\n     | {caret}\n  help: {self.remedy}"


class FileFault(ValueError):
    """A file that is refused, with every fault that was found."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("\n".join(map(str, faults)))
        self.faults = tuple(faults)


@dataclass(frozen=True)
class TomlFile:
    """A TOML file with the place of each value in its text. Decimals are kept as texts, so 0.1 is no double."""

    path: Path
    content: str
    data: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def places(self) -> dict[Place, Span]:
        """The span of each table, key and value: of the text within the quotes where there are any."""
        return dict(_places(self.content))

    def fault(self, span: Span | None, sentence: str, remedy: str) -> Fault:
        """A fault at a span of the text, or of the file as a whole."""
        name = plain(self.path, 400)
        if span is None:
            return Fault(name, 0, 0, 0, "", sentence, remedy)
        start = min(span[0], len(self.content))
        line = self.content.count("\n", 0, start) + 1
        begin = self.content.rfind("\n", 0, start) + 1
        shown = self.content[begin:].partition("\n")[0].rstrip("\r")
        return Fault(name, line, start - begin + 1, span[1] - span[0], shown, sentence, remedy)

    def span(self, place: Place) -> Span | None:
        """Where a value stands, or else the key, the table, that it belongs to."""
        while place and place not in self.places:
            place = place[:-1]
        return self.places.get(place)

    def refuse(self, span: Span | None, sentence: str, remedy: str) -> NoReturn:
        """Raise FileFault at a span."""
        raise FileFault([self.fault(span, sentence, remedy)])


def read_toml(path: Path) -> TomlFile:
    """Read a small TOML file of short lines; raises FileFault for what is none, or cannot be read."""
    content = _text(path)
    file = TomlFile(path, content)
    start = 0
    for line in content.split("\n"):
        if len(line) > WIDEST:
            file.refuse((start, start + 1), f"a line of more than {WIDEST} characters", "write shorter lines")
        start += len(line) + 1
    try:
        return TomlFile(path, content, tomllib.loads(content, parse_float=str))
    except tomllib.TOMLDecodeError as error:
        what, _, _ = str(error).partition(" (at")
        remedy = "write TOML: key = value, with texts in quotes"
        file.refuse(_span_in_message(str(error), content), f"this is not TOML: {plain(what)}", remedy)
    except (ValueError, RecursionError):
        sentence = "a number of thousands of digits, a date that is none, or brackets nested thousands deep"
        file.refuse(None, sentence, "write what an experiment file holds")


def _text(path: Path) -> str:
    file = TomlFile(path, "")
    try:
        content = read_bytes(path, LARGEST)
    except ValueError as error:
        _, _, why = str(error).rpartition(": ")
        file.refuse(None, why, f"name an experiment file, in TOML, of at most {LARGEST} bytes")
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8-sig")
        file = TomlFile(path, before + content[error.start :].decode("latin-1"))
        span = len(before), len(before) + 1
        file.refuse(span, f"the byte {content[error.start]:#04x} is not UTF-8", "save the file as UTF-8")


def _span_in_message(message: str, content: str) -> Span:
    found = re.search(r"at line (\d+), column (\d+)", message)
    if not found:
        return max(0, len(content.rstrip())), len(content.rstrip()) + 1
    lines = content.split("\n")
    line, column = int(found[1]), int(found[2])
    start = sum(len(text) + 1 for text in lines[: line - 1]) + column - 1
    return start, start + 1


# ------------------------------------------------------------------ where values stand

TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+|\#[^\n]*)"
    r"|(?P<text>\"\"\"(?P<a>(?:\\.|[^\\])*?)\"\"\"|'''(?P<b>.*?)'''|\"(?P<c>(?:\\.|[^\"\\\n])*)\"|'(?P<d>[^'\n]*)')"
    r"|(?P<sign>[\[\]{},=])|(?P<bare>[^\s\[\]{},=\"'\#]+)",
    re.DOTALL,
)


def _places(content: str) -> list[tuple[Place, Span]]:
    """The places of a text that is known to be TOML; of inline tables and dotted keys only the first key."""
    found: list[tuple[Place, Span]] = []
    table: Place = ()
    repeated: dict[Place, int] = {}
    position = 0
    while token := _token(content, position):
        if token.lastgroup == "sign" and token["sign"] == "[":
            end = content.index("]", token.end())
            double = content[token.end()] == "["
            table = tuple(part.strip(" \t\"'") for part in content[token.end() + double : end].split("."))
            if double:
                repeated[table] = repeated.get(table, -1) + 1
                table = (*table, str(repeated[table]))
            found.append((table, (token.start(), end + 1 + double)))
            position = end + 1 + double
        else:
            key, span = _inner(token)
            equals = content.index("=", token.end())
            found += [((*table, key), span), (("", *table, key), span)]
            position = _value(content, equals + 1, (*table, key), found)
    return found


def _value(content: str, position: int, place: Place, found: list[tuple[Place, Span]]) -> int:
    """Note the places of a value, of the elements of a list too; returns the position behind it."""
    indices: list[int] = []
    opened: list[int] = []
    braces = 0
    while token := _token(content, position):
        position = token.end()
        sign = token["sign"]
        if sign == "[":
            indices.append(0)
            opened.append(token.start())
        elif sign == "," and indices and not braces:
            indices[-1] += 1
        elif sign == "]":
            indices.pop()
            found.append(((*place, *map(str, indices)), (opened.pop(), position)))
        elif sign in ("{", "}"):
            braces += 1 if sign == "{" else -1
        elif not sign and not braces:
            found.append(((*place, *map(str, indices)), _inner(token)[1]))
        if not indices and not braces and sign not in ("[", "{"):
            return position
    return position


def _token(content: str, position: int) -> re.Match[str] | None:
    while (token := TOKEN.match(content, position)) and token.lastgroup == "space":
        position = token.end()
    return token


def _inner(token: re.Match[str]) -> tuple[str, Span]:
    for quoted in "abcd":
        if token[quoted] is not None:
            return token[quoted], token.span(quoted)
    return token[0], token.span()
