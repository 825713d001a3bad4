# SPDX-License-Identifier: MIT
"""Every operator and number of the arithmetic is mutated; a survivor is told, unless it is proven to be the same."""

import re
from pathlib import Path

import pytest

from conformance.programs.ports import ROOT, read_ports, the_six
from conformance.programs.writer import write
from conformance.tests.under_test import PORTS
from conformance.theory.experiment_file import read_experiment
from conformance.trials.edits import in_experiment
from conformance.trials.mutants import (
    EXPERIMENT,
    Fate,
    Mutant,
    changes,
    equivalents,
    fates,
    fates_of,
    lively,
    mutants,
    mutants_of,
    summary,
    unexplained,
)
from conformance.trials.variant import runnable

ALL = the_six()
MADE = {name: mutants(port) for name, port in ALL.items()}
FIRST = next(iter(runnable(PORTS.values())))


def test_operators_signs_and_numbers_are_changed_one_at_a_time() -> None:
    assert list(changes("a = -b * c[0] + 2 * d1")) == [
        "a = b * c[0] + 2 * d1",
        "a = -b / c[0] + 2 * d1",
        "a = -b * c[0] - 2 * d1",
        "a = -b * c[0] + 3 * d1",
        "a = -b * c[0] + 2 / d1",
    ]
    assert list(changes("theta_hat = 0.0;")) == ["theta_hat = 0.01;"]
    assert list(changes("k2 = 2.5;")) == ["k2 = 2.525;"]


@pytest.mark.parametrize("name", MADE)
def test_every_term_of_the_control_is_mutated(name: str) -> None:
    changed = [mutant for mutant in MADE[name] if re.search(r"\b(u |control\[t_\] :)= alpha1", mutant.old)]
    assert len(changed) == 5 and len({mutant.new for mutant in changed}) == 5


@pytest.mark.parametrize("name", MADE)
def test_a_mutant_differs_in_one_line(name: str) -> None:
    for mutant in MADE[name]:
        text = in_experiment(mutant.port, EXPERIMENT)
        lines = zip(text.splitlines(), mutant.text.splitlines(), strict=True)
        assert [number for number, (old, new) in enumerate(lines, start=1) if old != new] == [mutant.line]


def test_steps_that_are_written_out_are_mutated_too() -> None:
    assert {len(MADE[name]) for name in ("cpp", "java")} == {74}
    assert {len(MADE[name]) for name in ("python", "matlab", "simulink", "mathematica")} == {47}


def test_fates_are_told_apart() -> None:
    killed = MADE[FIRST.name][0]
    harmless = in_experiment(FIRST, EXPERIMENT)
    survivor = Mutant(FIRST, 1, "x = 1", "x = 2", harmless)
    found = fates([killed, survivor], ROOT / "build" / "mutants" / "test")
    assert [fate.status for fate in found] == ["killed", "survived"]
    assert unexplained(found) == found[1:]
    assert "x = 1 -> x = 2" in summary(found) and "UNEXPLAINED" in summary(found)
    assert "1 killed of 2 made; 1 unexplained" in summary(found)


def test_an_excuse_is_of_a_mutant_that_is_made() -> None:
    made = {(mutant.port.name, mutant.old, mutant.new) for each in MADE.values() for mutant in each}
    assert equivalents().keys() <= made


def test_an_excused_survivor_is_not_unexplained(tmp_path: Path) -> None:
    excuses = tmp_path / "equivalent.toml"
    excuses.write_text('[[equivalent]]\nports = ["cpp"]\nold = "a"\nnew = "b"\nwhy = "a is b"\n')
    mutant = Mutant(ALL["cpp"], 1, "a", "b", "")
    assert equivalents(excuses) == {("cpp", "a", "b"): "a is b"}
    assert unexplained([Fate(mutant, "survived")]) and not unexplained([Fate(mutant, "killed")])


SUBTLE = (  # which survive where gains are 1, or states and estimates start from 0
    ("- theta2_hat * x2", "+ theta2_hat * x2"),
    ("1 + k2 * k1", "1 + k2 / k1"),
    ("+ w2_1 * k1", "+ w2_1 / k1"),
)


def test_subtle_mutants_of_a_written_program_are_killed() -> None:
    of = lively(read_experiment(ROOT / "plants" / "problem_1c.toml"))
    made = mutants_of(read_ports(plant=of.name)["cpp"], write(of, read_ports()["cpp"]))
    subtle = [m for old, new in SUBTLE for m in made if old in m.old and m.new == m.old.replace(old, new)]
    assert len(subtle) == len(SUBTLE) and len(made) > 170
    assert [fate.status for fate in fates_of(subtle, of)] == ["killed"] * len(SUBTLE)
