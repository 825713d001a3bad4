# SPDX-License-Identifier: MIT
"""The playground: its programs, written like those of the languages, its sliders, mistakes, starts and questions."""

import functools
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from difflib import unified_diff
from itertools import cycle
from math import log10
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from conformance.judging.trajectory import Array
from conformance.pages.report.curves import GRID, exact_curves
from conformance.pages.report.exercises import marked
from conformance.pages.report.listing import highlighted_lines, listing
from conformance.pages.report.picture import Line, picture
from conformance.places import PLANTS
from conformance.programs.ports import LESSON, Port
from conformance.programs.spelling import Spelling
from conformance.programs.writer import Program, templates
from conformance.theory.derivation import letter
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment, is_diagonal
from conformance.theory.expressions import FUNCTIONS, names_in
from conformance.theory.statements import ENTRY, Parameter, parameters_of, statements_of
from conformance.trials.edits import Edit, edited
from conformance.trials.variant import EVERY, Variant
from conformance.truth.exact import Exact

HERE = Path(__file__).parent
PROGRAM = Port(
    name="playground",
    folder=HERE,
    language="JavaScript",
    source="program.js",
    method="RK4, written out",
    comment=("// ", ""),
    section="// ---- {} ----",
    products=(),
    engines=(),
    names="camel",
    statement="const {};",
    functions=tuple((name, f"Math.{name}({{}})") for name in FUNCTIONS),
    power="Math.pow({}, {})",
    reserved="""
        arguments await break case catch class const continue debugger default delete do else enum eval export extends
        false finally for function if implements import in instanceof interface let new null package private protected
        public return static super switch this throw true try typeof undefined var void while with yield
    """,
    template="program.js.jinja",
)
STARTS = {LESSON: "the lesson", "no_excitation": "Problem 4", "problem_6": "Problem 6"}  # of plants/: title
STEPS = 240  # of a slider
GAINS = 20.0  # by which a gain may differ from the experiment's, either way
CONSTANTS = 3.0  # and a constant of the plant
WIDEST = (1.0, 2.0, 3.0, 5.0)  # times a power of ten: ends of other sliders


@dataclass(frozen=True)
class Slider:
    """A constant that the reader moves: its name in the programs, its label (LaTeX), what it is, and its range.

    Where it is logarithmic, `low` and `high` are powers of ten.
    """

    name: str
    label: str
    meaning: str
    unit: str
    low: float
    high: float
    logarithmic: bool

    @property
    def step(self) -> float:
        """By how much the slider moves at a touch of a key."""
        return (self.high - self.low) / STEPS


@dataclass(frozen=True)
class Mistake:
    """A mistake in the program of a reference, and the lines in which that is another."""

    variant: Variant
    program: Markup
    difference: Markup
    reference: str


@dataclass(frozen=True)
class Question:
    """A question, what to look at, the answer in words, and the start, constants and mistake that show it."""

    question: str
    section: str
    look: str
    answer: str
    start: str = LESSON
    mistake: str = ""
    constants: Mapping[str, float] = field(default_factory=dict)
    figures: Mapping[str, float] = field(default_factory=dict)  # of the run, which the words name
    exercise: str = ""  # that goes further

    def told(self, words: str) -> list[str]:
        """The words with the figures, and every second part LaTeX."""
        return re.sub(r"«(\w+)»", lambda name: f"{self.figures[name[1]]:g}", words).split("$")


def read_questions() -> list[Question]:
    """The questions in their order."""
    asked = tomllib.loads((HERE / "questions.toml").read_text(encoding="utf-8"))["question"]
    return [Question(**question) for question in asked]


# ---- Programs ----


@functools.lru_cache(64)
def program_text(experiment: Experiment, variant: Variant | None = None) -> str:
    """The program, or the one that makes a mistake; raises ValueError where the mistake's text is not in it once."""
    program = Program(experiment, PROGRAM, statements_of(experiment))
    text = templates(PROGRAM).get_template(PROGRAM.template).render(
        program=program, **program.given(), **dict(_figures(experiment, program.spelling))
    )  # fmt: skip
    edits = variant.edits if variant else ()
    spelling = Spelling(PROGRAM, ())
    return edited(text, (Edit(spelling.spelled(edit.old), spelling.spelled(edit.new)) for _, edit in edits))


