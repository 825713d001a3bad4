# SPDX-License-Identifier: MIT
"""The pages where they belong, and the index of all plants: what each is, and the way to its page if there is one."""

import json
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from conformance.atomic import write_atomically
from conformance.judging.verdict import Judgement
from conformance.pages.report.evidence import Changes
from conformance.pages.report.page import PAGE, environment_of, page, page_of, raw
from conformance.pages.report.symbols import Notation
from conformance.pages.report.typesetting import type_css
from conformance.places import PLANTS
from conformance.programs.ports import Port
from conformance.theory.derivation import derivation
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.faults import DesignError, FileFault
from conformance.theory.lesson import LESSON

GALLERY = PAGE.with_name("plants.html")


@dataclass(frozen=True)
class Entry:
    """A plant: its title and source, its equations (LaTeX), how many unknown it has, its page and verdict, or "".

    Of a file that is no experiment its name, and what is wrong in the verdict's place.
    """

    title: str
    source: str
    equations: tuple[str, ...]
    unknown: int
    page: str
    verdict: str


def publish(
    ports: Mapping[str, Port], judgement: Judgement, experiment: Experiment = LESSON, changes: Changes | None = None
) -> Path:
    """Write the page of an experiment where it belongs, and the index, to which it leads; raises ValueError as `page`.

    Returns where the page is.
    """
    path = page_of(experiment)
    write_atomically(path, page(ports, judgement, experiment, changes, os.path.relpath(GALLERY, path.parent)))
    write_atomically(GALLERY, gallery(sorted(PLANTS.glob("*.toml"))))
    return path


def gallery(paths: Iterable[Path]) -> str:
    """The index of the plants of these files, as HTML; of a file that is no experiment it says what is wrong."""
    environment, typesetter = environment_of((), Notation(derivation(LESSON)))
    template = environment.get_template("gallery.html")
    entries = [entry(path) for path in paths]
    return typesetter.filled(template.render(raw=raw(environment), faces=type_css(), entries=entries))


def entry(path: Path) -> Entry:
    """What the index says of a plant."""
    try:
        experiment = read_experiment(path)
        derived = derivation(experiment)
    except (FileFault, DesignError) as fault:
        return Entry(path.name, "", (), 0, "", str(fault).replace(str(path), path.name).partition("\n")[0])
    rows = Notation(derived).equations(derived.parts[0].equations[: len(experiment.states)])
    place = page_of(experiment)
    return Entry(
        experiment.title,
        experiment.source,
        tuple(re.sub(r"\\htmlData\{symbol=\w+\}", "", row) for row in rows),
        len(experiment.unknown),
        os.path.relpath(place, PAGE.parent) if place.is_file() else "",
        headline(place.parents[1] / "result.json"),
    )


def headline(result: Path) -> str:
    """What was judged of the programs; "" where nothing was."""
    try:
        return str(json.loads(result.read_text())["headline"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
