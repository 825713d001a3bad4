# SPDX-License-Identifier: MIT
"""The programs under test: those of the environment variable PORTS, all where it is not set; and one that is quick."""

import functools
import subprocess
from pathlib import Path
from typing import Any

from conformance.judging.trajectory import Trajectory, load
from conformance.programs.new_port import write_skeleton
from conformance.programs.ports import ROOT, Engine, Port, selected_ports
from conformance.programs.run import as_a_user
from conformance.theory.scenario import LESSON

PORTS = selected_ports()
AWK = ROOT / "conformance/tests/data/Chapter17_Lesson1.awk"


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


def write_awk(root: Path) -> None:
    """Add a port in AWK, by way of the skeleton: it runs in a tenth of a second, and needs no compiler."""
    write_skeleton("awk", root)
    (root / "awk/Chapter17_Lesson1.sh").unlink()
    (root / "awk" / AWK.name).write_text(AWK.read_text())
    for name in ("port.toml", "port.mk"):
        path = root / "awk" / name
        text = path.read_text().replace('["sh", "{root}', '["awk", "-f", "{root}').replace("Lesson1.sh", "Lesson1.awk")
        text = text.replace('"sh"', '"awk"')
        tolerances = "{x1 = 2e-9, x2 = 2e-8, theta_hat = 2e-8}"
        path.write_text(text.replace("{x1 = 1e-6, x2 = 1e-6, theta_hat = 1e-6}", tolerances))


def make(root: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run make in a tree, as a user would: without this run's own PORTS and make flags."""
    return subprocess.run(
        ["make", *words], cwd=root, env=as_a_user() | environment, capture_output=True, text=True, timeout=300
    )
