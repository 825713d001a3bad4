# SPDX-License-Identifier: MIT
"""A verdict counts honestly, names what is wrong, and comes as a table, as JSON and as an exit status."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from conformance.judging.checks import Result
from conformance.judging.layout import columns_of
from conformance.judging.verdict import Verdict, headline, judge_all, judge_file, judge_port, to_json
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.tests.under_test import PORTS, record
from conformance.theory.lesson import LESSON
from conformance.truth.exact import exact
from conformance.truth.experiment import truth

SCHEMA = json.loads((ROOT / "conformance/judging/result.schema.json").read_text())


@pytest.fixture
def exact_csv(tmp_path: Path) -> Path:
    """A trajectory that the suite has never seen: the exact solution at irregular times, 17 digits."""
    t = 20 * np.linspace(0, 1, 3001) ** 1.05
    x1, x2, theta_hat = truth(LESSON).evaluate(t)
    reference = exact(LESSON).reference(t)
    path = tmp_path / "exact.csv"
    rows = np.column_stack([t, x1, x2, theta_hat, reference, x1 - reference])
    np.savetxt(path, rows, fmt="%.17g", delimiter=",", header=",".join(columns_of(LESSON.names)), comments="")
    return path


@pytest.fixture
def copied(port: Port, tmp_path: Path) -> Port:
    """The port's results, in a tree of their own."""
    record(port)
    shutil.copytree(port.build, tmp_path / "build" / port.name)
    shutil.copytree(port.folder, tmp_path / port.folder.name)
    return read_ports(tmp_path)[port.name]


def validate(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "conformance", "validate", *words], cwd=ROOT, capture_output=True, text=True
    )


# ---- Ports ----


def test_good_run_passes(copied: Port) -> None:
    assert judge_port(copied, LESSON).status == "pass"


def test_changed_source_is_stale(copied: Port) -> None:
    copied.source_path.write_text(copied.source_path.read_text() + "\n")
    assert judge_port(copied, LESSON).status == "stale"


def test_program_that_ended_badly_is_an_error(copied: Port) -> None:
    path = copied.build / "run.json"
    path.write_text(path.read_text().replace('"exit_status": 0', '"exit_status": 3'))
    assert judge_port(copied, LESSON).status == "error"


def test_program_that_did_not_run_is_missing(copied: Port) -> None:
    (copied.build / "run.json").unlink()
    verdict = judge_port(copied, LESSON)
    assert verdict.status == "missing" and f"make {copied.name}" in verdict.reason


def test_standard_output_of_another_run_fails(copied: Port) -> None:
    text = copied.stdout.read_text()
    for old, new in (("1.19999", "1.18999"), ("True parameter: 1.2", "True parameter: 1.3"), ("Data", "data")):
        copied.stdout.write_text(text.replace(old, new))
        verdict = judge_port(copied, LESSON)
        assert verdict.status == "fail" and "standard output" in verdict.reason


def test_csv_of_another_port_under_this_name_is_told_by_standard_output(copied: Port) -> None:
    other = "python" if copied.name != "python" else "cpp"
    copied.stdout.write_text(copied.stdout.read_text().replace(f"_{copied.name}.csv", f"_{other}.csv"))
    assert "file name" in judge_port(copied, LESSON).reason


def test_csv_of_another_port_copied_under_this_name_is_not_this_ports(copied: Port) -> None:
    other = next(port for name, port in read_ports().items() if name != copied.name and port.csv.is_file())
    shutil.copy(other.csv, copied.csv)
    verdict = judge_port(copied, LESSON)
    assert verdict.status == "stale" and "is not the file that the run wrote" in verdict.reason


def test_ports_that_are_not_selected_are_left_out_and_counted() -> None:
    name, port = next(iter(PORTS.items()))
    verdicts = judge_all({name: port}, LESSON).verdicts
    assert headline(verdicts).startswith(f"1 of 1 conform; {len(read_ports()) - 1} left out")


def test_headline_counts_what_is_missing_and_what_stood_in() -> None:
    verdicts = [Verdict("a", "pass"), Verdict("b", "pass", stand_in=True), Verdict("c", "missing", "C not found; type")]
    expected = "2 of 3 conform; 1 missing: c (C not found); b on an open engine in place of the proprietary one"
    assert headline(verdicts) == expected


def test_json_follows_its_schema() -> None:
    judgement = judge_all(PORTS, LESSON)
    jsonschema.validate(json.loads(to_json(judgement.verdicts, judgement.pairs)), SCHEMA)
    judged = next(verdict for verdict in judgement.verdicts if verdict.results)
    unbounded = replace(judged, results=(replace(judged.results[0], figure=float("inf")),))
    jsonschema.validate(json.loads(to_json([unbounded])), SCHEMA)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(json.loads(to_json([Verdict("a", "fine")])), SCHEMA)


# ---- Anyone's CSV ----


