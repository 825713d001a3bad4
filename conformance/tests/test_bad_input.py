# SPDX-License-Identifier: MIT
"""Whatever comes in, the command line answers in one line and status 2, loses nothing, and nothing forges a line."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from conformance import __main__, atomic
from conformance.judging.difference import read_result
from conformance.judging.verdict import judge_all, judge_port
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.programs.table import table
from conformance.tests.judging.test_corruptions import RIGHT_TEXT
from conformance.tests.under_test import PORTS
from conformance.theory.experiment_file import to_toml
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON

Said = Callable[..., tuple[int, str, str]]


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Said:
    """A function that runs a command here; returns status, output and errors."""

    def run(*words: str | Path) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["conformance", *map(str, words)])
        try:
            status = __main__.main()
        except SystemExit as end:
            status = int(end.code or 0)
        return (status, *capsys.readouterr())

    return run


@pytest.fixture
def right_csv(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    path.write_text(RIGHT_TEXT)
    return path


def one_line(answer: tuple[int, str, str]) -> str:
    """The line of an answer that is refused as it must be."""
    status, output, errors = answer
    assert status == 2 and output == "" and errors.endswith("\n") and errors[:-1].isprintable(), answer
    assert "Traceback" not in errors and len(errors) < 1200
    return errors


# ---- What is read ----

VERDICT = {"name": "a", "status": "pass", "reason": "", "engine": "", "stand_in": False, "results": []}
RESULT = {
    "claim": "a", "section": "(1)", "figure": 1.0, "bound": 1.0, "where": "", "bound_from": "", "passed": True,
}  # fmt: skip
NO_RESULT = {
    "{}": "'headline' is a required property",
    '{"verdicts": [{"name": "x"}]}': "a required property",
    json.dumps({"headline": "", "pairs": [], "verdicts": [{**VERDICT, "status": 3}]}): "verdicts[0].status",
    json.dumps(
        {"headline": "", "pairs": [], "verdicts": [{**VERDICT, "results": [{**RESULT, "figure": "word"}]}]}
    ): "verdicts[0].results[0].figure",
    "[" * 100000: "brackets nested",
    "[1]": "is not of type 'object'",
    '{"headline": NaN}': "a number that is none",
    '{"headline": ' + "1" * 5000 + "}": "thousands of digits",
    "": "line 1, column 1: found nothing more, expected JSON",
    '{"headline"\n 3}': "line 2, column 2: found '3}', expected JSON",
    "\x1b[31mrun.csv conforms": r"found '\x1b[31mrun.csv conforms', expected JSON",
}


@pytest.mark.parametrize("content", NO_RESULT, ids=range(len(NO_RESULT)))
def test_result_that_is_none(content: str, said: Said, tmp_path: Path) -> None:
    (tmp_path / "r.json").write_text(content)
    assert NO_RESULT[content] in one_line(said("diff", tmp_path / "r.json", tmp_path / "r.json"))


def test_what_is_no_text_is_refused_by_its_place(said: Said, tmp_path: Path) -> None:
    (tmp_path / "r.json").write_bytes(b"{\n\xe9")
    assert "r.json, line 2: found the byte 0xe9, expected text in UTF-8" in one_line(
        said("diff", tmp_path / "r.json", tmp_path / "r.json")
    )


def test_pipes_are_not_waited_on(said: Said, right_csv: Path, tmp_path: Path) -> None:
    for name in ("p.toml", "p.json", "p.txt"):
        os.mkfifo(tmp_path / name)
    for words in (
        ("validate", right_csv, "--stdout", tmp_path / "p.txt"),
        ("diff", tmp_path / "p.json", tmp_path / "p.json"),
        ("report", "--since", tmp_path / "p.json", "--to", tmp_path / "page.html"),
    ):
        assert "a pipe or a device" in one_line(said(*words))
    for words in (("validate", right_csv), ("truth",)):  # whose answer is that of a compiler
        status, output, errors = said(*words, "--plant", tmp_path / "p.toml")
        assert (status, output) == (2, "") and "a pipe or a device" in errors and "Traceback" not in errors


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("truth", "--times", "1e999999999"), "expected an exponent from -400 to 400"),
        (("truth", "--times", "0," + "9" * 5000), "expected at most 400 characters"),
        (("truth", "--step", "1e-9"), "found a step that makes 20000000001 rows, expected at most 1000000"),
        (("truth", "--step", "1e-400"), "rows, expected at most 1000000"),
        (("truth", "--digits", "9" * 5000), "expected a whole number from 1 to 100"),
        (("campaign", "--count", "1" * 5000), "expected a positive whole number"),
        (("campaign", "--seed", "1" * 5000), "expected a whole number"),
        (("variants", "a\x1b[31m\nconforms"), r"a\x1b[31m\nconforms"),
        (("check", "--ports", "a\x1b[31m\nconforms"), r"a\x1b[31m\nconforms"),
        (("a\x1b[31m\nconforms",), "invalid choice"),
        (("validate", "a\0b.csv"), "no name of a file"),
        (("validate", "x" * 5000 + ".csv"), "cannot be read"),
    ],
)
def test_words_that_make_no_sense(words: tuple[str, ...], reason: str, said: Said) -> None:
    assert reason in one_line(said(*words))


def test_proof_that_ends_is_told(said: Said, right_csv: Path, tmp_path: Path) -> None:
    """From x1 = 1e8 m the estimate rises faster than a step of 2^-40 of the horizon can follow."""
    far = tmp_path / "far.toml"
    far.write_text(to_toml(with_values(LESSON, {"x1_start": Fraction(10**8)})))
    for words in (("validate", right_csv), ("truth",)):
        line = one_line(said(*words, "--plant", far))
        assert "the exact solution of this experiment is out of reach: the proof reached t = 0" in line


def test_what_was_not_foreseen_is_one_line_too(said: Said, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: object) -> int:
        raise TypeError("one\ntwo\x1b[31m" + 9999 * "x")

    monkeypatch.setitem(__main__.COMMANDS, "table", broken)
    assert "not foreseen, please report it: TypeError in test_bad_input.py" in one_line(said("table"))


# ---- Records of runs ----


@pytest.fixture
def copied(tmp_path: Path) -> dict[str, Port]:
    """Two ports' results, in a tree of their own."""
    for name in ("python", "cpp"):
        shutil.copytree(ROOT / "build" / name, tmp_path / "build" / name, ignore=shutil.ignore_patterns("bin"))
        shutil.copytree(ROOT / name, tmp_path / name)
    return read_ports(tmp_path)


