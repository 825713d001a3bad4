# SPDX-License-Identifier: MIT
"""Exercises and mistakes on the page: each variant's diffs, what it led to, and which checks refuse it."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from conformance.judging.trajectory import Trajectory, TrajectoryError, load
from conformance.pages.exercises import diff
from conformance.pages.report.curves import packed
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.trials.variant import Variant

KILL_MATRIX = ROOT / "build" / "kill-matrix.json"
POINTS = 301  # of a curve
CLASSES = {"+": "added", "-": "removed"}  # of a line of a diff, by its first character


@dataclass(frozen=True)
class Exercise:
    """A variant, its diff by language, and what it led to in the program `ran`, "" where none has left a CSV."""

    variant: Variant
    diffs: Mapping[str, Markup]
    ran: str
    curves: Mapping[str, Any]


def shown(variant: Variant, ports: Iterable[Port]) -> Exercise:
    """What the page shows of a variant."""
    here = [port for port in ports if variant.has(port)]
    ran, trajectory = next(_runs(variant, here), ("", None))
    return Exercise(
        variant=variant,
        diffs={language: marked(text) for language, text in _diffs(variant, here)},
        ran=ran,
        curves={**thinned(trajectory), "theta": float(variant.scenario.theta)} if trajectory else {},
    )


def _diffs(variant: Variant, ports: Iterable[Port]) -> Iterator[tuple[str, str]]:
    """(language, diff) of every program into which the variant can be edited; one that is not finished is left out."""
    for port in ports:
        with suppress(ValueError):
            yield port.language, diff(variant, port)


def _runs(variant: Variant, ports: Iterable[Port]) -> Iterator[tuple[str, Trajectory]]:
    """(language, trajectory) of every program that left a CSV of the variant."""
    in_tree = read_ports(variant.tree)
    for port in ports:
        try:
            yield port.language, load(in_tree[port.name].csv, float(variant.scenario.horizon))
        except (KeyError, TrajectoryError):
            continue


def thinned(trajectory: Trajectory) -> dict[str, str]:
    """Its curves at equal distances, on straight lines between rows."""
    t = np.linspace(0, trajectory.t[-1], POINTS)
    names = ("x1", "reference", "theta_hat")
    return packed({"t": t, **{name: np.interp(t, trajectory.t, trajectory[name]) for name in names}})


def marked(text: str) -> Markup:
    """A diff as HTML, without the lines that say where."""
    line = Markup('<span class="line {}">{}\n</span>')
    return Markup("").join(
        line.format(CLASSES.get(row[:1], ""), row) for row in text.splitlines() if not row.startswith("@@")
    )


def kill_matrix(path: Path = KILL_MATRIX) -> dict[tuple[str, str], dict[str, Any]]:
    """What `make check` found on each (variant, port); empty where it has not run."""
    if not path.is_file():
        return {}
    return {(row["variant"], row["port"]): row for row in json.loads(path.read_text())}
