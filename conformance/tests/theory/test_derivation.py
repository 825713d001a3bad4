# SPDX-License-Identifier: MIT
"""The printed derivation of the lesson reads as its sections (5) to (7), and every format holds the same equations."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from conformance.programs.ports import ROOT
from conformance.theory import derivation as derivations
from conformance.theory.derivation import (
    FORMATS,
    Derivation,
    derivation,
    letter,
    to_json,
    to_latex,
    to_text,
)
from conformance.theory.experiment_file import read_experiment
from conformance.theory.expressions import operations, text
from conformance.theory.reader import read
from conformance.theory.statements import CONTROLLER, REGRESSOR, statements_of

pytestmark = pytest.mark.beyond

PLANTS = {path.stem: path for path in sorted((ROOT / "plants").glob("*.toml"))}

STEPS = """
Step 1

    z1 = x1 - r                           (5) tracking error
    w1 = phi                              (7)
    tau1 = phi z1                         (7) tuning function
    alpha1 = -k1 z1 - theta_hat phi + r'  (7) virtual control

Step 2

    z2 = x2 - alpha1                                                 (5) deviation from the virtual control
    alpha1_x1 = -k1 - theta_hat                                      (7) partial derivative of alpha1 by x1
    w2 = -alpha1_x1 phi                                              (7) regressor in z2'
    tau2 = phi z1 - alpha1_x1 phi z2                                 (7) tuning function
    theta_hat' = gamma tau2                                          (7) update law
    alpha1_dot_known = alpha1_x1 (x2 + theta_hat phi) + k1 r' + r''  (7) known part
    u = alpha1_dot_known - z1 - k2 z2 - phi theta_hat'               (7) control

Lyapunov function

    theta_tilde = theta_hat - theta                (5) parameter error
    V = z1^2/2 + z2^2/2 + theta_tilde^2/(2 gamma)  (7)
    V' = -k1 z1^2 - k2 z2^2                        (7) so V never grows

Proof

    V' + k1 z1^2 + k2 z2^2 = 0
    holds for the equations above, in exact arithmetic, at 3 random rational points

Assumptions (3) not proven

    none
