# SPDX-License-Identifier: MIT
"""The index of all plants: what each is, and the way to its page where there is one."""

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from conformance.pages.report.page import PAGE, environment_of, page_of, raw
from conformance.pages.report.symbols import Notation, symbols_of
from conformance.pages.report.typesetting import type_css
from conformance.theory.derivation import derivation
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment

GALLERY = PAGE.with_name("plants.html")


@dataclass(frozen=True)
class Entry:
    """A plant: its title and source, its equations (LaTeX), how many unknown it has, its page and verdict, or ""."""

    title: str
    source: str
    equations: tuple[str, ...]
    unknown: int
    page: str
    verdict: str


def gallery(paths: Iterable[Path]) -> str:
    """The index of the plants of these files, as HTML; raises FileFault for a file that is no experiment."""
    experiments = [read_experiment(path) for path in paths]
    entries = [entry(experiment) for experiment in experiments]
    notation = Notation(derivation(experiments[0]))
    environment, typesetter = environment_of(symbols_of(experiments[0], notation), notation)
    template = environment.get_template("gallery.html")
    return typesetter.filled(template.render(raw=raw(environment), faces=type_css(), entries=entries))


def entry(experiment: Experiment) -> Entry:
    """What the index says of a plant."""
    derived = derivation(experiment)
    rows = Notation(derived).equations(derived.parts[0].equations[: len(experiment.states)])
    page = page_of(experiment)
    return Entry(
        experiment.title,
        experiment.source,
        tuple(re.sub(r"\\htmlData\{symbol=\w+\}", "", row) for row in rows),
        len(experiment.unknown),
        f"../{page.relative_to(PAGE.parents[1])}" if page.is_file() else "",
        headline(page.parents[1] / "result.json"),
    )


def headline(result: Path) -> str:
    """What was judged of the programs; "" where nothing was."""
    try:
        return str(json.loads(result.read_text())["headline"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
