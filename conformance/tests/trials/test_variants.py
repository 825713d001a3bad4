# SPDX-License-Identifier: MIT
"""Edited into another experiment, every program conforms to it; into a mistake, it is refused by the check named."""

import functools
import signal
import subprocess
import sys
import time
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from conformance.atomic import write_atomically
from conformance.judging.trajectory import Trajectory, load
from conformance.judging.verdict import Verdict
from conformance.pages.exercises import MATRIX, PAGE, page
from conformance.programs.ports import ROOT, SIX, Port, the_six
from conformance.tests.under_test import PORTS, record, trajectory_of
from conformance.theory.experiments import Experiment, with_values
from conformance.theory.lesson import LESSON
from conformance.trials import kill_matrix
from conformance.trials.campaign import carry_out, prove
from conformance.trials.coverage import own_trials
from conformance.trials.edits import Edit
from conformance.trials.kill_matrix import END, OUTPUT, Outcome, refusals
from conformance.trials.variant import (
    UNWRITTEN,
    Variant,
    copy_what_runs,
    in_tree,
    job,
    read_variant,
    read_variants,
    run_all,
    runnable,
    source,
    write_tree,
)
from conformance.truth.exact import exact

VARIANTS = read_variants()
outcome = functools.cache(kill_matrix.outcome)
PAIRS = [(variant, port) for variant in VARIANTS.values() for port in PORTS.values() if variant.has(port)]


pytestmark = pytest.mark.usefixtures("variants_have_run")


def cases(mistakes: bool) -> pytest.MarkDecorator:
    some = [(variant, port) for variant, port in PAIRS if bool(variant.refused_by) == mistakes]
    return pytest.mark.parametrize(("variant", "port_"), some, ids=[f"{v.name}-{p.name}" for v, p in some])


@cases(mistakes=False)
def test_experiment_conforms(variant: Variant, port_: Port) -> None:
    record(port_)
    found = outcome(variant, port_)
    assert found.verdict.conforms, found.verdict.reason


@cases(mistakes=True)
def test_mistake_is_refused_by_its_check(variant: Variant, port_: Port) -> None:
    record(port_)
    found = outcome(variant, port_)
    assert variant.refused_by in found.refusals, f"{found.verdict.status}: {found.verdict.reason}"


def test_program_conforms_on_experiments_of_its_own(port: Port) -> None:
    """Those that follow from its source: it cannot be right on the ones of a list alone."""
    record(port)
    outcomes = [carry_out(one, prove(one.experiment)) for one in own_trials(port, 2)]
    assert [outcome.reason for outcome in outcomes] == ["", ""]


def test_every_program_has_every_experiment_and_mistake_or_a_reason(port: Port) -> None:
    for variant in VARIANTS.values():
        assert dict(variant.without).get(port.name) != UNWRITTEN, f"{variant.name}: {UNWRITTEN}"
        assert not variant.has(port) or source(variant, port) != port.source_path.read_text()


def test_every_common_error_of_the_lesson_is_among_the_mistakes() -> None:
    assert sum(variant.section == "(16)" and bool(variant.refused_by) for variant in VARIANTS.values()) >= 4


# ---- What single variants are for ----


def variant_run(name: str, port: Port) -> Trajectory:
    record(port)
    variant = VARIANTS[name]
    return load(in_tree(port, variant.tree).csv, variant.experiment)


def largest_error(trajectory: Trajectory, experiment: Experiment = LESSON) -> float:
    """Against the exact solution, over the 4 s of the variants."""
    early = trajectory.t <= 4.001
    wanted = exact(experiment).evaluate(trajectory.t[early])
    return float(np.abs(trajectory.states[:, early] - wanted).max())


def test_without_excitation_the_estimate_stops_away_from_theta(port: Port) -> None:
    last = variant_run("problem-4", port).states[:, -1]
    assert abs(last[2] - 2.77724) < 5e-6 and np.abs(last[:2]).max() < 1e-4


with_a_step = pytest.mark.parametrize("name", [n for n in PORTS if VARIANTS["half-step"].has(PORTS[n])])
with_a_tolerance = pytest.mark.parametrize("name", [n for n in PORTS if VARIANTS["tight-tolerance"].has(PORTS[n])])


def orders(errors: list[float]) -> list[float]:
    """The observed order of convergence between steps that are halved."""
    return [float(np.log2(a / b)) for a, b in pairwise(errors)]


