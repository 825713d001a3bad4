# SPDX-License-Identifier: MIT
"""The command line: python -m conformance --help."""

import argparse
import csv
import os
import sys
from fractions import Fraction
from typing import NoReturn

EXACT = "a finite decimal, such as 0.1, or a fraction, such as 1/3"


def exact_number(text: str) -> Fraction:
    """A number that is what it says: 0.1 is 1/10."""
    try:
        return Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise argparse.ArgumentTypeError(f"found {text!r}, expected {EXACT}") from None


def exact_times(text: str) -> list[Fraction]:
    """Comma-separated times."""
    return [exact_number(part) for part in text.split(",")]


def positive(text: str) -> Fraction:
    """A positive exact number."""
    value = exact_number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a positive number")
    return value


def digit_count(text: str) -> int:
    """A number of significant digits."""
    if not text.isdecimal() or not 1 <= int(text) <= 100:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected a whole number from 1 to 100")
    return int(text)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> Parser:
    """The commands and their options."""
    top = Parser(prog="conformance", description="Judge the six programs of Chapter 17, Lesson 1.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("table", help="what ran, on which engine, and what came out (the ports of PORTS, or all)")
    truth = commands.add_parser(
        "truth",
        help="the exact solution, as proven balls",
        description="Print the proven enclosure of the exact solution as CSV: t, then for x1, x2, theta_hat, z1, z2 "
        "and V a value and its radius, which covers the rounding of the print too.",
    )
    truth.add_argument("--scenario", default="lesson", help="the experiment (default: lesson)")
    when = truth.add_mutually_exclusive_group()
    when.add_argument("--times", type=exact_times, metavar="T,T,...", help=f"times in s, each {EXACT}")
    when.add_argument("--step", type=positive, default=Fraction(1, 10), help="every so many s (default: 0.1)")
    truth.add_argument("--digits", type=digit_count, default=20, help="significant digits printed (default: 20)")
    return top


def main() -> int:
    """Run one command; returns the exit status."""
    top = parser()
    arguments = top.parse_args()
    try:
        if arguments.command == "table":
            print_table()
        else:
            print_truth(arguments)
    except ValueError as error:
        top.error(f"{arguments.command}: {error}")
    except BrokenPipeError:  # the reader of a pipe has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def print_table() -> None:
    """What ran and what came out."""
    from conformance.ports import selected_ports
    from conformance.table import table

    print(table(selected_ports().values()))


def print_truth(arguments: argparse.Namespace) -> None:
    """The enclosure at the times asked for."""
    from conformance.experiment import balls
    from conformance.scenario import SCENARIOS

    if arguments.scenario not in SCENARIOS:
        raise ValueError(f"--scenario: found {arguments.scenario!r}, expected one of {', '.join(SCENARIOS)}")
    scenario = SCENARIOS[arguments.scenario]
    times = arguments.times or [i * arguments.step for i in range(int(scenario.horizon / arguments.step) + 1)]
    rows = list(balls(scenario, times, arguments.digits))
    csv.writer(sys.stdout, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    sys.exit(main())
