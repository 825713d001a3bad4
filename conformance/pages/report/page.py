# SPDX-License-Identifier: MIT
"""The page put together: what the results say, as one HTML file."""

import base64
import json
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import log10
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from conformance.atomic import write_atomically
from conformance.judging.checks import Result
from conformance.judging.trajectory import Array
from conformance.judging.verdict import Judgement, Verdict, headline
from conformance.pages.report.curves import (
    ERROR_PANELS,
    GRID,
    PANELS,
    curves,
    exact_curves,
    packed,
    pictures,
)
from conformance.pages.report.equations import equations
from conformance.pages.report.exercises import EXERCISE_PANELS, in_order, kill_matrix, shown
from conformance.pages.report.listing import highlighted, highlighting
from conformance.pages.report.playground import playground
from conformance.pages.report.typesetting import MODULES, Typesetter, type_css, version_of
from conformance.programs.ports import ROOT, Port
from conformance.programs.sources import STEPS
from conformance.programs.table import engine_and_version
from conformance.theory.scenario import LESSON, Scenario
from conformance.trials.variant import Variant, read_variants
from conformance.truth.exact import Exact, exact

HERE = Path(__file__).parent
COLOURS = 8  # in frame.css
PAGE = ROOT / "build" / "report" / "index.html"


@dataclass(frozen=True)
class Cell:
    """A result of one program: its figure, short and in words."""

    status: str  # pass, fail or none
    figure: str
    words: str
    weight: float = 0.0  # how near the figure is to its bound, on a logarithmic scale from 0 to 1


@dataclass(frozen=True)
class Program:
    """A program on the page: its verdict, its run, and its code by steps."""

    name: str
    language: str
    method: str
    source: str
    colour: int
    verdict: Verdict
    engine: str
    licence: str
    run: str
    error: str
    code: Mapping[str, Markup]
    diagram: str


NOTHING = Cell("none", "", "not measured")


def write_page(path: Path, ports: Mapping[str, Port], judgement: Judgement, scenario: Scenario = LESSON) -> None:
    """Write the page on these ports; raises ValueError where what it embeds is not installed."""
    write_atomically(path, page(ports, judgement, scenario))


