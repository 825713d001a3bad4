# SPDX-License-Identifier: MIT
"""The sources are clean by each language's own tools; C++ and Java are compiled with warnings as errors."""

import subprocess
import sys

import pytest

from conformance.ports import ROOT

LINTERS = {
    "ruff": ["ruff", "check", "--quiet", "."],
    "format": ["ruff", "format", "--check", "--quiet", "conformance"],
    "mypy": ["mypy", "--no-error-summary"],
    "matlab": ["miss_hit.mh_lint", "--brief", "matlab/Chapter17_Lesson1.m", "matlab/Chapter17_Lesson1_Simulink.m"],
}


@pytest.mark.parametrize("linter", LINTERS)
def test_sources_are_clean(linter: str) -> None:
    answer = subprocess.run([sys.executable, "-m", *LINTERS[linter]], cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout + answer.stderr
