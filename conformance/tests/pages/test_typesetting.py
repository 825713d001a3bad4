# SPDX-License-Identifier: MIT
"""Equations are typeset at once, for eye and reader, by what is installed; what cannot be set is refused."""

import re

import pytest

from conformance.pages.report import typesetting
from conformance.pages.report.typesetting import KATEX_FACES, MODULES, Typesetter, type_css, typeset
from conformance.programs.ports import ROOT
from conformance.theory.derivation import derivation, to_markdown
from conformance.theory.experiment_file import read_experiment

OTHER_FACES = r"\b(mathbf|boldsymbol|textbf|mathit|textit|mathcal|mathfrak|mathsf|textsf|mathtt|texttt|mathscr|amsrm)\b"


def test_equations_stand_where_they_were_asked_for() -> None:
    math = Typesetter()
    html = math.filled(f"<p>{math('a')}{math('b', 'inline')}{math('a')}</p>")
    assert re.findall("<mi>(.)</mi>", html) == ["a", "b", "a"]
    assert html.count("<span class=katex-display>") == 2 and html.count("<math") == 3
    assert html.startswith("<p><span") and html.endswith("</span></p>")


def test_styles_of_an_equation_are_said_once() -> None:
    math = Typesetter()
    html = math.filled(f"<head></head><p>{math('x_1')}{math('x_1^2')}{math('x_1')}</p>")
    assert "style=" not in html and "mord" not in html and "vlist" not in html
    asked = {name for classes in re.findall('class="?([^">]*)', html) for name in classes.split() if name[:1] == "_"}
    sheet = {name for name in asked if not name[1:].isdecimal()}
    assert all(f".{name}" in type_css() for name in sheet) and len(sheet) > 5
    rules = dict(re.findall(r"\.katex \.katex-html \.(_\d+)\{([^}]*)\}", html.partition("</head>")[0]))
    assert asked - sheet == set(rules) and len(set(rules.values())) == len(rules) > 5


def test_symbol_keeps_its_name() -> None:
    (html,) = typeset([(r"\htmlData{symbol=theta_hat}{\hat\theta}", "inline")])
    assert 'data-symbol="theta_hat"' in html


@pytest.mark.parametrize("latex", [r"\unknown", r"\frac{1}{", r"\href{x}{y}"])
def test_equation_that_cannot_be_set_is_refused(latex: str) -> None:
    with pytest.raises(ValueError, match="KaTeX: "):
        typeset([("a", "block"), (latex, "block")])


def test_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(typesetting, "MODULES", ROOT / "build" / "nothing")
    with pytest.raises(ValueError, match="katex is not installed; type: make report"):
        typeset([("a", "block")])


@pytest.mark.beyond
def test_derivations_of_all_plants_can_be_set_in_the_faces_that_are_embedded() -> None:
    formulas = [
        formula
        for path in sorted((ROOT / "plants").glob("*.toml"))
        for formula in re.findall(r"\$\$(.*?)\$\$", to_markdown(derivation(read_experiment(path))), re.DOTALL)
    ]
    set_ones = typeset([(formula, "block") for formula in formulas])
    assert len(set_ones) == len(formulas) > 50
    assert [f for f, html in zip(formulas, set_ones, strict=True) if re.search(OTHER_FACES, html)] == []
    (bold,) = typeset([(r"\mathbf{x}", "block")])
    assert re.search(OTHER_FACES, bold)


def test_faces_are_embedded_and_no_file_is_asked_for() -> None:
    css = type_css()
    assert css.count("@font-face") == css.count("data:font/woff2") == 3 + len(KATEX_FACES)
    assert set(re.findall(r"url\(([^:)]*)", css)) == {"data"}
    assert "fonts/" in (MODULES / "katex" / "dist" / "katex.min.css").read_text()