def _figures(experiment: Experiment, spelling: Spelling) -> Iterator[tuple[str, object]]:
    """What the template says of V and V', as the language spells it."""
    own = spelling.name
    n, p = len(experiment.states), len(experiment.unknown)
    tilde = [f"{own(q.estimate)} - {own(f'{q.name}_true')}" for q in experiment.unknown]
    diagonal = is_diagonal(experiment)
    z = [f"z{i}" for i in range(1, n + 1)]
    yield "constants", [own(c.name) for c in parameters_of(experiment)]
    yield "final_time", own("final_time")
    yield "z", z
    yield "full_gamma", not diagonal
    if diagonal:
        shares = [f"({of}) ** 2 / (2 * {own(experiment.gamma(i, i))})" for i, of in enumerate(tilde, 1)]
    else:
        gammas = experiment.gammas
        entries = [[experiment.gamma(i, j) for j in range(1, p + 1)] for i in range(1, p + 1)]
        rows = [f"[{', '.join(own(name) if name in gammas else '0' for name in row)}]" for row in entries]
        shares = [f"parameterShare([{', '.join(rows)}], [{', '.join(tilde)}])"]
    yield "of_parameters", shares or ["0"]
    yield "dissipated", [f"{own(f'k{i}')} * {name} ** 2" for i, name in enumerate(z, 1)]
    yield "named", [name if own(name) == name else f"{name}: {own(name)}" for name in experiment.names] + z


def mistakes(experiments: Mapping[str, Experiment], variants: Iterable[Variant]) -> Iterator[Mistake]:
    """The mistakes that are the same edit in every program, in each experiment whose program has the text."""
    candidates = [
        variant
        for variant in variants
        if variant.refused_by and variant.edits and not variant.constants
        and all(port == EVERY for port, _ in variant.edits)
    ]  # fmt: skip
    for name, experiment in experiments.items():
        right = program_text(experiment)
        for variant in candidates:
            with suppress(ValueError):
                wrong = program_text(experiment, variant)
                yield Mistake(variant, Markup(wrong), difference(right, wrong), name)


def difference(right: str, wrong: str) -> Markup:
    """The lines in which a program is another, as they were and as they are."""
    lines = list(unified_diff(right.splitlines(), wrong.splitlines(), n=0, lineterm=""))[2:]
    changed = [line for line in lines if not line.startswith("@@")]
    shortened = [line[0] + line[1:].strip().partition("  //")[0] for line in changed]
    return marked(shortened, PROGRAM.source)


# ---- Sliders ----


def sliders(experiment: Experiment) -> list[Slider]:
    """A slider for each constant but the horizon, in the programs' order."""
    rows = {name for row in experiment.rows for name in names_in(row)}
    return [
        slider(c, in_plant=c.name in rows)
        for c in parameters_of(experiment)
        if c.name != "final_time" and not c.wording.startswith(ENTRY)
    ]


def slider(c: Parameter, in_plant: bool) -> Slider:
    """The slider of a constant; one of the plant, and a gain, keep their sign, over decades."""
    value = float(c.value)
    name = c.name.removesuffix("_true").removesuffix("_start")
    label = {"amplitude": "A"}.get(name, letter(name)) + ("(0)" if c.name.endswith("_start") else "")
    factor = GAINS if "gain" in c.wording else CONSTANTS if in_plant and value > 0 else 0.0
    if factor:
        return Slider(c.name, label, c.by_itself, c.unit, log10(value / factor), log10(value * factor), True)
    wanted = max(2.0, 2.5 * abs(value))
    power = 10.0 ** int(log10(wanted))
    end = next((of * power for of in WIDEST if of * power >= wanted), 10 * power)
    return Slider(c.name, label, c.by_itself, c.unit, -end, end, False)


# ---- Charts ----


@dataclass(frozen=True)
class Drawing:
    """A chart of the playground: what kind, its formula (LaTeX), the signals drawn and what stands beside them.

    `keys` are (class, LaTeX) of what is told apart by its colour; `still` is the chart of the experiment itself.
    """

    key: str
    kind: str  # time, budget, rate, logarithm or plane
    formula: str
    words: str
    signals: tuple[str, ...]
    beside: tuple[str, ...] = ()
    keys: tuple[tuple[str, str], ...] = ()
    axes: tuple[str, str] = ("t (s)", "")
    still: Markup | str = ""


FIRST_DRAWINGS = ("output", "estimates", "logarithm")  # on the first screen too
LITTLE = 0.01  # share of V(0) that is left where the shares of V are no longer drawn
COLOURS = ("--accent", "--second", "--third", "--quiet")  # of the signals of a chart
TILDE = r"\tilde\theta"


