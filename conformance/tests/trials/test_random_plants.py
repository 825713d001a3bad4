# SPDX-License-Identifier: MIT
"""Random plants: what is drawn, that their written programs conform, and how one that does not is told.

Two are run, in C++; GALLERY=all runs them in every language.
"""

import os
import random
from fractions import Fraction
from pathlib import Path

import pytest

from conformance.programs.ports import ROOT, read_ports
from conformance.programs.step import step_of
from conformance.theory.experiment_file import read_experiment
from conformance.trials.random_plants import (
    SIZES,
    SMALLEST_STEP,
    UNKNOWN,
    Drawn,
    draw_plant,
    draw_text,
    kept_plants,
    report,
    run_plant,
)
from conformance.trials.variant import runnable

pytestmark = pytest.mark.beyond

SEED, NUMBERS = 18, (0, 1)
LANGUAGES = [port.name for port in runnable(read_ports(plant="random").values())]
ASKED = LANGUAGES if os.environ.get("GALLERY") == "all" else [name for name in LANGUAGES if name == "cpp"]


def test_a_plant_depends_on_seed_and_number_alone(tmp_path: Path) -> None:
    texts = {draw_plant(seed, number, tmp_path).read_text() for seed in (1, 2) for number in range(2)}
    assert len(texts) == 4 and draw_plant(1, 1, tmp_path).read_text() in texts


def test_plants_of_every_size_are_drawn() -> None:
    chance = random.Random(3)
    texts = [draw_text(chance, "drawn") for _ in range(300)]
    sizes = {(text.count("= [") and len(text.split("[plant]\n")[1].split("\n\n")[0].splitlines())) for text in texts}
    unknown = {text.count("_hat") or sum(line.startswith("theta") for line in text.splitlines()) for text in texts}
    assert sizes == set(SIZES) and unknown == set(UNKNOWN)
    for part in ("sin(", "cos(", "^3", "-u", "2*", ")*x", "/2", "Gamma = [["):
        assert any(part in text for text in texts), part


def test_what_is_drawn_can_be_simulated(tmp_path: Path) -> None:
    for number in range(2):
        assert step_of(read_experiment(draw_plant(5, number, tmp_path))) >= Fraction(str(SMALLEST_STEP))


@pytest.mark.parametrize("number", NUMBERS)
def test_the_programs_of_a_random_plant_conform(number: int) -> None:
    found = run_plant(draw_plant(SEED, number), ASKED)
    assert found.conforms, found.reason
    (kept,) = [one for one in kept_plants() if (one.seed, one.number) == (SEED, number)]
    assert kept.holds and kept.path == found.path and kept.verdicts[ASKED[0]]["status"] == "pass"


def test_a_plant_that_fails_is_told_as_a_file(tmp_path: Path) -> None:
    path = draw_plant(1, 0, tmp_path)
    told = report([Drawn(path, True), Drawn(path, False, "cpp: x1 strays")], ["cpp", "java"])
    assert told.startswith("cpp: x1 strays\n# make check PLANT=") and path.read_text() in told
    assert told.endswith("1 of 2 plants conform, each in cpp, java")
    (tmp_path / "again.toml").write_text(told.partition(f"{path.name}\n")[2].rpartition("\n1 of 2")[0])
    assert read_experiment(tmp_path / "again.toml") == read_experiment(path)
    assert path.is_relative_to(tmp_path) and not path.is_relative_to(ROOT)
