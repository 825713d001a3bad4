# SPDX-License-Identifier: MIT
"""Exercises and mistakes on the page: each variant's diffs, what it led to, and which checks refuse it."""

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from conformance.judging.trajectory import Array, Trajectory, TrajectoryError, load
from conformance.pages.exercises import diff
from conformance.pages.report.curves import GRID, Panel, packed, panels
from conformance.pages.report.listing import highlighted_lines
from conformance.pages.report.picture import Line, picture
from conformance.programs.ports import ROOT, Port
from conformance.programs.sources import as_code
from conformance.theory.experiments import Experiment, values_of, with_values
from conformance.theory.lesson import LESSON
from conformance.trials.variant import Variant, in_tree
from conformance.truth.exact import exact

KILL_MATRIX = ROOT / "build" / "kill-matrix.json"
SHARES = GRID[::2]  # of the time drawn, closer where the transient is
EXERCISE_PANELS = tuple(panel for panel in panels(LESSON) if panel.signal in ("x1", "theta_hat"))
DRAWN = ("x1", "reference", "theta_hat")
CLASSES = {"+": "added", "-": "removed"}  # of a line of a diff, by its first character


@dataclass(frozen=True)
class Exercise:
    """A variant, its diff by port, and what it led to in the program `ran`, "" where none has left a CSV.

    `seconds` are drawn; `curves` are for the script, over the same shares of them in all exercises, with the true
    parameter; `pictures` are the same as vectors, by signal.
    """

    variant: Variant
    diffs: Mapping[str, Markup]
    ran: str
    seconds: float
    curves: Mapping[str, str | float]
    pictures: Mapping[str, Markup]


def in_order(variants: Iterable[Variant]) -> list[Variant]:
    """As the lesson's sections come."""
    return sorted(variants, key=lambda variant: (int(variant.section.strip("()")), variant.title))


def shown(variant: Variant, ports: Iterable[Port]) -> Exercise:
    """What the page shows of a variant: of an experiment the exact solution, of a mistake what a program has made."""
    here = [port for port in ports if variant.has(port)]
    ran, trajectory = next(_runs(variant, here), ("", None))
    curves: dict[str, Array] = {}
    theta = float(variant.experiment.unknown[0].true)
    if trajectory:
        curves = thinned(trajectory) if variant.refused_by else solved(variant.experiment)
        curves["theta"] = np.full(SHARES.size, theta)
    seconds = float(curves["t"][-1]) if curves else 0.0
    return Exercise(
        variant=variant,
        diffs=dict(_diffs(variant, here)),
        ran=ran,
        seconds=seconds,
        curves={**packed({name: curves[name] for name in DRAWN if curves}), "seconds": seconds, "theta": theta},
        pictures={panel.signal: still(panel, curves) for panel in EXERCISE_PANELS if curves},
    )


def still(panel: Panel, curves: Mapping[str, Array]) -> Markup:
    """A chart of an exercise as vectors."""
    lines = [Line(curves[panel.beside], "var(--quiet)", 1.25, "4 4"), Line(curves[panel.signal], "var(--accent)")]
    return picture(curves["t"], lines, f"{panel.signal.replace('_', ' ')} over time")


def _diffs(variant: Variant, ports: Iterable[Port]) -> Iterator[tuple[str, Markup]]:
    """(port, diff) of every program into which the variant can be edited; one that is not finished is left out."""
    for port in ports:
        with suppress(ValueError):
            rows = [row for row in diff(variant, port, as_code).splitlines() if not row.startswith("@@")]
            filled = [i for i, row in enumerate(rows) if row.strip()]
            yield port.name, marked(rows[filled[0] : filled[-1] + 1], port.source)


def _runs(variant: Variant, ports: Iterable[Port]) -> Iterator[tuple[str, Trajectory]]:
    """(language, trajectory) of every program that left a CSV of the variant."""
    for port in ports:
        with suppress(TrajectoryError):
            yield port.language, load(in_tree(port, variant.tree).csv, variant.experiment)


def thinned(trajectory: Trajectory) -> dict[str, Array]:
    """Its curves, on straight lines between rows, which a fixed step leaves close together."""
    t = SHARES * trajectory.t[-1]
    return {"t": t, **{name: np.interp(t, trajectory.t, trajectory[name]) for name in DRAWN}}


def solved(experiment: Experiment) -> dict[str, Array]:
    """The curves of the exact solution over the lesson's horizon; if the reference is another, over whole periods."""
    horizon, own, lesson = LESSON.horizon, values_of(experiment), values_of(LESSON)
    if own["amplitude"] and (own["omega"], experiment.reference) != (lesson["omega"], LESSON.reference):
        period = 2 * math.pi / float(own["omega"])
        horizon = Fraction(round(period * math.ceil(float(horizon) / period), 2))
    solution = exact(with_values(experiment, {"horizon": horizon}))
    t = SHARES * float(horizon)
    found = dict(zip(solution.setting.names, solution.evaluate(t), strict=True)) | {"reference": solution.reference(t)}
    return {"t": t, **{name: found[name] for name in DRAWN}}


def marked(rows: Iterable[str], file: str) -> Markup:
    """The lines of a diff as HTML, each in the colours of the language that the file's name tells."""
    some = dedented(rows)
    code = highlighted_lines("".join(f"{row[1:]}\n" for row in some), file)
    line = Markup('<span class="line {}"><span class="sign">{}</span>{}\n</span>')
    marks = (CLASSES.get(row[:1], "") for row in some)
    return Markup("").join(line.format(mark, row[:1], text) for row, mark, text in zip(some, marks, code, strict=True))


def dedented(rows: Iterable[str]) -> list[str]:
    """The lines of a diff without their common indentation, and comments two spaces behind the code."""
    some = [re.sub(r"(?<=\S) {3,}(?=//|#|%|\(\*)", "  ", row) for row in rows]
    common = min((len(row) - 1 - len(row[1:].lstrip()) for row in some if row[1:].strip()), default=0)
    return [row[:1] + row[1 + common :] for row in some]


def kill_matrix(path: Path = KILL_MATRIX) -> dict[tuple[str, str], dict[str, Any]]:
    """What `make check` found on each (variant, port); empty where it has not run."""
    if not path.is_file():
        return {}
    return {(row["variant"], row["port"]): row for row in json.loads(path.read_text())}
