# SPDX-License-Identifier: MIT
"""The sources are clean by each language's own tools; C++ and Java are compiled with warnings as errors."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from conformance.programs.ports import ROOT

# MATLAB, not Octave: every .m file but those that only Octave runs
MATLAB = [str(path.relative_to(ROOT)) for path in ROOT.glob("matlab/*.m")]
LINTERS = {
    "ruff": ["ruff", "check", "--quiet", "."],
    "format": ["ruff", "format", "--check", "--quiet", "conformance"],
    "mypy": ["mypy", "--no-error-summary"],
    "matlab": ["miss_hit.mh_lint", "--brief", *MATLAB],
}


def test_there_are_matlab_files_to_check() -> None:
    assert {"Chapter17_Lesson1.m", "Chapter17_Lesson1_Simulink.m"} <= {Path(name).name for name in MATLAB}


@pytest.mark.parametrize("fragment", ["x = 1; # one", "if x\n  y = 2;\nendif", "y = !x;", "x = {1}{1};"])
def test_octave_alone_is_not_taken_for_matlab(fragment: str, tmp_path: Path) -> None:
    (tmp_path / "octave.m").write_text(fragment + "\n")
    assert subprocess.run([sys.executable, "-m", "miss_hit.mh_lint", tmp_path], capture_output=True).returncode != 0


@pytest.mark.parametrize("linter", LINTERS)
def test_sources_are_clean(linter: str) -> None:
    answer = subprocess.run([sys.executable, "-m", *LINTERS[linter]], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout + answer.stderr


# ---- The order of the rooms ----


def rooms(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"]
    return subprocess.run([*command, "--no-cache"], cwd=folder, capture_output=True, text=True)


def test_rooms_import_what_is_below_them_alone() -> None:
    answer = rooms(ROOT)
    assert answer.returncode == 0, answer.stdout + answer.stderr


def test_an_import_upwards_is_refused(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "conformance", tmp_path / "conformance", ignore=shutil.ignore_patterns("tests", "*.html"))
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    with (tmp_path / "conformance" / "theory" / "numbers.py").open("a") as file:
        file.write("import conformance.judging.checks\n")
    answer = rooms(tmp_path)
    assert answer.returncode == 1 and "conformance.theory is not allowed to import conformance.judging" in answer.stdout
