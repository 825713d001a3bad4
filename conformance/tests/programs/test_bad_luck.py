# SPDX-License-Identifier: MIT
"""A program that cannot finish says so in one line, ends with a non-zero status, and leaves no CSV that looks whole."""

import os
import re
import shutil
import subprocess
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import pytest

from conformance.judging.report import report_problems
from conformance.judging.trajectory import load
from conformance.programs.ports import ROOT, SIX, Port, read_ports
from conformance.programs.run import choose_engine, headless
from conformance.programs.sources import source
from conformance.tests.under_test import PORTS, record
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.trials.edits import constant_edit, edited, in_experiment
from conformance.trials.variant import Job, copy_what_runs, in_tree, job, run_all, runnable

BUILD = ROOT / "build" / "bad-luck"  # kept as the variants are
SHORT = with_values(LESSON, {"horizon": Fraction("0.1")})
TYPED_PATH = f"{ROOT / '.venv' / 'bin'}:{os.environ['PATH']}"  # where an environment is active
FIRST_RUN = "first-run.csv"
BLOW_UPS = {"x1_start": "1" + 200 * "0" + ".0", "x2_start": "1" + 300 * "0" + ".0"}
ENGINE_REMARK = "error: ignoring const execution_exception& while preparing to exit\n"  # GNU Octave 7.3, at every end


def short_job(port: Port) -> Job:
    """The program over 0.1 s instead of 20 s."""
    return job(BUILD / "short", port, in_experiment(port, SHORT))


def blow_up_job(port: Port, constant: str) -> Job:
    """The short program from a start whose square is beyond the doubles."""
    text = in_experiment(port, SHORT)
    edit = constant_edit(port, text, constant, BLOW_UPS[constant])
    return job(BUILD / constant, port, edited(text, [edit]))


@pytest.fixture(scope="module")
def have_run() -> None:
    ports = runnable(PORTS.values())
    jobs = []
    for port in ports:
        with suppress(ValueError):  # of a program that is not finished: its own tests tell
            jobs += [short_job(port), *(blow_up_job(port, constant) for constant in BLOW_UPS)]
    run_all(jobs, copy_what_runs)


@pytest.fixture
def short_program(have_run: None, port: Port, tmp_path: Path) -> Port:
    """The short program in a copy of its tree, compiled, and not run."""
    record(port)
    root = Path(shutil.copytree(short_job(port).tree, tmp_path / "a copy", symlinks=True))
    program = read_ports(root)[port.name]
    assert program.csv.is_file(), program.build
    (program.build / FIRST_RUN).write_bytes(program.csv.read_bytes())
    for path in program.build.glob(f"{program.csv.name}*"):
        path.unlink()
    return program


def start(port: Port) -> subprocess.CompletedProcess[str]:
    """Run a copied program bare, in its build folder."""
    command = port.in_place(choose_engine(port).command)
    return subprocess.run(command, cwd=port.build, capture_output=True, text=True, timeout=120)


def assert_refused(port: Port, status: int, stderr: str, reason: str) -> None:
    assert status != 0, f"{port.name} ended with status 0"
    message = stderr.replace(ENGINE_REMARK, "")
    assert reason in message and len(message.strip().splitlines()) == 1, f"{port.name} said: {message}"
    assert not port.csv.is_file()


def test_csv_name_that_is_a_folder(short_program: Port) -> None:
    (short_program.csv / "in the way").mkdir(parents=True)
    answer = start(short_program)
    assert_refused(short_program, answer.returncode, answer.stderr, "Chapter17_Lesson1")


def test_full_disk(short_program: Port) -> None:
    Path(f"{short_program.csv}.part").symlink_to("/dev/full")
    answer = start(short_program)
    assert_refused(short_program, answer.returncode, answer.stderr, "")


@pytest.mark.parametrize("constant", BLOW_UPS)
def test_integration_that_blows_up(have_run: None, port: Port, constant: str) -> None:
    record(port)
    ran = in_tree(port, blow_up_job(port, constant).tree)
    run = ran.run()
    assert run is not None, f"{port.name} did not run"
    assert_refused(ran, run["exit_status"], (ran.build / "stderr.txt").read_text(), "integration failed")


