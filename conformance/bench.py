# SPDX-License-Identifier: MIT
"""How long things take, printed as ratios of one run on one machine: make bench."""

import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from statistics import median
from typing import TypeVar

import mpmath
import numpy as np
import sympy as sp

from conformance.judging.trajectory import load
from conformance.judging.verdict import judge_all, judge_file
from conformance.programs.ports import ROOT, read_ports, the_six
from conformance.programs.run import choose_engine, compile_command
from conformance.programs.step import step_of
from conformance.programs.table import layout
from conformance.programs.writer import write
from conformance.tests.truth import plants
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment, starts_of, with_values
from conformance.theory.expressions import operations
from conformance.theory.faults import FileFault
from conformance.theory.identity import prove
from conformance.theory.lesson import LESSON
from conformance.theory.program import explicit
from conformance.theory.statements import statements_of
from conformance.trials import mutants, named
from conformance.trials.campaign import Trial, draw, prepare_all, run_campaign, run_program, scratch_tree, trial
from conformance.trials.edits import Edit, constant_edit, edited
from conformance.trials.variant import copy_tree, read_variants, runnable
from conformance.truth.certificate import certificate
from conformance.truth.certify import certify, parse
from conformance.truth.exact import CONTRACT, exact
from conformance.truth.exact import prove as prove_solution
from conformance.truth.experiment import family, problem
from conformance.truth.sensitivity import sensitivity
from conformance.truth.truth import Enclosure, InitialValueProblem, ProofEnded, enclose

T = TypeVar("T")
START = tuple(starts_of(LESSON).values())


def seconds(command: list[str] | str, folder: Path) -> float:
    """Wall time of one command, whose output is dropped; exits where it fails."""
    start = time.perf_counter()
    answer = subprocess.run(command, cwd=folder, shell=isinstance(command, str), capture_output=True, text=True)
    if answer.returncode:
        sys.exit(f"bench: {command} failed: {answer.stderr}")
    return time.perf_counter() - start


def bench_make() -> None:
    """make -j2 all against the same commands typed bare, one after another."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        copy_tree(root)
        bare = 0.0
        rows: list[tuple[str, ...]] = [("port", "compile s", "start-up s", "run s", "start-up and compile, share")]
        for port in read_ports(root).values():
            port.build.mkdir(parents=True)
            compiler = compile_command(port)
            if compiler:
                (port.build / "bin").mkdir()
            compiled = seconds(compiler, root) if compiler else 0.0
            engine = choose_engine(port)
            start = seconds(port.in_place(engine.startup), port.build) if engine.startup else 0.0
            ran = seconds(port.in_place(engine.command), port.build)
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
    """The enclosure of the lesson's solution, against solvers without a proof; `limit` in s is for mpmath."""
    lesson = replace(problem(LESSON), horizon=sp.Rational(LESSON.horizon))
    enclosed, cold = timed(lambda: enclose(lesson))
    _, coarse = timed(lambda: enclose(lesson, 1e-12))
    times = np.random.default_rng(0).uniform(0, 20, 10**6)
    dense = min(timed(lambda: enclosed.evaluate(times))[1] for _ in range(3))
    error = (enclosed.bound / enclosed.scale).max()
    print(f"enclosure, cold: {cold:.2f} s, radius at most {enclosed.largest_radius:.1e} (aims: 3 s, 1e-18)")
    print(f"  for a radius of 1e-12: {coarse:.2f} s")
    print(f"  at a million times, as doubles: {dense:.2f} s, {1e6 / dense:.1e} per s (aim: 0.5 s);", end=" ")
    print(f"error at most {error:.1e} of each state's scale (aim: 1e-15)")
    text, wrote = timed(lambda: certificate(lesson, enclosed))
    found, read = timed(lambda: parse(text))
    proven, checked = timed(lambda: certify(found))
    radius = max(float(bound) for step in proven for bound in step)
    stated = max(float(bound) for step in found.steps for bound in step.radius)
    print(
        f"certificate: {len(text) / 1e6:.1f} MB, written and checked in {wrote:.1f} s; read in {read:.2f} s,", end=" "
    )
    print(f"checked in {checked:.1f} s: within {radius:.1e}, stated {stated:.1e} (aim: below 1e-15)")
    of = family(LESSON)
    _, took = timed(lambda: sensitivity(of.loop, of.numbers(LESSON), enclosed, np.full(3, CONTRACT)))
    print(f"sensitivities and gains: {took:.1f} s")
    print(f"heyoka, double precision, no proof: {heyoka_figures(lesson, enclosed)}")
    print(f"mpmath.odefun, 20 digits, no proof: {mpmath_figures(lesson, enclosed, limit)}")


