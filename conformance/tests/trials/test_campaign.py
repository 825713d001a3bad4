# SPDX-License-Identifier: MIT
"""A campaign judges every program on random scenarios, survives the death of a worker, and does nothing twice."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from conformance.judging.verdict import judge_file
from conformance.programs.ports import ROOT, Port, read_ports
from conformance.tests.under_test import PORTS, write_awk
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import values_of, with_values
from conformance.theory.expressions import text as text_of
from conformance.theory.lesson import LESSON
from conformance.trials import campaign
from conformance.trials.campaign import (
    RANGES,
    WAVES,
    Trial,
    carry_out,
    draw,
    kept_outcomes,
    known,
    prepare,
    report,
    trial,
)
from conformance.trials.edits import Edit, edited

pytestmark = pytest.mark.beyond

SEED = 2694  # whose first scenarios have short horizons


# ---- Drawing ----


def test_a_scenario_depends_on_seed_and_number_alone() -> None:
    assert draw(1, 5) == draw(1, 5) and len({draw(seed, n) for seed in range(3) for n in range(50)}) == 150


def test_draws_fill_the_ranges_and_stay_inside() -> None:
    drawn = [draw(0, n) for n in range(2000)]
    for name, (low, high, grain) in RANGES.items():
        values = [values_of(experiment)[name] for experiment in drawn]
        width = Fraction(high) - Fraction(low)
        assert Fraction(low) <= min(values) <= Fraction(low) + width / 20, name
        assert Fraction(high) >= max(values) >= Fraction(high) - width / 20, name
        assert all((value / Fraction(grain)).denominator == 1 for value in values), name
    assert {wave for e in drawn for wave in WAVES if wave in text_of(e.reference)} == set(WAVES)


def test_the_lesson_itself_could_be_drawn() -> None:
    for name, (low, high, grain) in RANGES.items():
        value = values_of(LESSON).get(name, Fraction(0))
        assert Fraction(low) <= value <= Fraction(high) and (value / Fraction(grain)).denominator == 1, name


# ---- The command ----


def arguments(count: int, ports: Iterable[str], *more: str) -> list[str]:
    words = ["campaign", "--count", str(count), "--seed", str(SEED), "--ports", *ports, *more]
    return [sys.executable, "-m", "conformance", *words]


def test_campaign_takes_scenarios_of_its_own_for_each_program() -> None:
    words = ["campaign", "--own", "--count", "2", "--ports", next(iter(PORTS))]
    answer = subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert answer.stdout.splitlines()[-1] == "2 of 2 runs on 2 scenarios conform"


# ---- On a cluster that loses a worker ----


def results(folder: Path) -> dict[Path, int]:
    """Every result there is, and when it was written (ns)."""
    return {path: path.stat().st_mtime_ns for path in folder.glob("*/*.json")}


def wait_for(event: Callable[[], object], patience: float = 300) -> None:
    started = time.monotonic()
    while not event():
        assert time.monotonic() - started < patience, "nothing came"
        time.sleep(0.02)


@contextlib.contextmanager
def process(root: Path, *words: str) -> Iterator[subprocess.Popen[str]]:
    """A process at the top of a tree, that has ended when the block has."""
    with subprocess.Popen(words, cwd=root, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as started:
        try:
            yield started
        finally:
            started.kill()


@contextlib.contextmanager
def cluster(root: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A scheduler and two workers at the top of a tree: the address, and the first worker."""
    place = root / "build" / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    worker = [*dask, "worker", "--scheduler-file", str(place), "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    scheduler = [*dask, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(place)]
    with process(root, *scheduler), process(root, *worker) as first, process(root, *worker):
        wait_for(place.exists)
        yield json.loads(place.read_text())["address"], first


def test_every_result_is_there_once_though_a_worker_dies(copy_of_the_tree: Callable[..., Path]) -> None:
    root, wanted = copy_of_the_tree(write_awk), 10
    folder, words = root / "build/campaign", arguments(wanted, ["awk"])
    with (
        cluster(root) as (address, victim),
        process(root, *words, "--scheduler", address) as asked,
    ):
        wait_for(lambda: results(folder) or asked.poll() is not None)
        victim.kill()
        early = results(folder)
        answer, _ = asked.communicate(timeout=600)
    found = results(folder)
    assert 0 < len(early) < wanted, "the worker did not die half-way"
    assert answer.splitlines()[-1] == f"{wanted} of {wanted} runs on {wanted} scenarios conform"
    assert len(found) == wanted and {path: found[path] for path in early} == early, "a result was made a second time"

    again = subprocess.run(words, cwd=root, capture_output=True, text=True)
    assert again.returncode == 0 and again.stdout == answer, again.stderr
    assert results(folder) == found, "what is done was done again"


def test_an_interrupted_campaign_keeps_what_is_done(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    folder, words = root / "build/campaign", arguments(16, ["awk"], "--jobs", "1")
    with subprocess.Popen(
        words, cwd=root, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),  # ignored in the background
    ) as asked:  # fmt: skip
        wait_for(lambda: results(folder) or asked.poll() is not None)
        early = results(folder)
        os.killpg(asked.pid, signal.SIGINT)
        _, said = asked.communicate(timeout=300)
    assert (asked.returncode, said) == (130, "conformance: campaign: interrupted; what is done is kept\n")
    kept = results(folder)
    assert early and {path: kept[path] for path in early} == early


# ---- One trial ----


@pytest.fixture
def one(copy_of_the_tree: Callable[..., Path], tmp_path: Path) -> Trial:
    """A quick program on a short scenario."""
    return trial_of(read_ports(copy_of_the_tree(write_awk))["awk"], tmp_path)


def trial_of(port: Port, folder: Path) -> Trial:
    return trial(with_values(draw(SEED, 0), {"horizon": Fraction(1)}), prepare(port), folder)


def spoilt(one: Trial, old: str, new: str) -> Trial:
    return replace(one, text=edited(one.text, [Edit(old, new)]), key="spoilt")


def test_a_wrong_program_fails_and_what_is_printed_reproduces_it(one: Trial, tmp_path: Path) -> None:
    outcome = carry_out(spoilt(one, " - phi * theta_hat_dot  #", "  #"), "")
    assert outcome.status == "fail" and "(16)" in outcome.reason
    text = report([outcome], tmp_path)
    printed = tmp_path / "printed.toml"
    printed.write_text(text[text.index("title =") : text.index("# python")])
    assert read_experiment(printed) == one.experiment
    command = next(line for line in text.splitlines() if line.startswith("# python -m conformance validate"))
    path, toml = (Path(word) for word in command.split()[5::2])
    assert judge_file(path, read_experiment(toml)).reason == outcome.reason


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("    main()\n", "    main(\n", "awk ended with status 2"),
        ("    main()\n", '    print "integration failed" > "/dev/stderr"; exit 1\n', "integration failed"),
        ('csv_name = "Chapter', 'csv_name = "chapter', "no such file"),
    ],
)
def test_a_program_without_a_csv_does_not_pass(one: Trial, old: str, new: str, reason: str) -> None:
    outcome = carry_out(spoilt(one, old, new), "")
    assert outcome.status != "pass" and reason in outcome.reason


