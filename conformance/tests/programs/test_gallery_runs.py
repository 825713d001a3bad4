# SPDX-License-Identifier: MIT
"""Written programs run bare, and agree with a tight integration of the statements that they write.

A few of them here; GALLERY=all runs every plant by every program, which takes some minutes.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from conformance.programs.ports import ROOT, read_ports
from conformance.programs.run import headless
from conformance.programs.step import closed_loop, initial_state
from conformance.programs.writer import write_programs
from conformance.theory.experiment_file import read_experiment

COMMANDS = {
    "python": ["{python} {stem}.py"],
    "cpp": ["g++ -std=c++17 -Wall -Wextra -Wpedantic -Wconversion -Werror -o {stem} {stem}.cpp", "./{stem}"],
    "java": ["javac -Xlint:all -Werror {stem}.java", "java {stem}"],
    "matlab": ["octave-cli --path octave --eval {stem}"],
    "simulink": ["octave-cli --path octave --eval {stem}_Simulink"],
    "mathematica": ["{python} -m woxi run run_woxi.wls"],
}
PLANTS = sorted(path.stem for path in (ROOT / "plants").glob("*.toml"))
FEW = [("problem_1c", "cpp"), ("wing_rock_actuator", "cpp"), ("motor_arm", "java"), ("khalil", "cpp")]
ALL = [(plant, port) for plant in PLANTS for port in COMMANDS]
SHARE = 1e-6 / 3  # of each state's scale


@pytest.mark.parametrize(("plant", "name"), ALL if os.environ.get("GALLERY") == "all" else FEW)
def test_a_written_program_agrees_with_a_tight_integration(plant: str, name: str, tmp_path: Path) -> None:
    of, port = read_experiment(ROOT / "plants" / f"{plant}.toml"), read_ports()[name]
    (program,) = write_programs(of, [port], tmp_path)
    for command in COMMANDS[name]:
        words = command.format(stem=plant, python=sys.executable).split()
        answer = subprocess.run(words, cwd=program.parent, env=headless(), capture_output=True, text=True)
        assert answer.returncode == 0, answer.stdout + answer.stderr
    csv = program.parent / f"{plant}_{name}.csv"
    assert answer.stdout.splitlines()[-1].strip() == f"Data written to {csv.name}"
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
