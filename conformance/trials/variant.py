# SPDX-License-Identifier: MIT
"""Variants: edited copies of the tree, run by their own Makefile in build/variants/<name>/, and judged.

A variant is a TOML file of conformance/trials/variants/: an experiment, which every program must pass when so edited,
or a mistake, which a named check must refuse. Its edits there are in words that all programs share; what a program
spells in its own, or why it has no such text, stands in variants.toml beside it. A result is kept until something that
it depends on changes.
"""

import fcntl
import functools
import hashlib
import os
import shutil
import signal
import subprocess
import tomllib
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from threading import Event
from typing import Any

from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.run import as_a_user, choose_engine
from conformance.programs.writer import write_programs
from conformance.theory.experiments import Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.theory.numbers import double, exact_value
from conformance.theory.reader import Unreadable, read
from conformance.trials.edits import Edit, constant_edit, edited, in_experiment, spelled_edit, without_drawing

DATA = Path(__file__).with_name("variants")
BUILD = ROOT / "build" / "variants"
PATIENCE = 180  # s, for one program; the slowest needs 8, and 60 on a machine that is busy with ten other things
PATIENCE_WITH_MATLAB = 600  # s, for a proprietary engine: two slow starts, and models that are compiled
RUNNER = ROOT / "conformance" / "programs" / "run.py"
PACKAGES = ("numpy", "scipy", "woxi")  # of .venv, on which programs run
MAKE_NEEDS = (
    "Makefile", "conformance/__init__.py", "conformance/foreign.py", "conformance/places.py",
    "conformance/alone.sh", "conformance/setup.sh",
    "conformance/programs/__init__.py", "conformance/programs/ports.py", "conformance/programs/sandbox.py",
    "conformance/theory/__init__.py", "conformance/theory/numbers.py",
)  # fmt: skip
OWN = "variants.toml"  # in the folder of a port
UNWRITTEN = "not written yet"  # the reason that a new port begins with
EVERY = "every"  # stands for all ports; its text is in snake_case, spelled for each
KEYS = {"title", "section", "shows", "refused_by", "experiment", "constants", "edits"}


@dataclass(frozen=True)
class Variant:
    """The experiment it is set to and judged against, then constants and edits; `refused_by` is "" unless a mistake.

    Constants are (name, value); edits (port or "every", Edit); `without`: (port, why the port has no such text).
    """

    name: str
    title: str
    section: str
    shows: str
    experiment: Experiment = LESSON
    constants: tuple[tuple[str, str], ...] = ()
    edits: tuple[tuple[str, Edit], ...] = ()
    without: tuple[tuple[str, str], ...] = ()
    refused_by: str = ""

    @property
    def tree(self) -> Path:
        return BUILD / self.name

    def has(self, port: Port) -> bool:
        """Whether the port has the text to edit."""
        return port.name not in dict(self.without)


# ---- Reading ----


def read_variants(folder: Path = DATA, root: Path = ROOT) -> dict[str, Variant]:
    """Every variant of a folder, by name, with what the ports have of their own; raises ValueError for nonsense."""
    variants = {path.stem: read_variant(path) for path in sorted(folder.glob("*.toml"))}
    for path in sorted({port.folder / OWN for port in read_ports(root).values()}):
        if path.is_file():
            _add_own(variants, path)
    return variants


def _add_own(variants: dict[str, Variant], path: Path) -> None:
    """Add the edits and reasons of the ports of one folder."""
    ports = [port.name for port in read_ports(path.parent.parent).values() if port.folder == path.parent]
    where = f"{path.parent.name}/{path.name}"
    for port, own in _toml(path, where).items():
        if port not in ports:
            raise ValueError(f"{where}: found the port {port}, expected {' or '.join(ports)}")
        for name, entry in own.items():
            if name not in variants:
                raise ValueError(f"{where}: found the variant {port}.{name}, expected one of {' '.join(variants)}")
            if not isinstance(entry, dict) or entry.keys() not in ({"edits"}, {"without"}):
                raise ValueError(f"{where}: {port}.{name}: expected either edits or without")
            try:
                edits = tuple((port, _edit(edit)) for edit in entry.get("edits", ()))
            except ValueError as error:
                raise ValueError(f"{where}: {port}.{name}: {error}") from None
            without = tuple((port, str(reason)) for kind, reason in entry.items() if kind == "without")
            old = variants[name]
            variants[name] = replace(old, edits=(*old.edits, *edits), without=(*old.without, *without))