def as_its_head_says(port: Port) -> list[str]:
    """What the program's head says to type, in its folder, to build and run it with an engine that is here."""
    head = source(port).partition(port.section.format("Parameters"))[0]
    lines = re.findall(r"^\W*(build|run|or):? +(.+)$", head, flags=re.MULTILINE)
    run = next(line for kind, line in lines if kind != "build" and is_here(line.split()[0]))
    return [*(line for kind, line in lines if kind == "build"), run]


def is_here(program: str) -> bool:
    """Whether a program can be typed: one that is built in the folder will be."""
    return program.startswith("./") or shutil.which(program, path=TYPED_PATH) is not None


def test_program_runs_bare_as_its_head_says_and_replaces_an_old_csv(short_program: Port) -> None:
    csv = short_program.folder / short_program.csv.name
    csv.write_text("of an earlier run\n")
    answer = subprocess.run(
        " && ".join(as_its_head_says(short_program)),
        shell=True, cwd=short_program.folder, env=headless() | {"PATH": TYPED_PATH}, capture_output=True, text=True,
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    assert not list(short_program.folder.glob("*.part"))
    assert csv.read_bytes() == (short_program.build / FIRST_RUN).read_bytes()  # another run gives the same
    trajectory = load(csv, SHORT)  # in the transient, where every row differs from the one before it
    assert report_problems(answer.stdout.splitlines(), trajectory, LESSON, csv.name) == []


@pytest.mark.parametrize("name", [name for name in PORTS if name in SIX])
def test_readme_says_how_to_run_each_program_bare(name: str) -> None:
    port = PORTS[name]
    lines = [
        line
        for line in (ROOT / "README.md").read_text().splitlines()
        if line.startswith(f"    (cd {port.folder.name} && ")
    ]
    assert any(all(command in line for command in as_its_head_says(port)) for line in lines), lines


@pytest.mark.parametrize("name", [name for name in ("matlab", "simulink") if name in PORTS])
def test_matlab_programs_return_their_variables_when_asked(have_run: None, name: str, tmp_path: Path) -> None:
    tree = Path(shutil.copytree(short_job(PORTS[name]).tree, tmp_path / "tree", symlinks=True))
    stem = PORTS[name].source.removesuffix(".m")
    code = f"r = {stem}; disp(strjoin(fieldnames(r)', ' ')); disp(numel(r.x1) == numel(r.t)); {stem}"
    answer = subprocess.run(
        ["octave-cli", "--norc", "--path", "octave", "--eval", code],
        cwd=tree / "matlab", env=headless(), capture_output=True, text=True,
    )  # fmt: skip
    lines = answer.stdout.splitlines()
    assert lines[4:6] == ["t x1 x2 thetaHat referenceSignal trackingError", "1"], answer.stderr
    assert lines[:4] == lines[6:], "called by its name alone, it prints four lines and no struct"


@pytest.mark.skipif("mathematica" not in PORTS, reason="PORTS leaves mathematica out")
def test_notebook_leaves_the_controllers_signals_as_functions_of_t(have_run: None, tmp_path: Path) -> None:
    tree = Path(shutil.copytree(short_job(PORTS["mathematica"]).tree, tmp_path / "tree", symlinks=True))
    script = tree / "mathematica" / "then.wls"
    script.write_text('Get["run_woxi.wls"];\nPrint[CForm[{z2[0.], tau2[0.], control[0.]}]];\n')
    answer = subprocess.run(
        [ROOT / ".venv/bin/python", "-m", "woxi", "run", script.name],
        cwd=script.parent, env=headless(), capture_output=True, text=True,
    )  # fmt: skip
    x1, x2 = 1.2, -0.5  # by hand from (10): theta_hat, r, r'' are 0, r' is 0.35
    z2 = x2 + 2 * x1 - 0.35
    tau2 = x1 * x1 + 2 * x1 * z2
    u = -2 * x2 + 2 * 0.35 - x1 - 2.5 * z2 - x1 * 3 * tau2
    found = [float(number) for number in re.findall(r"-?\d+\.\d*", answer.stdout.splitlines()[-1])]
    assert found == pytest.approx([z2, tau2, u], rel=1e-12)
