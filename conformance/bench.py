# SPDX-License-Identifier: MIT
"""How long things take, printed as ratios of one run on one machine: make bench."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import mpmath
import numpy as np
import sympy as sp

from conformance.experiment import problem
from conformance.ports import ROOT, Port, read_ports
from conformance.run import choose_engine, in_place
from conformance.scenario import LESSON
from conformance.table import layout
from conformance.truth import Enclosure, InitialValueProblem, enclose

T = TypeVar("T")
START = (LESSON.x1_start, LESSON.x2_start, LESSON.theta_hat_start)


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
    if not port.target:
        return None
    command = ["make", "-n", f"build/{port.name}/{port.target}"]
    return subprocess.run(command, cwd=root, capture_output=True, text=True).stdout.splitlines()[-1]


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
            engine = choose_engine(port)
            start = seconds(in_place(engine.startup), port.build) if engine.startup else 0.0
            ran = seconds(in_place(engine.command), port.build)
            bare += compiled + ran
            share = (compiled + min(start, ran)) / (compiled + ran)
            rows.append((port.name, f"{compiled:.2f}", f"{start:.2f}", f"{ran:.2f}", f"{share:.2f}"))
        print(layout(rows))
        subprocess.run(["make", "clean"], cwd=root, check=True, capture_output=True)
        all_ = seconds(["make", "-j2", "all"], root)
        again = seconds(["make", "all"], root)
        print(f"bare, one after another: {bare:.2f} s; make -j2 all: {all_:.2f} s, {all_ / bare:.2f} of it (aim: 0.65)")
        print(f"up-to-date make all: {again:.2f} s (aim: 0.3 s)")


def timed(action: Callable[[], T]) -> tuple[T, float]:
    """The result of an action and its wall time in s."""
    started = time.perf_counter()
    return action(), time.perf_counter() - started


def bench_truth(limit: float = 60.0) -> None:
    """The enclosure of the lesson's three states, against solvers without a proof; `limit` in s is for mpmath."""
    whole = problem(LESSON)
    horizon = sp.Rational(LESSON.horizon.numerator, LESSON.horizon.denominator)
    three = {"states": whole.states[:3], "rhs": whole.rhs[:3], "start": whole.start[:3]}
    lesson = replace(whole, **three, horizon=horizon, outputs=())
    with tempfile.TemporaryDirectory() as name:
        enclosed, cold = timed(lambda: enclose(lesson, cache=Path(name)))
        _, warm = timed(lambda: enclose(lesson, cache=Path(name)))
    _, with_outputs = timed(lambda: enclose(whole, cache=None))
    _, coarse = timed(lambda: enclose(lesson, 1e-12, cache=None))
    times = np.random.default_rng(0).uniform(0, 20, 10**6)
    dense = min(timed(lambda: enclosed.evaluate(times))[1] for _ in range(3))
    error = (enclosed.bound / enclosed.scale).max()
    print(f"enclosure, cold: {cold:.2f} s, radius at most {enclosed.largest_radius:.1e} (aims: 3 s, 1e-18)")
    print(f"  with z1, z2, V and the integral of -V': {with_outputs:.2f} s; for a radius of 1e-12: {coarse:.2f} s")
    print(f"  from the cache: {warm:.3f} s (aim: 0.1 s)")
    print(f"  at a million times, as doubles: {dense:.2f} s, {1e6 / dense:.1e} per s (aim: 0.5 s);", end=" ")
    print(f"error at most {error:.1e} of each state's scale (aim: 1e-15)")
    print(f"heyoka, double precision, no proof: {heyoka_figures(lesson, enclosed)}")
    print(f"mpmath.odefun, 20 digits, no proof: {mpmath_figures(lesson, enclosed, limit)}")


def heyoka_figures(lesson: InitialValueProblem, enclosed: Enclosure) -> str:
    """heyoka's Taylor integrator in double precision: building it, and one run."""
    import heyoka as hy

    names = [s.name for s in lesson.states]
    variables = dict(zip(lesson.states, hy.make_vars(*names), strict=True)) | {lesson.time: hy.time}
    functions = [{"sin": hy.sin, "cos": hy.cos}]
    rhs = sp.lambdify(list(variables), [sp.N(f, 17) for f in lesson.rhs], modules=functions)(*variables.values())
    system = [(variables[s], f) for s, f in zip(lesson.states, rhs, strict=True)]
    integrator, build = timed(lambda: hy.taylor_adaptive(system, list(map(float, START))))
    _, ran = timed(lambda: integrator.propagate_until(20.0))
    error = np.abs(integrator.state - enclosed.evaluate(20.0)).max()
    return f"{ran:.4f} s after {build:.2f} s of compilation, error {error:.1e} at t = 20"


def mpmath_figures(lesson: InitialValueProblem, enclosed: Enclosure, limit: float) -> str:
    """How far odefun at 20 digits gets within the limit (s), and its error there, by the enclosure."""
    with mpmath.workdps(20):
        rhs = sp.lambdify((lesson.time, lesson.states), lesson.rhs, "mpmath")
        start = [mpmath.mpf(v.numerator) / v.denominator for v in START]
        solution = mpmath.odefun(lambda t, x: rhs(t, x), 0, start, tol=mpmath.mpf(10) ** -18)
        started, reached, values = time.perf_counter(), 0, start
        while reached < enclosed.end and time.perf_counter() - started < limit:
            reached += 1
            values = solution(reached)
        ran = time.perf_counter() - started
        balls = enclosed.at(reached)
        error = max(abs(mpmath.mpf(b.mid().str(25, radius=False)) - v) for b, v in zip(balls, values, strict=True))
    return f"{ran:.2f} s to t = {reached}, error {float(error):.1e}"


if __name__ == "__main__":
    bench_make()
    bench_truth()
