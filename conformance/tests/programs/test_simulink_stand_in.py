# SPDX-License-Identifier: MIT
"""The stand-in for Simulink refuses what Simulink refuses, naming block and port, and integrates what was wired."""

import functools
import math
import subprocess

import pytest

from conformance.programs.ports import ROOT
from conformance.programs.run import choose_engine
from conformance.tests.under_test import PORTS

pytestmark = pytest.mark.skipif(
    "simulink" not in PORTS or choose_engine(PORTS["simulink"]).proprietary, reason="the stand-in is not in use"
)

REFUSALS = {
    "unknown block": "there is no library block named 'simulink/Sources/Clok'",
    "unknown parameter": "block 'test_model/Clock 2' does not have a parameter named 'Speed'",
    "value that is no text": "model 'test_model': the value of 'RelTol' must be text",
    "unknown model parameter": "model 'test_model' does not have a parameter named 'RelTolerance'",
    "block twice": "there is already a block 'test_model/Clock'",
    "unknown block in a line": "there is no block 'test_model/Clack'",
    "wrong output port": "there is no output port 'test_model/Clock/2': the block has 1",
    "wrong input port": "there is no input port 'test_model/Loop/3': the block has 2",
    "doubled line": "input port 1 of block 'test_model/Loop' already has a line",
    "missing line": "input port 2 of block 'test_model/Loop' is not connected",
    "algebraic loop": "algebraic loop through 'test_model/Loop'",
    "wrong width": "input port 1 of block 'test_model/Integrator' has width 2, its InitialCondition 1",
    "no initial condition": "block 'test_model/Integrator': InitialCondition 'x' is not a vector",
    "unknown save format": "block 'test_model/Log': SaveFormat 'Table' is not known here",
    "another solver": "this stand-in for Simulink knows Solver = 'ode45' alone, not 'ode15s'",
    "unset tolerance": "this stand-in for Simulink needs a number for AbsTol, not 'auto'",
    "script without a signature": "MATLAB Function block 'Loop': its Script must begin with",
    "script that fails": "'nowhere' undefined",
    "state that blows up": "the derivative of the state of block 'test_model/Integrator' is not finite",
    "unknown model": "there is no model named 'another'",
    "model twice": "there is already a model named 'test_model'",
    "right diagram": "no error",
}


@functools.cache
def answers() -> dict[str, str]:
    cases = ROOT / "matlab/octave/tests/simulink_cases.m"
    command = f"addpath('{ROOT}/matlab/octave'); source('{cases}'); simulink_cases();"
    answer = subprocess.run(["octave-cli", "--norc", "--eval", command], capture_output=True, text=True, timeout=120)
    assert answer.returncode == 0, answer.stderr
    return dict(line.split(": ", 1) for line in answer.stdout.splitlines())


@pytest.mark.parametrize("case", REFUSALS)
def test_wrong_diagram_is_refused(case: str) -> None:
    assert answers()[case].startswith(REFUSALS[case])


def test_every_case_has_its_answer() -> None:
    assert set(answers()) == {*REFUSALS, "value at 1", "last time"}


def test_wired_diagram_is_integrated_to_its_settings() -> None:
    assert abs(float(answers()["value at 1"]) - math.exp(-1)) < 1e-9
    assert answers()["last time"] == "1"
