# SPDX-License-Identifier: MIT
"""Which ports there are, how each is spelled and run, and where its results lie.

The facts come from the `port.toml` of every language folder; the standard library suffices to read them.
"""

import functools
import hashlib
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from conformance.foreign import kind, plain, read_json, read_toml, shown
from conformance.places import ROOT as ROOT
from conformance.theory.numbers import exact_value

RECORD: dict[str, Any] = {  # of a run: what each key holds
    "engine": str, "engine_version": str, "proprietary": bool, "command": list, "seconds": (int, float),
    "exit_status": int, "source_sha256": str, "csv_sha256": str,
}  # fmt: skip
SHAPES: dict[Any, str] = {
    str: "a text",
    int: "a whole number",
    bool: "true or false",
    tuple[str, ...]: "a list of texts",
}

LESSON = "Chapter17_Lesson1"  # the stem of its programs
SIX = ("python", "cpp", "java", "matlab", "simulink", "mathematica")  # in the lesson's order; any other is a guest
MODEL = "cpp"  # whose statements and wording a guest is shown


@dataclass(frozen=True)
class Engine:
    """One engine that can run a port; `tolerance` bounds its error in x1, x2 and theta_hat, by `tolerance_from`."""

    name: str
    proprietary: bool
    program: str
    version: tuple[str, ...]
    command: tuple[str, ...]
    install: str
    tolerance: tuple[float, float, float]
    tolerance_from: str
    products: tuple[str, ...] = ()
    startup: tuple[str, ...] = ()  # starts the engine and what the program imports, and no more: for make bench
    present: tuple[str, ...] = ()  # a command that ends with 0 where the program brings all that is needed

    def found(self, root: Path) -> bool:
        """Whether its program is there, on the PATH or at its path below `root`, and brings what is needed."""
        program = shutil.which(root / self.program if "/" in self.program else self.program)
        return program is not None and (not self.present or _ends_well(program, self.present))


@functools.cache
def _ends_well(program: str, command: tuple[str, ...]) -> bool:
    """Whether the command of this program ends with 0; asked once."""
    return subprocess.run([program, *command[1:]], stdin=subprocess.DEVNULL, capture_output=True).returncode == 0


@dataclass(frozen=True)
class Port:
    """One program: its facts, and the paths of its source and results."""

    name: str
    folder: Path
    language: str
    source: str
    method: str
    comment: tuple[str, str]
    section: str
    products: tuple[str, ...]
    engines: tuple[Engine, ...]
    target: str = ""  # what make builds in the build folder before the program can run
    rows: int = 0  # how many times the contract logs; 0: the solver's own
    names: str = "snake"  # or camel: theta_hat, or thetaHat
    constants: str = ""  # upper, where the constants of the section Parameters stand in capitals
    exceptions: tuple[tuple[str, str], ...] = ()  # names that differ from the other programs' in more than their case
    signal: str = "{name}"  # how the value of a signal at the time t is written
    definition: str = "{name} = {expression}"  # and how it is defined
    frame: tuple[str, ...] = ()  # the lines of the mathematical core that are no statement of the lesson
    lesson_names: tuple[str, ...] = ()  # of the lesson's own listing, each of which the program uses
    constant: str = "{name} = {value}"  # how a constant is stated in the section Parameters
    functions: tuple[tuple[str, str], ...] = (("sin", "sin({})"), ("cos", "cos({})"))
    power: str = "{}^{}"  # a base with an exponent, as operator or as function
    exponent: str = "{}e{}"  # a number with an exponent of ten
    statement: str = "{}"  # what stands around a definition
    broken: tuple[str, str, str] = ("", "", "")  # what opens a long expression, ends each of its lines, and closes it
    aligned: bool = True  # whether the comments that trail statements stand below each other
    reserved: str = ""  # names that mean something in the language, apart from those that its program uses
    template: str = ""  # of the program, in its folder; a port that has none takes part in the lesson alone
    plant: str = ""  # the name of the plant that the program is written for; "" for the lesson
    taken: str = ""  # stems that no program can have, since what it runs on has them
    named_by_stem: bool = False  # whether the program has its stem as a name within
    needs: tuple[str, ...] = ()  # further files of its folder that the program needs to run, as patterns
    drawing: tuple[str, ...] = ()  # how the statements begin that draw the figure, which a variant leaves out

    @property
    def source_path(self) -> Path:
        return self.folder / self.source

    @property
    def root(self) -> Path:
        """The top of the tree: programs of a plant lie in build/<plant>/programs/<folder> of it."""
        return self.folder.parents[3 if self.plant else 0]

    @property
    def build(self) -> Path:
        return self.root / "build" / self.plant / self.name

    @property
    def make(self) -> str:
        """What to type to have it run."""
        return f"make {self.name}{' PLANT=FILE.toml' * bool(self.plant)}"

    @property
    def csv(self) -> Path:
        return self.build / f"{self.plant or LESSON}_{self.name}.csv"

    @property
    def stdout(self) -> Path:
        return self.build / "stdout.txt"

    def source_hash(self) -> str:
        """SHA-256 of the source in the tree."""
        return hashlib.sha256(self.source_path.read_bytes()).hexdigest()

    def csv_hash(self) -> str:
        """SHA-256 of the CSV, "" where there is none."""
        return hashlib.sha256(self.csv.read_bytes()).hexdigest() if self.csv.is_file() else ""

    def run(self) -> dict[str, Any] | None:
        """The record of the last run (`run.json`), or None where there is none.

        Raises ValueError, naming file and key, for a record that lacks a key or names an engine that the port lacks.
        """
        path = self.build / "run.json"
        if not os.path.lexists(path):
            return None
        run, where = read_json(path), str(path.relative_to(self.root))
        if not isinstance(run, dict):
            raise ValueError(f"{where}: found {kind(run)}, expected the record of a run")
        for key, kinds in RECORD.items():
            if key not in run:
                raise ValueError(f"{where}: found no {key!r}, expected the record of a run")
            if not isinstance(run[key], kinds) or (kinds is int and isinstance(run[key], bool)):
                raise ValueError(f"{where}, {key}: found {kind(run[key])}, expected what a run records there")
        names = [engine.name for engine in self.engines]
        if run["engine"] not in names:
            raise ValueError(f"{where}, engine: found {shown(run['engine'])}, expected of port.toml {', '.join(names)}")
        return {**run, "engine_version": plain(run["engine_version"])}

    def ran_engine(self, run: dict[str, Any]) -> Engine:
        """The engine that a record names."""
        return next(engine for engine in self.engines if engine.name == run["engine"])

    def in_place(self, words: Sequence[str]) -> list[str]:
        """A command for the build folder, from where the tree's top and the program's folder are ../.. and the like."""
        places = {"{root}": self.root, "{folder}": self.folder}
        for name, place in places.items():
            words = [word.replace(name, os.path.relpath(place, self.build)) for word in words]
        return list(words)


