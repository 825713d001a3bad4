# SPDX-License-Identifier: MIT
"""Installed from a wheel, outside of a clone: it validates and prints the truth in any folder, and keeps its proofs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from conformance.places import ROOT
from conformance.tests.under_test import PORTS, record

pytestmark = pytest.mark.beyond


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the package from a wheel, and its command; the libraries are those of .venv."""
    place = tmp_path_factory.mktemp("installed")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet"]
    quick = ["--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "wheel", *quick, "--wheel-dir", place, ROOT], check=True)
    (wheel,) = place.glob("*.whl")
    subprocess.run([*pip, "install", *quick, "--target", place / "site", wheel], check=True)
    return place / "site"


def conformance(site: Path, folder: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(site), "XDG_CACHE_HOME": str(folder / "cache")}
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    command = [sys.executable, site / "bin" / "conformance", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def test_it_judges_and_keeps_its_proof_in_the_users_cache(installed: Path, tmp_path: Path) -> None:
    port = next(iter(PORTS.values()))
    record(port)
    before = sorted(installed.rglob("*"))
    answer = conformance(installed, tmp_path, "validate", port.csv, "--stdout", port.stdout)
    assert (answer.returncode, answer.stderr) == (0, "") and f"{port.csv.name} conforms" in answer.stdout
    assert list((tmp_path / "cache").rglob("*.exact")), "nothing was kept"
    assert sorted(installed.rglob("*")) == before
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]


def test_it_prints_the_truth(installed: Path, tmp_path: Path) -> None:
    answer = conformance(installed, tmp_path, "truth", "--times", "1/3,20", "--digits", "8")
    assert (answer.returncode, answer.stderr) == (0, "") and "0.49530368" in answer.stdout


def test_it_derives(installed: Path, tmp_path: Path) -> None:
    answer = conformance(installed, tmp_path, "design", ROOT / "plants" / "Chapter17_Lesson1.toml")
    assert (answer.returncode, answer.stderr) == (0, "") and "Assumptions (3)" in answer.stdout


def test_what_needs_a_clone_says_so(installed: Path, tmp_path: Path) -> None:
    answer = conformance(installed, tmp_path, "check")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert "this needs a clone of the repository" in answer.stderr and len(answer.stderr.splitlines()) == 1
