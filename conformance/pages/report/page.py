# SPDX-License-Identifier: MIT
"""The page put together: what the results say, as one HTML file."""

import json
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from conformance.atomic import write_atomically
from conformance.judging.layout import COUNTED
from conformance.judging.trajectory import Array
from conformance.judging.verdict import Judgement, Verdict, headline
from conformance.pages.report.campaigns import campaigns
from conformance.pages.report.curves import (
    GRID,
    SPANS,
    curves,
    error_panels,
    exact_curves,
    leaders,
    legend,
    packed,
    panels,
    pictures,
)
from conformance.pages.report.derivation import steps
from conformance.pages.report.evidence import (
    DECADES,
    Changes,
    Error,
    Refusal,
    against,
    claims,
    errors,
    in_words,
    outcomes,
    refusal,
    rounded_up,
    said,
)
from conformance.pages.report.exercises import EXERCISE_PANELS, in_order, shown
from conformance.pages.report.listing import highlighting
from conformance.pages.report.playground import playground
from conformance.pages.report.rest import at_rest
from conformance.pages.report.rows import Part, parts
from conformance.pages.report.symbols import Notation, Symbol, linker, symbols_of
from conformance.pages.report.typesetting import MODULES, Typesetter, type_css, version_of
from conformance.pages.report.ways import ways
from conformance.programs.ports import ROOT, SIX, Port
from conformance.programs.sources import source
from conformance.programs.table import engine_and_version
from conformance.theory.derivation import Derivation, derivation
from conformance.theory.experiments import Experiment
from conformance.theory.expressions import negative
from conformance.theory.lesson import LESSON, SECTIONS, Section
from conformance.trials.variant import Variant, read_variants
from conformance.truth.exact import Exact, exact

HERE = Path(__file__).parent
COLOURS = 8  # in frame.css
PLAIN = " !$()*+,/:;=?@[\\]^`{|}~"  # signs that need no escape in the data of an address
PAGE = ROOT / "build" / "report" / "index.html"
OF_ITS_OWN = Section(range(1), "in no section of the lesson: numbers of this plant's own")
CITED = re.compile(r"(?<!\w)\(\d{1,2}\)")  # in words, a section of the lesson


@dataclass(frozen=True)
class Program:
    """A program on the page: its verdict, its run, and its code by steps."""

    name: str
    language: str
    method: str
    source: str
    colour: int
    verdict: Verdict
    refusal: Refusal | None
    engine: str
    licence: str
    run: str
    errors: list[Error]
    code: Mapping[str, Markup]
    diagram: str
    file: str
    address: str  # that holds the source


def page_of(experiment: Experiment) -> Path:
    """Where the page of an experiment lies."""
    return PAGE if experiment == LESSON else ROOT / "build" / experiment.name / "report" / "index.html"


def write_page(
    path: Path,
    ports: Mapping[str, Port],
    judgement: Judgement,
    experiment: Experiment = LESSON,
    changes: Changes | None = None,
) -> None:
    """Write the page on these ports; raises ValueError where what it embeds is not installed."""
    write_atomically(path, page(ports, judgement, experiment, changes))


def page(
    ports: Mapping[str, Port],
    judgement: Judgement,
    experiment: Experiment = LESSON,
    changes: Changes | None = None,
    index: str = "",
) -> str:
    """The page on these ports, as they were judged, as HTML.

    `changes` are those since an earlier result, `index` the address of the index of all plants, "" for none.
    """
    for port in ports.values():
        if port.plant and not port.source_path.is_file():
            raise ValueError(f"{port.plant}: found no program for {port.name}, expected that of make all PLANT=FILE")
    derived = derivation(experiment)
    notation = Notation(derived)
    ports = dict(sorted(ports.items(), key=lambda item: SIX.index(item[0]) if item[0] in SIX else len(SIX)))
    verdicts = {name: next(v for v in judgement.verdicts if v.name == name) for name in ports}
    shown_parts = parts(experiment, notation, ports.values())
    programs = [program(port, verdicts[name], i % COLOURS, shown_parts) for i, (name, port) in enumerate(ports.items())]
    languages = {name: port.language for name, port in ports.items()}
    solution = exact(experiment)
    lesson = experiment == LESSON
    variants = read_variants() if lesson else {}
    play = playground(solution, variants.values(), None if lesson else experiment)
    symbols = symbols_of(experiment, notation)
    environment, typesetter = environment_of(symbols, notation)
    html = environment.get_template("page.html").render(
        raw=raw(environment),
        programs=programs,
        **facts(list(verdicts.values()), languages, judgement),
        ways=list(ways(experiment, languages, [p.name for p in programs if p.code], list(verdicts.values()), variants)),
        **derivation_shown(derived, notation, symbols, shown_parts),
        title=experiment.title,
        rest=at_rest(experiment) if lesson else None,
        lesson=lesson,
        counted=COUNTED,
        sections=SECTIONS if experiment.section else (*SECTIONS, OF_ITS_OWN),
        index=index,
        source=experiment.source,
        parts=shown_parts,
        **trajectories(list(verdicts.values()), languages, experiment, solution),
        **exercises(ports, variants),
        campaigns=campaigns(ports, lesson),
        changes=changes,
        result=page_of(experiment).parents[1].relative_to(ROOT) / "result.json",
        playground=play,
        playground_data=Markup(embedded(play.data)),
        faces=type_css(),
        highlighting=Markup(highlighting()),
        libraries={name: version_of(name.lower()) for name in ("uPlot", "KaTeX")},
    )
    return typesetter.filled(html)


