# SPDX-License-Identifier: MIT
"""The programs read alike: same sections, same statements, same wording, in the same order."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from conformance.programs.ports import Port, read_ports
from conformance.programs.sources import SECTIONS, STEPS, code, cut, sections, snake, source, statements

ALL = read_ports()
FIRST = next(iter(ALL.values()))

every_port = pytest.mark.parametrize("any_port", ALL.values(), ids=ALL)


def section(port: Port, title: str) -> str:
    """The text of a section, up to the next one."""
    titles = sections(port)
    mark = port.section.format(title)
    following = titles[titles.index(title) + 1]
    text = source(port)
    return text[text.index(mark) : text.index(port.section.format(following))]


def steps(port: Port) -> list[tuple[str, str, str]]:
    return statements(source(port), port.comment)


@every_port
def test_sections_stand_in_the_common_order(any_port: Port) -> None:
    assert [title for title in sections(any_port) if title != "Figures"] == list(SECTIONS)


@every_port
def test_statements_and_their_wording_are_the_same_in_every_program(any_port: Port) -> None:
    assert steps(any_port) == steps(FIRST)


@every_port
def test_every_step_stands_once_and_in_order(any_port: Port) -> None:
    steps_there = cut(any_port)
    assert list(steps_there) == [step.key for step in STEPS if step.key in steps_there]
    assert {step.key for step in STEPS if not step.optional} <= steps_there.keys()
    assert "".join(steps_there.values()) == code(any_port)


@pytest.mark.parametrize("change", ["a step left out", "a step twice", "steps exchanged"])
def test_steps_that_are_not_the_lessons_are_refused(change: str, tmp_path: Path) -> None:
    text = source(FIRST)
    law = next(line for line in text.splitlines(keepends=True) if "(7) update law" in line)
    changed = {"a step left out": "", "a step twice": law + law, "steps exchanged": ""}[change]
    text = text.replace(law, changed) + (law if change == "steps exchanged" else "")
    (tmp_path / FIRST.source).write_text(text)
    with pytest.raises(ValueError, match="expected it once, after the step before"):
        cut(replace(FIRST, folder=tmp_path))


def test_statements_cover_the_lesson() -> None:
    tags = [tag for tag, _, _ in steps(FIRST)]
    assert tags.count("(10)") == 13 and tags.count("(5)") == 2 and tags.count("(7)") == 8


@every_port
def test_constants_stand_in_the_parameters_alone(any_port: Port) -> None:
    parameters = section(any_port, "Parameters")
    elsewhere = source(any_port).replace(parameters, "")
    assert set(re.findall(r"(?<![\w.%:])\d+\.\d+|\d+e-\d+", elsewhere)) <= {"0.0"}


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
    assert not re.search(r"\btheta\b", code)


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
    parameters = snake(section(any_port, "Parameters"))
    for name, value in SETTINGS.get(any_port.name, {}).items():
        assert re.search(rf"\b{name} = {re.escape(value)}(;| )", parameters), f"{name} = {value}"


@every_port
def test_every_parameter_is_used(any_port: Port) -> None:
    parameters = section(any_port, "Parameters")
    names = re.findall(r"(\w+) = [-\d.e\"']", parameters)
    assert len(names) >= 12
    text = source(any_port)
    elsewhere = text[text.index(parameters) + len(parameters) :]
    _, _, passed_on = parameters.partition("parameters = {")  # into the Simulink block's code
    assert [name for name in names if not re.search(rf"\b{name}\b", passed_on + elsewhere)] == []


OCTAVE_FIGURE = [
    "plot(t, x1, '-', t, r, '--')", "ylabel('output y')", "legend({'x_1', 'r'})",
    "plot(t, x1 - r, '-')", "ylabel('tracking error z_1')", "legend({'z_1'})",
    "plot(t, theta_hat, '-', t, theta + 0 * t, '--')", "ylabel('parameter, 1/s')",
    r"legend({'estimate of \theta', '\theta'})", "xlabel('time (s)')", "print(window, png_name, '-dpng')",
]  # fmt: skip
FIGURES = {  # the curves, legends and labels of the three panels, in order
    "python": [
        'tracking.plot(t, x1, "-", label="$x_1$")', 'tracking.plot(t, r, "--", label="$r$")', '"output y"',
        'error.plot(t, x1 - r, "-", label="$z_1$")', '"tracking error $z_1$"',
        r'estimate.plot(t, theta_hat, "-", label=r"estimate of $\theta$")',
        r'estimate.plot(t, np.full_like(t, theta), "--", label=r"$\theta$")', '"parameter, 1/s"', '"time (s)"',
        "axes.legend()", "savefig(png_name)",
    ],
    "matlab": OCTAVE_FIGURE,
    "simulink": OCTAVE_FIGURE,
    "mathematica": [
        r"PlotLegends -> legends", r"FrameLabel -> {\"time (s)\", label}",
        r"panel[{x1, r}, {\"x1\", \"r\"}, \"output y\"]",
        r"panel[{x1 - r}, {\"z1\"}, \"tracking error z1\"]",
        r"panel[{thetaHat, 0 * t + theta}, {\"estimate of theta\", \"theta\"}, \"parameter, 1/s\"]",
        "Export[pngName, figure]",
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", FIGURES)
def test_figures_show_tracking_error_and_estimate(name: str) -> None:
    text = source(ALL[name])
    figures = text[text.index(ALL[name].section.format("Figures")) :]
    places = [figures.find(fragment) for fragment in FIGURES[name]]
    assert -1 not in places, FIGURES[name][places.index(-1)]
    assert places == sorted(places)


def test_notebook_has_one_input_cell_per_section() -> None:
    styles = re.findall(r'"(Title|Text|Section|Input)"\]', source(ALL["mathematica"]))
    assert styles == ["Title", "Text", *["Section", "Input"] * (len(SECTIONS) + 1)]
