# SPDX-License-Identifier: MIT
"""Standard output says what the CSV says, the record tells how it came about, and the figures are there."""

import re
import struct

from conformance.judging.report import report_problems
from conformance.judging.trajectory import Trajectory
from conformance.programs.ports import Port
from conformance.tests.under_test import engine_of, record
from conformance.theory.lesson import LESSON


def test_standard_output_says_the_same_as_the_csv(port: Port, trajectory: Trajectory) -> None:
    problems = report_problems(port.stdout.read_text().splitlines(), trajectory, LESSON, port.csv.name)
    assert not problems, "\n".join(problems)


def test_program_ended_well(port: Port) -> None:
    assert record(port)["exit_status"] == 0, f"{port.name} failed:\n{(port.build / 'stderr.txt').read_text()}"


def test_record_is_of_the_source_in_the_tree(port: Port) -> None:
    assert record(port)["source_sha256"] == port.source_hash(), f"{port.name} is stale; type: make {port.name}"


def test_record_names_engine_and_version(port: Port) -> None:
    run = record(port)
    assert {"port", "engine", "engine_version", "command", "start", "seconds", "exit_status"} <= run.keys()
    assert run["port"] == port.name and re.search(r"\d", run["engine_version"])


def test_figures_are_there(port: Port) -> None:
    for name in (*port.products, *engine_of(port).products):
        content = (port.build / name).read_bytes()
        assert len(content) > 1000, f"{port.name}: {name} is nearly empty"
        if name.endswith(".png"):
            assert content.startswith(b"\x89PNG\r\n"), name
            width, height = struct.unpack(">II", content[16:24])
            assert width >= 400 and height >= 300, name