ALL_THERE = {"python", "cpp"} <= set(PORTS) and all(
    (ROOT / "build" / p / "run.json").exists() for p in ("python", "cpp")
)
NO_RECORD = {
    "": "line 1, column 1: found nothing more, expected JSON",
    "[1]": "found a list, expected the record of a run",
    "{}": "found no 'engine'",
    "other engine": "engine: found 'Other', expected of port.toml GCC",
    "exit_status": "exit_status: found 'x', expected what a run records there",
}


@pytest.mark.skipif(not ALL_THERE, reason="python and cpp did not run")
@pytest.mark.parametrize("content", NO_RECORD)
def test_record_that_is_none_hides_no_other_port(content: str, copied: dict[str, Port]) -> None:
    path = copied["cpp"].build / "run.json"
    edits = {"other engine": {"engine": "Other"}, "exit_status": {"exit_status": "x"}}
    path.write_text(json.dumps({**json.loads(path.read_text()), **edits[content]}) if content in edits else content)
    verdicts = {name: judge_port(port, LESSON) for name, port in copied.items()}
    assert verdicts["python"].conforms and verdicts["cpp"].status == "error"
    assert NO_RECORD[content] in verdicts["cpp"].reason and "run.json" in verdicts["cpp"].reason
    assert NO_RECORD[content][:30] in table(copied.values())


@pytest.mark.skipif(not ALL_THERE, reason="python and cpp did not run")
def test_check_holds_what_the_tests_hold(copied: dict[str, Port], tmp_path: Path) -> None:
    """Rows, the contract's cap, ten times the error, the command of port.toml, and standard output that is there."""
    facts = tmp_path / "cpp/port.toml"
    right = facts.read_text()
    for old, new, reason in (
        ("x1 = 2e-9", "x1 = 1", "tolerance-keeps-the-contract (10) FAILS"),
        ("x1 = 2e-9", "x1 = 1e-6", "tolerance-is-tight (10) FAILS"),
        ("rows = 10001", "rows = 10002", "rows-are-those-of-the-contract (10) FAILS"),
        ('command = ["', 'command = ["nice", "', "run.json tells of another command than port.toml"),
    ):
        assert old in right
        facts.write_text(right.replace(old, new))
        (verdict,) = (v for v in judge_all({"cpp": read_ports(tmp_path)["cpp"]}, LESSON).verdicts if v.name == "cpp")
        assert not verdict.conforms and reason in verdict.reason, (new, verdict.reason)
    facts.write_text(right)
    copied["cpp"].stdout.unlink()
    assert "stdout.txt: no such file" in judge_port(copied["cpp"], LESSON).reason


