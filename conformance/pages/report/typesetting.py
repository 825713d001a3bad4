# SPDX-License-Identifier: MIT
"""Equations and type: LaTeX typeset by KaTeX, one run for the whole page, and the faces that the page embeds."""

import base64
import json
import re
import subprocess
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from string import ascii_lowercase

from markupsafe import Markup

from conformance.programs.ports import ROOT

INSTALLED = ROOT / ".venv" / "page"
MODULES = INSTALLED / "node_modules"
NODE = ROOT / ".venv" / "bin" / "node"
SCRIPT = Path(__file__).with_name("typeset.cjs")
KATEX_FACES = ("Main-Regular", "Math-Italic", "Size1-Regular", "Size2-Regular", "Size3-Regular", "Size4-Regular")
FACES = {"Serif": "source-serif-4", "Sans": "inter", "Mono": "source-code-pro"}  # the Latin of each, of every weight
FACE, CLASS = r"@font-face\{[^}]*\}", r"\.([a-zA-Z][\w-]*)"  # in a style sheet
SPOKEN_OF = ("katex", "katex-display", "katex-html", "katex-mathml")  # classes, by the page's own style and script
MARK = "\N{OBJECT REPLACEMENT CHARACTER}{}\N{OBJECT REPLACEMENT CHARACTER}"  # where an equation will stand


class Typesetter:
    """Equations that are asked for one by one, and typeset all at once."""

    def __init__(self) -> None:
        self.asked: dict[tuple[str, str], int] = {}

    def __call__(self, latex: str, display: str = "block") -> Markup:
        """A mark for an equation, "block" or "inline", which `filled` replaces."""
        return Markup(MARK.format(self.asked.setdefault((latex, display), len(self.asked))))

    def filled(self, html: str) -> str:
        """A page with the equations in the place of their marks, as HTML for the eye and MathML for readers.

        Raises ValueError where KaTeX is not installed, or refuses an equation.
        """
        styles: dict[str, str] = {}
        short = short_classes()
        equations = [with_classes(equation, styles, short) for equation in typeset(list(self.asked))]
        whole = re.sub(MARK.format(r"(\d+)"), lambda mark: equations[int(mark[1])], html)
        sheet = "".join(f".katex .katex-html .{name}{{{style}}}" for style, name in styles.items())
        return whole.replace("</head>", f"<style>{sheet}</style>\n</head>", 1)


def with_classes(equation: str, styles: dict[str, str], short: Mapping[str, str]) -> str:
    """An equation with classes in the place of its styles, short ones, and without those that no sheet has a rule for.

    A few hundred styles and names of classes stand thousands of times on a page, and are a fourth of it.
    """

    def named(found: re.Match[str]) -> str:
        classes = [short[name] for name in (found["class"] or "").split() if name in short]
        if found["style"]:
            classes.append(styles.setdefault(found["style"], f"_{len(styles)}"))
        if len(classes) == 1:
            return f"<span class={classes[0]}"  # a single word needs no quotes in HTML
        return f'<span class="{" ".join(classes)}"' if classes else "<span"

    html = equation.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")  # which HTML knows by itself
    return re.sub(r'<span(?: class="(?P<class>[^"]*)")?(?: style="(?P<style>[^"]*)")?', named, html)


def short_classes() -> dict[str, str]:
    """The page's name for each class of KaTeX's style: _a, _b, .. but for those that the page itself speaks of."""
    names = dict.fromkeys(re.findall(CLASS, re.sub(FACE, "", katex_sheet())))
    letters = (f"_{''.join(word)}" for length in (1, 2) for word in product(ascii_lowercase, repeat=length))
    return {name: name if name in SPOKEN_OF else next(letters) for name in names}


def typeset(equations: list[tuple[str, str]]) -> list[str]:
    """The HTML of equations, each LaTeX and "block" or "inline"; raises ValueError as `Typesetter.filled` does."""
    version_of("katex")
    done = subprocess.run([NODE, SCRIPT], cwd=INSTALLED, input=json.dumps(equations), capture_output=True, text=True)
    if done.returncode:
        raise ValueError(f"KaTeX: {done.stderr.strip()}")
    found: list[str] = json.loads(done.stdout)
    return found


def version_of(package: str) -> str:
    """The version of a package that the page embeds; raises ValueError where it is not installed."""
    try:
        return str(json.loads((MODULES / package / "package.json").read_text())["version"])
    except OSError:
        raise ValueError(f"{package} is not installed; type: make report") from None


def type_css() -> Markup:
    """The faces of the page and the style of equations, as one style sheet that asks for no file."""
    return Markup("\n".join([*_text_faces(), _katex_css()]))


def _text_faces() -> Iterator[str]:
    for family, package in FACES.items():
        version_of(f"@fontsource-variable/{package}")
        file = MODULES / "@fontsource-variable" / package / "files" / f"{package}-latin-wght-normal.woff2"
        yield (
            f'@font-face {{ font-family: "Page {family}"; font-style: normal; font-weight: 200 900; '
            f"font-display: swap; src: {_embedded(file)}; }}"
        )


def _katex_css() -> str:
    """KaTeX's own style, with the faces that the page's equations use, embedded."""
    faces = MODULES / "katex" / "dist" / "fonts"

    def face(found: re.Match[str]) -> str:
        name = re.search(r"fonts/KaTeX_([\w-]+)\.woff2", found[0])
        if name is None or name[1] not in KATEX_FACES:
            return ""
        return re.sub("src:[^}]*", f"src:{_embedded(faces / f'KaTeX_{name[1]}.woff2')}", found[0])

    short = short_classes()
    return re.sub(CLASS, lambda found: f".{short[found[1]]}", re.sub(FACE, face, katex_sheet()))


def katex_sheet() -> str:
    """KaTeX's own style as it comes, which asks for files of faces."""
    return (MODULES / "katex" / "dist" / "katex.min.css").read_text()


def _embedded(file: Path) -> str:
    return f'url(data:font/woff2;base64,{base64.b64encode(file.read_bytes()).decode()}) format("woff2")'
