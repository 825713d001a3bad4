# SPDX-License-Identifier: MIT
"""How long things take, printed as ratios of one run on one machine: make bench."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from conformance.ports import ROOT, Port, read_ports
from conformance.run import choose_engine, in_place
from conformance.table import layout

STARTUP = {  # what an engine needs before it comes to the program: its start, and the libraries the program imports
    "python": ["{root}/.venv/bin/python", "-c", "import matplotlib.pyplot, numpy, scipy.integrate"],
    "java": ["java", "-version"],
    "matlab": ["octave-cli", "--norc", "--eval", "1;"],
    "simulink": ["octave-cli", "--norc", "--eval", "1;"],
    "mathematica": ["{root}/.venv/bin/python", "-m", "woxi", "eval", "1"],
}


def seconds(command: list[str] | str, folder: Path) -> float:
    """Wall time of one command, whose output is dropped; exits where it fails."""
    start = time.perf_counter()
    answer = subprocess.run(command, cwd=folder, shell=isinstance(command, str), capture_output=True, text=True)
    if answer.returncode:
        sys.exit(f"bench: {command} failed: {answer.stderr}")
    return time.perf_counter() - start


def copy_of_the_tree(folder: Path) -> Path:
    """A clean copy of what git tracks or would track, with this tree's Python environment."""
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    files = subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "--null", "-T", "-", "-cf", str(folder / "tree.tar")], cwd=ROOT, input=files, check=True)
    subprocess.run(["tar", "-xf", "tree.tar"], cwd=folder, check=True)
    (folder / ".venv").symlink_to(ROOT / ".venv")
    return folder


def compile_command(port: Port, root: Path) -> str | None:
    """The compiler's line of the Makefile, where there is one."""
    lines = subprocess.run(["make", "-n", port.name], cwd=root, capture_output=True, text=True).stdout.splitlines()
    return next((line for line in lines if line.startswith(("g++ ", "javac "))), None)


def bench_make() -> None:
    """make -j2 all against the same commands typed bare, one after another."""
    with tempfile.TemporaryDirectory() as name:
        root = copy_of_the_tree(Path(name))
        bare = 0.0
        rows: list[tuple[str, ...]] = [("port", "compile s", "start-up s", "run s", "start-up and compile, share")]
        for port in read_ports(root).values():
            port.build.mkdir(parents=True)
            compiler = compile_command(port, root)
            if compiler:
                (port.build / "bin").mkdir()
            compiled = seconds(compiler, root) if compiler else 0.0
            start = seconds(in_place(tuple(STARTUP[port.name])), port.build) if port.name in STARTUP else 0.0
            ran = seconds(in_place(choose_engine(port).command), port.build)
            bare += compiled + ran
            share = (compiled + min(start, ran)) / (compiled + ran)
            rows.append((port.name, f"{compiled:.2f}", f"{start:.2f}", f"{ran:.2f}", f"{share:.2f}"))
        print(layout(rows))
        subprocess.run(["make", "clean"], cwd=root, check=True, capture_output=True)
        all_ = seconds(["make", "-j2", "all"], root)
        again = seconds(["make", "all"], root)
        print(f"bare, one after another: {bare:.2f} s; make -j2 all: {all_:.2f} s, {all_ / bare:.2f} of it (aim: 0.65)")
        print(f"up-to-date make all: {again:.2f} s (aim: 0.3 s)")


if __name__ == "__main__":
    bench_make()
