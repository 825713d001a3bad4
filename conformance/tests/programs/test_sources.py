# SPDX-License-Identifier: MIT
"""The programs read alike: same sections, same statements, same wording, in the same order."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from conformance.programs.ports import ROOT, SIX, Port, read_ports, the_six
from conformance.programs.sources import (
    SECTIONS,
    STEPS,
    WORKS,
    code,
    cut,
    frame,
    sections,
    snake,
    source,
    statements,
    tagged,
)
from conformance.programs.spelling import spelled_name, spelling_of
from conformance.programs.writer import write
from conformance.tests.under_test import FIRST, PORTS
from conformance.theory.experiment_file import read_experiment
from conformance.trials.edits import constant_value

ALL = read_ports()

every_port = pytest.mark.parametrize("any_port", PORTS.values(), ids=PORTS)


def section(port: Port, title: str) -> str:
    """The text of a section, up to the next one."""
    titles = sections(port)
    mark = port.section.format(title)
    following = titles[titles.index(title) + 1]
    text = source(port)
    return text[text.index(mark) : text.index(port.section.format(following))]


def steps(port: Port) -> list[tuple[str, str, str]]:
    return statements(port, source(port))


@every_port
def test_sections_stand_in_the_common_order(any_port: Port) -> None:
    assert [title for title in sections(any_port) if title != "Figures"] == list(SECTIONS)


@every_port
def test_statements_and_their_wording_are_the_same_in_every_program(any_port: Port) -> None:
    assert steps(any_port) == steps(FIRST)


@every_port
def test_nothing_but_statements_and_their_frame_stands_in_the_core(any_port: Port) -> None:
    assert frame(any_port) == list(any_port.frame)
    if any_port.name not in SIX:  # whose frames have been read
        assert [line for line in any_port.frame if WORKS.search(line)] == []


@every_port
@pytest.mark.parametrize("title", ["Controller", "Closed loop"])
def test_a_line_more_in_the_core_is_seen(title: str, any_port: Port, tmp_path: Path) -> None:
    """Such as a projection of theta_hat, or adaptation that is switched off."""
    tagged = [line for line in section(any_port, title).splitlines() if re.search(r"\S.*\(7\) ", line)]
    text = source(any_port).replace(tagged[0], f"{tagged[0]}\n{tagged[0].partition('=')[0]}= 0")
    (tmp_path / any_port.source).write_text(text)
    assert frame(replace(any_port, folder=tmp_path)) != list(any_port.frame)


@pytest.mark.parametrize(
    ("line", "works"),
    [
        ("theta_hat = min(theta_hat, cap)", True),
        ("if (small) return", True),
        ("x1 = x1 > 4 ? cap : x1", True),
        ("gain = 0.5", True),
        ("def controller(t: float) -> float:", False),
        ("const auto [x1, x2, theta_hat] = state;", False),
    ],
)
def test_a_frame_has_nothing_that_computes_or_decides(line: str, works: bool) -> None:
    assert bool(WORKS.search(line)) is works


@every_port
def test_comments_between_the_statements_are_the_same_in_every_program(any_port: Port) -> None:
    assert explanations(any_port) == explanations(FIRST)


def explanations(port: Port) -> list[str]:
    """The lines of the section Controller that are comments."""
    leader, end = (re.escape(part.strip()) for part in port.comment)
    lines = re.findall(rf"^[ \t]*'?{leader} (.*?)(?: *{end})?'?$", section(port, "Controller"), flags=re.MULTILINE)
    return [snake(line.replace("''", "'")) for line in lines if "----" not in line]


def test_there_are_comments_between_the_statements() -> None:
    assert len(explanations(FIRST)) == 3


@every_port
def test_names_are_those_of_the_lessons_listing(any_port: Port) -> None:
    leader = re.escape(any_port.comment[0].strip())
    bare = re.sub(rf"(?<!%) *{leader}.*", "", code(any_port))
    assert [name for name in any_port.lesson_names if not re.search(rf"\b{name}\b", bare)] == []


def test_each_of_the_six_has_names_of_the_lesson() -> None:
    assert all(len(port.lesson_names) > 20 for port in the_six().values())


@every_port
def test_every_step_stands_once_and_in_order(any_port: Port) -> None:
    steps_there = cut(any_port)
    assert list(steps_there) == [step.key for step in STEPS if step.key in steps_there]
    assert {step.key for step in STEPS if not step.optional} <= steps_there.keys()
    assert "".join(steps_there.values()) == code(any_port)


@pytest.mark.parametrize("change", ["a step left out", "a step twice", "steps exchanged"])
def test_steps_that_are_not_the_lessons_are_refused(change: str, tmp_path: Path) -> None:
    text = source(FIRST)
    heading = FIRST.section.format("Reference") + "\n"
    changed = {"a step left out": "", "a step twice": heading + heading, "steps exchanged": ""}[change]
    text = text.replace(heading, changed) + (heading if change == "steps exchanged" else "")
    (tmp_path / FIRST.source).write_text(text)
    with pytest.raises(ValueError, match="expected it once, after the step before"):
        cut(replace(FIRST, folder=tmp_path))


def test_statements_cover_the_lesson() -> None:
    tags = [tag for tag, _, _ in steps(FIRST)]
    assert tags == [*["(15)"] * 13, "(4)", "(5)", "(7)", "(5)", *["(7)"] * 7]


@every_port
def test_constants_stand_in_the_parameters_alone(any_port: Port) -> None:
    parameters = section(any_port, "Parameters")
    elsewhere = source(any_port).replace(parameters, "")
    assert set(re.findall(r"(?<![\w.%:])\d+\.\d+|\d+e-\d+", elsewhere)) <= {
        "0.0",
        "1.4",
    }  # the line width of the lesson's figures


@every_port
def test_notation_is_explained_in_the_same_words(any_port: Port) -> None:
    assert notation(any_port) == notation(FIRST)


def notation(port: Port) -> str:
    text = source(port)
    text = text[text.index("x1' = x2") : text.index("of the lesson")]
    return snake(re.sub(r"[^\w=']+", " ", text))


@every_port
def test_controller_does_not_use_theta(any_port: Port) -> None:
    code = re.sub(re.escape(any_port.comment[0].strip()) + ".*", "", section(any_port, "Controller"))
    assert not re.search(r"\btheta_?true\b", code, flags=re.IGNORECASE)


ODE45 = {"rel_tol": "1e-9", "abs_tol": "1e-11", "max_step": "0.02"}
SETTINGS = {  # of the integrators, by the contract; the tagged parameters are compared above
    "python": {**ODE45, "intervals": "4000"},
    "cpp": {"h": "0.002"},
    "java": {"h": "0.002"},
    "matlab": ODE45,
    "simulink": ODE45,
    "mathematica": {"precision_goal": "9", "accuracy_goal": "11", "max_step": "0.02", "intervals": "2000"},
}


@every_port
def test_settings_of_the_integrator_are_those_of_the_contract(any_port: Port) -> None:
    for name, value in SETTINGS.get(any_port.name, {}).items():
        assert constant_value(any_port, source(any_port), name) == value


@every_port
def test_every_parameter_is_used(any_port: Port) -> None:
    parameters = section(any_port, "Parameters")
    stated = [spelled_name(any_port, name) for name in spelling_of(any_port).constants]
    names = [name for name in stated if re.search(rf"\b{name}\b", parameters)]
    assert len(names) >= 11
    text = source(any_port)
    elsewhere = text[text.index(parameters) + len(parameters) :]
    _, _, passed_on = parameters.partition("parameters = {")  # into the Simulink block's code
    assert [name for name in names if not re.search(rf"\b{name}\b", passed_on + elsewhere)] == []


OCTAVE_TRACKING = [
    "plot(t, x1, '-', t, referenceSignal, '--', 'LineWidth', 1.4)", "legend({'x_1', 'r'}, 'Location', 'northeast')",
]  # fmt: skip
FIGURES = {  # the curves, legends, titles and labels, and what saves them, in order
    "python": [
        'axes.plot(t, x1, label="$x_1$")', 'axes.plot(t, r, "--", label="$r$")',
        '(title="Adaptive-Backstepping Tracking", xlabel="time (s)", ylabel="output y")', "axes.legend(", "axes.grid()",
        'axes.plot(t, tracking_error, label="$z_1 = x_1 - r$")',
        '(title="Tracking Error", xlabel="time (s)", ylabel="tracking error $z_1$")', "axes.legend(", "axes.grid()",
        r'axes.plot(t, theta_hat, label=r"$\hat{\theta}$")',
        r'axes.axhline(THETA_TRUE, color="C1", linestyle="--", label=r"$\theta$")',
        '(title="Parameter Estimate", xlabel="time (s)", ylabel="parameter (1/s)")', "axes.legend(", "axes.grid()",
        "tracking_figure.savefig(TRACKING_NAME)", "error_figure.savefig(ERROR_NAME)",
        "estimate_figure.savefig(ESTIMATE_NAME)",
    ],
    "matlab": [
        *OCTAVE_TRACKING, "endFigure('Adaptive-Backstepping Tracking', 'output y', trackingName)",
        "plot(t, trackingError, '-', 'LineWidth', 1.4)", "legend({'z_1 = x_1 - r'}, 'Location', 'northeast')",
        "endFigure('Tracking Error', 'tracking error z_1', errorName)",
        "plot(t, thetaHat, '-', 'LineWidth', 1.4)", "yline(thetaTrue, '--', 'LineWidth', 1.4)",
        r"legend({'estimate of \theta', '\theta'}, 'Location', 'northeast')",
        "endFigure('Parameter Estimate', 'parameter (1/s)', estimateName)",
        "title(heading)", "xlabel('time (s)')", "ylabel(label)", "grid('on')", "print(gcf(), name, '-dpng')",
    ],
    "simulink": [
        *OCTAVE_TRACKING, "title('Adaptive-Backstepping Tracking')", "xlabel('time (s)')", "ylabel('output y')",
        "grid('on')", "print(gcf(), trackingName, '-dpng')", "open_system(model)", "Model saved to %s.slx",
    ],
    "mathematica": [
        "trackingPlot = Plot[{x1Solution[t], r[t]}, {t, 0, finalTime}", "GridLines", "PlotStyle -> {{}, Dashed}",
        r'PlotLegends -> {\"x1\", \"r\"}', r'{\"time (s)\", \"output y\"}', "Adaptive-Backstepping Tracking",
        "errorPlot = Plot[x1Solution[t] - r[t], {t, 0, finalTime}", "GridLines", r'{\"z1 = x1 - r\"}',
        r'{\"time (s)\", \"tracking error z1\"}', "Tracking Error",
        "parameterPlot = Plot[{thetaHatSolution[t], thetaTrue}, {t, 0, finalTime}", "GridLines",
        "PlotStyle -> {{}, Dashed}", r'{\"estimate of theta\", \"theta\"}', r'{\"time (s)\", \"parameter (1/s)\"}',
        "Parameter Estimate", "save[trackingName, trackingPlot]", "save[errorName, errorPlot]",
        "save[estimateName, parameterPlot]",
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name in FIGURES if name in PORTS])
def test_figures_show_what_the_lessons_show(name: str) -> None:
    text = source(ALL[name])
    rest = text[text.index(ALL[name].section.format("Figures")) :]
    for fragment in FIGURES[name]:
        _, found, rest = rest.partition(fragment)
        assert found, fragment


def test_notebook_has_one_input_cell_per_section() -> None:
    styles = re.findall(r'"(Title|Text|Section|Input)"\]', source(ALL["mathematica"]))
    assert styles == ["Title", "Text", *["Section", "Input"] * (len(SECTIONS) + 1)]


@every_port
def test_statements_are_found_as_they_stand(any_port: Port) -> None:
    found = tagged(any_port)
    assert [t[:2] for t in found] == [s[:2] for s in statements(any_port, code(any_port))]
    assert all(f"{t.text} " in code(any_port) or f"{t.text}'" in code(any_port) for t in found)


@every_port
def test_statement_of_several_lines_keeps_them(any_port: Port, tmp_path: Path) -> None:
    if not any_port.template:
        return
    written = replace(any_port, folder=tmp_path)
    written.source_path.write_text(write(read_experiment(ROOT / "plants" / "problem_1c.toml"), any_port))
    assert sum(t.wording.endswith("z3'") for t in tagged(written)) == 2
    control = next(t for t in tagged(written) if t.wording == "control").text.splitlines()
    assert len(control) > 1 and "=" in control[0] and control[1].lstrip().startswith(("+", "-"))
    assert not any("'" in line for line in control)
