# SPDX-License-Identifier: MIT
"""Random plants in strict-feedback form: drawn, written in every language, run and judged, as make does for a file.

A plant is one file in build/random/, which is all that it takes to have a failure again: make check PLANT=FILE.
"""

import math
import os
import random
import re
import subprocess
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from conformance.atomic import write_atomically
from conformance.judging.difference import read_result
from conformance.judging.gallery import judge_plants
from conformance.programs.ports import ROOT
from conformance.programs.run import as_a_user
from conformance.programs.step import closed_loop, initial_state, step_of, trajectory
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.faults import FileFault

FOLDER = ROOT / "build" / "random"
SIZES = (1, 2, 2, 2, 3, 3, 3, 3, 4)  # of the state
UNKNOWN = (0, 1, 1, 2, 2, 3, 3)  # how many parameters
LARGEST_STATE = 50  # of a trajectory that somebody would look at
SMALLEST_STEP = 0.001  # s
WAVES = ("sin", "cos")
NAME = "random_{seed}_{number}"
DRAWN = re.compile(NAME.format(seed=r"(?P<seed>(minus_)?\d+)", number=r"(?P<number>\d+)"))


class Drawn(NamedTuple):
    """A plant's file, whether all its programs conform, and in words what does not."""

    path: Path
    conforms: bool
    reason: str = ""


class Kept(NamedTuple):
    """A plant whose programs have been judged: its draw, its file, the verdicts by program.

    It does not hold where templates or harness are newer than the verdicts.
    """

    seed: int
    number: int
    path: Path
    verdicts: Mapping[str, Any]
    holds: bool


# ---- Drawing ----


def draw_plant(seed: int, number: int, folder: Path = FOLDER) -> Path:
    """Write the plant of that number, which does not depend on how many are drawn; returns its file.

    What no engineer would simulate is drawn again: a plant that is refused, whose states leave all bounds, or which
    takes a step below a millisecond.
    """
    chance = random.Random(f"plant {seed} {number}")
    name = NAME.format(seed=seed, number=number).replace("-", "minus_")
    while True:
        path = folder / f"{name}.toml"
        write_atomically(path, draw_text(chance, name))
        try:
            if is_tame(read_experiment(path)):
                return path
        except (FileFault, ValueError, OverflowError, ZeroDivisionError):
            continue


def is_tame(experiment: Experiment) -> bool:
    """Whether states and estimates stay within bounds, and RK4 does with a step of a millisecond or more."""
    path = trajectory(closed_loop(experiment), initial_state(experiment), experiment.horizon, experiment.horizon / 1000)
    sizes = [abs(value) for state in path for value in state]
    return all(map(math.isfinite, sizes)) and max(sizes) < LARGEST_STATE and step_of(experiment) >= SMALLEST_STEP


def draw_text(chance: random.Random, name: str) -> str:
    """The text of an experiment file."""
    n = chance.choice(SIZES)
    p = chance.choice(UNKNOWN)
    states = [f"x{i + 1}" for i in range(n)]
    unknown = [f"theta{j + 1}" for j in range(p)]
    rows = [draw_row(chance, states[: i + 1], (*states, "u")[i + 1]) for i in range(n)]
    for theta in unknown:  # each in one row or two
        for i in sorted(chance.sample(range(n), min(n, chance.randint(1, 2)))):
            rows[i] += f" {chance.choice('+-')} {theta}*{draw_term(chance, states[: i + 1], with_number=False)}"
    wave, amplitude, omega = chance.choice(WAVES), decimal(chance, 0, 0.8), decimal(chance, 0.3, 1.5)
    offset = chance.choice(["", "", f"{decimal(chance, -0.5, 0.5)} + "])
    lines = [
        f'title = "Random plant {name}"', f'name = "{name}"', 'source = "drawn at random"', "", "[plant]",
        *(f'{x} = "{row}"' for x, row in zip(states, rows, strict=True)), "",
        "[unknown]", *(f'{q} = ["{decimal(chance, -1, 1)}", "{decimal(chance, -0.5, 0.5)}"]' for q in unknown), "",
        "[design]", f"k = [{', '.join(quoted(decimal(chance, 0.5, 2)) for _ in states)}]",
        *([f"Gamma = {draw_gain(chance, p)}"] if p else []), "",
        "[experiment]", f'reference = "{offset}{amplitude}*{wave}({omega}*t)"',
        f"start = [{', '.join(quoted(decimal(chance, -0.6, 0.6)) for _ in states)}]",
        f'horizon = "{chance.choice([4, 5, 6, 8, 10])}"', "",
    ]  # fmt: skip
    return "\n".join(lines if p else [line for line in lines if line != "[unknown]"])