@pytest.mark.skipif(not ALL_THERE, reason="python and cpp did not run")
@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("rows = 10001", 'rows = "x"', "rows: found 'x', expected a whole number"),
        ("[[cpp.engine]]", "[cpp.engine]", "engine: found a table, expected [[cpp.engine]]"),
        ("x1 = 2e-9", "x1 = nan", "found 'nan', expected a finite decimal"),
        ("x1 = 2e-9", "x1 = -1", "expected positive numbers"),
        ("", "cpp = 3", "[cpp]: found 3, expected a table"),
        ("[cpp]", "[cpp", "line 2, column 5: found"),
    ],
)
def test_facts_of_a_port_are_checked(old: str, new: str, reason: str, copied: dict[str, Port], tmp_path: Path) -> None:
    facts = tmp_path / "cpp/port.toml"
    facts.write_text(facts.read_text().replace(old, new) if old else new)
    with pytest.raises(ValueError, match=r"port\.toml") as refused:
        read_ports(tmp_path)
    assert reason in str(refused.value) and str(refused.value).isprintable()


# ---- What is written ----


def test_output_is_never_an_input(said: Said, right_csv: Path, tmp_path: Path) -> None:
    (tmp_path / "link.json").symlink_to(right_csv)
    os.link(right_csv, tmp_path / "hard.json")
    for name in ("run.csv", "link.json", "hard.json"):
        assert "to be read and to be written" in one_line(said("validate", right_csv, "--json", tmp_path / name))
    assert right_csv.read_text() == RIGHT_TEXT


def test_link_and_stream_are_written_through(said: Said, right_csv: Path, tmp_path: Path) -> None:
    (tmp_path / "real.json").write_text("{}")
    (tmp_path / "link.json").symlink_to("real.json")
    assert said("validate", right_csv, "--json", tmp_path / "link.json")[0] == 0
    assert (tmp_path / "link.json").is_symlink() and read_result(tmp_path / "real.json").keys() == {"run.csv"}
    os.mkfifo(tmp_path / "pipe")
    heard: list[str] = []
    listener = threading.Thread(target=lambda: heard.append((tmp_path / "pipe").read_text()))
    listener.start()
    assert said("validate", right_csv, "--json", tmp_path / "pipe")[0] == 0
    listener.join()
    assert json.loads(heard[0])["verdicts"] and (tmp_path / "pipe").is_fifo()
    assert said("validate", right_csv, "--json", "/dev/null")[0] == 0 and Path("/dev/null").is_char_device()


def test_dash_is_standard_output(said: Said, right_csv: Path) -> None:
    status, output, _ = said("validate", right_csv, "--json", "-")
    assert status == 0 and json.loads(output)["verdicts"][0]["status"] == "pass"


def test_old_result_does_not_outlive_a_run_that_could_not_judge(said: Said, tmp_path: Path) -> None:
    (tmp_path / "old.json").write_text("{}")
    one_line(said("validate", tmp_path / "none.csv", "--json", tmp_path / "old.json"))
    assert not (tmp_path / "old.json").exists()


def test_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(atomic.os, "replace", refuse)
    with pytest.raises(OSError, match="disk is full"):
        atomic.write_atomically(tmp_path / "a.json", "{}")
    assert list(tmp_path.iterdir()) == []


# ---- Streams and terminals ----


def command(*words: str | bytes | Path, **options: object) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, stderr=subprocess.PIPE, **options)


def test_reader_that_leaves_ends_us_in_silence() -> None:
    read, write = os.pipe()
    os.close(read)
    answer = command("checks", stdout=write)
    os.close(write)
    assert answer.returncode == -signal.SIGPIPE and answer.stderr == b""


def test_output_that_cannot_be_written_is_one_line() -> None:
    with open("/dev/full", "wb") as full:
        answer = command("checks", stdout=full)
    assert answer.returncode == 2 and answer.stderr.count(b"\n") == 1 and b"No space left" in answer.stderr


def test_encoding_of_the_terminal_changes_no_verdict(tmp_path: Path) -> None:
    path = os.path.join(os.fsencode(tmp_path), b"\xe9\xff \xe2\x98\x83\n\x1b.csv")
    with open(path, "w") as file:
        file.write(RIGHT_TEXT)
    answer = command("validate", path, stdout=subprocess.PIPE, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert answer.returncode == 0 and answer.stderr == b"" and answer.stdout.isascii()
    assert answer.stdout.splitlines()[-1].endswith(b".csv conforms") and b"\x1b" not in answer.stdout
