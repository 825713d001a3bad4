# SPDX-License-Identifier: MIT
"""No module that knows plants, programs or logs knows one plant by its names: these come from an experiment's file."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from conformance.places import PACKAGE

ROOMS = ("theory", "truth", "programs", "judging", "trials")  # below the pages
OF_THE_LESSON = re.compile(r"\b(x1|x2|theta_hat)\b|Chapter17_Lesson1")
EXCEPTIONS = {
    "theory/design.py": "the recursion's vector of estimates has the lesson's symbol, whatever its entries are called",
    "programs/ports.py": "make reads it before there is a library: the stem of the lesson's programs, and whose errors",
    "programs/writer.py": "templates have the lesson's symbol for the list of estimates",
}


def said(source: str) -> Iterator[str]:
    """Names and texts of a module, its docstrings apart."""
    tree = ast.parse(source)
    words = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        for name in ("id", "attr", "arg", "name"):
            yield str(getattr(node, name, ""))
        if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes) and id(node) not in words:
            yield str(node.value)


def lessons(source: str) -> set[str]:
    """What a module says of the lesson's plant alone."""
    return {match[0] for text in said(source) for match in OF_THE_LESSON.finditer(text)}


MODULES = [path for room in ROOMS for path in sorted((PACKAGE / room).glob("*.py"))]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_module_knows_no_plant_by_its_names(path: Path) -> None:
    found = lessons(path.read_text())
    excepted = f"{path.parent.name}/{path.name}" in EXCEPTIONS
    assert bool(found) is excepted, f"{path.name} says {', '.join(sorted(found)) or 'nothing that needs an exception'}"


@pytest.mark.parametrize(
    "line", ["x1 = 0", "state.x2", "def f(theta_hat): pass", "'x1,x2'", "f'{t}_x1 x2'", "b'theta_hat'"]
)
def test_what_is_the_lessons_is_noticed(line: str) -> None:
    assert lessons(f'"""Of x1 and theta_hat."""\n{line}\n') and not lessons(
        '"""Of x1 and theta_hat."""\nx = "alpha1_x"\n'
    )