def read_ports(root: Path = ROOT, plant: str = "") -> dict[str, Port]:
    """Every port of every `*/port.toml`, by name; those that have a template as they are of a plant of that name.

    Raises ValueError where a fact lacks or is unknown.
    """
    ports: dict[str, Port] = {}
    for path in sorted(root.glob("*/port.toml")):
        folder = root / "build" / plant / "programs" / path.parent.name if plant else path.parent
        try:
            facts = _with_stem(read_toml(path), plant or LESSON)
            ports |= {name: replace(_port(name, folder, own), plant=plant) for name, own in facts.items()}
        except KeyError as error:
            raise ValueError(f"{path}: found no {error}, expected the facts that conformance new-port writes") from None
        except (TypeError, AttributeError, ValueError) as error:
            reason = str(error).removeprefix("Port.__init__() ").removeprefix("Engine.__init__() ")
            reason = reason.removeprefix("port.toml: ").removeprefix("port.toml, ")
            raise ValueError(f"{path}: {reason}; expected the facts that conformance new-port writes") from None
    return {name: port for name, port in ports.items() if port.template or not plant}


def the_six(root: Path = ROOT) -> dict[str, Port]:
    """The lesson's own ports, of which README, tolerances and exercises tell."""
    return {name: port for name, port in read_ports(root).items() if name in SIX}


def _with_stem(facts: Any, stem: str) -> Any:
    """The facts with the stem of the programs in the place of {stem}."""
    if isinstance(facts, dict):
        return {key: _with_stem(value, stem) for key, value in facts.items()}
    if isinstance(facts, list):
        return [_with_stem(value, stem) for value in facts]
    return facts.replace("{stem}", stem) if isinstance(facts, str) else facts


def _port(name: str, folder: Path, given: Any) -> Port:
    facts = _table(given, name)
    engines = facts.pop("engine")
    if not isinstance(engines, list) or not engines:
        raise ValueError(f"[{name}], engine: found {kind(engines)}, expected [[{name}.engine]]")
    port = Port(name, folder, engines=tuple(_engine(name, engine) for engine in engines), **_frozen(facts))
    _check_shapes(port, f"[{name}]")
    return port


def _engine(port: str, given: Any) -> Engine:
    facts = _table(given, f"{port}.engine")
    by_state = _table(facts.pop("tolerance"), f"{port}.engine, tolerance")
    tolerance = tuple(float(exact_value(by_state[state])) for state in ("x1", "x2", "theta_hat"))
    if not all(0 < bound < 1e300 for bound in tolerance):
        raise ValueError(f"[{port}.engine], tolerance: found {kind(by_state)}, expected positive numbers")
    x1, x2, theta_hat = tolerance
    engine = Engine(**_frozen(facts), tolerance=(x1, x2, theta_hat))
    _check_shapes(engine, f"[{port}.engine]")
    return engine


def _table(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"[{where}]: found {kind(value)}, expected a table")
    return dict(value)


def _check_shapes(facts: Port | Engine, where: str) -> None:
    """Raise ValueError unless each fact has the shape of its field."""
    for fact in fields(facts):
        value = getattr(facts, fact.name)
        right: dict[Any, bool] = {
            str: isinstance(value, str),
            int: isinstance(value, int) and not isinstance(value, bool),
            bool: isinstance(value, bool),
            tuple[str, ...]: isinstance(value, tuple) and all(isinstance(word, str) for word in value),
        }
        if not right.get(fact.type, True):
            raise ValueError(f"{where}, {fact.name}: found {kind(value)}, expected {SHAPES[fact.type]}")


def _frozen(facts: dict[str, Any]) -> dict[str, Any]:
    """Lists as tuples, tables as tuples of pairs."""
    pairs = {name: tuple(fact.items()) if isinstance(fact, dict) else fact for name, fact in facts.items()}
    return {name: tuple(fact) if isinstance(fact, list) else fact for name, fact in pairs.items()}


def selected_ports(names: Sequence[str] | None = None, root: Path = ROOT, plant: str = "") -> dict[str, Port]:
    """The ports of these names; of the environment variable PORTS where none are given; all where it is not set.

    Raises ValueError for a name that is no port's, or has no template to be written by for a plant.
    """
    ports = read_ports(root, plant)
    asked = os.environ.get("PORTS", " ".join(ports)).split() if names is None else names
    unknown = [name for name in asked if name not in ports]
    if unknown or not asked:
        raise ValueError(f"PORTS: {plain(' '.join(unknown)) or 'empty'}; the ports are {' '.join(ports)}")
    return {name: port for name, port in ports.items() if name in asked}
