# SPDX-License-Identifier: MIT
"""The programs' code as HTML: one element per line, in the language's colours, light and dark."""

import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice

from markupsafe import Markup
from pygments import lex
from pygments.lexer import Lexer
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.styles import get_style_by_name
from pygments.token import STANDARD_TYPES, Token
from pygments.util import ClassNotFound

from conformance.programs.ports import Port
from conformance.programs.sources import cut

LANGUAGES = {".m": "matlab", ".nb": "wolfram"}  # where the name does not say which
NO_NAMES: Mapping[str, str] = {}
PLAIN = ("", "err", "n", "o", "p", "w", "nn", "nv")  # kinds of tokens that need no colour


def highlighted(port: Port, names: Mapping[str, str] = NO_NAMES) -> dict[str, Markup]:
    """The code of each step as HTML, one element per line; a port that is not cut into the steps has none.

    `names` are as those of `highlighted_lines`.
    """
    try:
        steps = cut(port)
    except ValueError:
        return {}
    lines = highlighted_lines("".join(steps.values()), port.source, names)
    return {key: listing(text, islice(lines, text.count("\n"))) for key, text in steps.items()}


def listing(text: str, lines: Iterable[Markup]) -> Markup:
    """Whole lines of code as a block that keeps, but does not show, its common indentation and blank lines around."""
    plain = text.splitlines()
    indents = [len(line) - len(line.lstrip()) for line in plain]
    filled = [i for i, line in enumerate(plain) if line.strip()]
    common = min((indents[i] for i in filled), default=0)
    html = Markup("").join(
        Markup('<span class="line"{}>{}\n</span>').format(_columns("indent", indents[i]), line)
        if filled and filled[0] <= i <= filled[-1]
        else Markup('<span class="blank">\n</span>')
        for i, line in enumerate(lines)
    )
    return Markup('<pre class="code"{}><code>{}</code></pre>').format(_columns("common", common), html)


def _columns(name: str, count: int) -> Markup:
    """A style that tells a count of columns, if there are any."""
    return Markup(' style="--{}:{}"').format(name, count) if count else Markup("")


def highlighted_lines(text: str, file: str, names: Mapping[str, str] = NO_NAMES) -> Iterator[Markup]:
    """The lines of a text as HTML without their ends, in the colours of the language that the file's name tells.

    `names` are the common names of symbols by the program's: each is marked where it stands in code, and told where
    the program spells it otherwise.
    """
    line = Markup("")
    for kind, value in lex(text, lexer(file)):
        name = STANDARD_TYPES[next(ancestor for ancestor in reversed(kind.split()) if ancestor in STANDARD_TYPES)]
        for part in re.findall(r"[^\n]+|\n", value):
            if part == "\n":
                yield line
                line = Markup("")
            elif kind in Token.Comment:
                line += Markup('<span class="{}">{}</span>').format(name, with_sections(part))
            elif part in names:
                told = Markup(' data-symbol="{}"').format(names[part]) if names[part] != part else ""
                line += Markup("<var{}>{}</var>").format(told, part)
            elif name in PLAIN:
                line += Markup.escape(part)
            else:
                line += Markup('<span class="{}">{}</span>').format(name, part)


def lexer(file: str) -> Lexer:
    """What cuts a file's text into tokens; of an unknown language the whole text is one."""
    suffix = file[file.rfind(".") :]
    try:
        if suffix in LANGUAGES:
            return get_lexer_by_name(LANGUAGES[suffix], stripnl=False, ensurenl=False)
        return get_lexer_for_filename(file, stripnl=False, ensurenl=False)
    except ClassNotFound:
        return get_lexer_by_name("text", stripnl=False, ensurenl=False)


def with_sections(comment: str) -> Markup:
    """A comment in which the lesson's sections stand out."""
    return Markup(re.sub(r"(\(\d+\))", r"<b>\1</b>", str(Markup.escape(comment))))


def highlighting() -> str:
    """The colours of the code, each light and dark; weight and slant are the same in both."""
    return "\n".join(_rules())


def _rules() -> Iterator[str]:
    """A rule for each kind of token that has a colour of its own."""
    light, dark = (get_style_by_name(name) for name in ("default", "github-dark"))
    for kind, name in STANDARD_TYPES.items():
        style, colour = light.style_for_token(kind), dark.style_for_token(kind)["color"]
        if name not in PLAIN and style["color"] and colour:
            shape = "; font-weight: bold" * style["bold"] + "; font-style: italic" * style["italic"]
            yield f".code .{name} {{ color: light-dark(#{style['color']}, #{colour}){shape} }}"
