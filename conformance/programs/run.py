# SPDX-License-Identifier: MIT
"""Run one port in build/<port>/ and record how: python -m conformance.programs.run PORT [PLANT].

With the name of a plant, its program, which lies in build/<plant>/programs, runs in build/<plant>/<port>/. Leaves there
what the program makes, its standard output and error (stdout.txt, stderr.txt), the record run.json and, after a
success, the empty file `done` for make. With --engine, only asks that an engine is there.
"""

import json
import os
import shlex
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

from conformance.programs.ports import ROOT, Engine, Port, read_ports
from conformance.programs.sandbox import boxed

PATIENCE = 120  # s, for an engine to tell its version


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


def engine_version(engine: Engine, port: Port) -> str:
    """The first line that the version command prints; of a proprietary engine, which may print a banner, the last."""
    command = port.in_place(engine.version)
    answer = subprocess.run(
        command, cwd=port.build, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE
    )
    said = (answer.stdout + answer.stderr).strip()
    if answer.returncode or not said:
        sys.exit(f"{engine.name}: {' '.join(command)} ended with status {answer.returncode}: {said}")
    return said.splitlines()[-1 if engine.proprietary else 0]


def compile_command(port: Port) -> list[str]:
    """The compiler's line of the Makefile, to be run at the top of a tree; nothing where nothing is compiled."""
    if not port.target:
        return []
    target = (port.build / port.target).relative_to(port.root)
    make = ["make", "ALONE=yes", f"PLANT_NAME={port.plant}", "--dry-run", "--always-make", str(target)]
    answer = subprocess.run(make, cwd=port.root, env=as_a_user(), capture_output=True, text=True, check=True)
    return shlex.split(answer.stdout.splitlines()[-1])


def as_a_user() -> dict[str, str]:
    """The environment for a make of its own: without PORTS and what a make that runs this has set."""
    inherited = ("PORTS", "PLANT", "PLANT_NAME", "MAKEFLAGS", "MFLAGS", "MAKELEVEL", "ALONE")
    return {name: value for name, value in os.environ.items() if name not in inherited}


def headless() -> dict[str, str]:
    """The environment without a display."""
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return {**kept, "MPLBACKEND": "agg"}


def run(port: Port) -> int:
    """Run the port and write its record; returns the exit status."""
    engine = choose_engine(port)
    clear(port.build)
    source_hash = port.source_hash()
    version = engine_version(engine, port)
    command = port.in_place(engine.command)
    in_box, sandbox = boxed(engine, command, port.build)
    start, clock = datetime.now(UTC), time.perf_counter()
    with open(port.stdout, "wb") as stdout, open(port.build / "stderr.txt", "wb") as stderr:
        status = subprocess.run(
            in_box,
            cwd=port.build,
            env=headless(),
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
        "sandbox": sandbox,
        "start": start.isoformat(timespec="milliseconds"),
        "seconds": round(time.perf_counter() - clock, 3),
        "exit_status": status,
        "source": port.source,
        "source_sha256": source_hash,
        "csv_sha256": port.csv_hash(),
    }
    part = port.build / "run.json.part"
    part.write_text(json.dumps(record, indent=2) + "\n")
    part.replace(port.build / "run.json")
    if status == 0 and port.csv.is_file():
        (port.build / "done").touch()
        return 0
    sys.stderr.write((port.build / "stderr.txt").read_text(errors="replace"))
    lacking = "" if status else f" and wrote no {port.csv.name}"
    print(f"{port.name}: {engine.name} ended with status {status}{lacking}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    name, *plants = (word for word in sys.argv[1:] if word != "--engine")
    ports = read_ports(plant="".join(plants))
    if name not in ports:
        sys.exit(
            f"run: no port is called {name}{' and has a template' * bool(plants)}; the ports are {' '.join(ports)}"
        )
    asked = ports[name]
    if "--engine" in sys.argv:
        choose_engine(asked)
    else:
        try:
            sys.exit(run(asked))
        except KeyboardInterrupt:  # of which make tells
            sys.exit(130)
