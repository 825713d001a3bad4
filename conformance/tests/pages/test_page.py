# SPDX-License-Identifier: MIT
"""The page holds what the results say, in one file, whatever became of the programs."""

import json
import re
import subprocess
from dataclasses import replace
from functools import partial
from html import unescape
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from sympy.parsing.sympy_parser import parse_expr

from conformance.judging.checks import Result
from conformance.judging.trajectory import load
from conformance.judging.verdict import Verdict, judge_file
from conformance.pages.exercises import diff
from conformance.pages.report import derivation as page_of_derivation
from conformance.pages.report.curves import BAND, EXACT, GRID, SPANS, Panel, curves, leaders, legend, pictures, signals
from conformance.pages.report.evidence import DECADES, cell, errors, in_words, outcome
from conformance.pages.report.exercises import marked, solved
from conformance.pages.report.listing import highlighted, highlighting
from conformance.pages.report.page import HERE, derivation_shown, environment_of, raw
from conformance.pages.report.picture import BOTTOM, HEIGHT, LEFT, RIGHT, ROOM, TOP, WIDTH, Line, picture
from conformance.pages.report.playground import PROGRAM, Playground, playground, program_text, references
from conformance.pages.report.rows import Row, parts
from conformance.pages.report.symbols import Notation, symbols_of
from conformance.pages.report.typesetting import NODE, typeset
from conformance.programs.ports import ROOT, SIX, Port
from conformance.programs.sources import STEPS, cut, source, statements, tagged
from conformance.tests.under_test import FIRST, PORTS, trajectory_of
from conformance.theory.derivation import derivation
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import camel
from conformance.theory.lesson import LESSON, SECTIONS
from conformance.theory.statements import parameters_of, statements_of
from conformance.trials.variant import read_variants
from conformance.truth.exact import exact

LARGEST = 3_000_000  # bytes
LESSON_ADDRESS = "https://github.com/mohammadijoo/Control_and_Robotics_Tutorials"
PAPER_ADDRESS = "https://doi.org/10.1109/9.100933"

VARIANTS = read_variants()
LESSON_FILE = read_experiment(ROOT / "plants" / "Chapter17_Lesson1.toml")


def steps(port: Port) -> list[tuple[str, str, str]]:
    """The tagged statements of a program."""
    return statements(port, source(port))


@pytest.fixture(scope="module")
def html(report: Path) -> str:
    return report.read_text()


def test_page_is_small(html: str) -> None:
    assert len(html.encode()) <= LARGEST


def test_page_names_nothing_outside_of_itself(html: str) -> None:
    addresses = re.findall(r'(?:src|href|action|data)="([^"]*)"', html)
    assert len(addresses) > len(STEPS)
    assert {address for address in addresses if not address.startswith(("#", "?", "data:"))} == {
        LESSON_ADDRESS,
        PAPER_ADDRESS,
        "plants.html",
    }
    assert html.count(LESSON_ADDRESS) == html.count(f'<a href="{LESSON_ADDRESS}"') == 2


def test_every_link_leads_somewhere(html: str) -> None:
    assert set(re.findall(r'href="[^"#]*#([^"]+)"', html)) <= set(re.findall(r'id="([^"]+)"', html))


def test_every_program_shows_every_part_in_the_lessons_order(html: str) -> None:
    columns = re.findall(r'class="column" data-port="(\w+)" data-part="([\w-]+)"', html)
    assert columns == [(port, step.key) for step in STEPS for port in SIX if port in PORTS]


def test_text_that_ends_an_element_is_refused(tmp_path: Path) -> None:
    from jinja2 import Environment, FileSystemLoader

    (tmp_path / "a.js").write_text("const text = '</script>';")
    with pytest.raises(ValueError, match="found the end of its own element"):
        raw(Environment(loader=FileSystemLoader(tmp_path)))("a.js")


@pytest.mark.parametrize(
    ("figure", "status", "weight"), [(0.0, "pass", 0), (1e-9, "pass", 0.5), (1e-6, "pass", 1), (2e-6, "fail", 1)]
)
def test_cell_is_the_darker_the_nearer_to_its_bound(figure: float, status: str, weight: float) -> None:
    found = cell(Result("claim", "(10)", figure, 1e-6, "x1 at t = 1", "tolerance"))
    assert (found.status, found.weight) == (status, weight)


