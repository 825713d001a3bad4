# SPDX-License-Identifier: MIT
"""What a program prints beside its CSV: four lines, which must say the same."""

import re
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path, PureWindowsPath

from conformance.foreign import plain, read_bytes, shown
from conformance.judging.trajectory import COARSEST, Trajectory, number, print_error
from conformance.theory.scenario import Scenario

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


REPORT = (
    Said("Final tracking error", "scientific, such as -2.685662e-09", r"([-+]?\d+\.?\d*[eE][-+]?\d{1,3})"),
    Said("Final parameter estimate", "fixed, at least 6 decimals", r"([-+]?\d+\.\d{6,40})"),
    Said("True parameter", "fixed", r"([-+]?\d+\.\d{1,40})"),
    Said("Data written to", "the CSV's name", r"(\S.*)"),
)
COLONLESS = REPORT[3].label
LABELS = tuple(said.label for said in REPORT)
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


def report_problems(lines: list[str], trajectory: Trajectory, scenario: Scenario, csv_name: str) -> list[str]:
    """Where standard output does not say the same as the CSV; empty lines do not count."""
    found, problems = _four_lines(lines)
    if problems:
        return problems
    error, estimate, parameter, name = found
    z1, theta_hat = float(trajectory.tracking_error[-1]), float(trajectory["theta_hat"][-1])
    coarse_z1, coarse_theta_hat = (print_error(c)[-1] for c in (trajectory.tracking_error, trajectory["theta_hat"]))
    wanted = (
        ("final tracking error", abs(float(error) - z1) <= half_unit(error) + coarse_z1, error, number(z1)),
        (
            "final parameter estimate",
            abs(float(estimate) - theta_hat) <= half_unit(estimate) + coarse_theta_hat,
            estimate,
            number(theta_hat),
        ),
        (
            "true parameter",
            float(parameter) == float(scenario.theta),
            parameter,
            number(float(scenario.theta)),
        ),
        ("file name", PureWindowsPath(name).name == csv_name, shown(name), shown(csv_name)),
    )
    causes = {
        "final tracking error": "; usual cause: another row than the last, or a state that is advanced once more",
        "final parameter estimate": "; that is theta itself" if float(estimate) == float(scenario.theta) else "",
    }
    return [
        f"standard output, {what}: found {plain(got)}, expected {want}{causes.get(what, '')}"
        for what, same, got, want in wanted
        if not same
    ]


def _four_lines(lines: list[str]) -> tuple[list[str], list[str]]:
    """What stands behind the labels of the four lines; or else what is wrong, line by line."""
    found: list[str] = []
    problems: list[str] = []
    for place, text in enumerate(lines, start=1):
        line = text.strip()
        if not line:
            continue
        said = REPORT[len(found)] if len(found) < len(REPORT) else None
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
    if len(found) < len(REPORT):
        number_of = f"{len(found)} of the four lines" if found else "none of the four lines"
        expected = "expected the four lines of the contract"
        problems.append(f"found {number_of}, {expected}; the next is {REPORT[len(found)].expected}")
    more = [f"and {len(problems) - MOST} more lines"] if len(problems) > MOST else []
    return found, [f"standard output, {problem}" for problem in [*problems[:MOST], *more]]


def half_unit(digits: str) -> float:
    """Half a unit of the last digit that a number shows, and a little for its own rounding; the contract's at most."""
    exponent = Decimal(digits).as_tuple().exponent
    return min(float(f"0.500001e{exponent}"), COARSEST)