"""


def of(name: str) -> Derivation:
    return derivation(read_experiment(PLANTS[name]))


def test_the_lesson_reads_as_its_sections() -> None:
    assert to_text(of("Chapter17_Lesson1")).endswith(STEPS)


@pytest.mark.parametrize("name", PLANTS)
def test_every_statement_of_the_controller_is_shown_and_nothing_else_but_w_and_tau(name: str) -> None:
    steps = [part for part in of(name).parts if part.heading.startswith("Step")]
    shown = [(e.name, e.expression) for part in steps for e in part.equations]
    written = [(s.name, s.expression) for s in statements_of(read_experiment(PLANTS[name])) if s.section == CONTROLLER]
    assert len(shown) == len(dict(shown))
    assert [pair for pair in written if pair not in shown] == []
    assert all(re.fullmatch(r"(w|tau)\d(_\d)?", name) for name in dict(shown).keys() - dict(written).keys())


@pytest.mark.parametrize("name", PLANTS)
def test_the_text_is_not_too_wide_to_be_read(name: str) -> None:
    assert max(len(line.split("  (")[0]) for line in to_text(of(name)).splitlines()[2:]) <= 120


@pytest.mark.parametrize("name", ["Chapter17_Lesson1", "motor_arm", "wing_rock"])
def test_the_json_holds_the_equations_as_expressions_that_can_be_read(name: str) -> None:
    given = of(name)
    answer = json.loads(to_json(given))
    assert answer["identity"]["holds"] is True and answer["name"] == name
    for part, ours in zip(answer["parts"], given.parts, strict=True):
        assert part["heading"] == ours.heading
        for equation, one in zip(part["equations"], ours.equations, strict=True):
            assert text(read(equation["expression"])) == text(one.expression)


@pytest.mark.parametrize("name", ["problem_1c", "motor_arm", "moore_greitzer", "chain_4"])
def test_the_latex_is_balanced(name: str) -> None:
    given = of(name)
    body = to_latex(given)
    assert body.count("{") == body.count("}") and body.count("\\left(") == body.count("\\right)")
    assert body.count("\\begin{align*}") == len(given.parts) == body.count("\\end{align*}")


LETTERS = {
    "theta1_hat": r"\hat{\theta}_{1}",
    "theta_hat_dot": r"\dot{\hat{\theta}}",
    "r_ddot": r"\ddot{r}",
    "K_B": "K_{\\mathrm{B}}".replace(r"\mathrm{B}", "B"),
    "phi2_1": r"\phi_{2,1}",
    "gamma12": r"\gamma_{12}",
    "angle": r"\mathrm{angle}",
    "alpha1_dot_known": r"\dot{\alpha}_{1,\text{known}}",
}


@pytest.mark.parametrize("name", LETTERS)
def test_names_are_set_as_symbols(name: str) -> None:
    assert letter(name) == LETTERS[name]


def test_an_assumption_that_is_not_proven_is_printed(tmp_path: Path) -> None:
    source = PLANTS["Chapter17_Lesson1"].read_text().replace('"u"', '"(2 + x1^2*x2^2 - x1*x2)*u"')
    path = tmp_path / "plant.toml"
    path.write_text(source)
    assert "g_2 = " in to_text(derivation(read_experiment(path))).partition("not proven")[2]


def test_an_identity_that_fails_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    lesson = read_experiment(PLANTS["Chapter17_Lesson1"])
    wrong = replace(lesson, k=(lesson.k[0], lesson.k[1] + 1))
    monkeypatch.setattr(derivations, "prove", lambda e, statements: real(e, tuple(map(broken, statements))))
    given = derivation(wrong)
    assert not given.holds and "REFUTED" in to_text(given)


real = derivations.prove


def broken(s):
    return s._replace(expression=read("-gamma*tau2")) if s.name == "theta_hat_dot" else s


# ------------------------------------------------------------------ the page that leads there

PAGE = (ROOT / "docs" / "plants.md").read_text()


def test_the_file_that_the_page_shows_can_be_read_and_is_as_long_as_it_says(tmp_path: Path) -> None:
    shown = re.search(r"^    title = .*?^    horizon = [^\n]*\n", PAGE, re.DOTALL | re.MULTILINE)
    assert shown
    path = tmp_path / "plant.toml"
    path.write_text(re.sub(r"^    ", "", shown[0], flags=re.MULTILINE))
    assert read_experiment(path) == replace(read_experiment(PLANTS["problem_1c"]), title="Problem 1(c)")
    written = [s for s in statements_of(read_experiment(path)) if s.section in (CONTROLLER, REGRESSOR)]
    count = f"{len(written)} statements and {sum(operations(s.expression) for s in written)}"
    assert count in " ".join(PAGE.split())


def test_the_refusal_that_the_page_shows_is_the_one_that_is_given() -> None:
    bad = (Path(__file__).parent / "bad" / "pure_feedback.expected").read_text()
    assert [line.partition("| ")[2] or line.partition(": ")[2] for line in bad.splitlines()] == [
        line.partition("| ")[2] or line.partition(": ")[2]
        for line in re.search(r"^    plants/mine.toml.*?\n\n", PAGE, re.DOTALL | re.MULTILINE)[0].strip().splitlines()
    ]


# ------------------------------------------------------------------ the command


def conformance(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)


def test_the_command_prints_the_derivation() -> None:
    answer = conformance("design", "plants/Chapter17_Lesson1.toml", "--format", "markdown")
    assert (answer.returncode, answer.stderr) == (0, "")
    assert answer.stdout == FORMATS["markdown"](of("Chapter17_Lesson1"))


def test_the_command_refuses_a_bad_file_at_its_place_and_prints_nothing_else() -> None:
    bad = Path(__file__).parent / "bad" / "pure_feedback.toml"
    answer = conformance("design", str(bad))
    assert answer.returncode == 2 and answer.stdout == ""
    assert answer.stderr.replace(f"{bad.parent}/", "") == bad.with_suffix(".expected").read_text()