def environment_of(symbols: Sequence[Symbol], notation: Notation) -> tuple[Environment, Typesetter]:
    """What the templates are read by, and what sets the equations that they ask for."""
    environment = Environment(
        loader=FileSystemLoader([HERE / "templates", HERE / "static", MODULES / "uplot" / "dist"]),
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    typesetter = Typesetter()
    known = "|".join(sorted((s.name for s in symbols), key=len, reverse=True))
    names = re.compile(rf"\b({known}|Gamma|tau\d)\b((?:&#39;)*)")

    def set_name(found: re.Match[str]) -> Markup:
        symbol = r"\Gamma" if found[1] == "Gamma" else notation.name(found[1])
        return typesetter(symbol + found[2].replace("&#39;", "'"), "inline")

    link = linker(symbols)
    environment.filters["math"] = lambda latex, display="block": typesetter(link(latex), display)
    environment.filters["words"] = lambda text: Markup(
        CITED.sub(r"<small>\g<0></small>", names.sub(set_name, str(Markup.escape(text))))
    )
    environment.globals |= {"symbols": symbols, "notation": notation}
    return environment, typesetter


def facts(verdicts: list[Verdict], languages: Mapping[str, str], judgement: Judgement) -> dict[str, Any]:
    """What the verdict and its evidence say."""
    return {
        "headline": in_words(headline(verdicts), languages),
        "conforms": all(verdict.conforms for verdict in verdicts),
        "made": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": commit(),
        "claims": claims(verdicts),
        "language_of": languages,
        "said": said,
        "pairs": against(languages, judgement.pairs),
        "decades": range(DECADES[0], DECADES[1] + 1),
    }


def derivation_shown(
    derived: Derivation, notation: Notation, symbols: Sequence[Symbol], shown_parts: Sequence[Part]
) -> dict[str, Any]:
    """What the derivation says: the plant, V, each step, the theorem."""
    e, n = derived.experiment, len(derived.experiment.states)
    by_name = {equation.name: equation for part in derived.parts for equation in part.equations}
    zs = [notation.name(f"z{i}") for i in range(1, n + 1)]
    losses = notation.expression(negative(by_name["V_dot"].expression))
    gammas = [name for name in (s.name for s in symbols) if re.fullmatch(r"gamma\d*", name)]
    ks = ", ".join(notation.name(f"k{i}") for i in range(1, n + 1))
    return {
        "n": n,
        "states": e.states,
        "output": e.states[0],
        "estimates": e.estimates,
        "laws": [f"{estimate}_dot" for estimate in e.estimates],
        "unknown": [notation.name(p.name) for p in e.unknown],
        "tildes": [notation.name(f"{p.name}_tilde") for p in e.unknown],
        "plant": notation.equations(derived.parts[0].equations[:n]),
        "lyapunov": notation.equation("V", by_name["V"].expression),
        "errors": [notation.equation(f"{p.name}_tilde", by_name[f"{p.name}_tilde"].expression) for p in e.unknown],
        "derivation_steps": steps(derived, notation, shown_parts),
        "gains": ", ".join([ks, *map(notation.name, gammas)]) + " > 0",
        "gains_k": ks,
        "gains_gamma": ", ".join(map(notation.name, gammas)),
        "zs": ", ".join(zs),
        "identity": rf"\dot V = -\left({losses}\right) \le 0",
        "integral": rf"\int_0^\infty \left({losses}\right) dt \le V(0)",
        "outcome": derived.outcome,
    }


def trajectories(
    verdicts: list[Verdict], languages: Mapping[str, str], experiment: Experiment, solution: Exact
) -> dict[str, Any]:
    """What the curves are drawn from."""
    drawn = {v.name: curves(solution, v.trajectory) for v in verdicts if v.trajectory}
    bounds = {v.name: {state: result.bound for state, result in v.errors.items()} for v in verdicts}
    signals, of_errors, known = panels(experiment), error_panels(experiment), exact_curves(solution)
    charts = (*signals, *of_errors)
    lines = {panel.signal: leaders(drawn, panel) for panel in charts}
    return {
        "panels": signals,
        "error_panels": of_errors,
        "points": GRID.size,
        "known_to": rounded_up(float(solution.table.bound.max())),
        "drawn": list(drawn),
        "pictures": pictures(charts, solution, known, drawn, bounds, lines, COLOURS),
        "keys": {panel.signal: legend(panel, lines[panel.signal], languages, COLOURS) for panel in charts},
        "horizon": f"{solution.setting.horizon:g}",
        "data": Markup(embedded(data(solution, known, drawn, bounds, lines))),
    }


def exercises(ports: Mapping[str, Port], variants_by_name: Mapping[str, Variant]) -> dict[str, Any]:
    """The exercises and mistakes, and which checks refuse them."""
    variants = in_order(variants_by_name.values())
    shown_ones = [shown(variant, ports.values()) for variant in variants]
    return {
        "exercises": shown_ones,
        "exercise_panels": EXERCISE_PANELS,
        "outcomes": outcomes(variants, ports),
        "exercise_data": Markup(embedded({exercise.variant.name: exercise.curves for exercise in shown_ones})),
    }


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


def program(port: Port, verdict: Verdict, colour: int, shown_parts: Sequence[Part]) -> Program:
    """What the page says of one port."""
    run = port.run()
    return Program(
        name=port.name,
        language=port.language,
        method=port.method,
        source=f"{port.folder.name}/{port.source}",
        colour=colour,
        verdict=verdict,
        refusal=refusal(verdict),
        engine=engine_and_version(run) if run else "",
        licence=licence(port, run),
        run=f"{run['start'][:19].replace('T', ' ')} UTC, {run['seconds']:.2f}\N{NO-BREAK SPACE}s" if run else "",
        errors=errors(verdict),
        code={part.key: part.whole[port.name] for part in shown_parts if port.name in part.whole},
        diagram=diagram(port),
        file=port.source,
        address=data_address("text/plain;charset=utf-8", source(port)),
    )


def licence(port: Port, run: Mapping[str, Any] | None) -> str:
    """Whether the engine that ran is proprietary, stands in for one that is, or neither."""
    if run is None:
        return ""
    if run["proprietary"]:
        return "proprietary"
    return "open, in place of a proprietary engine" if any(e.proprietary for e in port.engines) else "open"


def diagram(port: Port) -> str:
    """The block diagram that the port left, as an address that holds its data; "" where there is none."""
    path = next(iter(sorted(port.build.glob("*.svg"))), None)
    return data_address("image/svg+xml", path.read_text(encoding="utf-8")) if path else ""


def data_address(kind: str, text: str) -> str:
    """An address that holds a text, of the given type."""
    return f"data:{kind},{quote(text, safe=PLAIN)}"


# ---- Data ----


def data(
    solution: Exact,
    known: Mapping[str, Array],
    drawn: Mapping[str, Mapping[str, Array]],
    bounds: Mapping[str, Mapping[str, float]],
    lines: Mapping[str, Mapping[str, Iterable[str]]],
) -> dict[str, Any]:
    """What the scripts draw: curves in single precision, base64, on one grid, errors by spans; tolerances by column.

    "on" says of each signal and program on whose curve its own lies, as `lines` do by signal and leader.
    """
    setting = solution.setting
    return {
        "horizon": setting.horizon,
        "parameters": dict(zip(setting.unknown, map(float, setting.theta), strict=True)),
        **packed({"grid": GRID * setting.horizon, "spans": SPANS * setting.horizon}),
        "exact": packed(known),
        "ports": {name: packed(values) for name, values in drawn.items()},
        "on": {signal: {n: of for of, names in found.items() for n in names} for signal, found in lines.items()},
        "tolerance": bounds,
    }


def embedded(value: Any) -> str:
    """JSON that can stand in a script element."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")
