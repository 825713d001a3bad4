# SPDX-License-Identifier: MIT
"""An experiment's numbers by name: given others, it is the same in all else. What differs in them alone is a family."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from conformance.places import PLANTS
from conformance.tests.under_test import NO_EXCITATION, PROBLEM_6
from conformance.theory.experiment_file import as_written, read_experiment, to_toml
from conformance.theory.experiments import Experiment, family_of, values_of, with_values
from conformance.theory.lesson import LESSON
from conformance.trials.campaign import draw

EVERY = [as_written(path) for path in sorted(PLANTS.glob("*.toml"))]


def test_the_lesson_is_its_file() -> None:
    assert read_experiment(PLANTS / "Chapter17_Lesson1.toml") == LESSON


@pytest.mark.parametrize("experiment", EVERY, ids=lambda experiment: experiment.name)
def test_every_number_can_be_changed_by_its_name(experiment: Experiment) -> None:
    values = {name: number + Fraction(1, 8) for name, number in values_of(experiment).items()}
    changed = with_values(experiment, values)
    assert values_of(changed) == values and not changed.facts
    assert with_values(changed, values_of(experiment)) == replace(experiment, facts=())
    assert with_values(experiment, values_of(experiment)) is experiment


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"k3": Fraction(1)}, "found 'k3', expected one of theta, k1, k2, gamma, amplitude, omega, x1_start"),
        ({"k1": Fraction(0)}, "k1: found 0, expected a positive number"),
        ({"gamma": Fraction(-1)}, "gamma: found -1, expected a positive number"),
        ({"horizon": Fraction(0)}, "horizon: found 0, expected a positive number"),
    ],
)
def test_values_that_make_no_sense_are_refused(values: dict[str, Fraction], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        with_values(LESSON, values)


def test_a_family_is_all_that_differ_in_numbers_alone() -> None:
    assert family_of(LESSON) == family_of(NO_EXCITATION) == family_of(with_values(LESSON, {"k1": Fraction(7)}))
    assert family_of(LESSON) != family_of(PROBLEM_6)  # another wave
    assert family_of(draw(1, 2)) == family_of(with_values(draw(1, 2), values_of(draw(1, 3))))
    arm = as_written(PLANTS / "motor_arm.toml")
    name, value = next((name, value) for name, value in arm.constants)
    assert (
        family_of(with_values(arm, {name: 2 * value})) == family_of(arm) != family_of(with_values(arm, {name: -value}))
    )


def test_a_full_Gamma_belongs_to_the_family() -> None:
    full = as_written(PLANTS / "problem_5.toml")
    other = with_values(full, {"gamma12": full.Gamma[0][1] / 2})
    assert family_of(full).Gamma == full.Gamma and family_of(other) != family_of(full)


@pytest.mark.parametrize("number", range(3))
def test_what_is_drawn_goes_through_a_file_unchanged(number: int, tmp_path: Path) -> None:
    path = tmp_path / "drawn.toml"
    path.write_text(to_toml(draw(5, number)))
    assert read_experiment(path) == draw(5, number)
