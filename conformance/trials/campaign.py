# SPDX-License-Identifier: MIT
"""Campaigns: random scenarios, every program run and judged on each, in parallel on a Dask cluster.

A result is one file per scenario and program, written at once or not at all; what is there and unchanged is not run
again, so an interrupted campaign goes on where it stopped. docs/campaign.md tells of ranges, tolerance and clusters.
"""

import hashlib
import json
import logging
import os
import random
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

from conformance.atomic import write_atomically
from conformance.foreign import read_toml
from conformance.programs.ports import ROOT, Port
from conformance.programs.run import choose_engine, compile_command, engine_version, headless
from conformance.programs.sandbox import boxed
from conformance.programs.table import layout
from conformance.theory.experiment_file import to_toml
from conformance.theory.experiments import Constant, Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.theory.reader import read
from conformance.trials.edits import edited, in_experiment, without_drawing

FOLDER = ROOT / "build" / "campaign"
PATIENCE = 120  # s, for one compilation or one run; the slowest program needs 5
RADIUS = 1e-12  # of the proofs: a millionth of the tolerance
WAVES = ("sin", "cos")
TITLE = "Drawn: number {number} of the seed {seed}"
DRAWN = re.compile(TITLE.format(number=r"(?P<number>\d+)", seed=r"(?P<seed>-?\d+)"))
RANGES: dict[str, list[str]] = read_toml(Path(__file__).with_name("ranges.toml"))  # of what is drawn
MOST_THREADS = 4  # per worker process: a thread mostly waits for a program, and a process needs 2 s to start


def draw(seed: int, number: int) -> Experiment:
    """The lesson's plant in the experiment of that number; it does not depend on how many are drawn."""
    chance = random.Random(f"{seed} {number}")
    drawn = {name: _multiple(chance, *map(Fraction, limits)) for name, limits in RANGES.items()}
    reference = read(f"amplitude*{chance.choice(WAVES)}(omega*t + phase)")
    constants = (*LESSON.constants, Constant("phase", Fraction(0)))
    title = TITLE.format(number=number, seed=seed)
    return with_values(replace(LESSON, title=title, reference=reference, constants=constants, facts=()), drawn)


def _multiple(chance: random.Random, low: Fraction, high: Fraction, grain: Fraction) -> Fraction:
    return chance.randint(int(low / grain), int(high / grain)) * grain


# ---- Trials ----


@dataclass(frozen=True)
class Program:
    """A port as a campaign runs it: paths are of this machine."""

    port: Port
    engine_version: str
    compiler: tuple[str, ...]  # its command at the top of a tree, or nothing
    depends_on: str  # digest of what a result rests on, but for the program's text

    @property
    def name(self) -> str:
        return self.port.name

    @property
    def state(self) -> str:
        """Digest of what its results rest on, whatever the experiment."""
        return state_of(self.port, self.depends_on)


@dataclass(frozen=True)
class Trial:
    """One program on one experiment, and the folder of its results; `key` is of all that it rests on."""

    experiment: Experiment
    program: Program
    text: str
    folder: Path
    key: str

    @property
    def path(self) -> Path:
        return self.folder / f"{self.program.name}.json"

    @property
    def kept(self) -> Path:
        """Where the files of a run that failed are left."""
        return self.folder / self.program.name


@dataclass(frozen=True)
class Outcome:
    """How a trial went: pass or fail, or error where there was nothing to judge.

    error: the largest deviation from the exact solution, in any column. seconds: of compiler and engine.
    """

    port: str
    scenario: str
    status: str
    reason: str = ""
    error: float = 0.0
    seconds: float = 0.0


def prepare_all(ports: Iterable[Port]) -> list[Program]:
    """The programs of a campaign; the engines are asked for their versions at the same time."""
    with ThreadPoolExecutor() as executor:
        return list(executor.map(prepare, ports))


def prepare(port: Port) -> Program:
    """What is the same for all trials of a port; exits with one line where it has no engine."""
    port.build.mkdir(parents=True, exist_ok=True)
    version = engine_version(choose_engine(port), port)
    return Program(port, version, tuple(compile_command(port)), depends_on(port, version))


def depends_on(port: Port, version: str) -> str:
    """Digest of what stands beside a program, the harness, and the version of its engine."""
    digest = hashlib.sha256(version.encode())
    beside = (path for path in port.folder.rglob("*") if path != port.source_path and "__pycache__" not in path.parts)
    harness = (path for path in (ROOT / "conformance").rglob("*.py") if "tests" not in path.parts)
    for path in sorted((*beside, *harness, ROOT / "requirements.txt")):
        if path.is_file():
            digest.update(path.read_bytes())
    return digest.hexdigest()