def _toml(path: Path, where: str) -> dict[str, Any]:
    """A TOML file, its numbers as texts; raises ValueError, naming it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"), parse_float=str)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{where}: {error}") from None


def read_variant(path: Path) -> Variant:
    """The variant of a TOML file; raises ValueError, naming the file."""
    table = _toml(path, path.name)
    try:
        return _variant(path.stem, table)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from None


def _variant(name: str, table: dict[str, Any]) -> Variant:
    unknown, missing = table.keys() - KEYS, {"title", "section", "shows"} - table.keys()
    if unknown or missing:
        raise ValueError(f"unknown {' '.join(sorted(unknown)) or '-'}; missing {' '.join(sorted(missing)) or '-'}")
    return Variant(
        name=name,
        experiment=_experiment(table.get("experiment", {})),
        constants=tuple((constant, str(value)) for constant, value in table.get("constants", {}).items()),
        edits=tuple((EVERY, _edit(edit)) for edit in table.get("edits", ())),
        **{key: table[key] for key in ("title", "section", "shows", "refused_by") if key in table},
    )


def _experiment(table: dict[str, Any]) -> Experiment:
    """The lesson's with other numbers, by name, and perhaps another reference."""
    numbers = {}
    for name, value in table.items():
        if name != "reference":
            try:
                numbers[name] = exact_value(value)
                double(numbers[name])
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
    try:
        reference = read(table["reference"]) if "reference" in table else LESSON.reference
    except Unreadable as error:
        raise ValueError(f"reference: {error.sentence}") from None
    found = with_values(LESSON, numbers)
    return found if reference == LESSON.reference else replace(found, reference=reference, facts=())


def _edit(table: dict[str, str]) -> Edit:
    if not isinstance(table, dict) or table.keys() != {"old", "new"}:
        raise ValueError(f"found an edit of {' '.join(table) or 'nothing'}, expected old and new")
    return Edit(table["old"], table["new"])


# ---- Editing ----


def own_edits(variant: Variant, port: Port) -> list[Edit]:
    """The edits of a variant in a port's spelling, those of its experiment left out; raises ValueError for none."""
    text = in_experiment(port, variant.experiment)
    edits = [constant_edit(port, text, name, value) for name, value in variant.constants]
    edits += [spelled_edit(port, e.old, e.new) for name, e in variant.edits if name == EVERY]
    edits += [e for name, e in variant.edits if name == port.name]
    if not edits and variant.refused_by:
        raise ValueError(f"found neither an edit nor a reason why there is none in {port.folder.name}/{OWN}")
    return edits


def source(variant: Variant, port: Port) -> str:
    """The program as the variant has it, with its figure; raises ValueError where an edit does not apply."""
    try:
        return edited(in_experiment(port, variant.experiment), own_edits(variant, port))
    except ValueError as error:
        raise ValueError(f"{variant.name}, {port.name}: {error}") from None


def copy_tree(destination: Path) -> None:
    """Copy the tree, without what was made, to a folder that shares .venv."""
    ignored = shutil.ignore_patterns("build", ".venv", ".git", "__pycache__")
    shutil.copytree(ROOT, destination, ignore=ignored, dirs_exist_ok=True)
    _share_environment(destination)


def copy_what_runs(destination: Path) -> None:
    """Copy what the programs need, and no more; much smaller than the tree."""
    paths = [*(ROOT / name for name in MAKE_NEEDS), RUNNER, *ROOT.glob("*.txt")]
    paths += [path for folder in {port.folder for port in read_ports().values()} for path in folder.rglob("*")]
    for path in paths:
        if path.is_file() and "__pycache__" not in path.parts:
            copied = destination / path.relative_to(ROOT)
            copied.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, copied)
    _share_environment(destination)


def copy_with_programs(experiment: Experiment, tree: Path) -> None:
    """Copy what runs, and write the programs of an experiment where make has those of a plant."""
    copy_what_runs(tree)
    ports = [port for port in read_ports().values() if port.template]
    write_programs(experiment, ports, tree / "build" / experiment.name / "programs", force=True)


def _share_environment(destination: Path) -> None:
    if not (destination / ".venv").exists():
        (destination / ".venv").symlink_to((ROOT / ".venv").resolve())


# ---- Running ----


@dataclass(frozen=True)
class Job:
    """One edited program, to be run in a tree; `key` tells what its result depends on."""

    tree: Path
    port: Port  # of this tree; its edited copy has the same place in `tree`
    text: str
    key: str

    @property
    def folder(self) -> Path:
        return in_tree(self.port, self.tree).build

    @property
    def fresh(self) -> bool:
        """Whether its result is kept."""
        path = self.folder / "key"
        return path.is_file() and path.read_text() == self.key

    @property
    def timed_out(self) -> bool:
        """Whether the program had to be ended."""
        return (self.folder / "timeout").exists()


