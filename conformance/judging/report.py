# SPDX-License-Identifier: MIT
"""What a program prints beside its CSV: four lines, two where nothing is unknown, which must say the same."""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path, PureWindowsPath

from conformance.foreign import plain, read_bytes, shown
from conformance.judging.trajectory import COARSEST, Trajectory, number, print_error
from conformance.theory.experiments import Experiment
from conformance.truth.setting import setting_of

LARGEST = 1 << 20  # bytes of standard output
MOST = 5  # lines that are named


@dataclass(frozen=True)
class Said:
    """One line of the four: how it begins, what the contract wants behind that, and as a pattern."""

    label: str
    form: str
    pattern: str

    @property
    def expected(self) -> str:
        return f"'{self.label}: <{self.form}>'"


COLONLESS = "Data written to"


def report_of(p: int) -> tuple[Said, ...]:
    """The lines on a plant of p unknown parameters, whose values are separated by a comma and a space."""

    def listed(label: str, form: str, one: str) -> Said:
        numbers = form if p == 1 else f"{p} numbers separated by ', ', {form}"
        return Said(label, numbers, f"({', '.join([one] * p)})")

    estimates = listed("Final parameter estimate", "fixed, at least 6 decimals", r"[-+]?\d+\.\d{6,40}")
    return (
        Said("Final tracking error", "scientific, such as -2.685662e-09", r"([-+]?\d+\.?\d*[eE][-+]?\d{1,3})"),
        *((estimates, listed("True parameter", "fixed", r"[-+]?\d+\.\d{1,40}")) if p else ()),
        Said(COLONLESS, "the CSV's name", r"(\S.*)"),
    )


LABELS = tuple(said.label for said in report_of(1))
OF_THE_JVM = re.compile(r"(Picked up \w+:|NOTE: Picked up|.*VM warning:|WARNING: ).*")


def read_report(path: Path, banners: bool = False) -> tuple[list[str], list[str]]:
    """The lines of a text in UTF-8 or UTF-16, empty ones for what a Java machine says of itself; and notes.

    With `banners`, also for what is none of the four lines: a proprietary engine may greet, or tell of its licence.
    Raises ValueError where it cannot be read.
    """
    content = read_bytes(path, LARGEST)
    encoding = "utf-8-sig"
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif content[1::2][:20].strip(b"\0") == b"" and len(content) > 1:
        encoding = "utf-16-le"
    lines = content.decode(encoding, errors="replace").splitlines()
    spoken = [bool(OF_THE_JVM.fullmatch(line)) or (banners and not line.startswith(LABELS)) for line in lines]
    who = "engine" if banners else "Java machine"
    notes = [f"standard output: lines of the {who} about itself are left out"] if any(spoken) else []
    return ["" if its_own else line for line, its_own in zip(lines, spoken, strict=True)], notes


def report_problems(lines: list[str], trajectory: Trajectory, experiment: Experiment, csv_name: str) -> list[str]:
    """Where standard output does not say the same as the CSV; empty lines do not count."""
    theta = setting_of(experiment).theta.tolist()
    p = len(theta)
    found, problems = _lines(lines, report_of(p))
    if problems:
        return problems
    error, *lists, name = found
    estimates, parameters = (text.split(", ") for text in lists) if p else ((), ())
    z1, logged = float(trajectory.tracking_error[-1]), trajectory.states[-p:] if p else ()
    coarse_z1 = print_error(trajectory.tracking_error)[-1]
    wanted = [("final tracking error", abs(float(error) - z1) <= half_unit(error) + coarse_z1, error, number(z1))]
    for estimate, column in zip(estimates, logged, strict=True):
        near = abs(float(estimate) - column[-1]) <= half_unit(estimate) + print_error(column)[-1]
        wanted.append(("final parameter estimate", bool(near), estimate, number(column[-1])))
    for parameter, value in zip(parameters, theta, strict=True):
        wanted.append(("true parameter", _is_the_parameter(parameter, value), parameter, number(value)))
    wanted.append(("file name", PureWindowsPath(name).name == csv_name, shown(name), shown(csv_name)))
    theta_itself = [float(estimate) for estimate in estimates] == theta
    causes = {
        "final tracking error": "; usual cause: another row than the last, or a state that is advanced once more",
        "final parameter estimate": "; that is theta itself" if theta_itself else "",
    }
    return [
        f"standard output, {what}: found {plain(got)}, expected {want}{causes.get(what, '')}"
        for what, same, got, want in wanted
        if not same
    ]


def _is_the_parameter(digits: str, value: float) -> bool:
    """Whether a fixed decimal is the value, or, with six decimals at least, the value rounded: 0.333333 is 1/3."""
    rounded = abs(float(digits) - value) <= half_unit(digits) and len(digits.partition(".")[2]) >= 6
    return float(digits) == value or rounded


def _lines(lines: list[str], report: tuple[Said, ...]) -> tuple[list[str], list[str]]:
    """What stands behind the labels of the report's lines; or else what is wrong, line by line."""
    found: list[str] = []
    problems: list[str] = []
    for place, text in enumerate(lines, start=1):
        line = text.strip()
        if not line:
            continue
        said = report[len(found)] if len(found) < len(report) else None
        if said is None:
            problems.append(f"line {place}: found {shown(line)}, expected nothing more")
            continue
        label = said.label + ("" if said.label == COLONLESS else ":")
        match = re.fullmatch(f"{label} {said.pattern}", line, re.ASCII if said.label != COLONLESS else 0)
        if not match:
            comma = "; the decimal sign is a point" if re.search(r"\d,\d", line) and said.label != COLONLESS else ""
            problems.append(f"line {place}: found {shown(line)}, expected {said.expected}{comma}")
        if match or line.startswith(said.label):
            found.append(match[1] if match else "")
    if len(found) < len(report):
        count = "four" if len(report) == 4 else "two"
        number_of = f"{len(found) or 'none'} of the {count} lines"
        expected = f"expected the {count} lines of the contract"
        problems.append(f"found {number_of}, {expected}; the next is {report[len(found)].expected}")
    more = [f"and {len(problems) - MOST} more lines"] if len(problems) > MOST else []
    return found, [f"standard output, {problem}" for problem in [*problems[:MOST], *more]]


def half_unit(digits: str) -> float:
    """Half a unit of the last digit that a number shows, and a little for its own rounding; the contract's at most."""
    exponent = Decimal(digits).as_tuple().exponent
    return min(float(f"0.500001e{exponent}"), COARSEST)