def test_value_at_the_pointer_is_off_by_no_more_than_the_program(port: Port) -> None:
    """Between rows too, where a straight line is off by 1e-3."""
    trajectory, solution = trajectory_of(port), exact(LESSON)
    drawn, grid = curves(solution, trajectory), GRID * float(LESSON.horizon)
    error = np.abs(trajectory.states - solution.evaluate(trajectory.t)).max(axis=1)
    for name, largest, true in zip(LESSON.names, error, solution.evaluate(grid), strict=True):
        assert np.abs(drawn[name] - true).max() <= 1.5 * largest


def test_rows_too_far_apart_leave_a_gap() -> None:
    trajectory = trajectory_of(next(iter(PORTS.values())))
    few = np.isin(np.arange(trajectory.t.size), [*range(100), *range(100, trajectory.t.size, 400)])
    t, states, r, error = (
        a[..., few] for a in (trajectory.t, trajectory.states, trajectory.reference, trajectory.tracking_error)
    )
    drawn = curves(exact(LESSON), replace(trajectory, t=t, states=states, reference=r, tracking_error=error))
    known = np.isfinite(drawn["x1"])
    assert 0.1 < known.mean() < 0.9 and (np.isfinite(drawn["V"]) == known).all()


def test_error_stands_at_its_decade_with_its_tolerance() -> None:
    result = Result("x1-equals-the-exact-solution", "(10)", 1e-9, 1e-7, "x1 at t = 1", "tolerance")
    (error,) = errors(Verdict("cpp", "pass", results=(result,)))
    low, high = DECADES
    assert (error.place, error.bound) == pytest.approx(((-9 - low) / (high - low), (-7 - low) / (high - low)))
    assert error.words == "x1: 1.0e-09, tolerance 1.0e-07"
    nothing = replace(result, figure=0.0, bound=1.0)
    assert [(e.place, e.bound) for e in errors(Verdict("cpp", "pass", results=(nothing,)))] == [(0, 1)]


def test_headline_has_the_languages() -> None:
    languages = {"cpp": "C++", "matlab": "MATLAB"}
    assert in_words("1 of 2 conform; matlab, cpp on an open engine", languages).endswith(
        "MATLAB, C++ on an open engine"
    )