CHANGED = (("gamma", 30), ("gamma", 100), ("theta", 20), ("amplitude", 5), ("x1_start", 20), ("k1", 100))


def bench_proofs() -> None:
    """CPU time, steps and radius of proofs, doubles included: the lesson with one parameter changed, other plants."""
    rows: list[tuple[str, ...]] = [("proof", "target", "CPU s", "steps", "radius at most")]
    experiments = {"lesson": LESSON}
    experiments |= {f"{name} = {v}": with_values(LESSON, {name: Fraction(v)}) for name, v in CHANGED}
    for name, changed in experiments.items():
        of = replace(problem(changed), horizon=sp.Rational(LESSON.horizon))
        rows.append((name, "1e-18", *proof_figures(of, 1e-18)))
    for name in plants.PLANTS:
        for kind, gains in (("mild", plants.MILD), ("harsh", plants.HARSH)):
            rows.append((f"{name}, {kind}", "1e-12", *proof_figures(plants.problem(name, gains), 1e-12)))
    print(layout(rows))


def bench_proofs_of_plants() -> None:
    """CPU time of the proof of every plant in plants/ to 1e-12, of which nothing was kept."""
    rows: list[tuple[str, ...]] = [("proof to 1e-12", "derived s", "enclosed s", "steps", "all that is judged by s")]
    longest = 0.0
    for path in sorted((ROOT / "plants").glob("*.toml")):
        experiment = read_experiment(path)
        of, deriving = worked(partial(problem, experiment))
        enclosed, enclosing = worked(partial(enclose, of, 1e-12))
        _, whole = worked(partial(prove_solution, experiment, 1e-12))
        longest = max(longest, deriving + whole)
        figures = (f"{deriving:.2f}", f"{enclosing:.2f}", str(len(enclosed.starts)), f"{deriving + whole:.1f}")
        rows.append((path.stem, *figures))
    print(layout(rows))
    print(f"proofs of plants: each in at most {longest:.1f} s of CPU time (aim: 30 s)")


def proof_figures(of: InitialValueProblem, target: float) -> tuple[str, str, str]:
    """CPU time (s), steps and radius; or how far it got, and why no further."""
    started = time.process_time()
    try:
        enclosed = enclose(of, target)
    except ProofEnded as ended:
        return f"{time.process_time() - started:.1f}", "", str(ended)
    spent = time.process_time() - started
    return f"{spent:.1f}", str(len(enclosed.starts)), f"{enclosed.largest_radius:.0e}"


def written_out(lesson: InitialValueProblem) -> list[sp.Expr]:
    """The right-hand sides in time and states alone."""
    return [explicit(f, dict(lesson.definitions)) for f in lesson.rhs]


def heyoka_figures(lesson: InitialValueProblem, enclosed: Enclosure) -> str:
    """heyoka's Taylor integrator in double precision: building it, and one run."""
    import heyoka as hy

    names = [s.name for s in lesson.states]
    variables = dict(zip(lesson.states, hy.make_vars(*names), strict=True)) | {lesson.time: hy.time}
    functions = [{"sin": hy.sin, "cos": hy.cos}]
    field = [sp.N(f, 17) for f in written_out(lesson)]
    rhs = sp.lambdify(list(variables), field, modules=functions)(*variables.values())
    system = [(variables[s], f) for s, f in zip(lesson.states, rhs, strict=True)]
    integrator, build = timed(lambda: hy.taylor_adaptive(system, list(map(float, START))))
    _, ran = timed(lambda: integrator.propagate_until(20.0))
    error = np.abs(integrator.state - enclosed.evaluate(20.0)).max()
    return f"{ran:.4f} s after {build:.2f} s of compilation, error {error:.1e} at t = 20"


def mpmath_figures(lesson: InitialValueProblem, enclosed: Enclosure, limit: float) -> str:
    """How far odefun at 20 digits gets within the limit (s), and its error there, by the enclosure."""
    with mpmath.workdps(20):
        rhs = sp.lambdify((lesson.time, lesson.states), written_out(lesson), "mpmath")
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


# ---- Judging a CSV ----

READING = "import pandas, conformance.judging.verdict, conformance.__main__"  # what validate imports
LARGE = "0.000002"  # s, the step of RK4 that logs 10 million rows


