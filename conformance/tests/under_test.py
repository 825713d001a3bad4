# SPDX-License-Identifier: MIT
"""The programs under test: those of the environment variable PORTS, all where it is not set; and one that is quick."""

import functools
import subprocess
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from conformance.judging.trajectory import Trajectory, load
from conformance.places import PLANTS
from conformance.programs.new_port import AWK as AWK
from conformance.programs.new_port import write_skeleton
from conformance.programs.ports import MODEL, ROOT, Engine, Port, read_ports, selected_ports
from conformance.programs.run import as_a_user
from conformance.theory.experiment_file import as_written
from conformance.theory.lesson import LESSON

PORTS = selected_ports()
FIRST = read_ports()[MODEL]  # whose statements and wording all share
PROBLEM_6, NO_EXCITATION = (as_written(PLANTS / f"{name}.toml") for name in ("problem_6", "no_excitation"))
GUESTS = ROOT / "conformance/tests/data"  # ports that are none of the six

ONE_STATE = """title = "One state, by itself"
name = "one"
source = "ours"
[plant]
level = "u - c*level^3"
[unknown]
c = ["0.5", "0"]
[design]
k = ["1"]
Gamma = "1"
[experiment]
reference = "0.5*sin(t)"
start = ["0.2"]
horizon = "2"
"""


@functools.cache
def record(port: Port) -> dict[str, Any]:
    """The port's run.json; the test fails where the port did not run."""
    run = port.run()
    assert run is not None, f"{port.name} is missing: it did not run; type: make {port.name}"
    return run


@functools.cache
def trajectory_of(port: Port) -> Trajectory:
    """The port's CSV, validated."""
    record(port)
    return load(port.csv, LESSON)


def engine_of(port: Port) -> Engine:
    """The engine that ran the port."""
    return port.ran_engine(record(port))


def write_awk(root: Path) -> None:
    """Add a port in AWK, which the skeleton is: it runs in a tenth of a second, and needs no compiler."""
    write_skeleton("awk", root)


def not_run(reasons: Iterable[str]) -> list[str]:
    """One line per reason why tests could not run here, with their count."""
    counts = Counter(reason.removeprefix("Skipped: ") for reason in reasons)
    return [f"{count} not run: {reason}" for reason, count in counts.items()]


def make(root: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run make in a tree, as a user would: without this run's own PORTS and make flags."""
    return subprocess.run(
        ["make", *words], cwd=root, env=as_a_user() | environment, capture_output=True, text=True, timeout=300
    )