def draw_row(chance: random.Random, states: list[str], following: str) -> str:
    """A row without unknown parameters: up to two known terms, and the next state or the input with its gain."""
    gain = chance.choice(
        ["", "", "", "", "-", "-", "2*", "-1.5*", "0.7*", f"(2 + sin({states[-1]}))*", f"(1 + {states[0]}^2)*"]
    )
    row = f"{gain}{following}"
    for _ in range(chance.choice([0, 0, 1, 1, 2])):
        row += f" {chance.choice('+-')} {draw_term(chance, states)}"
    return row


def draw_term(chance: random.Random, states: list[str], with_number: bool = True) -> str:
    """A product of a number, a power and perhaps a sine, in these states."""
    x, y = chance.choice(states), chance.choice(states)
    power = chance.choice(["", "", "^2", "^3"])
    core = chance.choice(
        [f"{x}{power}", f"{x}{power}", f"{x}*{y}", f"sin({x})", f"cos({x})", f"{x}*sin({y})", f"{x}^2*{y}", f"{x}/2"]
    )
    return f"{decimal(chance, 0.1, 1)}*{core}" if with_number and chance.random() < 0.7 else core


def draw_gain(chance: random.Random, p: int) -> str:
    """One number, or a matrix that is diagonal or, with small numbers beside the diagonal, full."""
    if chance.random() < 0.5:
        return quoted(decimal(chance, 0.3, 2))
    full = chance.random() < 0.5
    beside = {(i, j): decimal(chance, -0.1, 0.1) if full else "0" for i in range(p) for j in range(i)}
    diagonal = [decimal(chance, 0.5, 2) for _ in range(p)]
    rows = [[diagonal[i] if i == j else beside[max(i, j), min(i, j)] for j in range(p)] for i in range(p)]
    return str(rows).replace("'", '"')


def decimal(chance: random.Random, low: float, high: float) -> str:
    """A number with two decimals."""
    return f"{chance.randint(round(100 * low), round(100 * high)) / 100:g}"


def quoted(text: str) -> str:
    return f'"{text}"'


# ---- Running ----


def run_plants(seed: int, count: int, ports: list[str], jobs: int, folder: Path = FOLDER) -> Iterator[Drawn]:
    """Draw that many plants, and write, run and judge the programs of each; what has run is not run again."""
    with ProcessPoolExecutor(jobs) as executor:  # and not threads: the precision of ball arithmetic is a process's
        paths = (draw_plant(seed, number, folder) for number in range(count))
        for done in as_completed([executor.submit(run_plant, path, ports) for path in paths]):
            yield done.result()


def run_plant(path: Path, ports: list[str]) -> Drawn:
    """Have make bring the programs of a plant up to date, and judge them."""
    below = os.path.relpath(path, ROOT)  # the tree's own path may hold a space
    make = ["make", "ALONE=yes", "--keep-going", "ports", f"PLANT={below}", f"PORTS={' '.join(ports)}"]
    subprocess.run(make, cwd=ROOT, env=as_a_user(), capture_output=True)
    (judged,) = judge_plants([path], ports, 1)
    return Drawn(path, judged.conforms, "" if judged.conforms else judged.summary)


def kept_plants(build: Path = FOLDER.parent) -> list[Kept]:
    """Every plant that was drawn and judged, by seed and number; what is damaged is left out."""
    made_by = (*(ROOT / "conformance").rglob("*.py"), *ROOT.glob("*/*.jinja"), *ROOT.glob("*/port.toml"))
    newest = max(path.stat().st_mtime for path in made_by if "tests" not in path.parts)
    found = []
    for path in (build / FOLDER.name).glob("*.toml"):
        drawn, result = DRAWN.fullmatch(path.stem), build / path.stem / "result.json"
        with suppress(OSError, ValueError):
            if drawn:
                seed, number = (int(drawn[of].replace("minus_", "-")) for of in ("seed", "number"))
                found.append(Kept(seed, number, path, read_result(result), result.stat().st_mtime >= newest))
    return sorted(found, key=lambda one: (one.seed, one.number))


def report(drawn: list[Drawn], ports: list[str]) -> str:
    """Per plant that does not conform the verdicts, its file and what to type; the count last."""
    lines = []
    for one in sorted(drawn):
        if not one.conforms:
            lines += [one.reason, f"# make check PLANT={os.path.relpath(one.path, ROOT)}", one.path.read_text()]
    conforming = sum(one.conforms for one in drawn)
    return "\n".join([*lines, f"{conforming} of {len(drawn)} plants conform, each in {', '.join(ports)}"])