def drawings(e: Experiment, solution: Exact) -> Iterator[Drawing]:
    """The charts, V first."""
    n, p = len(e.states), len(e.unknown)
    of_z = r"\tfrac12 " + ("z_1^2" if n == 1 else "(z_1^2 + z_2^2)" if n == 2 else rf"\sum_{{i \le {n}}} z_i^2")
    of_theta = {0: "", 1: rf"\tfrac{{1}}{{2\gamma}} {TILDE}^2"}.get(p, rf"\tfrac12 {TILDE}^\top \Gamma^{{-1}} {TILDE}")
    lost = " + ".join(f"k_{i} z_{i}^2" for i in range(1, n + 1)) if n < 3 else rf"\sum_{{i \le {n}}} k_i z_i^2"
    output, z = e.states[0], tuple(f"z{i}" for i in range(1, n + 1))
    estimates, parameters = ", ".join(map(letter, e.estimates)), ", ".join(letter(q.name) for q in e.unknown)
    budget = (
        *((("of-parameters", of_theta),) if p else ()),
        ("of-errors", of_z),
        ("lost", rf"\textstyle\int_0^t ({lost})"),
    )
    charts = [
        Drawing("budget", "budget", "V = " + " + ".join(filter(None, (of_z, of_theta))),
                "V over time, as the sum of its shares, and what has been dissipated of V(0)", ("V",), keys=budget),
        Drawing("output", "time", rf"{letter(output)} \text{{ and }} r",
                f"{output} and the reference", (output,), ("r",),
                keys=(("line-0", letter(output)), ("beside", "r"))),
        Drawing("estimates", "time", rf"{estimates} \text{{ and }} {parameters}",
                "estimates and true parameters", e.estimates, tuple(f"{q.name}_true" for q in e.unknown),
                keys=(*((f"line-{i}", letter(name)) for i, name in enumerate(e.estimates)), ("beside", parameters))),
        Drawing("errors", "time", ", ".join(map(letter, z)), "error coordinates", z,
                keys=tuple((f"line-{i}", letter(name)) for i, name in enumerate(z)) if n > 1 else ()),
        Drawing("control", "time", "u", "control", ("u",)),
        Drawing("rate", "rate", rf"\dot V = -{lost if n < 2 else f'({lost})'}", "the derivative of V", ("V_dot",)),
        Drawing("logarithm", "logarithm", "V", "V on a logarithmic axis, down to the integration's own error", ("V",),
                keys=(("floor", r"\text{the integration's own error}"),)),
        Drawing("plane_z", "plane", r"(z_1, z_2)", "z2 against z1, and the circle V = V(0)",
                ("z1", "z2"), axes=("z₁", "z₂")),
        Drawing("plane_theta", "plane", rf"(z_1, {TILDE})", "the parameter error against z1, and the ellipse V = V(0)",
                ("z1", "tilde"), axes=("z₁", "θ̃")),
    ]  # fmt: skip
    left_out = {*({"plane_z"} if n < 2 else ()), *({"estimates", "plane_theta"} if not p else ())}
    shown = signals_of(e, solution)
    for chart in charts:
        if chart.key not in left_out:
            yield replace(chart, still=still(chart, shown))


def signals_of(e: Experiment, solution: Exact) -> dict[str, Array]:
    """What the charts draw of the exact solution, by name, on the grid of the page."""
    found = exact_curves(solution)
    found |= {"t": GRID * solution.setting.horizon, "r": found["reference"]}
    one = np.ones_like(GRID)
    found |= {f"{q.name}_true": float(q.true) * one for q in e.unknown}
    found["ofParameters"] = found["V"] - sum(found[f"z{i}"] ** 2 / 2 for i in range(1, len(e.states) + 1))
    found["whole"] = found["V"][0] * one
    found["zero"] = 0 * one
    if e.unknown:
        found["tilde"] = found[e.unknown[0].estimate] - float(e.unknown[0].true)
    return found


def still(chart: Drawing, shown: Mapping[str, Array]) -> Markup:
    """A chart as a picture."""
    lines = [Line(shown[n], "var(--quiet)", 1.25, "4 4", symbol=n.removesuffix("_true")) for n in chart.beside]
    shown = dict(shown)
    if chart.kind == "budget":
        until = shown["t"] <= np.ceil(2 * shown["t"][shown["V"] > LITTLE * shown["V"][0]][-1])
        shown = {name: values[until] for name, values in shown.items()}
        lines += [
            Line(shown["ofParameters"], "var(--of-parameters)", down_to=shown["zero"]),
            Line(shown["V"], "var(--of-errors)", down_to=shown["ofParameters"]),
            Line(shown["whole"], "var(--lost)", down_to=shown["V"]),
        ]
    if chart.kind == "rate":
        lines.append(Line(shown[chart.signals[0]], "var(--lost)", down_to=shown["zero"]))
    if chart.kind == "plane":
        across, up = (shown[name] for name in chart.signals)
        return picture(across, [Line(up, "var(--accent)")], chart.words, across=chart.axes[0])
    colours = zip(chart.signals, cycle(COLOURS), strict=False)
    lines += [Line(shown[name], f"var({colour})", symbol=name.removesuffix("_dot")) for name, colour in colours]
    return picture(shown["t"], lines, chart.words, logarithmic=chart.kind == "logarithm")


