# SPDX-License-Identifier: MIT
"""Tests that cannot run on a machine are counted at the end, with the way to get them; the CI gets them."""

import re

from conformance.places import ROOT
from conformance.tests.under_test import not_run


def test_what_cannot_run_is_counted_by_its_reason() -> None:
    browser, go = "there is no Chromium here; Debian's package is chromium", "there is no Go here"
    found = not_run([f"Skipped: {browser}", f"Skipped: {go}", f"Skipped: {browser}"])
    assert found == [f"2 not run: {browser}", f"1 not run: {go}"]


def test_ci_gets_every_package_without_which_tests_do_not_run() -> None:
    """Each reason that names a package names one that .ci/run installs, whatever its machine has."""
    sources = [path.read_text() for path in (ROOT / "conformance/tests").rglob("test_*.py")]
    packages = {name for text in sources for name in re.findall(r'reason="[^"]*package is ([\w-]+)"', text)}
    (installed,) = re.findall(r"^packages='(.*)'$", (ROOT / ".ci/run").read_text(), flags=re.MULTILINE)
    assert len(packages) >= 3 and packages <= set(installed.split())