def bench_validate() -> None:
    """validate on the rows of the C++ program, against pyfunnel on the same columns; and on 10 million rows."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        csv = logged_by_cpp(folder / "10001", "0.002")
        command = [sys.executable, "-m", "conformance", "validate", str(csv)]
        whole = min(seconds(command, ROOT) for _ in range(5))
        imports = min(seconds([sys.executable, "-c", READING], ROOT) for _ in range(5))
        work = min(timed(lambda: judge_file(csv, LESSON))[1] for _ in range(10))
        rows = load(csv, LESSON).t.size
        funnel = pyfunnel_seconds(csv, folder)
        print(
            f"validate, {rows} rows: {work:.3f} s of work (aim: 0.05 s), process {whole:.2f} s (aim: 0.8 s),", end=" "
        )
        print(f"of which {imports:.2f} s interpreter and imports")
        print(f"pyfunnel 2.1.1, the same columns: {funnel:.2f} s, {funnel / work:.0f} times as long a row (aim: 10)")
        csv = logged_by_cpp(folder / "10000001", LARGE)
        size = csv.stat().st_size
        command[-1] = str(csv)
        os.sync()  # the time to write the file is not ours
        long = seconds(command, ROOT)
        memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
        print(f"validate, 10000001 rows, {size / 1e9:.2f} GB: {long:.1f} s (aim: 30 s), {memory:.2f} GiB (aim: 3 GiB)")


def logged_by_cpp(root: Path, step: str) -> Path:
    """The CSV of the C++ program with another step of RK4."""
    copy_tree(root)
    port = read_ports(root)["cpp"]
    text = port.source_path.read_text()
    port.source_path.write_text(edited(text, [constant_edit(port, text, "h", step)]))
    seconds(["make", "cpp"], root)
    return port.csv


def pyfunnel_seconds(csv: Path, folder: Path) -> float:
    """The time pyfunnel takes to compare the columns with the exact solution at the same times."""
    from pyfunnel import compareAndReport

    log = load(csv, LESSON)
    x1, x2, theta_hat = exact(LESSON).evaluate(log.t)
    r = exact(LESSON).reference(log.t)
    wanted = {"x1": x1, "x2": x2, "theta_hat": theta_hat, "reference": r, "tracking_error": x1 - r}
    started = time.perf_counter()
    for column, values in wanted.items():
        given = log[column]
        compareAndReport(log.t, values, log.t, given, str(folder / f"funnel-{column}"), atolx=0.002, atoly=1e-6)
    return time.perf_counter() - started


def bench_diagnosis() -> None:
    """How often the first line of a verdict names the statement that was broken, once all variants and mutants ran."""
    ports = runnable(read_ports().values())
    of_mistakes = named.mistakes(list(read_variants().values()), ports)
    of_mutants = named.of_mutants([mutant for port in ports for mutant in mutants.mutants(port)])
    for what, found, aim in (("mistakes", of_mistakes, "all"), ("mutants", of_mutants, "90 %")):
        share = sum(found) / max(len(found), 1)
        print(f"diagnosis: the first line names {sum(found)} of {len(found)} {what}, {share:.0%} (aim: {aim})")


def bench_fuzz(limit: float = 60.0) -> None:
    """Random bytes into a right CSV, for a time in s: every file is refused with a reason, or conforms."""
    choose = random.Random()
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "fuzzed.csv"
        whole = bytearray(b"".join(logged_by_cpp(Path(name) / "cpp", "0.01").read_bytes().splitlines(True)[:2002]))
        refused = passed = 0
        started = time.perf_counter()
        while time.perf_counter() - started < limit:
            content = whole.copy()
            for _ in range(choose.randint(1, 8)):
                at, gone = choose.randrange(len(content)), choose.choice((0, 1, 1, 7, 300))
                content[at : at + gone] = choose.choice(
                    (
                        choose.randbytes(choose.randint(0, 9)),
                        choose.choice((b",", b"\n", b"\r", b"-", b"e", b".", b"nan", b"1e999", b"\xef\xbb\xbf", b'"')),
                        content[at - 50 : at],
                    )
                )
            path.write_bytes(content)
            verdict = judge_file(path, LESSON)
            refused += verdict.status == "fail" and bool(verdict.reason)
            passed += verdict.conforms
            if not (verdict.conforms or verdict.reason):
                sys.exit(f"bench: a verdict without a reason: {bytes(content)!r}")
    print(
        f"fuzz, {limit:.0f} s: {refused} files refused, {passed} conform (a digit beyond the tolerance), none broke it"
    )


def bench_plants(limit: float = 60.0) -> None:
    """Experiment files with pieces cut, copied and put in, for a time in s: each is read, or refused at its place."""
    choose = random.Random()
    files = sorted((ROOT / "plants").glob("*.toml"))
    pieces = (*"()^*/+-'\"=[],.9ut#|\0\xe9\n", "1e999", "^20", "theta", "exp(", "[[fact]]", "-x1^-1", "tan(1/x1)")
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "damaged.toml"
        for file in files:  # which a damaged one may extend
            shutil.copy(file, name)
        read, refused, longest = 0, 0, 0.0
        started = time.perf_counter()
        while time.perf_counter() - started < limit:
            content = bytearray(choose.choice(files).read_bytes())
            for _ in range(choose.randint(1, 4)):
                at, gone = choose.randrange(len(content) + 1), choose.choice((0, 0, 1, 5, 60))
                content[at : at + gone] = choose.choice(
                    (choose.choice(pieces).encode("latin-1"), content[at - 40 : at])
                )
            path.write_bytes(content)
            before = time.process_time()
            try:
                read_experiment(path)
                read += 1
            except FileFault:
                refused += 1
            except Exception as error:
                sys.exit(f"bench: {error!r} from the experiment file {bytes(content)!r}")
            longest = max(longest, time.process_time() - before)
    print(f"fuzz, {limit:.0f} s: {refused} experiment files refused, {read} read, each within {longest:.2f} s")


def bench_design() -> None:
    """From an experiment file to six programs, each proven as it is written, for every plant in plants/; CPU time."""
    head = ("plant", "read s", "statements", "derived s", "proven s", "step s", "six written s", "in all s")
    rows: list[tuple[str, ...]] = [head]
    for path in sorted((ROOT / "plants").glob("*.toml")):
        experiment, reading = worked(partial(read_experiment, path))
        statements, deriving = worked(partial(statements_of, experiment))
        _, proving = worked(partial(prove, experiment, statements))
        _, stepping = worked(partial(step_of, experiment))
        _, writing = worked(partial(written, experiment))
        times = (f"{reading:.2f}", str(len(statements)), f"{deriving:.3f}", f"{proving:.2f}", f"{stepping:.2f}")
        whole = reading + deriving + proving + stepping + writing
        rows.append((path.stem, *times, f"{writing:.2f}", f"{whole:.2f}"))
    print(layout(rows))
    print("aims: the lesson 0.5 s, n = 4 2 s")


def worked(action: Callable[[], T]) -> tuple[T, float]:
    """The result of an action and its CPU time in s."""
    started = time.process_time()
    return action(), time.process_time() - started


def written(experiment: Experiment) -> list[str]:
    """The programs of an experiment, of every port that has a template."""
    return [write(experiment, port) for port in read_ports().values() if port.template]


STEPS, TURNS = 500_000, 9
OF_RK4 = 13  # operations of a step for each state, beside those of the closed loop


def bench_steps() -> None:
    """CPU time of a step of RK4 in the C++ programs, and for each of its operations, against the lesson's."""
    paths = sorted((ROOT / "plants").glob("*.toml"), key=lambda path: path.stem != LESSON.name)
    experiments = {path.stem: read_experiment(path) for path in paths}
    rows: list[tuple[str, ...]] = [("C++", "operations of a step", "step ns", "operation ns", "of the lesson's")]
    with tempfile.TemporaryDirectory() as name:
        programs = {stem: long_program(e, Path(name)) for stem, e in experiments.items()}
        # every program in each turn: the pace of a machine drifts
        turns = [{stem: worked_by(program) for stem, program in programs.items()} for _ in range(TURNS)]
    times = {stem: min(turn[stem] for turn in turns) / STEPS for stem in experiments}
    each = {stem: times[stem] / operations_of_step(e) for stem, e in experiments.items()}
    for stem, e in experiments.items():
        figures = (f"{1e9 * times[stem]:.0f}", f"{1e9 * each[stem]:.2f}", f"{each[stem] / each[LESSON.name]:.2f}")
        rows.append((stem, str(operations_of_step(e)), *figures))
    print(layout(rows))
    print(f"an operation takes at most {max(each.values()) / each[LESSON.name]:.2f} of the lesson's (aim: 1.05)")


