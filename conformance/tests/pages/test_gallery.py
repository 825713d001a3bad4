# SPDX-License-Identifier: MIT
"""The index has every plant with its equations, and leads to the pages that are there."""

import json
import re
from html import unescape
from pathlib import Path

import pytest

from conformance.pages.report import gallery as index
from conformance.pages.report.gallery import gallery, headline
from conformance.pages.report.page import PAGE
from conformance.pages.report.ways import ways
from conformance.places import PLANTS
from conformance.theory.experiment_file import read_experiment

pytestmark = pytest.mark.beyond

FILES = sorted(PLANTS.glob("*.toml"))[:4]


def test_index_has_every_plant_with_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(index, "page_of", lambda experiment: PAGE.parents[1] / "nothing" / "report" / "index.html")
    html = unescape(gallery(FILES))
    experiments = [read_experiment(path) for path in FILES]
    assert re.findall("<h2>(.*?)</h2>", html) == [e.title for e in experiments]
    assert html.count('<div class="equation">') == sum(len(e.states) for e in experiments)
    assert re.findall(r'(?:src|href)="(?!data:)([^"]*)"', html) == []


def test_index_leads_to_a_page_that_is_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    page = tmp_path / "build" / "some" / "report" / "index.html"
    page.parent.mkdir(parents=True)
    page.touch()
    (page.parents[1] / "result.json").write_text(json.dumps({"headline": "6 of 6 conform"}))
    monkeypatch.setattr(index, "PAGE", tmp_path / "build" / "report" / "index.html")
    monkeypatch.setattr(index, "page_of", lambda experiment: page)
    html = gallery(FILES[:1])
    assert re.findall(r'<a href="([^"]*)"', html) == ["../some/report/index.html"]
    assert "6 of 6 conform." in html


def test_index_says_what_is_wrong_with_a_file_that_is_no_experiment(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("title = 1\n")
    html = unescape(gallery([tmp_path / "mine.toml"]))
    assert "<h2>mine.toml</h2>" in html and ">mine.toml: the table [plant] is missing.<" in html


def test_page_and_index_lead_to_each_other(report: Path) -> None:
    index = report.with_name("plants.html")
    assert '<a href="plants.html">' in report.read_text()
    assert re.search('<h2><a href="index.html">', index.read_text())
    assert index.read_text().count("<li>") == len(list(PLANTS.glob("*.toml")))


@pytest.mark.parametrize("text", ["", "[]", "{}", "{"])
def test_result_that_cannot_be_read_says_nothing(text: str, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(text)
    assert headline(tmp_path / "result.json") == "" == headline(tmp_path / "missing.json")


def test_the_first_way_into_the_page_of_a_plant_is_its_tuning_function() -> None:
    """And not a partial derivative of one."""
    plant = read_experiment(PLANTS / "problem_1c.toml")
    asked = [way.question for way in ways(plant, {"java": "Java", "matlab": "MATLAB"}, ["java", "matlab"], [], [])]
    assert asked[0] == "How does Java write the tuning function of theta2, against MATLAB?"