@with_a_step
def test_error_is_of_order_4_in_the_step(name: str) -> None:
    runs = [trajectory_of(PORTS[name]), *(variant_run(each, PORTS[name]) for each in ("half-step", "quarter-step"))]
    assert orders([largest_error(run) for run in runs]) == pytest.approx([4, 4], abs=0.2)


def test_orders_tell_euler_from_runge_kutta() -> None:
    assert orders([4e-3, 2e-3, 1e-3]) == [1, 1]


@with_a_tolerance
def test_a_tighter_tolerance_gives_a_smaller_error(name: str) -> None:
    assert largest_error(variant_run("tight-tolerance", PORTS[name])) < largest_error(trajectory_of(PORTS[name])) / 5


# ---- The machinery ----

MISTAKE = VARIANTS["sign-in-tau2"]
FIRST = next(iter(runnable(PORTS.values())))


def test_a_mistake_that_no_check_refuses_is_told() -> None:
    survivor = Outcome("m", "cpp", "x1-equals-the-exact-solution", Verdict("cpp", "pass"))
    missed = Outcome("m", "java", "x1-equals-the-exact-solution", Verdict("java", "missing"))
    failed = Outcome("e", "cpp", "", Verdict("cpp", "fail", "off"))
    assert not (survivor.as_wanted or missed.as_wanted or failed.as_wanted)
    text = kill_matrix.table([survivor, missed, failed])
    assert "SURVIVES" in text and "0 of 2 mistakes refused; 0 of 1 experiments conform" in text


def test_refusals_that_are_no_figure_have_names() -> None:
    assert refusals(Verdict("cpp", "error")) == (END,)
    assert refusals(Verdict("cpp", "fail", "standard output, file name: found a")) == (kill_matrix.CSV, OUTPUT)
    assert refusals(Verdict("cpp", "missing")) == ()


def test_an_edit_whose_text_is_gone_is_told_with_its_variant_and_port() -> None:
    rotten = replace(MISTAKE, edits=(("every", Edit("x3_dot = u", "x3_dot = 0")),))
    with pytest.raises(ValueError, match=rf"^sign-in-tau2, {FIRST.name}: found '.*' 0 times, expected once$"):
        source(rotten, FIRST)


def test_a_mistake_must_be_edited_or_explained_in_every_port() -> None:
    with pytest.raises(ValueError, match="neither an edit nor a reason"):
        source(replace(MISTAKE, edits=()), FIRST)


def test_only_what_changed_is_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    kept = job(MISTAKE.tree, FIRST, source(MISTAKE, FIRST))
    before = (kept.folder / "run.json").read_text()
    run_all([kept])
    assert (kept.folder / "run.json").read_text() == before
    changed = replace(MISTAKE, experiment=with_values(MISTAKE.experiment, {"horizon": Fraction("2.5")}))
    assert kept.fresh and not job(MISTAKE.tree, FIRST, source(changed, FIRST)).fresh
    monkeypatch.setattr("conformance.trials.variant._runs_on", lambda port: "another engine")
    assert not job(MISTAKE.tree, FIRST, source(MISTAKE, FIRST)).fresh


