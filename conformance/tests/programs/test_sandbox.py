# SPDX-License-Identifier: MIT
"""In the sandbox a program has no network, and writes into its own build folder alone; run.json says if it had one."""

import json
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from conformance.programs import sandbox
from conformance.programs.ports import read_ports
from conformance.programs.sandbox import NAME, boxed
from conformance.programs.table import boxes
from conformance.tests.programs.test_makefile import without
from conformance.tests.under_test import AWK, make, write_awk

ENGINE = read_ports()["cpp"].engines[0]

in_a_box = pytest.mark.skipif(
    not sandbox.works(), reason="there is no bubblewrap here that works; its package is bubblewrap"
)


def in_box(build: Path, script: str) -> subprocess.CompletedProcess[str]:
    command, _ = boxed(ENGINE, ["sh", "-c", script], build)
    return subprocess.run(command, cwd=build, capture_output=True, text=True)


@in_a_box
def test_only_its_own_folder_is_writable(tmp_path: Path) -> None:
    build = tmp_path / "build" / "cpp"
    for folder in (build, tmp_path / "build" / "truth"):
        folder.mkdir(parents=True)
    assert in_box(build, "echo own >own && mktemp").returncode == 0 and (build / "own").read_text() == "own\n"
    for place in ("../truth/forged", "../../source", "/tmp/stray"):
        answer = in_box(build, f"echo forged >{place}")
        assert answer.returncode != 0 and "Read-only file system" in answer.stderr
    assert not any((tmp_path / "build/truth").iterdir())


@in_a_box
def test_there_is_no_network(tmp_path: Path) -> None:
    answer = in_box(tmp_path, "tail -n +3 /proc/net/dev")
    assert [line.split(":")[0].strip() for line in answer.stdout.splitlines()] == ["lo"]


@in_a_box
def test_a_program_that_forges_the_truth_is_stopped(copy_of_the_tree: Callable[..., Path]) -> None:
    root = copy_of_the_tree(write_awk)
    source = root / "awk" / AWK
    source.write_text(source.read_text().replace("    main()\n", '    print "forged" > "../truth/forged"; main()\n', 1))
    answer = make(root, "awk")
    assert answer.returncode != 0 and "awk: awk ended with status 2" in answer.stderr
    run = json.loads((root / "build/awk/run.json").read_text())
    assert run["sandbox"] == NAME and run["command"][0] == "awk" and not (root / "build/truth/forged").exists()


def test_where_there_is_none_it_is_said(copy_of_the_tree: Callable[..., Path], tmp_path: Path) -> None:
    root = copy_of_the_tree(write_awk)
    answer = make(root, "all", PORTS="awk", PATH=without("bwrap", tmp_path))
    assert answer.returncode == 0 and "without a sandbox" in answer.stdout.splitlines()[-1]
    ran = read_ports(root)["awk"]
    assert boxes([ran]).endswith(": awk") and json.loads((ran.build / "run.json").read_text())["sandbox"] == ""


def test_a_proprietary_engine_runs_outside(tmp_path: Path) -> None:
    assert boxed(replace(ENGINE, proprietary=True), ["true"], tmp_path) == (["true"], "")


@in_a_box
def test_temporary_files_have_a_path_without_a_space(tmp_path: Path) -> None:
    build = tmp_path / "a copy" / "build" / "matlab"  # GNU Octave cannot print a figure by way of a path with one
    build.mkdir(parents=True)
    answer = in_box(build, 'echo some >"$TMPDIR/some" && echo "$TMPDIR"')
    assert answer.returncode == 0 and " " not in answer.stdout, answer.stderr
