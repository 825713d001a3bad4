# SPDX-License-Identifier: MIT
"""The Makefile builds what is asked for, again only what changed, and says what is missing."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from conformance.programs.ports import read_ports
from conformance.programs.run import as_a_user, choose_engine
from conformance.tests.under_test import AWK, make, write_awk
from conformance.trials.variant import copy_tree

pytestmark = pytest.mark.beyond

CopyOfTheTree = Callable[..., Path]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy in which a port in AWK has run, once for all tests."""
    root = tmp_path_factory.mktemp("made")
    copy_tree(root)
    write_awk(root)
    answer = make(root, "awk")
    assert answer.returncode == 0, answer.stderr
    return root


@pytest.fixture
def tree(made: Path, tmp_path: Path) -> Path:
    """A copy of that copy, as old."""
    return Path(shutil.copytree(made, tmp_path / "a copy", symlinks=True))


def without(program: str, tmp_path: Path) -> str:
    """A PATH on which every program is found but this one; apt-get and sudo are hidden too."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for place in os.environ["PATH"].split(":"):
        for path in Path(place).glob("*") if Path(place).is_dir() else ():
            link = folder / path.name
            if path.name not in (program, "apt-get", "sudo") and not link.is_symlink():
                link.symlink_to(path)
    return str(folder)


def test_an_up_to_date_tree_runs_nothing(tree: Path) -> None:
    before = (tree / "build/awk/run.json").read_text()
    assert "conformance.programs.run" not in make(tree, "awk").stdout
    assert (tree / "build/awk/run.json").read_text() == before


def test_a_changed_source_runs_its_program_again(tree: Path) -> None:
    os.utime(tree / "awk" / AWK)
    assert "conformance.programs.run awk" in make(tree, "awk").stdout


def test_a_source_that_does_not_compile_leaves_nothing_stale(copy_of_the_tree: CopyOfTheTree) -> None:
    tree = copy_of_the_tree()
    built = read_ports()["cpp"].build
    if built.is_dir():  # which spares a compilation
        shutil.copytree(built, tree / "build/cpp")
    assert make(tree, "cpp").returncode == 0  # an earlier success
    source = tree / "cpp/Chapter17_Lesson1.cpp"
    source.write_text(source.read_text().replace("return {x1_dot, x2_dot", "int same = 1; return {x1_dot, x2_dot"))
    answer = make(tree, "cpp")
    assert answer.returncode != 0 and "unused variable" in answer.stderr
    assert make(tree, "--question", "cpp").returncode == 1  # it does not hide this: there is more to do


def test_a_program_that_fails_is_not_taken_for_done(tree: Path) -> None:
    source = tree / "awk" / AWK
    source.write_text(source.read_text().replace("    main()\n", '    print "too stiff" > "/dev/stderr"; exit 1\n'))
    answer = make(tree, "awk")
    assert answer.returncode != 0 and "awk: awk ended with status 1" in answer.stderr
    assert "too stiff" in answer.stderr and not list((tree / "build/awk").glob("*.csv"))
    assert make(tree, "awk").returncode != 0
    table = make(tree, "all", PORTS="awk")
    assert table.returncode != 0 and "failed, status 1" in table.stdout


def test_missing_engine_is_named_with_what_to_install(copy_of_the_tree: CopyOfTheTree, tmp_path: Path) -> None:
    root = copy_of_the_tree(write_awk)
    path = without("g++", tmp_path)
    answer = make(root, "--keep-going", "all", PORTS="cpp awk", PATH=path)
    assert answer.returncode != 0
    assert "cpp: no engine found: it needs GCC (g++; install the Debian package g++" in answer.stderr
    assert (root / "build/awk/done").exists()
    assert "cpp did not run" in [" ".join(line.split()) for line in answer.stdout.splitlines()]


def test_without_keep_going_one_command_is_named(copy_of_the_tree: CopyOfTheTree, tmp_path: Path) -> None:
    answer = make(copy_of_the_tree(), "all", PORTS="cpp", PATH=without("g++", tmp_path))
    assert answer.returncode != 0 and "type: brew install gcc" in answer.stderr
    assert "conformance.programs.run" not in answer.stdout


def test_a_program_that_did_not_run_fails_the_check(copy_of_the_tree: CopyOfTheTree) -> None:
    root = copy_of_the_tree()
    check = [root / ".venv/bin/python", "-m", "pytest", "conformance/tests/programs/test_results.py"]
    answer = subprocess.run(check, cwd=root, env={**os.environ, "PORTS": "cpp"}, capture_output=True, text=True)
    assert answer.returncode == 1 and "cpp is missing: it did not run; type: make cpp" in answer.stdout


def test_unknown_port_is_refused(copy_of_the_tree: CopyOfTheTree) -> None:
    answer = make(copy_of_the_tree(), "all", PORTS="fortran")
    assert answer.returncode != 0 and "no port is called fortran" in answer.stderr


def test_make_and_harness_know_the_same_ports(tree: Path) -> None:
    names = make(tree, "help").stdout.split("one of ")[1].splitlines()[0].split()
    assert sorted(names) == sorted(read_ports(tree))


def test_a_new_language_is_one_new_folder(copy_of_the_tree: CopyOfTheTree) -> None:
    root = copy_of_the_tree()
    folder = root / "shell"
    folder.mkdir()
    (folder / "program.sh").write_text("echo t > Chapter17_Lesson1_shell.csv\n")
    (folder / "port.mk").write_text("KNOWN_PORTS += shell\nFOLDER.shell := shell\nbuild/shell/done: shell/program.sh\n")
    (folder / "port.toml").write_text(
        '[shell]\nlanguage = "shell"\nsource = "program.sh"\nmethod = "none"\ncomment = ["# ", ""]\nsection = "{}"\n'
        'products = []\n[[shell.engine]]\nname = "sh"\nproprietary = false\nprogram = "sh"\nversion = ["echo", "1"]\n'
        'command = ["sh", "{root}/shell/program.sh"]\ninstall = "sh"\n'
        'tolerance = {x1 = 1e-6, x2 = 1e-6, theta_hat = 1e-6}\ntolerance_from = "the contract"\n'
    )
    answer = make(root, "shell")
    assert answer.returncode == 0 and (root / "build/shell/Chapter17_Lesson1_shell.csv").exists(), answer.stderr


def test_parallel_make_gives_every_result(copy_of_the_tree: CopyOfTheTree) -> None:
    root = copy_of_the_tree(write_awk)
    assert make(root, "-j2", "all", PORTS="cpp java awk").returncode == 0
    assert all((root / f"build/{name}/done").exists() for name in ("cpp", "java", "awk"))


def test_an_interrupted_run_is_not_taken_for_done(copy_of_the_tree: CopyOfTheTree) -> None:
    root = copy_of_the_tree()
    interrupted = subprocess.Popen(
        ["make", "python"], cwd=root, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    started = root / "build/python/stdout.txt"
    for _ in range(600):
        if started.exists():
            break
        time.sleep(0.05)
    os.killpg(interrupted.pid, signal.SIGTERM)  # SIGINT is ignored below a shell in the background
    assert started.exists() and interrupted.wait(timeout=60) != 0
    assert not any((root / "build/python" / name).exists() for name in ("done", "run.json"))
    assert not list((root / "build/python").glob("*.csv"))


SLOW = '    while (waited++ < 600 && (getline line < "go") < 0) system("sleep 0.05")\n    main()\n'


@pytest.fixture
def slow_tree(tree: Path) -> Path:
    """A tree in which the program waits for the file build/awk/go."""
    source = tree / "awk" / AWK
    source.write_text(source.read_text().replace("    main()\n", SLOW, 1))
    return tree


def start(root: Path, *words: str) -> subprocess.Popen[str]:
    """make in a tree, by itself in its session, which hears the interrupt key."""
    return subprocess.Popen(
        ["make", *words], cwd=root, env=as_a_user(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def wait_for(path: Path) -> None:
    for _ in range(600):
        if path.exists():
            return
        time.sleep(0.05)
    raise AssertionError(f"{path} did not come")


def test_an_interrupt_is_told_in_one_line(slow_tree: Path) -> None:
    (slow_tree / "build/awk/stdout.txt").unlink()
    with start(slow_tree, "all", "PORTS=awk") as asked:
        wait_for(slow_tree / "build/awk/stdout.txt")
        os.killpg(asked.pid, signal.SIGINT)
        _, said = asked.communicate(timeout=60)
    assert asked.returncode != 0 and len(said.splitlines()) == 1 and "Interrupt" in said, said
    assert not (slow_tree / "build/awk/done").exists()


def test_a_second_make_says_that_it_waits_and_finds_the_work_done(slow_tree: Path) -> None:
    (slow_tree / "build/awk/stdout.txt").unlink()
    with start(slow_tree, "awk") as first:
        wait_for(slow_tree / "build/awk/stdout.txt")
        with start(slow_tree, "awk") as second:
            assert second.stderr is not None
            assert second.stderr.readline() == "make: another make is at work in this tree; waiting until it ends\n"
            (slow_tree / "build/awk/go").write_text("go\n")
            answer, said = second.communicate(timeout=60)
        assert first.wait(timeout=60) == 0
    assert (second.returncode, said) == (0, "") and "conformance.programs.run" not in answer


@pytest.mark.parametrize("name", ["matlab", "simulink", "mathematica"])
def test_proprietary_engine_is_used_where_it_is_on_the_path(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = read_ports()[name]
    assert not choose_engine(port).proprietary or shutil.which(port.engines[0].program)
    (tmp_path / port.engines[0].program).symlink_to("/bin/true")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    assert choose_engine(port).proprietary
