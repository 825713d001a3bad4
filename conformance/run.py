# SPDX-License-Identifier: MIT
"""Run one port in build/<port>/ and record how: python -m conformance.run PORT.

Leaves there what the program makes, its standard output and error (stdout.txt, stderr.txt), the record run.json and,
after a success, the empty file `done` for make. With --engine, only asks that an engine is there.
"""

import json
import os
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

from conformance.ports import ROOT, Engine, Port, read_ports


def choose_engine(port: Port) -> Engine:
    """The first engine found, in the order of port.toml; exits with one line where there is none."""
    for engine in port.engines:
        if engine.found(ROOT):
            return engine
    names = " or ".join(f"{engine.name} ({engine.program}; install {engine.install})" for engine in port.engines)
    sys.exit(f"{port.name}: no engine found: it needs {names}")


def clear(folder: Path) -> None:
    """Remove what an earlier run left; what was built stays, in a folder of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in folder.iterdir():
        if not path.is_dir():
            path.unlink()


def in_place(words: tuple[str, ...]) -> list[str]:
    """A command for build/<port>/, from where the top is ../.."""
    return [word.replace("{root}", "../..") for word in words]


def engine_version(engine: Engine, folder: Path) -> str:
    """The first line that the engine's version command prints."""
    answer = subprocess.run(in_place(engine.version), cwd=folder, capture_output=True, text=True)
    return (answer.stdout + answer.stderr).strip().splitlines()[0]


def run(port: Port) -> int:
    """Run the port and write its record; returns the exit status."""
    engine = choose_engine(port)
    clear(port.build)
    source_hash = port.source_hash()
    version = engine_version(engine, port.build)
    headless = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = in_place(engine.command)
    start, clock = datetime.now(UTC), time.perf_counter()
    with open(port.stdout, "wb") as stdout, open(port.build / "stderr.txt", "wb") as stderr:
        status = subprocess.run(
            command,
            cwd=port.build,
            env={**headless, "MPLBACKEND": "agg"},
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=stderr,
        ).returncode
    record = {
        "port": port.name,
        "engine": engine.name,
        "engine_version": version,
        "proprietary": engine.proprietary,
        "command": command,
        "start": start.isoformat(timespec="milliseconds"),
        "seconds": round(time.perf_counter() - clock, 3),
        "exit_status": status,
        "source": port.source,
        "source_sha256": source_hash,
    }
    part = port.build / "run.json.part"
    part.write_text(json.dumps(record, indent=2) + "\n")
    part.replace(port.build / "run.json")
    if status == 0:
        (port.build / "done").touch()
    else:
        sys.stderr.write((port.build / "stderr.txt").read_text(errors="replace"))
        print(f"{port.name}: {engine.name} ended with status {status}", file=sys.stderr)
    return 1 if status else 0


if __name__ == "__main__":
    asked = read_ports()[sys.argv[-1]]
    if "--engine" in sys.argv:
        choose_engine(asked)
    else:
        sys.exit(run(asked))