def test_thinned_errors_keep_the_largest() -> None:
    trajectory = trajectory_of(next(iter(PORTS.values())))
    states = trajectory.states.copy()
    states[0, states.shape[1] // 3] += 1e-3  # one row, between two points of the grid
    drawn = curves(exact(LESSON), replace(trajectory, states=states))
    assert drawn["error_x1"].size == SPANS.size - 1 and np.nanmax(drawn["error_x1"]) == pytest.approx(1e-3, rel=1e-5)


def test_rows_that_are_missing_leave_a_gap() -> None:
    trajectory = trajectory_of(next(iter(PORTS.values())))
    early = trajectory.t < 10
    t, states, r, error = (
        a[..., early] for a in (trajectory.t, trajectory.states, trajectory.reference, trajectory.tracking_error)
    )
    cut_off = replace(trajectory, t=t, states=states, reference=r, tracking_error=error)
    drawn = curves(exact(LESSON), cut_off)
    assert all(np.isnan(drawn[name][GRID > 0.51]).all() for name in ("x1", "V"))
    assert (np.isnan(drawn["error_x1"]) == (SPANS[:-1] > 0.499)).all()


# ---- Code ----


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb or #rgb (WCAG 2)."""
    digits = colour if len(colour) == 7 else "#" + "".join(2 * digit for digit in colour[1:])
    shares = [int(digits[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("#fff", "#000000") == pytest.approx(21) and contrast("#777", "#fff") < 4.5 < contrast(
        "#767676", "#fff"
    )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_of_the_code_stand_out(scheme: str, html: str) -> None:
    """On the background of the code, which axe is not asked about for want of time."""
    pair, of = r"light-dark\((#\w+), (#\w+)\)", ("light", "dark").index(scheme)
    background = re.findall(rf"--raised: {pair}", (HERE / "static" / "frame.css").read_text())[0][of]
    used = set(re.findall(r'<span class="(\w+)">', html))
    colours = {kind: of_both[of] for kind, *of_both in re.findall(rf"\.code \.(\w+) {{ color: {pair}", highlighting())}
    assert len(used & colours.keys()) > 5
    assert {
        kind: colour for kind, colour in colours.items() if kind in used and contrast(colour, background) < 4.5
    } == {}


def test_colours_are_said_once_for_light_and_dark(html: str) -> None:
    """A second place would not hear of the reader's choice."""
    assert html.count("light-dark(") > 30 and html.count("prefers-color-scheme") == 1  # by which the script starts


def test_port_in_an_unknown_language_shows_its_code(tmp_path: Path) -> None:
    (tmp_path / "program.unknown").write_text(source(FIRST))
    steps = highlighted(replace(FIRST, folder=tmp_path, source="program.unknown"))
    assert [unescape(re.sub("<[^>]*>", "", html)) for html in steps.values()] == [*cut(FIRST).values()]


def test_port_without_the_steps_shows_none(tmp_path: Path) -> None:
    (tmp_path / FIRST.source).write_text("nothing\n")
    assert highlighted(replace(FIRST, folder=tmp_path)) == {}


# ---- Statements ----


def from_latex(latex: str) -> sp.Eq:
    """An equation as it is shown, read by way of the names of its symbols."""
    symbol = r"\\htmlData\{symbol=(\w+)\}\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\}"
    text = re.sub(r"\\left|\\right|\\text\{.*\}", "", re.sub(symbol, r" \1 ", latex)).replace("\\,", "*")
    return equation(*re.sub(r"\\(sin|cos)", r"\1", text).replace("\\ ", "").split("="))


def equation(left: str, right: str) -> sp.Eq:
    names = {name: sp.Symbol(name) for name in re.findall(r"[a-z]\w*", f"{left} {right}") if name not in ("sin", "cos")}
    return sp.Eq(*(parse_expr(side, names) for side in (left, right)))


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    found = parts(LESSON_FILE, Notation(derivation(LESSON_FILE)), PORTS.values())
    return [row for part in found for _, rows in part.groups for row in rows]


def test_every_constant_has_words_of_its_own(rows: list[Row]) -> None:
    words = [row.wording for row in rows][: len(parameters_of(LESSON_FILE))]
    assert len(set(words)) == len(words) == 10 and "omega of the reference" in words
    sliders = [slider.meaning for slider in playground(exact(LESSON)).sliders]
    assert len(set(sliders)) == len(sliders) > 5


def test_every_statement_has_a_row_with_every_program(rows: list[Row]) -> None:
    assert [row.name for row in rows] == [s.name for s in (*parameters_of(LESSON_FILE), *statements_of(LESSON_FILE))]
    assert all(list(row.cells) == list(PORTS) for row in rows)


def test_equations_of_the_rows_are_the_statements_of_the_programs(rows: list[Row]) -> None:
    wanted = [equation(*text.replace("theta_true", "theta").split("=")) for _, _, text in steps(FIRST)]
    shown = [from_latex(row.equation) for row in rows]
    assert [e.lhs for e in shown] == [e.lhs for e in wanted]
    assert all(sp.nsimplify(sp.expand(a.rhs - b.rhs)) == 0 for a, b in zip(shown, wanted, strict=True))


@pytest.mark.parametrize("plant", ["motor_arm", "ship_course"])  # with units such as s^2
def test_constants_can_be_set_with_their_units(plant: str) -> None:
    experiment = read_experiment(ROOT / "plants" / f"{plant}.toml")
    shown = parts(experiment, Notation(derivation(experiment)), ())
    equations = [row.equation for part in shown for _, some in part.groups for row in some]
    assert any(r"\text" in equation and "$^{2}$" in equation for equation in equations)
    assert len(typeset([(equation, "block") for equation in equations])) == len(equations)


def test_code_of_a_row_is_the_programs(rows: list[Row]) -> None:
    for port in PORTS.values():
        cells = [unescape(re.sub("<[^>]*>", "", row.cells[port.name])).rstrip("\n") for row in rows]
        assert cells == [t.text for t in tagged(port)]


def test_program_that_lacks_a_statement_leaves_its_cell_empty(tmp_path: Path) -> None:
    law = next(line for line in source(FIRST).splitlines(keepends=True) if "(7) update law" in line)
    (tmp_path / FIRST.source).write_text(source(FIRST).replace(law, ""))
    found = parts(LESSON_FILE, Notation(derivation(LESSON_FILE)), [replace(FIRST, folder=tmp_path, template="")])
    missing = [row.name for part in found for _, rows in part.groups for row in rows if not row.cells]
    assert missing == ["theta_hat_dot"]


def test_figures_of_several_lines_name_each(html: str) -> None:
    header = html.partition("<header>")[2].partition("</header>")[0]
    figures = re.findall(r'<figure class="chart.*?</figure>', header, flags=re.DOTALL)
    figures += re.findall(r'<figure class="small-figure.*?</figure>', html, flags=re.DOTALL)
    named = [(figure.count('<path class="curve"'), len(re.findall(r'class="key[ "]', figure))) for figure in figures]
    assert named == [(2, 2), (2, 2), (1, 1), (3, 3)], "of V it is the integration's own error that is named"


def test_figures_are_numbered_in_their_order(html: str) -> None:
    found = re.findall(r'<figcaption>\s*<a class="number"[^>]* id="figure-([\w-]+)" [^>]*>Figure (\d+)\.</a>', html)
    assert found == [
        (name, str(i)) for i, name in enumerate(("first", "no-convergence", "signals", "errors", "playground"), 1)
    ]


def test_every_symbol_has_its_meaning_and_section(html: str) -> None:
    marked, explained = (set(re.findall(rf'data-{kind}="(\w+)"', html)) for kind in ("symbol", "means"))
    assert {"theta_hat", "tau2", "phi", "u"} <= marked and marked <= explained
    assert re.search(r'data-means="tau2">.*: tuning function <small>\(7\)</small>', html)


def cited(html: str) -> set[str]:
    """The numbers of sections that stand in small print and in the comments of code."""
    return set(re.findall(r"(?<!\w)\(\d+\)", " ".join(re.findall(r"<(?:small|b)>(.*?)</", html))))


def test_every_section_that_is_cited_has_its_words(html: str) -> None:
    held = [f"({number})" for section in SECTIONS for number in section.numbers]
    assert cited(html) <= set(held) and len(cited(html)) > 10
    assert held == [f"({number})" for number in range(2, 18)]
    assert "(18)" in cited("<small>(9), (18) Problem 4</small>") and cited("<b>(7)</b> <small>x1(0)</small>") == {"(7)"}
    found = re.findall(r'<li id="section-\d+" data-words="([()\d]+)">(.*?)</li>', html)
    assert [unescape(text) for _, text in found] == [f"{section}: {section.words}" for section in SECTIONS]
    assert "".join(numbers for numbers, _ in found) == "".join(held)


def test_words_mark_the_sections_that_they_cite() -> None:
    notation = Notation(derivation(LESSON))
    environment, _ = environment_of(symbols_of(LESSON, notation), notation)
    words = environment.filters["words"]
    assert words("f(0) & (2024): the column (12)") == "f(0) &amp; (2024): the column <small>(12)</small>"


def test_terms_of_the_derivation_are_answered_in_their_statements(html: str) -> None:
    step = html.partition('id="step-2"')[2].partition("</article>")[0]
    fates = re.findall(r'<tr class="(\w+)"[^>]*?(?: data-by="(\w+)")?>', step)
    assert fates == [*[("cancels", "u")] * 3, ("stays", ""), ("waits", "tau2"), ("cancels", "theta_hat_dot")]
    assert {by for _, by in fates if by} <= set(re.findall(r'class="statement" data-row="(\w+)"', step))


def test_each_step_begins_with_the_rate_of_its_error() -> None:
    derived = derivation(LESSON)
    bare = partial(re.sub, r"\\htmlData\{symbol=\w+\}", "")
    found = [
        (bare(step.rate), [*map(bare, step.put_in)])
        for step in page_of_derivation.steps(derived, Notation(derived), ())
    ]
    assert found == [
        (
            r"{\dot{z}_{1}} = {x_{2}} + {\theta} \, {x_{1}} - {\dot{r}}",
            [r"{x_{2}} = {\alpha_{1}} + {z_{2}}", r"{\theta} = {\hat{\theta}} - {\tilde{\theta}}"],
        ),
        (r"{\dot{z}_{2}} = {u} - {\dot{\alpha}_{1}}", []),
    ]


def test_page_says_what_the_exact_solution_is(html: str) -> None:
    known = re.search(r'<p id="exact">.*known to ([\de-]+)\.', html, flags=re.DOTALL)
    assert known and 0 < float(known[1]) / float(exact(LESSON).table.bound.max()) - 1 < 1
    assert 'href="#exact"' in html.partition("</header>")[0]


@pytest.mark.parametrize("plant", ["first_order", "problem_1c", "motor_arm", "problem_5"])
def test_derivation_of_any_plant_can_be_shown(plant: str) -> None:
    experiment = read_experiment(ROOT / "plants" / f"{plant}.toml")
    derived = derivation(experiment)
    notation = Notation(derived)
    shown = derivation_shown(derived, notation, symbols_of(experiment, notation), parts(experiment, notation, ()))
    written = [
        shown["lyapunov"],
        shown["identity"],
        *shown["errors"],
        *(row for s in shown["derivation_steps"] for row in s.tuning),
    ]
    written += [text for s in shown["derivation_steps"] for t in s.terms for text in (t.latex, t.answer) if text]
    assert len(shown["derivation_steps"]) == len(experiment.states)
    assert len(typeset([(latex, "inline") for latex in written])) == len(written)


# ---- Exercises ----


@pytest.mark.parametrize(
    ("refusals", "status", "expected"),
    [(["x1-is"], "fail", "caught"), (["other"], "fail", "fail"), ([], "pass", "fail")],
)
def test_mistake_must_be_refused_by_its_check(refusals: list[str], status: str, expected: str) -> None:
    mistake = replace(next(v for v in VARIANTS.values() if v.refused_by), refused_by="x1-is")
    assert outcome(mistake, {"refusals": refusals, "status": status}).status == expected


def test_experiment_must_conform_and_refusals_are_told_in_words() -> None:
    experiment = next(v for v in VARIANTS.values() if not v.refused_by)
    conforms, refused = (
        outcome(experiment, {"refusals": refusals, "status": status})
        for refusals, status in ([[], "pass"], [["x1-equals-the-exact-solution"], "fail"])
    )
    assert (conforms.status, refused.status) == ("pass", "fail")
    assert refused.words == "refused by: x1 equals the exact solution"
    assert outcome(experiment, {"refusals": [], "status": "missing"}).figure == "missing"


def test_every_exercise_is_on_the_page_in_every_program_that_has_it(html: str) -> None:
    for variant in VARIANTS.values():
        part = html.partition(f'id="exercise-{variant.name}"')[2].partition("</details>")[0]
        assert part and part.count('class="code diff"') == sum(map(variant.has, PORTS.values())), variant.name


@pytest.mark.parametrize(
    ("row", "plain"), [("-  a < 1", "-a < 1"), ("+    a = 2     # (7) it", "+a = 2  # (7) it"), ("+", "+")]
)
def test_lines_of_a_diff_keep_their_text(row: str, plain: str) -> None:
    html = str(marked([row], "program.py"))
    assert unescape(re.sub("<[^>]*>", "", html)) == plain + "\n"
    assert {"-": "removed", "+": "added"}[plain[0]] in html


def test_no_diff_begins_or_ends_with_an_empty_line(html: str) -> None:
    diffs = re.findall(r'<div data-edit="\w+">.*?<code>(.*?)</code>', html, flags=re.DOTALL)
    plain = [unescape(re.sub("<[^>]*>", "", diff)).removesuffix("\n").split("\n") for diff in diffs]
    assert len(plain) > len(VARIANTS) and all(rows[0].strip() and rows[-1].strip() for rows in plain)


def test_edit_of_a_notebook_is_shown_as_its_reader_sees_it_and_whole(html: str) -> None:
    notebooks = [port for port in PORTS.values() if port.source.endswith(".nb")]
    for variant, port in ((v, port) for v in VARIANTS.values() for port in notebooks if v.has(port)):
        part = html.partition(f'id="exercise-{variant.name}"')[2].partition(f'data-edit="{port.name}"')[2]
        shown = unescape(re.sub("<[^>]*>", "", part.partition("<code>")[2].partition("</code>")[0]))
        bare = re.sub(r'Cell\["|", "Input"\],?|\\(?=["\\])', "", diff(variant, port))
        edits = [[row for row in text.replace(" ", "").splitlines() if row[:1] in ("+", "-")] for text in (bare, shown)]
        assert edits[0] == edits[1] != [] and "Cell[" not in shown, variant.name


def test_exercises_come_as_the_lessons_sections(html: str) -> None:
    ids = re.findall(r'data-exercise="([\w-]+)"', html)
    for group in (True, False):
        sections = [int(VARIANTS[i].section.strip("()")) for i in ids if bool(VARIANTS[i].refused_by) == group]
        assert sections == sorted(sections) and len(set(sections)) > 1


def test_problem_6_is_drawn_over_whole_periods() -> None:
    curves = solved(VARIANTS["problem-6"].experiment)
    periods = curves["t"][-1] * 0.5 / (2 * np.pi)
    assert periods > 1 and periods == pytest.approx(round(periods), abs=1e-3)
    settled = curves["t"] > 10
    assert np.abs(curves["x1"] - curves["reference"])[settled].max() < 0.01


# ---- Pictures ----

RAMP = np.linspace(0, 10, 101)


def points(svg: str, kind: str) -> list[list[tuple[float, float]]]:
    """The pieces of the first path of a kind, each a list of points."""
    path = re.findall(rf'<path class="{kind}"[^>]* d="([^"]*)"', svg)[0]
    pairs = [[p.split() for p in piece.strip("Z").split("L")] for piece in path.split("M")[1:]]
    return [[(float(x), float(y)) for x, y in piece] for piece in pairs]


def test_picture_of_a_line_is_the_line() -> None:
    (piece,) = points(picture(RAMP, [Line(2 * RAMP, "red")], "a ramp"), "curve")
    (x0, y0), (x1, y1) = piece[0], piece[-1]
    assert (x0, x1) == (LEFT, WIDTH - RIGHT) and TOP < y1 < y0 < HEIGHT - BOTTOM


def test_picture_keeps_what_is_seen_of_a_curve() -> None:
    wave = np.sin(3 * RAMP)
    (piece,) = points(picture(RAMP, [Line(wave, "red")], "a wave"), "curve")
    x, y = np.transpose(piece)
    inner = (HEIGHT - BOTTOM - TOP) / (1 + 2 * ROOM)
    wanted = (HEIGHT - BOTTOM + TOP) / 2 - wave * inner / 2 / np.abs(wave).max()
    drawn = np.interp(LEFT + RAMP / 10 * (WIDTH - LEFT - RIGHT), x, y)
    assert len(piece) < RAMP.size and np.abs(drawn - wanted).max() < 1


def test_picture_has_gaps_where_nothing_is_known() -> None:
    values = np.where((RAMP > 4) & (RAMP < 6), np.nan, RAMP)
    assert len(points(picture(RAMP, [Line(values, "red")], "two pieces"), "curve")) == 2


def test_logarithmic_picture_has_powers_of_ten_within_it() -> None:
    svg = picture(RAMP, [Line(10.0 ** (-RAMP - 3), "red")], "decades", logarithmic=True)
    rules = [float(y) for y in re.findall(r'class="rule" d="M46 ([\d.]+)H', svg)]
    assert 2 <= len(rules) <= 8 and all(TOP <= y <= HEIGHT - BOTTOM for y in rules)
    assert "10⁻³" in svg and "10⁻²" not in svg


def test_every_chart_has_a_picture(html: str) -> None:
    charts = re.findall(r'<figure class="chart.*?</figure>', html, flags=re.DOTALL)
    assert len(charts) > 20 and all('<svg class="still"' in chart for chart in charts)


def test_programs_that_lie_on_one_another_are_one_line() -> None:
    same, other = {"x": RAMP}, {"x": RAMP + 0.1}
    drawn, panel = {"a": same, "b": same, "c": other, "d": same}, Panel("x", "x", "x")
    found = leaders(drawn, panel)
    assert found == {"a": ["a", "b", "d"], "c": ["c"]}
    languages = {"a": "A", "absent": "-", "b": "B", "c": "C", "d": "D"}
    own = [("var(--colour-0)", "A, B, D on one line"), ("var(--colour-3)", "C")]
    assert legend(panel, found, languages, 8) == [(EXACT, "exact"), *own]
    assert legend(Panel("x", "x", "x", "tolerance"), found, languages, 8) == own


def test_exact_solution_is_a_thin_line_in_the_band_of_the_programs_and_in_the_legend(html: str) -> None:
    section = html.partition('id="trajectories"')[2].partition("</section>")[0]
    signals, errors = section.split('<div class="charts errors">')
    for chart in signals.split('<figure class="chart"')[1:]:
        drawn = re.findall(r'class="curve" style="stroke:([^;]*);stroke-width:([\d.]+)"', chart)
        (band, wide), (line, thin) = drawn[-2:]
        assert band in {BAND.format(f"var(--colour-{i})") for i in range(8)} and line == EXACT
        assert float(wide) >= 3 * float(thin)
        assert chart.count(f'style="--colour: {EXACT}">exact</span>') == 1
    assert signals.count('<figure class="chart"') > 7 and EXACT not in errors


def test_of_tolerances_that_are_the_same_the_first_programs_is_seen() -> None:
    panel, known = Panel("error_x1", "", "", "tolerance", True), {name: {"error_x1": SPANS[:-1]} for name in "abc"}
    bounds = {"a": {"x1": 1e-6}, "b": {"x1": 1e-6}, "c": {"x1": 1e-7}}
    svg = pictures([panel], exact(LESSON), {}, known, bounds, {"error_x1": ["a"]}, 8)["error_x1"]
    dashed = re.findall(r'stroke:([^;]*);[^"]*stroke-dasharray[^"]*" d="([^"]*)"', svg)
    on_top = {path: colour for colour, path in dashed}
    assert list(on_top.values()) == ["var(--colour-2)", "var(--colour-0)"]


def test_small_values_of_a_logarithmic_chart_are_told_apart() -> None:
    """Though they are far below the largest, by which curves on a linear axis are compared."""
    one, other = ({"x": np.array([1.0, small])} for small in (1e-9, 1e-8))
    found = [leaders({"a": one, "b": other}, Panel("x", "x", "x", logarithmic=log)) for log in (False, True)]
    assert [len(lines) for lines in found] == [1, 2]
    none = {"x": np.array([1.0, 0.0])}  # which the axis cannot show
    assert len(leaders({"a": one, "b": none}, Panel("x", "x", "x", logarithmic=True))) == 1


def test_errors_are_drawn_in_steps_each_as_high_as_the_largest_of_its_span(port: Port) -> None:
    trajectory, solution = trajectory_of(port), exact(LESSON)
    drawn = {port.name: curves(solution, trajectory)}
    off = np.abs(trajectory.states[0] - solution.evaluate(trajectory.t)[0])
    spans = SPANS * float(LESSON.horizon)
    within = [off[(trajectory.t >= a) & (trajectory.t < b)] for a, b in pairwise([*spans[:-1], np.inf])]
    assert drawn[port.name]["error_x1"] == pytest.approx([values.max(initial=0) for values in within], rel=1e-6)
    panel = Panel("error_x1", "", "", "tolerance", True)
    lines = {"error_x1": [port.name]}
    svg = pictures([panel], solution, {}, drawn, {port.name: {"x1": 1e-6}}, lines, 8)["error_x1"]
    (bar,), (steps,) = (points(path, "curve") for path in re.findall(r'<path class="curve".*?/>', svg))
    assert len({y for _, y in bar}) == 1
    assert all(x0 == x1 or abs(y0 - y1) < 0.5 for (x0, y0), (x1, y1) in pairwise(steps)) and len(steps) > 50


# ---- The playground ----

OTHERS = ("problem_5", "khalil", "first_order", "motor_arm")  # a full Gamma, nothing unknown, n = 1, names of its own


@pytest.fixture(scope="module")
def lessons() -> Playground:
    return playground(exact(LESSON), VARIANTS.values())


def test_playgrounds_statements_are_the_programs(lessons: Playground) -> None:
    parameters = 10
    text = program_text(lessons.experiment)
    assert statements(PROGRAM, text) == statements(FIRST, source(FIRST))[parameters:]


def test_playground_has_the_mistakes_of_the_controller(lessons: Playground) -> None:
    found = lessons.mistakes
    assert {"no-estimate-rate", "theta-in-the-control", "sign-in-tau2"} <= lessons.titles.keys()
    assert len(set(lessons.programs.values())) == len(references(lessons.starts)) + len(found)
    assert all(mistake.difference.count("removed") == mistake.difference.count("added") >= 1 for mistake in found)


def test_starts_and_questions_are_within_reach_of_the_sliders(lessons: Playground) -> None:
    reach = {s.name: (10**s.low, 10**s.high) if s.logarithmic else (s.low, s.high) for s in lessons.sliders}
    starts = lessons.data["starts"]
    assert all(start["constants"].keys() == reach.keys() for start in starts.values())
    wanted = [start["constants"] for start in starts.values()] + [q.constants for q in lessons.questions]
    assert all(reach[name][0] <= value <= reach[name][1] for of in wanted for name, value in of.items())


def test_questions_name_what_there_is(lessons: Playground) -> None:
    for question in lessons.questions:
        assert question.start in lessons.starts
        assert question.mistake in ("", *lessons.titles) and question.exercise in ("", *VARIANTS)
        assert all(f"«{name}»" in question.look + question.answer for name in question.figures)
        assert all(len(question.told(words)) % 2 for words in (question.question, question.look, question.answer))
    errors_of_16 = {v.name for v in VARIANTS.values() if v.section == "(16)"}
    assert errors_of_16 <= {name for q in lessons.questions for name in (q.mistake, q.exercise)}


@pytest.mark.parametrize("plant", OTHERS)
def test_playgrounds_program_of_any_plant_passes_every_check(plant: str, tmp_path: Path) -> None:
    """And its V and V' are the theorem's."""
    experiment = read_experiment(ROOT / "plants" / f"{plant}.toml")
    constants = {camel(c.name): float(c.value) for c in parameters_of(experiment)}
    script = f"""{program_text(experiment)}
        const {{ simulate, toCsv, signals }} = program({json.dumps(constants)});
        const trajectory = simulate();
        console.log(JSON.stringify([toCsv(trajectory), trajectory.slice(0, 50).map(signals)]));"""
    done = subprocess.run([NODE, "-"], input=script, capture_output=True, text=True, check=True)
    csv, found = json.loads(done.stdout)
    path = tmp_path / "playground.csv"
    path.write_text(csv)
    verdict = judge_file(path, experiment)
    assert verdict.conforms, verdict.reason
    solution = exact(experiment)
    log = load(path, experiment)
    shown = playground(solution, plant=experiment)
    assert [start["constants"].keys() for start in shown.data["starts"].values()] == [
        {c.name for c in parameters_of(experiment)} - {"final_time"}
    ]
    assert len(shown.drawings) == 9 - 2 * (not experiment.unknown) - (len(experiment.states) < 2)
    wanted = signals(solution, log.t[:50], log.states[:, :50])
    for name in ("u", "V", "V_dot", "z1"):
        assert [row[name] for row in found] == pytest.approx(wanted[name], rel=1e-9, abs=1e-12), name