# ---- The whole ----


@dataclass(frozen=True)
class Playground:
    """All that the page needs of it; `starts` are experiments by name, with their titles, the lesson's first."""

    starts: Mapping[str, tuple[str, Experiment]]
    sliders: list[Slider]
    mistakes: list[Mistake]
    questions: list[Question]
    drawings: list[Drawing]

    @property
    def experiment(self) -> Experiment:
        """The one that it begins with."""
        return next(experiment for _, experiment in self.starts.values())

    @property
    def first_drawings(self) -> list[Drawing]:
        """The charts of the first screen: the output meets the reference, the estimates move, V falls."""
        return [drawing for drawing in self.drawings if drawing.key in FIRST_DRAWINGS]

    @property
    def first_sliders(self) -> list[Slider]:
        """Those of the first screen: of an unknown parameter and of its adaptation gain; else of the first gain."""
        e = self.experiment
        wanted = (f"{e.unknown[0].name}_true", next(iter(e.gammas))) if e.unknown else ("k1",)
        return [slider for slider in self.sliders if slider.name in wanted]

    @property
    def titles(self) -> dict[str, Variant]:
        """The mistakes by name, each once."""
        return {mistake.variant.name: mistake.variant for mistake in self.mistakes}

    def start_of(self, mistake: str) -> str:
        """The first start whose program can make the mistake."""
        return next(m.reference for m in self.mistakes if m.variant.name == mistake)

    @property
    def code(self) -> Markup:
        """The program as it stands, in colours."""
        text = program_text(self.experiment)
        return listing(text, highlighted_lines(text, PROGRAM.source))

    @property
    def programs(self) -> dict[str, Markup]:
        """The programs by reference and mistake, as "name/mistake"."""
        right = {f"{name}/": Markup(program_text(e)) for name, e in references(self.starts).items()}
        return right | {f"{m.reference}/{m.variant.name}": m.program for m in self.mistakes}

    @property
    def data(self) -> dict[str, Any]:
        """What the script needs: the starts, and what the questions set."""
        e = self.experiment
        return {
            "states": e.states,
            "estimates": e.estimates,
            "truth": [f"{q.name}_true" for q in e.unknown],
            "horizon": float(e.horizon),
            "starts": {
                name: {
                    "title": title,
                    "reference": reference_name(self.starts, of),
                    "constants": {c.name: float(c.value) for c in parameters_of(of) if c.name != "final_time"},
                }
                for name, (title, of) in self.starts.items()
            },
            "questions": [{"start": q.start, "mistake": q.mistake, "constants": q.constants} for q in self.questions],
            "drawings": {
                d.key: {"kind": d.kind, "signals": d.signals, "beside": d.beside, "axes": d.axes} for d in self.drawings
            },
        }


def reference_name(starts: Mapping[str, tuple[str, Experiment]], experiment: Experiment) -> str:
    """The first start that has the same reference: whose program is the same."""
    return next(name for name, (_, other) in starts.items() if other.reference == experiment.reference)


def references(starts: Mapping[str, tuple[str, Experiment]]) -> dict[str, Experiment]:
    """The starts whose programs differ."""
    return {name: e for name, (_, e) in starts.items() if reference_name(starts, e) == name}


def playground(solution: Exact, variants: Iterable[Variant] = (), plant: Experiment | None = None) -> Playground:
    """That of a plant, or of the lesson, which has its problems as further starts, mistakes and questions."""
    if plant is not None:
        return Playground(
            starts={plant.name: (plant.title, plant)},
            sliders=sliders(plant),
            mistakes=[],
            questions=[],
            drawings=list(drawings(plant, solution)),
        )
    starts = {name: (title, read_experiment(PLANTS / f"{name}.toml")) for name, title in STARTS.items()}
    experiment = starts[LESSON][1]
    return Playground(
        starts=starts,
        sliders=sliders(experiment),
        mistakes=list(mistakes(references(starts), variants)),
        questions=read_questions(),
        drawings=list(drawings(experiment, solution)),
    )