def test_a_program_that_does_not_compile_does_not_pass(tmp_path: Path) -> None:
    outcome = carry_out(
        spoilt(trial_of(read_ports()["cpp"], tmp_path), "double theta_true = ", "int theta_true = "), ""
    )
    assert outcome.status == "error" and "g++ ended with status 1" in outcome.reason


def test_a_program_that_does_not_end_is_stopped(one: Trial, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign, "PATIENCE", 0.1)
    endless = spoilt(one, "    main()\n", "    while (1) main()\n")
    assert "did not end within 0.1 s" in carry_out(endless, "").reason


def test_a_result_that_is_damaged_or_of_something_else_is_not_taken(one: Trial) -> None:
    assert carry_out(one, "").status == "pass" and known(one) is not None
    port, folder = one.program.port, one.folder.parent
    assert [(k.seed, k.number, k.holds) for k in kept_outcomes([port], folder)] == [(SEED, 0, False)], "no run to go by"
    run = {"engine": port.engines[0].name, "engine_version": one.program.engine_version, "command": []}
    run |= {"proprietary": False, "seconds": 0, "exit_status": 0, "source_sha256": "", "csv_sha256": ""}
    (port.build / "run.json").write_text(json.dumps(run))
    assert [k.holds for k in kept_outcomes([port], folder)] == [True]
    port.source_path.write_text(port.source_path.read_text() + "\n")
    assert [k.holds for k in kept_outcomes([port], folder)] == [False]
    assert known(replace(one, key="of another source")) is None
    one.path.write_text(one.path.read_text()[:-20])
    assert known(one) is None and kept_outcomes([port], folder) == []


def test_an_error_is_tried_again(one: Trial) -> None:
    assert carry_out(one, "no enclosure").status == "error" and known(one) is None
    assert carry_out(one, "").status == "pass"


# ---- Bad input ----


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--count", "0"], "expected a positive whole number"),
        (["--seed", "x"], "expected a whole number"),
        (["--ports", "fortran"], "the ports are"),
        (["--scheduler", "nowhere"], "missing port number"),
    ],
)
def test_bad_input_is_answered_in_one_line(words: list[str], reason: str, tmp_path: Path) -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "conformance", "campaign", "--folder", tmp_path, *words],
        cwd=ROOT, capture_output=True, text=True, env={**os.environ, "PORTS": "cpp"},
    )  # fmt: skip
    assert answer.returncode == 2 and answer.stdout == ""
    assert reason in answer.stderr and len(answer.stderr.splitlines()) == 1, answer.stderr
