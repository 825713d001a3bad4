# SPDX-License-Identifier: MIT
"""An experiment is exact, goes through TOML unchanged, and is refused in one line where it makes no sense."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from conformance.theory.scenario import SCENARIOS, Scenario, read_scenario, scenario_named, to_toml
from conformance.truth.exact import exact
from conformance.truth.experiment import truth

OTHER = Scenario(theta=Fraction(-1, 3), phase=Fraction("0.1"), wave="cos", x1_start=Fraction("1e-3"))


@pytest.mark.parametrize("scenario", [*SCENARIOS.values(), OTHER], ids=[*SCENARIOS, "other"])
def test_scenario_goes_through_toml_unchanged(scenario: Scenario, tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(to_toml(scenario))
    assert scenario_named(str(path)) == scenario


def test_decimal_is_what_it_says(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text("[scenario]\nk1 = 0.1\n")
    assert read_scenario(path).k1 == Fraction(1, 10)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("k1 = 1", r"expected TOML with a table \[scenario\]"),
        ("[scenario]\nk1 =", r"expected TOML"),
        ("[scenario]\nk1 = 0", "k1: found 0, expected a positive number"),
        ("[scenario]\nhorizon = -1", "horizon"),
        ("[scenario]\nk1 = 'two'", "k1: found 'two', expected a number"),
        ("[scenario]\nk1 = nan", "k1"),
        ("[scenario]\nk3 = 1", "found 'k3', expected one of theta"),
        ("[scenario]\nwave = 'tan'", "wave: found 'tan', expected one of sin, cos"),
    ],
)
def test_scenario_that_makes_no_sense_is_refused(text: str, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=complaint):
        read_scenario(path)


def test_phase_and_wave_reach_the_reference() -> None:
    t = np.array([0.0, 1.0])
    assert np.allclose(exact(OTHER).reference(t), 0.5 * np.cos(0.7 * t + 0.1), rtol=1e-15)


def test_without_excitation_the_estimate_stops_where_the_lesson_says() -> None:
    assert abs(truth(SCENARIOS["no-excitation"]).evaluate(20.0)[2] - 2.77724) < 5e-6
