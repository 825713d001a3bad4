# SPDX-License-Identifier: MIT
"""Where MATLAB or a Wolfram kernel is on the PATH, it runs, with the banner that it may print before what is asked.

None is here: programs of the same names print a banner and hand on to the open engines.
"""

import os
import stat
import subprocess
from pathlib import Path

import pytest

from conformance.judging.verdict import judge_port
from conformance.programs.ports import ROOT, read_ports
from conformance.programs.run import as_a_user
from conformance.tests.under_test import PORTS
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.trials.edits import edited, in_experiment, without_drawing
from conformance.trials.variant import copy_what_runs

SHORT = with_values(LESSON, {"horizon": LESSON.horizon / 100})
MATLAB = """\
#!/bin/sh
[ "$1 $2" = "-nodisplay -batch" ] || exit 2
echo 'MATLAB is selecting SOFTWARE OPENGL rendering.'
case $3 in
    "exit(isempty(ver('simulink')))") exit $LACKS_SIMULINK ;;
    *"simulink.Version"*) echo 25.1 with Simulink 25.1 ;;
    "disp(version)") echo 25.1 ;;
    *) exec octave-cli --norc --path '{root}/matlab/octave' --eval "$3" ;;
esac
"""
WOLFRAM = """\
#!/bin/sh
echo 'Loading from a notebook server.'
case $1 in
    -code) echo 14.2 ;;
    -file) exec '{root}/.venv/bin/python' -m woxi run "$(dirname "$2")/run_woxi.wls" ;;
esac
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the programs over 0.2 s, and in `bin` the fake engines."""
    root = tmp_path / "tree"
    copy_what_runs(root)
    for name in ("matlab", "simulink", "mathematica"):
        port = PORTS[name]
        text = in_experiment(port, SHORT)
        text = edited(text, without_drawing(port, text))
        (root / port.folder.name / port.source).write_text(text, encoding="utf-8")
    (root / "bin").mkdir()
    for name, text in {"matlab": MATLAB, "wolframscript": WOLFRAM}.items():
        path = root / "bin" / name
        path.write_text(text.replace("{root}", str(ROOT)))
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return root


def make(tree: Path, *words: str, lacks_simulink: int = 0) -> subprocess.CompletedProcess[str]:
    path = f"{tree / 'bin'}:{os.environ['PATH']}"
    return subprocess.run(
        ["make", "-j2", "-o", ".venv/installed", *words],
        cwd=tree, env=as_a_user() | {"PATH": path, "LACKS_SIMULINK": str(lacks_simulink)},
        capture_output=True, text=True,
    )  # fmt: skip


@pytest.mark.skipif(not {"matlab", "simulink", "mathematica"} <= PORTS.keys(), reason="PORTS leaves one of them out")
def test_proprietary_engine_with_a_banner_runs_and_conforms(tree: Path) -> None:
    answer = make(tree, "matlab", "simulink", "mathematica")
    assert answer.returncode == 0, answer.stderr
    versions = {"matlab": "25.1", "simulink": "25.1 with Simulink 25.1", "mathematica": "14.2"}
    for name, version in versions.items():
        port = read_ports(tree)[name]
        run = port.run()
        assert run is not None
        assert (run["proprietary"], run["engine_version"]) == (True, version)
        assert len(port.stdout.read_text().splitlines()) == 5
        verdict = judge_port(port, SHORT)
        assert verdict.conforms, verdict


@pytest.mark.skipif("simulink" not in PORTS, reason="PORTS leaves simulink out")
def test_matlab_without_simulink_leaves_the_model_to_the_open_engine(tree: Path) -> None:
    answer = make(tree, "simulink", lacks_simulink=1)
    assert answer.returncode == 0, answer.stderr
    run = read_ports(tree)["simulink"].run()
    assert run is not None and run["engine"] == "Simulink stand-in"