@pytest.mark.beyond
def test_an_interrupted_run_keeps_what_has_run_and_ends_what_runs(tmp_path: Path) -> None:
    script = f"""
from pathlib import Path
from conformance.programs.ports import read_ports
from conformance.programs.sources import source as original
from conformance.trials.variant import job, run_all
port = read_ports()[{FIRST.name!r}]
run_all((job(Path({str(tmp_path)!r}) / name, port, original(port)) for name in ("one", "two", "three")), workers=1)
"""
    running = subprocess.Popen(
        [sys.executable, "-c", script], cwd=ROOT, stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    kept = tmp_path / "one" / "build" / FIRST.name / "key"
    for _ in range(1200):
        if kept.exists() and (tmp_path / "two" / "build" / FIRST.name).exists():
            break
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    assert kept.exists() and running.wait(timeout=20) != 0
    assert [path.parts[-4] for path in tmp_path.glob("*/build/*/key")] == ["one"]
    before = sorted(tmp_path.rglob("*"))
    time.sleep(0.5)
    assert sorted(tmp_path.rglob("*")) == before  # nothing goes on in the background


def test_a_tree_keeps_the_edited_programs_that_have_run(tmp_path: Path) -> None:
    first, second = (job(tmp_path, port, source(MISTAKE, port)) for port in runnable(the_six().values())[:2])
    for one in (first, second):  # one after another, as with --ports
        write_tree(tmp_path, [one], copy_what_runs)
    assert [in_tree(one.port, tmp_path).source_path.read_text() for one in (first, second)] == [first.text, second.text]


BAD = {
    "no TOML": ("title =", "Invalid value"),
    "no title": ("section = '(7)'\nshows = 'x'", "missing title"),
    "an unknown key": ("title = 't'\nsection = 's'\nshows = 'x'\nrefused = 'y'", "unknown refused"),
    "an unknown constant": ("title = 't'\nsection = 's'\nshows = 'x'\nexperiment.k3 = 1", "found 'k3'"),
    "half an edit": ("title = 't'\nsection = 's'\nshows = 'x'\nedits = [{old = 'a'}]", "expected old and new"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_variant_that_makes_no_sense_is_refused_in_one_line(case: str, tmp_path: Path) -> None:
    text, reason = BAD[case]
    path = tmp_path / "bad.toml"
    path.write_text(text + "\n")
    with pytest.raises(ValueError, match=rf"^bad\.toml: .*{reason}"):
        read_variant(path)


BAD_OWN = {
    "no TOML": ("cpp =", "Invalid value"),
    "another port": ("[java.euler-step]\nwithout = 'x'", "found the port java, expected cpp"),
    "an unknown variant": ("[cpp.euler]\nwithout = 'x'", "found the variant cpp.euler, expected one of euler-step"),
    "half an edit": ("[[cpp.euler-step.edits]]\nold = 'a'", "cpp.euler-step: found an edit of old, expected old"),
    "edits and none": (
        "[cpp.euler-step]\nwithout = 'x'\nedits = [{old = 'a', new = 'b'}]", "expected either edits or without"
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_OWN)
def test_what_a_port_has_of_its_own_is_refused_where_it_makes_no_sense(case: str, tmp_path: Path) -> None:
    text, reason = BAD_OWN[case]
    (tmp_path / "cpp").mkdir()
    (tmp_path / "cpp/port.toml").write_text((ROOT / "cpp/port.toml").read_text())
    (tmp_path / "cpp/variants.toml").write_text(text + "\n")
    with pytest.raises(ValueError, match=rf"^cpp/variants\.toml: .*{reason}"):
        read_variants(root=tmp_path)


@pytest.mark.beyond
@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["variants", "nothing"], "found nothing, expected of euler-step"),
        (["variants", "--ports", "fortran"], "PORTS: fortran; the ports are"),
        (["mutants", "--ports", "fortran"], "PORTS: fortran; the ports are"),
    ],
)
def test_a_name_that_is_none_is_answered_in_one_line(words: list[str], reason: str) -> None:
    answer = subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 2 and answer.stdout == ""
    assert reason in answer.stderr and len(answer.stderr.splitlines()) == 1


@pytest.mark.beyond
def test_variants_are_run_by_name_and_told_in_a_table() -> None:
    words = ["variants", MISTAKE.name, "--ports", FIRST.name]
    answer = subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0 and answer.stdout.endswith("1 of 1 mistakes refused; 0 of 0 experiments conform\n")


def test_every_named_check_is_one() -> None:
    named = {variant.refused_by for variant in VARIANTS.values()} - {"", OUTPUT}
    assert named <= {result.claim for result in outcome(MISTAKE, FIRST).verdict.results}


def test_the_page_of_exercises_is_current() -> None:
    runs = {name: port.run() for name, port in the_six().items()}
    found = [outcome(variant, port) for variant, port in PAIRS if port.run()]
    write_atomically(ROOT / "build" / "kill-matrix.json", kill_matrix.to_json(found))
    wanted, written = (
        page(VARIANTS.values(), list(the_six().values()), [o for o in found if o.port in SIX]),
        PAGE.read_text(encoding="utf-8"),
    )
    if not runs.keys() <= PORTS.keys() or any(run is None or run["proprietary"] for run in runs.values()):
        wanted, written = (text.partition(MATRIX)[0] for text in (wanted, written))  # the matrix is of the open engines
    assert written == wanted, "type: .venv/bin/conformance exercises"