def state_of(port: Port, rest: str) -> str:
    """Digest of a program's text, and of the rest that its results depend on."""
    return hashlib.sha256(f"{port.source_hash()} {rest}".encode()).hexdigest()


def trial(experiment: Experiment, program: Program, folder: Path) -> Trial:
    """The trial of a program on an experiment, its figure left out; raises ValueError where an edit does not apply."""
    port, toml = program.port, to_toml(experiment)
    text = in_experiment(port, experiment)
    text = edited(text, without_drawing(port, text))
    key = hashlib.sha256("\0".join((toml, text, program.depends_on)).encode()).hexdigest()
    return Trial(experiment, program, text, folder / hashlib.sha256(toml.encode()).hexdigest()[:16], key)


def known(one: Trial) -> Outcome | None:
    """The outcome that is kept; None where there is none, or one that rests on something else, or an error."""
    try:
        kept = json.loads(one.path.read_text())
        outcome = Outcome(**kept["outcome"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return outcome if kept["key"] == one.key and outcome.status != "error" else None


# ---- On a worker ----


def prove(experiment: Experiment) -> str:
    """Have the proof of the exact solution in the cache; returns an obstacle, or nothing."""
    from conformance.truth.exact import exact
    from conformance.truth.truth import ProofEnded

    try:
        exact(experiment, RADIUS)
    except ProofEnded as obstacle:
        return str(obstacle)
    return ""


def carry_out(one: Trial, obstacle: str) -> Outcome:
    """Run the program, judge what it left, and keep the outcome."""
    outcome = known(one)
    if outcome is None:
        with scratch_tree(one) as tree:
            started = time.perf_counter()
            problem = obstacle or run_program(one, tree)
            seconds = round(time.perf_counter() - started, 3)
            outcome = Outcome(one.program.name, one.folder.name, "error", problem, seconds=seconds)
            if not problem:
                outcome = judged(one, tree, seconds)
            if outcome.status != "pass":
                keep_files(one, tree)
        record = {"key": one.key, "title": one.experiment.title, "state": one.program.state, "outcome": asdict(outcome)}
        write_atomically(one.path, json.dumps(record, indent=2) + "\n")
    return outcome


@contextmanager
def scratch_tree(one: Trial) -> Iterator[Path]:
    """A tree with this program alone, for this attempt alone: its folder, edited, and an empty build folder."""
    port = one.program.port
    scratch = one.folder.parent / "scratch"
    scratch.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=scratch) as name:
        tree = Path(name)
        shutil.copytree(port.folder, tree / port.folder.name)
        (tree / port.folder.name / port.source).write_text(one.text, encoding="utf-8")
        (tree / ".venv").symlink_to(ROOT / ".venv")
        (tree / "build" / port.name / "bin").mkdir(parents=True)
        yield tree


def run_program(one: Trial, tree: Path) -> str:
    """Compile and run in the scratch tree; returns what went wrong, or nothing."""
    port, compiler = one.program.port, one.program.compiler
    build = tree / "build" / port.name
    problem = ended(compiler, compiler[0], tree, build) if compiler else ""
    engine = choose_engine(port)
    command = port.in_place(engine.command)
    return problem or ended(boxed(engine, command, build)[0], command[0], build, build)


def ended(command: Sequence[str], name: str, folder: Path, build: Path) -> str:
    """Run one command to its end, or to the end of patience; returns what went wrong, or nothing."""
    with open(build / "stdout.txt", "wb") as stdout, open(build / "stderr.txt", "wb") as stderr:
        process = subprocess.Popen(
            command, cwd=folder, env=headless(), stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr,
            start_new_session=True,
        )  # fmt: skip
        try:
            status = process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return f"{name} did not end within {PATIENCE} s"
    said = (build / "stderr.txt").read_text(errors="replace").strip().splitlines()
    return f"{name} ended with status {status}: {said[0] if said else 'it said nothing'}" if status else ""


def judged(one: Trial, tree: Path, seconds: float) -> Outcome:
    """The outcome of a program that ended well."""
    from conformance.judging.verdict import judge_file

    build = tree / "build" / one.program.name
    csv = build / one.program.port.csv.name
    verdict = judge_file(csv, one.experiment, build / "stdout.txt", target=RADIUS)
    errors = [result.figure for result in verdict.errors.values()]
    name = one.program.name
    return Outcome(name, one.folder.name, verdict.status, verdict.reason, max(errors, default=0.0), seconds)


def keep_files(one: Trial, tree: Path) -> None:
    """Leave the program, what it made and the experiment beside the outcome."""
    shutil.rmtree(one.kept, ignore_errors=True)
    shutil.copytree(tree / "build" / one.program.name, one.kept, ignore=shutil.ignore_patterns("bin", "home"))
    (one.kept / one.program.port.source).write_text(one.text, encoding="utf-8")
    (one.folder / "experiment.toml").write_text(to_toml(one.experiment))


# ---- On a cluster ----


@contextmanager
def cluster_client(scheduler: str | None, jobs: int) -> Iterator[Any]:
    """A client of the scheduler at that address, or of workers here that carry out as many trials at a time."""
    os.environ.setdefault("DASK_LOGGING__DISTRIBUTED", "critical")  # an interruption would be told of many times
    from distributed import Client, LocalCluster

    logging.getLogger("tornado.application").setLevel(logging.CRITICAL)  # distributed has just set it lower
    if scheduler:
        with Client(scheduler, timeout="10s") as client:
            yield client
        return
    with uninterrupted():
        threads = max(count for count in range(1, MOST_THREADS + 1) if jobs % count == 0)
        workers = {"n_workers": jobs // threads, "threads_per_worker": threads}
        cluster = LocalCluster(**workers, dashboard_address="127.0.0.1:0")
    with cluster, Client(cluster) as client:
        yield client


@contextmanager
def uninterrupted() -> Iterator[None]:
    """What is started here does not hear the interrupt key: whoever started it ends it."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def run_campaign(
    trials: Iterable[Trial], scheduler: str | None = None, jobs: int = os.cpu_count() or 1
) -> Iterator[Outcome]:
    """The outcome of every trial, those that are kept first, the others as they are carried out."""
    waiting: dict[Experiment, list[Trial]] = {}
    for one in trials:
        outcome = known(one)
        if outcome is None:
            waiting.setdefault(one.experiment, []).append(one)
        else:
            yield outcome
    if waiting:
        with cluster_client(scheduler, jobs) as client:
            yield from _outcomes(client, waiting)


def _outcomes(client: Any, waiting: dict[Experiment, list[Trial]]) -> Iterator[Outcome]:
    from distributed import as_completed

    futures = []
    for experiment, some in waiting.items():
        proof = client.submit(prove, experiment, pure=False)
        futures += [client.submit(carry_out, one, proof, pure=False) for one in some]
    for future in as_completed(futures):
        yield future.result()


# ---- What is kept ----


class Kept(NamedTuple):
    """An outcome that is kept: of which draw, and whether it is of program, engine and harness as they are now."""

    seed: int
    number: int
    holds: bool
    outcome: Outcome


def kept_outcomes(ports: Iterable[Port], folder: Path = FOLDER) -> list[Kept]:
    """Every outcome of these ports that is kept, by seed and number; what is damaged is left out.

    No engine is asked: today's is the one of a port's last run.
    """
    found = []
    for port in ports:
        now = state_of(port, depends_on(port, (port.run() or {}).get("engine_version", "")))
        found += [kept for path in folder.glob(f"*/{port.name}.json") if (kept := _kept(path, now))]
    return sorted(found, key=lambda kept: (kept.seed, kept.number, kept.outcome.port))


def _kept(path: Path, now: str) -> Kept | None:
    with suppress(OSError, ValueError, KeyError, TypeError):
        record = json.loads(path.read_text())
        drawn = DRAWN.fullmatch(record["title"])
        if drawn:
            return Kept(int(drawn["seed"]), int(drawn["number"]), record["state"] == now, Outcome(**record["outcome"]))
    return None


# ---- Telling ----


def summary(outcomes: Sequence[Outcome]) -> str:
    """One line per program: how many passed, and the largest error against the exact solution."""
    rows: list[tuple[str, ...]] = [("port", "pass", "fail", "error", "largest error")]
    for name in sorted({outcome.port for outcome in outcomes}):
        own = [outcome for outcome in outcomes if outcome.port == name]
        counts = [str(sum(o.status == status for o in own)) for status in ("pass", "fail", "error")]
        rows.append((name, *counts, f"{max(o.error for o in own):.1e}"))
    return layout(rows)


def report(outcomes: Sequence[Outcome], folder: Path) -> str:
    """The summary; per run that did not pass the reason and what reproduces it; the count last."""
    lines = [summary(outcomes)]
    for outcome in sorted((o for o in outcomes if o.status != "pass"), key=lambda o: (o.scenario, o.port)):
        toml = folder / outcome.scenario / "experiment.toml"
        lines += ["", f"{outcome.port}: {outcome.status}: {outcome.reason}", f"# {toml}", toml.read_text().strip()]
        for csv in (folder / outcome.scenario / outcome.port).glob("*.csv"):
            lines.append(f"# python -m conformance validate {csv} --plant {toml}")
    passed = sum(outcome.status == "pass" for outcome in outcomes)
    scenarios = len({outcome.scenario for outcome in outcomes})
    return "\n".join([*lines, f"{passed} of {len(outcomes)} runs on {scenarios} scenarios conform"])
