# SPDX-License-Identifier: MIT
"""Written programs run bare, by the commands of their heads, and agree with a tight integration of their statements.

A few of them: make check-gallery runs every plant by every program, and judges it by its proof.
"""

import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.run import headless
from conformance.programs.step import closed_loop, initial_state
from conformance.programs.writer import write_programs
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment

pytestmark = pytest.mark.beyond

COMMANDS = {
    "python": ["{python} {stem}.py"],
    "cpp": ["g++ -std=c++17 -Wall -Wextra -Wpedantic -Wconversion -Werror -o {stem} {stem}.cpp", "./{stem}"],
    "java": ["javac -Xlint:all -Werror {stem}.java", "java {stem}"],
    "matlab": ["octave-cli --path octave --eval {stem}"],
    "simulink": ["octave-cli --path octave --eval {stem}_Simulink"],
    "mathematica": ["{python} -m woxi run run_woxi.wls"],
}
FEW = [("problem_1c", "cpp"), ("wing_rock_actuator", "cpp"), ("motor_arm", "java"), ("khalil", "cpp")]
SHARE = 1e-6 / 3  # of each state's scale


def run_bare(of: Experiment, port: Port, folder: Path) -> tuple[Path, str]:
    """Write a program, run it without the harness; returns its file and what it printed."""
    (program,) = write_programs(of, [port], folder)
    for command in COMMANDS[port.name]:
        words = command.format(stem=of.name, python=sys.executable).split()
        answer = subprocess.run(words, cwd=program.parent, env=headless(), capture_output=True, text=True)
        assert answer.returncode == 0, answer.stdout + answer.stderr
    return program, answer.stdout


@pytest.mark.parametrize(("plant", "name"), FEW)
def test_a_written_program_agrees_with_a_tight_integration(plant: str, name: str, tmp_path: Path) -> None:
    of, port = read_experiment(ROOT / "plants" / f"{plant}.toml"), read_ports()[name]
    program, printed = run_bare(of, port, tmp_path)
    csv = program.parent / f"{plant}_{name}.csv"
    assert printed.splitlines()[-1].strip() == f"Data written to {csv.name}"
    header = csv.read_text().partition("\n")[0]
    assert header.split(",") == ["t", *of.states, *of.estimates, "reference", "tracking_error"]
    rows = np.loadtxt(csv, delimiter=",", skiprows=1)
    slope, horizon = closed_loop(of), float(of.horizon)
    assert rows[0, 0] == 0 and rows[-1, 0] == horizon
    tight = solve_ivp(
        lambda t, x: slope(t, tuple(x)), (0, horizon), initial_state(of), "DOP853", rows[:, 0], rtol=1e-12, atol=1e-13
    )
    error = np.abs(rows[:, 1 : 1 + len(tight.y)] - tight.y.T).max(axis=0)
    assert (error <= SHARE * np.maximum(1, np.abs(tight.y).max(axis=1))).all(), error


def test_the_block_of_simulink_has_every_digit_of_the_constants(tmp_path: Path) -> None:
    """A third is no decimal: the stand-in takes the steps of ode45, so the two logs are the same to the last bit."""
    own = read_experiment(ROOT / "plants" / "first_order.toml")
    thirds = [parameter._replace(true=Fraction(1, 3), start=Fraction(1, 7)) for parameter in own.unknown]
    of = replace(own, unknown=tuple(thirds), horizon=Fraction(1), facts=())
    logs = []
    for name in ("matlab", "simulink"):
        program, _ = run_bare(of, read_ports()[name], tmp_path / name)
        logs.append((program.parent / f"{of.name}_{name}.csv").read_text())
    assert logs[0] == logs[1] and len(logs[0].splitlines()) > 10
