# SPDX-License-Identifier: MIT
"""An experiment is exact, goes through TOML unchanged, and is refused in one line where it makes no sense."""

import os
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
        ("k1 = 1", r"expected a table \[scenario\], found none"),
        ("[[scenario]]\ntheta = 1.2", r"expected a table \[scenario\], found a list"),
        ("scenario = 5", r"expected a table \[scenario\], found 5"),
        ("[scenario]\nk1 =", r"line 2, column 5: found nothing more, expected TOML"),
        ("scenario = " + "[" * 100000, "brackets nested thousands deep"),
        ("[scenario]\nk1 = " + "1" * 5000, "has thousands of digits"),
        ("[scenario]\nk1 = 0x" + "f" * 5000, "k1: found a number of more than 20 digits"),
        ("[scenario]\nk1 = 1e999999999", "k1: found '1e999999999', expected an exponent"),
        ("[scenario]\ntheta = 1e-99999999", "theta: found '1e-99999999', expected an exponent"),
        ("[scenario]\ntheta = 1e309", "theta: found a number beyond what a double holds"),
        ("[scenario]\nk1 = true", "k1: found true, expected a finite decimal"),
        ("[scenario]\nk1 = 2020-01-01", "k1: found 2020-01-01, expected a finite decimal"),
        ("[scenario]\nk1 = [[1]]", "k1: found a list, expected a finite decimal"),
        ("[scenario]\nwave = 1", "wave: found 1, expected one of sin, cos"),
        ("[scenario]\nwave = '\u202esin'", r"wave: found '\\u202esin', expected one of sin, cos"),
        ("[scenario]\n'\u200bk1' = 1", r"found '\\u200bk1', expected one of theta"),
        ("[scenario]\nk1 = 0", "k1: found 0, expected a positive number"),
        ("[scenario]\nhorizon = -1", "horizon"),
        ("[scenario]\nk1 = 'two'", "k1: found 'two', expected a finite decimal"),
        ("[scenario]\nk1 = nan", "k1"),
        ("[scenario]\nk3 = 1", "found 'k3', expected one of theta"),
        ("[scenario]\nwave = 'tan'", "wave: found 'tan', expected one of sin, cos"),
    ],
)
def test_scenario_that_makes_no_sense_is_refused(text: str, complaint: str, tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=complaint) as refusal:
        read_scenario(path)
    assert str(refusal.value).isprintable() and len(str(refusal.value)) < 400


def test_scenario_that_is_no_text_file_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "latin.toml").write_bytes(b"[scenario]\n# caf\xe9\n")
    for name, reason in (("pipe", "a pipe"), ("folder", "a folder"), ("latin", "line 2: found the byte 0xe9")):
        with pytest.raises(ValueError, match=reason):
            read_scenario(tmp_path / f"{name}.toml")


def test_phase_and_wave_reach_the_reference() -> None:
    t = np.array([0.0, 1.0])
    assert np.allclose(exact(OTHER).reference(t), 0.5 * np.cos(0.7 * t + 0.1), rtol=1e-15)


def test_without_excitation_the_estimate_stops_where_the_lesson_says() -> None:
    assert abs(truth(SCENARIOS["no-excitation"]).evaluate(20.0)[2] - 2.77724) < 5e-6