def test_exact_solution_conforms(exact_csv: Path, tmp_path: Path) -> None:
    answer = validate(exact_csv, "--json", tmp_path / "result.json")
    assert answer.returncode == 0 and "exact.csv conforms" in answer.stdout, answer.stdout + answer.stderr
    jsonschema.validate(json.loads((tmp_path / "result.json").read_text()), SCHEMA)


def change(path: Path, edit: Callable[[list[list[str]]], None]) -> None:
    rows = [line.split(",") for line in path.read_text().splitlines()]
    edit(rows)
    path.write_text("".join(",".join(row) + "\n" for row in rows))


def test_wrong_trajectory_does_not_conform_and_says_why(exact_csv: Path) -> None:
    def frozen(rows: list[list[str]]) -> None:
        for row in rows[1:]:
            row[3] = "0"

    change(exact_csv, frozen)
    answer = validate(exact_csv)
    assert answer.returncode == 1 and "theta_hat-equals-the-exact-solution (10) FAILS" in answer.stdout
    assert "an estimate that is not updated" in answer.stdout and not answer.stderr


def test_file_with_a_wrong_cell_does_not_conform_and_says_where(exact_csv: Path) -> None:
    def spoilt(rows: list[list[str]]) -> None:
        rows[1000][2] = "1.0d0"

    change(exact_csv, spoilt)
    answer = validate(exact_csv)
    assert answer.returncode == 1 and "line 1001, column x2: found '1.0d0'" in answer.stdout


def test_file_cut_off_at_any_time_does_not_conform(exact_csv: Path) -> None:
    text = exact_csv.read_text()
    for share in (0.05, 0.5, 0.98, 0.9999):
        exact_csv.write_text(text[: int(share * len(text))])
        assert judge_file(exact_csv, LESSON).status == "fail", share


def test_standard_output_is_judged_too(exact_csv: Path, tmp_path: Path) -> None:
    said = tmp_path / "stdout.txt"
    said.write_text("Final tracking error: 9.52e-05\n")
    answer = validate(exact_csv, "--stdout", said)
    assert answer.returncode == 1 and "expected the four lines of the contract" in answer.stdout


@pytest.mark.parametrize("name", ["no such file.csv", "."])
def test_what_cannot_be_judged_ends_with_status_2_and_one_line(name: str, tmp_path: Path) -> None:
    answer = validate(tmp_path / name)
    assert answer.returncode == 2 and answer.stdout == "" and len(answer.stderr.splitlines()) == 1


def test_check_command_ends_on_the_headline() -> None:
    answer = subprocess.run([sys.executable, "-m", "conformance", "check"], cwd=ROOT, capture_output=True, text=True)
    assert " conform" in answer.stdout.splitlines()[-1]


# ---- What changed ----


def result_file(path: Path, *verdicts: Verdict) -> Path:
    path.write_text(to_json(verdicts))
    return path


def diff(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "conformance", "diff", *words], cwd=ROOT, capture_output=True, text=True
    )


def test_diff_tells_of_what_came_went_and_changed(tmp_path: Path) -> None:
    small, large = (Result("a-claim", "(10)", figure, 1.0, "", "") for figure in (0.01, 2.0))
    old = result_file(tmp_path / "old.json", Verdict("a", "pass", results=(small,)), Verdict("b", "pass"))
    new = result_file(tmp_path / "new.json", Verdict("a", "fail", results=(large,)), Verdict("c", "missing"))
    answer = diff(old, new)
    assert answer.returncode == 1 and answer.stdout.splitlines() == [
        "b: gone",
        "a: status was 'pass', is 'fail'",
        "c: new, missing",
        "a: a-claim: worse, was 0.01 of 1, holds, is 2 of 1, fails (200 times)",
        "1 worse",
    ]


def test_diff_tells_what_got_better_and_worse_where_every_status_is_the_same(tmp_path: Path) -> None:
    def verdict(figures: dict[str, float]) -> Verdict:
        return Verdict("a", "pass", results=tuple(Result(c, "(10)", f, 1.0, "", "") for c, f in figures.items()))

    old = result_file(tmp_path / "old.json", verdict({"left": 0.1, "fell": 0.4, "rose": 0.2, "tiny": 1e-9}))
    new = result_file(tmp_path / "new.json", verdict({"left": 0.105, "fell": 0.1, "rose": 0.3, "tiny": 1e-6}))
    assert diff(old, new).stdout.splitlines() == [
        "a: rose: worse, was 0.2 of 1, holds, is 0.3 of 1, holds (1.5 times)",
        "a: fell: better, was 0.4 of 1, holds, is 0.1 of 1, holds (4 times)",
        "1 worse, 1 better",
    ]


def test_diff_of_a_result_with_itself_is_nothing(tmp_path: Path) -> None:
    path = result_file(tmp_path / "result.json", *judge_all(PORTS, LESSON).verdicts)
    answer = diff(path, path)
    assert answer.returncode == 0 and answer.stdout == "nothing changed\n"


def test_diff_refuses_what_is_no_result(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("[1]")
    for name in ("a.json", "none.json"):
        answer = diff(tmp_path / name, tmp_path / name)
        assert answer.returncode == 2 and len(answer.stderr.splitlines()) == 1
