# SPDX-License-Identifier: MIT
"""The evidence: what campaigns have kept, what changed since an earlier result, why a program was refused."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from conformance.judging.checks import Result
from conformance.judging.difference import read_result
from conformance.judging.verdict import EXACT, Judgement, Verdict, judge_file, judge_port, to_json
from conformance.pages.report.campaigns import MOST_FAILURES, campaigns
from conformance.pages.report.evidence import changed, refusal
from conformance.programs.ports import Port
from conformance.tests.under_test import FIRST, record
from conformance.theory.lesson import LESSON
from conformance.trials.campaign import TITLE, Outcome, depends_on, state_of
from conformance.trials.coverage import own_seed
from conformance.trials.random_plants import draw_plant

# ---- Campaigns ----


def keep(build: Path, port: Port, number: int, seed: int = 7, now: bool = True, **outcome: object) -> None:
    """A result as a campaign keeps it; of the program as it is now, or of an earlier one."""
    state = state_of(port, depends_on(port, record(port)["engine_version"] if now else "an earlier engine"))
    folder = build / "campaign" / f"{seed}-{number}"
    folder.mkdir(parents=True, exist_ok=True)
    whole = Outcome(port.name, folder.name, **({"status": "pass", "error": 1e-9} | outcome))
    kept = {"key": "", "title": TITLE.format(number=number, seed=seed), "state": state, "outcome": asdict(whole)}
    (folder / f"{port.name}.json").write_text(json.dumps(kept))


def test_campaign_that_is_kept_is_counted_by_seed_and_its_failures_are_told(tmp_path: Path) -> None:
    ports = {FIRST.name: FIRST, "other": replace(FIRST, name="other")}
    keep(tmp_path, FIRST, 0)
    keep(tmp_path, FIRST, 1, status="fail", reason="x1 strays\nfar", error=1e-5)
    keep(tmp_path, FIRST, 2, now=False, status="fail", reason="it did once")
    keep(tmp_path, FIRST, 3, seed=own_seed(FIRST))
    told = campaigns(ports, lesson=True, build=tmp_path)
    assert [(line.head, [cell.status for cell in line.cells]) for line in told.lines] == [
        ("experiments of the seed 7", ["fail", "none"]),
        ("experiments of its own", ["pass", "none"]),
    ]
    assert told.lines[0].cells[0].figure == "1 of 2" and told.earlier == 1
    assert told.lines[0].cells[0].words == "1 of 2 conform; the largest error is 10 of its tolerance"
    (failure,) = told.failures
    assert (failure.what, failure.reason) == ("number 1 of the seed 7", "x1 strays\nfar")
    below = f"{tmp_path.name}/campaign/7-1"
    assert failure.command.endswith(f"{below}/{FIRST.name}/{FIRST.csv.name} --plant {below}/experiment.toml")
    for number in range(5, 10 + MOST_FAILURES):
        keep(tmp_path, FIRST, number, status="error", reason="")
    told = campaigns(ports, lesson=True, build=tmp_path)
    assert (len(told.failures), told.more) == (MOST_FAILURES, 6)
    assert campaigns(ports, lesson=False, build=tmp_path).lines == []


def test_random_plants_are_counted_and_those_that_fail_are_told(tmp_path: Path) -> None:
    for number, status in enumerate(("pass", "fail")):
        path = draw_plant(-4, number, tmp_path / "random")
        error = Result(f"x1{EXACT}", "(10)", 1e-8, 1e-6, "", "")
        verdict = Verdict(FIRST.name, status, "" if status == "pass" else "x1 strays", results=(error,))
        (tmp_path / path.stem).mkdir()
        (tmp_path / path.stem / "result.json").write_text(to_json([verdict, Verdict("other", "left out")]))
    told = campaigns({FIRST.name: FIRST, "other": replace(FIRST, name="other")}, lesson=False, build=tmp_path)
    (line,) = told.lines
    assert line.head == "plants of the seed -4" and [cell.figure for cell in line.cells] == ["1 of 2", ""]
    assert line.cells[0].words == "1 of 2 conform; the largest error is 0.01 of its tolerance"
    assert [(run.what, run.reason) for run in told.failures] == [("plant 1 of the seed -4", "x1 strays")]
    assert told.failures[0].command == f"make check PLANT={tmp_path.name}/random/random_minus_4_1.toml"


# ---- What changed ----


def test_change_since_an_earlier_result_is_told_worse_before_better(tmp_path: Path) -> None:
    def verdict(engine: str, rose: float, fell: float) -> Verdict:
        results = (Result("rose", "(1)", rose, 1.0, "", ""), Result("fell", "(1)", fell, 1.0, "", ""))
        return Verdict("a", "pass", "", engine, results=results)

    earlier = tmp_path / "earlier.json"
    earlier.write_text(to_json([verdict("one", 0.1, 0.4)]))
    told = changed("earlier.json", read_result(earlier), Judgement((verdict("two", 0.2, 0.1),), {}))
    assert [(c.what, c.was, c.now, c.way, c.factor) for c in told.changes] == [
        ("engine", "one", "two", "", ""),
        ("rose", "0.1 of 1, holds", "0.2 of 1, holds", "worse", "2 times"),
        ("fell", "0.4 of 1, holds", "0.1 of 1, holds", "better", "4 times"),
    ]
    assert (told.since, told.counted) == ("earlier.json", "1 worse, 1 better")


# ---- Why refused ----


def test_refusal_begins_with_the_cause_and_has_every_check_that_failed(tmp_path: Path) -> None:
    path = tmp_path / FIRST.csv.name
    header, *rows = FIRST.csv.read_text().splitlines()
    wrong = [",".join([t, x1, str(float(x2) + 1e-3), *rest]) for t, x1, x2, *rest in (row.split(",") for row in rows)]
    path.write_text("\n".join([header, *wrong]) + "\n")
    verdict = judge_file(path, LESSON, diagnose=True)
    why = refusal(verdict)
    assert why and why.first == "x2 is off by 0.001 in every row: the column, not its equation (12)"
    assert len(why.faults) == sum(not result.passed for result in verdict.results) > 2
    assert all(fault.cause and fault.section.startswith("(") for fault in why.faults)
    off = next(fault for fault in why.faults if fault.claim == "x2 equals the exact solution")
    assert off.figure == "0.001" and float(off.bound) < 2e-6 and off.where.startswith("x2 at t = ")


@pytest.mark.parametrize("reason", ["it did not run; type: make a", "a.csv, line 3: found 'x', expected a number"])
def test_reason_that_is_no_check_is_told_as_it_is(reason: str) -> None:
    why = refusal(Verdict("a", "missing", reason))
    assert why and (why.first, why.faults) == (reason, [])


def test_program_that_conforms_has_no_refusal() -> None:
    assert refusal(judge_port(FIRST, LESSON)) is None
