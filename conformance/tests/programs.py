# SPDX-License-Identifier: MIT
"""The programs under test: those of the environment variable PORTS, all where it is not set."""

import functools
import subprocess
from pathlib import Path
from typing import Any

from conformance.ports import Engine, Port, selected_ports
from conformance.run import as_a_user
from conformance.scenario import LESSON
from conformance.trajectory import Trajectory, load

PORTS = selected_ports()


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
    return load(port.csv, float(LESSON.horizon))


def engine_of(port: Port) -> Engine:
    """The engine that ran the port."""
    return port.ran_engine(record(port))


def make(root: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run make in a tree, as a user would: without this run's own PORTS and make flags."""
    return subprocess.run(
        ["make", *words], cwd=root, env=as_a_user() | environment, capture_output=True, text=True, timeout=300
    )