def page(ports: Mapping[str, Port], judgement: Judgement, scenario: Scenario = LESSON) -> str:
    """The page on these ports, as they were judged, as HTML."""
    verdicts = {verdict.name: verdict for verdict in judgement.verdicts if verdict.name in ports}
    programs = [program(port, verdicts[name], i % COLOURS) for i, (name, port) in enumerate(ports.items())]
    variants = read_variants()
    exercises = [shown(variant, ports.values()) for variant in in_order(variants.values())]
    solution = exact(scenario)
    drawn = {v.name: curves(solution, v.trajectory) for v in verdicts.values() if v.trajectory}
    bounds = {v.name: {state: result.bound for state, result in v.errors.items()} for v in verdicts.values()}
    play = playground(variants.values(), solution)
    environment = Environment(
        loader=FileSystemLoader([HERE / "templates", HERE / "static", MODULES / "uplot" / "dist"]),
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    typesetter = environment.filters["math"] = Typesetter()
    html = environment.get_template("page.html").render(
        raw=raw(environment),
        headline=headline(list(verdicts.values())),
        conforms=all(verdict.conforms for verdict in verdicts.values()),
        made=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        commit=commit(),
        programs=programs,
        claims=claims(list(verdicts.values())),
        pairs=against(list(ports), judgement.pairs),
        panels=PANELS,
        error_panels=ERROR_PANELS,
        points=GRID.size,
        steps=STEPS,
        equations=equations(scenario),
        exercises=exercises,
        exercise_panels=EXERCISE_PANELS,
        outcomes=outcomes(in_order(variants.values()), ports),
        playground=play,
        playground_data=Markup(embedded(play.data)),
        highlighting=Markup(highlighting()),
        drawn=list(drawn),
        pictures=pictures(solution, drawn, bounds, COLOURS),
        horizon=f"{float(scenario.horizon):g}",
        faces=type_css(),
        libraries={name: version_of(name.lower()) for name in ("uPlot", "KaTeX")},
        data=Markup(embedded(data(solution, drawn, bounds))),
        exercise_data=Markup(embedded({exercise.variant.name: exercise.curves for exercise in exercises})),
    )
    return typesetter.filled(html)


def raw(environment: Environment) -> Any:
    """A function that gives a style or script as it is, for the place where it is embedded."""

    def read(name: str) -> Markup:
        assert environment.loader is not None
        text, _, _ = environment.loader.get_source(environment, name)
        if re.search("</(script|style)", text, flags=re.IGNORECASE):
            raise ValueError(f"{name}: found the end of its own element in the text")
        return Markup(text)

    return read


def commit() -> str:
    """The commit of the tree, and whether it has changed since; "" outside of version control."""

    def git(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)

    try:
        name = git("rev-parse", "--short", "HEAD")
    except OSError:
        return ""
    if name.returncode:
        return ""
    return name.stdout.strip() + (", with changes" if git("status", "--porcelain").stdout else "")


# ---- Verdict ----


def program(port: Port, verdict: Verdict, colour: int) -> Program:
    """What the page says of one port."""
    run = port.run()
    state, worst = max(verdict.errors.items(), key=lambda item: item[1].figure / item[1].bound, default=("", None))
    return Program(
        name=port.name,
        language=port.language,
        method=port.method,
        source=f"{port.folder.name}/{port.source}",
        colour=colour,
        verdict=verdict,
        engine=engine_and_version(run) if run else "",
        licence=licence(port, run),
        run=f"{run['start'][:19].replace('T', ' ')} UTC, {run['seconds']:.2f}\N{NO-BREAK SPACE}s" if run else "",
        error=f"{worst.figure:.1e} in {state}, of {worst.bound:.1e}" if worst else "",
        code=highlighted(port),
        diagram=diagram(port),
    )


def licence(port: Port, run: Mapping[str, Any] | None) -> str:
    """Whether the engine that ran is proprietary, stands in for one that is, or neither."""
    if run is None:
        return ""
    if run["proprietary"]:
        return "proprietary"
    return "open, in place of a proprietary engine" if any(e.proprietary for e in port.engines) else "open"


def claims(verdicts: Sequence[Verdict]) -> list[tuple[str, str, list[Cell]]]:
    """(claim, section, one cell per program) of every claim that was measured."""
    order = {result.claim: result.section for verdict in verdicts for result in verdict.results}
    measured = [{result.claim: cell(result) for result in verdict.results} for verdict in verdicts]
    return [
        (claim.replace("-", " "), section, [results.get(claim, NOTHING) for results in measured])
        for claim, section in order.items()
    ]


def cell(result: Result) -> Cell:
    """A result as a cell; it weighs 1 at its bound, and 0 six decades below."""
    share = result.figure / result.bound if result.bound else float(not result.passed)
    weight = 1 + log10(share) / 6 if 0 < share < 1 else float(share > 0)
    words = f"{result.figure:.3g}, bound {result.bound:.3g} ({result.bound_from}); {result.where}"
    return Cell(
        "pass" if result.passed else "fail",
        f"{result.figure:.1g}",
        words,
        round(max(0.0, weight), 2),
    )


def against(ports: Iterable[str], pairs: Mapping[tuple[str, str], Result]) -> list[tuple[str, str, list[Cell]]]:
    """(port, "", one cell per port): how far each two are apart, over all states and times."""
    cells = {frozenset(names): cell(result) for names, result in pairs.items()}
    itself = Cell("self", "", "itself")
    return [(a, "", [itself if a == b else cells.get(frozenset((a, b)), NOTHING) for b in ports]) for a in ports]


def outcomes(variants: Iterable[Variant], ports: Iterable[str]) -> list[tuple[str, str, list[Cell]]]:
    """(variant, section, one cell per port): how many checks refuse it, as it must be or not."""
    found = kill_matrix()
    return [
        (variant.title, variant.section, [outcome(variant, found.get((variant.name, port))) for port in ports])
        for variant in variants
        if any((variant.name, port) in found for port in ports)
    ]


def outcome(variant: Variant, row: Mapping[str, Any] | None) -> Cell:
    """What became of a variant in one program: a mistake must be refused by its check, an experiment conform."""
    if row is None:
        return Cell("none", "", "the program has no such text")
    refusals = row["refusals"]
    as_wanted = variant.refused_by in refusals if variant.refused_by else row["status"] == "pass"
    words = f"refused by {', '.join(refusals)}" if refusals else "conforms"
    figure = f"refused {len(refusals)}" if refusals else "conforms"
    return Cell("pass" if as_wanted else "fail", figure, words)


def diagram(port: Port) -> str:
    """The block diagram that the port left, as an address that holds its data; "" where there is none."""
    path = next(iter(sorted(port.build.glob("*.svg"))), None)
    return f"data:image/svg+xml;base64,{base64.b64encode(path.read_bytes()).decode()}" if path else ""


# ---- Data ----


def data(
    solution: Exact, drawn: Mapping[str, Mapping[str, Array]], bounds: Mapping[str, Mapping[str, float]]
) -> dict[str, Any]:
    """What the scripts draw: curves in single precision, base64, on one grid; tolerances per column."""
    setting = solution.setting
    return {
        "horizon": setting.horizon,
        "theta": float(setting.theta[0]),
        "grid": packed({"t": GRID * setting.horizon})["t"],
        "exact": packed(exact_curves(solution)),
        "ports": {name: packed(values) for name, values in drawn.items()},
        "tolerance": bounds,
    }


def embedded(value: Any) -> str:
    """JSON that can stand in a script element."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")