def in_tree(port: Port, tree: Path) -> Port:
    """The port, with the source and the results of a copied tree."""
    return replace(port, folder=tree / port.folder.relative_to(port.root))


def runnable(ports: Iterable[Port]) -> list[Port]:
    """Those that have an engine here."""
    return [port for port in ports if any(engine.found(ROOT) for engine in port.engines)]


def job(tree: Path, port: Port, text: str) -> Job:
    """A job; the drawing of the figure is left out."""
    quick = edited(text, without_drawing(port, text))
    engine = choose_engine(port)
    program = ROOT / engine.program if "/" in engine.program else Path(shutil.which(engine.program) or "")
    status = program.stat()
    facts = (quick, *engine.command, str(status.st_size), str(status.st_mtime_ns), _runs_on(port))
    return Job(tree, port, quick, hashlib.sha256("\0".join(facts).encode()).hexdigest())


@functools.cache
def _runs_on(port: Port) -> str:
    """A digest of what a port runs on, but for its source and the facts that do not change a result."""
    folder = port.root / port.folder.name
    beside = (path for path in sorted(folder.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)
    paths = [RUNNER, *(path for path in beside if path.name not in ("port.toml", OWN) and path != port.source_path)]
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in paths]
    return " ".join([*digests, *map(version, PACKAGES)])


def run_all(jobs: Iterable[Job], copy: Callable[[Path], None] = copy_tree, workers: int = os.cpu_count() or 1) -> None:
    """Run what is not fresh, the slowest first; what has run stays when the rest is interrupted."""
    asked = list(jobs)
    with _alone({one.tree.parent for one in asked}):
        waiting = sorted((one for one in asked if not one.fresh), key=_seconds, reverse=True)
        for tree in dict.fromkeys(one.tree for one in waiting):
            write_tree(tree, [one for one in asked if one.tree == tree], copy)
        running: set[subprocess.Popen[bytes]] = set()
        over = Event()
        executor = ThreadPoolExecutor(workers)
        try:
            for done in [executor.submit(_run, one, running, over) for one in waiting]:
                done.result()
        finally:
            over.set()
            executor.shutdown(wait=False, cancel_futures=True)
            for process in tuple(running):
                _stop(process)


@contextmanager
def _alone(folders: Iterable[Path]) -> Iterator[None]:
    """One run at a time in each folder of trees: a second one waits, and then finds the results."""
    with ExitStack() as locks:
        for folder in sorted(folders):
            folder.mkdir(parents=True, exist_ok=True)
            fcntl.flock(locks.enter_context(open(folder / "lock", "w")), fcntl.LOCK_EX)
        yield


def _seconds(one: Job) -> float:
    """How long the program took in the tree, with a compiler's share; unknown is longest."""
    try:
        run = one.port.run()
    except ValueError:
        run = None
    return float("inf") if run is None else float(run["seconds"]) + 2 * bool(one.port.target)


def write_tree(tree: Path, jobs: Iterable[Job], copy: Callable[[Path], None]) -> None:
    """Copy the tree with its programs edited; those of other ports stay as they ran."""
    others = [in_tree(port, tree).source_path for port in read_ports().values()]
    texts = {path: path.read_text(encoding="utf-8") for path in others if path.exists()}
    texts |= {in_tree(one.port, tree).source_path: one.text for one in jobs}
    copy(tree)
    for path, text in texts.items():
        path.write_text(text, encoding="utf-8")


def _run(one: Job, running: set[subprocess.Popen[bytes]], over: Event) -> None:
    """make PORT in the tree, which installs nothing; this run's own PORTS and make flags do not reach it."""
    shutil.rmtree(one.folder, ignore_errors=True)
    one.folder.mkdir(parents=True)
    with open(one.tree / "build" / f"{one.port.name}.log", "wb") as log:
        words = ["make", "ALONE=yes", "-o", ".venv/installed", f"PLANT_NAME={one.port.plant}", one.port.name]
        process = subprocess.Popen(
            words, cwd=one.tree, env=as_a_user(), start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=log, stderr=log,
        )  # fmt: skip
        running.add(process)
        if over.is_set():
            _stop(process)
        try:
            process.wait(PATIENCE_WITH_MATLAB if choose_engine(one.port).proprietary else PATIENCE)
        except subprocess.TimeoutExpired:
            _stop(process)
            (one.folder / "timeout").touch()
        finally:
            running.discard(process)
    if process.returncode >= 0 or one.timed_out:  # and not ended by an interrupt
        (one.folder / "key").write_text(one.key)


def _stop(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it has started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return
    process.wait()