def operations_of_step(e: Experiment) -> int:
    """The operators, signs and functions of a step of RK4."""
    return 4 * sum(operations(s.expression) for s in statements_of(e)) + OF_RK4 * len(e.names)


def long_program(experiment: Experiment, folder: Path) -> Path:
    """The compiled C++ program that simulates the experiment again and again, and writes no CSV."""
    turns = round(STEPS * step_of(experiment) / experiment.horizon)
    again = Edit("write_csv(trajectory);", f"for (int i = 1; i < {turns}; ++i) {{ simulate(); }}")
    source = folder / f"{experiment.name}.cpp"
    source.write_text(edited(write(experiment, read_ports()["cpp"]), [again]))
    seconds(["g++", "-std=c++17", "-O2", "-o", experiment.name, source.name], folder)
    return source.with_suffix("")


def worked_by(program: Path) -> float:
    """The CPU time of a program in s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds([str(program)], program.parent)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def bench_gallery() -> None:
    """make check-gallery, once it is up to date."""
    again = seconds(["make", "-j2", "check-gallery"], ROOT)
    print(f"up-to-date make check-gallery: {again:.1f} s (aim: 20 s)")


def bench_campaign(count: int = 16) -> None:
    """A campaign on all cores, proofs included, against its compilers and engines alone, as many at a time."""
    cores = os.cpu_count() or 1
    programs = prepare_all(the_six().values())
    seed = time.time_ns()  # scenarios whose proofs are in no cache
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(cores) as executor:
        trials = [trial(draw(seed, number), program, Path(name)) for number in range(count) for program in programs]
        problems, bare = timed(lambda: list(executor.map(run_alone, trials)))
        outcomes, whole = timed(lambda: list(run_campaign(trials, jobs=cores)))
        _, again = timed(lambda: list(run_campaign(trials, jobs=cores)))
    passed = sum(outcome.status == "pass" for outcome in outcomes)
    print(
        f"campaign, {count} scenarios on {cores} cores: {passed} of {len(trials)} runs conform in {whole:.1f} s;",
        end=" ",
    )
    print(f"compilers and engines alone {bare:.1f} s, {bare / whole:.2f} of it (aim: 0.8); again: {again:.2f} s")
    print("".join(f"  {problem}\n" for problem in problems if problem), end="")


def run_alone(one: Trial) -> str:
    """Compile and run a trial without judging it; returns what went wrong, or nothing."""
    with scratch_tree(one) as tree:
        return run_program(one, tree)


FRAME_OF_A_SLIDER = """() => new Promise((done) => {
  const later = requestAnimationFrame;
  window.requestAnimationFrame = (draw) => later(() => {
    const begun = performance.now();
    draw();
    window.requestAnimationFrame = later;
    done(performance.now() - begun);
  });
  document.querySelector("#playground input[type=range]").dispatchEvent(new Event("input", { bubbles: true }));
})"""  # ms, of what a slider that moves sets off in the next frame
DRAG = 20  # frames
TASKS = """new PerformanceObserver((list) => {
  for (const { startTime, duration } of list.getEntries()) tasks.push([startTime, duration]);
}).observe({ type: "longtask", buffered: true });
globalThis.tasks = [];"""
OPENED = "performance.getEntriesByType('navigation')[0].domComplete"


def bench_page() -> None:
    """How soon the page answers, what then keeps it busy, and how long the playground takes to integrate and draw."""
    from playwright.sync_api import sync_playwright

    from conformance.pages.report import chromium
    from conformance.pages.report.page import write_page

    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        path = Path(name) / "index.html"
        _, written = timed(lambda: write_page(path, the_six(), judge_all(the_six(), LESSON)))
        browser_path = chromium()
        if browser_path is None:
            print("page: there is no Chromium here")
            return
        browser = playwright.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1900, "height": 1000})
        page.add_init_script(TASKS)
        opened, busy, updated = [], [], []
        for _ in range(5):
            page.goto(path.as_uri())
            page.wait_for_timeout(3000)
            opened.append(page.evaluate(OPENED))
            busy.append(max((length for start, length in page.evaluate("tasks") if start > opened[-1]), default=0))
            page.locator("#playground").scroll_into_view_if_needed()
            page.wait_for_timeout(500)
            updated += [page.evaluate(FRAME_OF_A_SLIDER) for _ in range(DRAG)]
        print(
            f"page: written in {written:.1f} s, {path.stat().st_size / 1e6:.1f} MB (aim: 3 MB), interactive after",
            f"{median(opened):.0f} ms (aim: 1000 ms), then busy for {median(busy):.0f} ms at a time at most,",
            f"playground integrated and drawn in {median(updated):.1f} ms (aim: a frame, 16.7 ms);",
            f"medians of {len(opened)} loads and {len(updated)} frames",
        )


if __name__ == "__main__":
    bench_make()
    bench_campaign()
    bench_truth()
    bench_proofs()
    bench_proofs_of_plants()
    bench_validate()
    bench_diagnosis()
    bench_page()
    bench_fuzz()
    bench_design()
    bench_steps()
    bench_gallery()
    bench_plants()
