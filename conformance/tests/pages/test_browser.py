# SPDX-License-Identifier: MIT
"""The page in a browser: it opens without a request, reads well by eye and by machine, and its playground conforms.

Needs Chromium; build/report/ keeps pictures of the page: wide and light, narrow and dark.
"""

import contextlib
import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, FloatRect, Locator, Page, expect, sync_playwright

from conformance.judging.difference import by_name
from conformance.judging.verdict import judge_all, judge_file, to_json
from conformance.pages.report import chromium
from conformance.pages.report.evidence import changed
from conformance.pages.report.page import write_page
from conformance.pages.report.playground import playground, read_questions
from conformance.programs.ports import ROOT, SIX, Port, read_ports
from conformance.programs.sources import source
from conformance.programs.writer import write_programs
from conformance.tests.under_test import NO_EXCITATION, PORTS, PROBLEM_6, trajectory_of
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.lesson import LESSON, SECTIONS
from conformance.trials.variant import read_variants
from conformance.truth.exact import exact

CHROMIUM = chromium()
QUESTIONS = read_questions()
PATIENCE = 6  # attempts at what takes longer on a busy machine
UNLAID = """[...document.querySelectorAll("main > section > *, .row")]
  .some((part) => getComputedStyle(part).contentVisibility === "hidden")"""
LAID_OUT = f"() => new Promise(function look(done) {{ {UNLAID} ? setTimeout(look, 50, done) : done(); }})"
ALL_AT_ONCE = ".inspector { position: static !important }"
WIDE_LIGHT, NARROW_DARK = (1900, 1000, "light"), (360, 740, "dark")  # width, height, colours

pytestmark = [
    pytest.mark.beyond,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here; Debian's package is chromium"),
]


@dataclass
class Opened:
    """A page in the browser, and what it complained of or asked for."""

    page: Page
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        yield playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])


def open_page(
    browser: Browser,
    path: Path,
    screen: tuple[int, int, str] = WIDE_LIGHT,
    motion: Literal["reduce", "no-preference"] = "reduce",
    laid_out: bool = True,
) -> Opened:
    width, height, scheme = screen
    context = browser.new_context(
        viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion=motion
    )
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    opened = Opened(context.new_page())
    opened.page.on("console", lambda message: opened.complaints.append(message.text))
    opened.page.on("pageerror", lambda error: opened.complaints.append(str(error)))
    opened.page.on("request", lambda request: opened.requests.append(request.url))
    opened.page.goto(path.as_uri())
    if laid_out:
        opened.page.evaluate(LAID_OUT)
    return opened


def show_charts(charts: Locator) -> None:
    """Bring each chart into view, where it is drawn; what is drawn above it may push it out of view again."""
    assert charts.count()
    for chart in charts.all():
        for _ in range(PATIENCE):
            chart.scroll_into_view_if_needed()
            with contextlib.suppress(AssertionError):
                expect(chart.locator("canvas")).to_have_count(1, timeout=2000)
                break
        expect(chart.locator("canvas")).to_have_count(1)


def box_of(one: Locator) -> FloatRect:
    """Where an element stands on the screen (px)."""
    box = one.bounding_box()
    assert box
    return box


def show_all(page: Page) -> None:
    """Show every chart but those of the exercises."""
    show_charts(page.locator("#trajectories .chart, #playground .chart:not(.plane)"))
    page.evaluate("scrollTo(0, 0)")


def drawn(page: Page) -> None:
    """Wait until what has been changed is drawn."""
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


@pytest.fixture(scope="module")
def opened(browser: Browser, report: Path) -> Opened:
    opened = open_page(browser, report)
    show_all(opened.page)
    return opened


@pytest.fixture
def page(opened: Opened) -> Page:
    return opened.page


def picture(page: Page, signal: str, where: str = "#trajectories") -> str:
    """What is drawn on a chart, as text."""
    canvas = f"{where} [data-signal={signal}] canvas"
    return str(page.evaluate("(canvas) => document.querySelector(canvas).toDataURL()", canvas))


# ---- Every screen ----


def test_page_opens_without_a_complaint_and_without_a_request(opened: Opened, report: Path) -> None:
    assert opened.complaints == []
    assert [url for url in opened.requests if not url.startswith("data:")] == [report.as_uri()]


def test_request_would_be_blocked_and_seen(browser: Browser, report: Path) -> None:
    other = open_page(browser, report)
    with other.page.expect_console_message(lambda message: "Content Security Policy" in message.text):
        other.page.evaluate(
            "document.body.append(Object.assign(new Image(), { src: 'https://example.invalid/x.png' }))"
        )
    assert len(other.complaints) == 1
    other.page.context.close()


def check_screen(page: Page, picture: Path) -> None:
    """It fits the screen, and is accessible; and a picture of it."""
    style = page.add_style_tag(content=ALL_AT_ONCE)
    page.screenshot(path=picture, type="jpeg", quality=80, full_page=True)  # a PNG file takes twice as long
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.evaluate("document.querySelector('nav ul').scrollWidth <= innerWidth")
    set_apart = {"exclude": [[".code"], [".katex"]]}  # for the contrast of code see test_page
    found = Axe().run(page, context=set_apart, options={"resultTypes": ["violations"]})
    assert found.violations_count == 0, found.generate_report()
    style.evaluate("(style) => style.remove()")


def test_page_is_accessible_and_fits_a_wide_light_screen(page: Page, report: Path) -> None:
    check_screen(page, report.with_name("wide-light.jpeg"))


def test_page_is_accessible_and_fits_a_narrow_dark_screen(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, NARROW_DARK)
    show_all(other.page)
    check_screen(other.page, report.with_name("narrow-dark.jpeg"))
    other.page.context.close()


def test_inaccessible_page_would_be_refused(browser: Browser) -> None:
    bare = browser.new_page()
    bare.set_content("<img src='data:,'><button></button>")
    assert Axe().run(bare).violations_count > 0
    bare.close()


# ---- Light and dark ----

COLOURS = "['backgroundColor', 'color'].map((name) => getComputedStyle(document.body)[name])"
LIGHT, DARK = ["rgb(255, 255, 255)", "rgb(26, 29, 33)"], ["rgb(17, 20, 24)", "rgb(230, 233, 237)"]
FRAMES = """frames = [];
  (function look() {
    if (document.body) frames.push(getComputedStyle(document.documentElement).colorScheme);
    if (frames.length < 5) requestAnimationFrame(look);
  })();"""
NOTHING_KEPT = "Object.defineProperty(window, 'localStorage', { get() { throw new DOMException('not allowed'); } })"


def test_reader_turns_light_over_to_dark_and_finds_it_so_again(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1440, 900, "light"))
    page, switch = other.page, other.page.locator("#scheme")
    show_charts(page.locator("#trajectories [data-signal=x1], #playground [data-drawing=output]"))
    page.evaluate("document.getElementById('exercise-problem-6').open = true")
    show_charts(page.locator("#exercise-problem-6 .chart"))
    charts = [f"#{part} .chart canvas" for part in ("trajectories", "playground", "exercise-problem-6")]
    drawn_as = [[page.locator(chart).first.evaluate("(canvas) => canvas.toDataURL()") for chart in charts]]
    assert page.evaluate(COLOURS) == LIGHT and switch.get_attribute("aria-pressed") == "false"
    for colours, pressed in ((DARK, "true"), (LIGHT, "false"), (DARK, "true")):
        switch.click()
        assert page.evaluate(COLOURS) == colours and switch.get_attribute("aria-pressed") == pressed
        drawn(page)
        drawn_as.append([page.locator(chart).first.evaluate("(canvas) => canvas.toDataURL()") for chart in charts])
    assert drawn_as[0] == drawn_as[2] and drawn_as[1] == drawn_as[3]
    assert all(light != dark for light, dark in zip(*drawn_as[:2], strict=True))
    assert other.complaints == []
    page.add_init_script(FRAMES)
    page.reload()
    page.wait_for_function("frames.length === 5")
    assert set(page.evaluate("frames")) == {"dark"}, "it was drawn in other colours at first"
    assert switch.get_attribute("aria-pressed") == "true"
    page.goto(report.with_name("plants.html").as_uri())
    assert page.evaluate(COLOURS) == DARK, "the index is in other colours"
    page.goto(report.as_uri())
    switch.click()  # as the system has it again, whatever that comes to be
    page.emulate_media(color_scheme="dark")
    assert page.evaluate(COLOURS) == DARK
    expect(switch).to_have_attribute("aria-pressed", "true")
    page.context.close()


def test_colours_can_be_chosen_where_nothing_is_kept(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (390, 800, "dark"))
    other.page.add_init_script(NOTHING_KEPT)
    other.page.reload()
    assert other.page.evaluate(COLOURS) == DARK
    other.page.locator("#scheme").click()
    assert other.page.evaluate(COLOURS) == LIGHT and other.complaints == []
    other.page.context.close()


def test_paper_is_light_and_without_script_it_is_as_the_system_has_it(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1440, 900, "light"))
    other.page.locator("#scheme").click()
    for system in ("light", "dark"):
        other.page.emulate_media(media="print", color_scheme=system)
        assert other.page.evaluate(COLOURS) == LIGHT
    other.page.context.close()
    bare = browser.new_page(java_script_enabled=False, color_scheme="dark")
    bare.goto(report.as_uri())
    background = bare.locator("body").evaluate("(body) => getComputedStyle(body).backgroundColor")
    assert background == DARK[0] and not bare.locator("#scheme").is_visible()
    bare.close()


# ---- As a book ----


def test_words_of_a_heading_stand_beside_it_and_on_a_narrow_screen_below(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1440, 900, "light"))
    for width, beside in ((1440, True), (1024, True), (900, False), (390, False)):
        other.page.set_viewport_size({"width": width, "height": 900})
        for opening in other.page.locator(".chapter:has(h2)").all():
            heading, words = (box_of(opening.locator(part).first) for part in ("h2", "p"))
            assert (words["x"] > width / 2 and words["x"] + words["width"] > 0.85 * width) == beside, width
            assert (words["y"] < heading["y"] + heading["height"]) == beside, width
    other.page.context.close()


BROKEN = """() => [...document.querySelectorAll("main .katex")].filter((equation) => {
  const ends = [...equation.querySelectorAll(".katex-html > *")].map((part) => part.getBoundingClientRect());
  const after = equation.nextSibling;
  if (after?.nodeType === Node.TEXT_NODE && /^[.,;:?!)]/.test(after.data)) {
    const sign = new Range();
    sign.setStart(after, 0);
    sign.setEnd(after, 1);
    ends.push(sign.getBoundingClientRect());
  }
  return equation.checkVisibility() && ends.some(({ left }, i) => i > 0 && left < ends[i - 1].left);
}).map((equation) => equation.closest("[id]").id)"""


@pytest.mark.parametrize("width", [390, 1024, 1440])
def test_equation_in_a_line_is_not_broken_nor_parted_from_its_full_stop(
    browser: Browser, report: Path, width: int
) -> None:
    page = open_page(browser, report, (width, 900, "light")).page
    assert page.evaluate(BROKEN) == []
    page.add_style_tag(content=".katex { white-space: normal !important }")
    assert page.evaluate(BROKEN) or width > 390
    page.context.close()


def test_readout_stands_in_the_place_of_the_axis_name(page: Page) -> None:
    for signal in ("x1", "error_x1"):
        chart = page.locator(f"#trajectories [data-signal={signal}]")
        chart.scroll_into_view_if_needed()
        chart.locator(".u-over").hover()
        caption, plot, readout = (box_of(chart.locator(part)) for part in ("figcaption", "canvas", ".readout"))
        assert plot["y"] - caption["y"] - caption["height"] < 8, "a gap under the caption"
        below = plot["y"] + plot["height"] - (readout["y"] + readout["height"])
        assert -20 < below < 2 and readout["y"] > plot["y"] + 0.8 * plot["height"]
    page.mouse.move(0, 0)


# ---- Ways in ----


def clicks(page: Page) -> Callable[[], int]:
    """A function that says how often the reader has clicked since it was asked last."""
    page.evaluate("clicked = 0; addEventListener('click', () => { clicked += 1; }, true)")
    return lambda: int(page.evaluate("[clicked, clicked = 0][0]"))


ANSWERS = {  # by a few words of the question: what is in view, and what it says
    "Java write the tuning function, against MATLAB": {
        "#row-tau2 .difference": "Java alone has final double; the rest"
    },
    "Problem 6's edit in Mathematica": {
        "#exercise-problem-6 > p >> nth=0": "cos stands for sin; both derivatives change with it",
        "#exercise-problem-6 .diff:visible": "rDot[t_] := -amplitude * omega * Sin[omega * t]",
    },
    "not converge with": {"#why-no-convergence > p >> nth=0": "adaptation stops"},
    "What does": {"#effect-gamma": "the estimate moves faster"},
    "the cross term of step 2": {"#cross-2": "the cross term", "#step-2 .statement.lit .quiet": "cancels"},
    "When is a program refused": {"#when-refused": "as soon as one check fails"},
}


@pytest.mark.skipif(len(PORTS) < len(SIX), reason="PORTS leaves out some")
def test_what_a_reader_asks_first_is_one_click_away_from_the_first_screen(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1440, 900, "light"))
    page = other.page
    asked = page.locator(".ways a")
    assert asked.count() == len(ANSWERS)
    clicked = clicks(page)
    for question, answer in ANSWERS.items():
        page.evaluate("scrollTo(0, 0)")
        link = asked.filter(has_text=question)
        expect(link).to_be_in_viewport()
        link.click()
        for place, words in answer.items():
            expect(page.locator(place)).to_be_in_viewport(ratio=0.5)
            found = re.sub(r"\s+", " ", page.evaluate("(e) => textOf(e)", page.locator(place).element_handle()))
            assert words in found, (question, found)
        assert clicked() == 1, question
    page.get_by_role("button", name="all", exact=True).last.click()
    assert page.locator("#exercise-problem-6 .diff:visible").count() == len(PORTS)
    for query in ("?compare=java,matlab#row-tau2", "?in=mathematica#exercise-problem-6"):
        page.goto(report.as_uri() + query)  # the same by a link from elsewhere
        expect(page.locator("#" + query.partition("#")[2])).to_be_in_viewport()
    assert page.locator("#exercise-problem-6 .diff:visible").count() == 1
    assert other.complaints == []
    page.context.close()


# ---- Verdict ----


def test_figure_of_a_check_shows_at_the_pointer_and_at_the_focus(page: Page) -> None:
    cells, inspector = page.locator("#verdict .cell"), page.locator("#verdict .inspector").first
    cells.nth(1).hover()
    assert inspector.inner_text() == cells.nth(1).get_attribute("data-words")
    cells.nth(0).focus()
    page.keyboard.press("ArrowDown")
    below = page.evaluate("document.activeElement.dataset.words")
    assert page.locator("#pairs + .inspected .cell[tabindex='0']").is_visible()
    assert below == cells.nth(len(PORTS)).get_attribute("data-words") == inspector.inner_text()


def test_refused_and_missing_programs_say_why(browser: Browser, tmp_path: Path) -> None:
    names = sorted(SIX)[:2]  # the first has run, the second has not
    for name in names:
        shutil.copytree(read_ports()[name].folder, tmp_path / read_ports()[name].folder.name, dirs_exist_ok=True)
    shutil.copytree(read_ports()[names[0]].build, tmp_path / "build" / names[0])
    ports = {name: port for name, port in read_ports(tmp_path).items() if name in names}
    refused, missing = ports.values()
    lines = refused.csv.read_text().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    wrong = [",".join([t, x1, str(float(x2) + 1e-3), *rest]) for t, x1, x2, *rest in rows]
    refused.csv.write_text("\n".join([lines[0], *wrong]) + "\n")
    record = refused.build / "run.json"
    record.write_text(json.dumps({**(refused.run() or {}), "csv_sha256": refused.csv_hash()}))
    judgement = judge_all(ports, LESSON)
    before = [replace(verdict, status="pass") for verdict in judgement.verdicts]
    changes = changed("earlier.json", by_name(json.loads(to_json(before))), judgement)
    write_page(tmp_path / "index.html", ports, judgement, changes=changes)
    other = open_page(browser, tmp_path / "index.html")
    show_all(other.page)
    for port, reason in ((refused, "the column, not its equation"), (missing, f"type: make {missing.name}")):
        other.page.evaluate("scrollTo(0, 0)")
        link = other.page.locator(f"header a[href='#verdict-{port.name}']")
        assert reason in link.locator("..").inner_text()
        assert link.locator("..").locator("small").all_inner_texts() == (["(12)"] if port == refused else [])
        link.click()
        expect(other.page.locator(f"#verdict-{port.name}").get_by_text(reason)).to_be_in_viewport()
    card = other.page.locator(f"#verdict-{refused.name}")
    assert card.get_by_text("Usual cause").first.is_visible() and card.get_by_text("Found").count() > 2
    told = other.page.locator("#changes ~ .scroll tbody tr")
    assert {re.sub(r"\s+", " ", text) for text in told.all_inner_texts()} >= {
        f"{port.language} status pass {status} " for port, status in ((refused, "fail"), (missing, "missing"))
    }
    assert Axe().run(other.page, context="#verdict", options={"resultTypes": ["violations"]}).violations_count == 0
    assert other.page.locator(f"#trajectories [data-port={missing.name}]").is_disabled()
    assert other.page.locator("#verdict .cell.fail").count() > 0
    assert other.complaints == []
    other.page.context.close()


# ---- Any plant ----


def ports_of(plant: Experiment, root: Path) -> dict[str, Port]:
    """The programs of a plant, where make writes them, of a tree that has two languages."""
    languages = [port for port in read_ports().values() if port.name in ("python", "cpp")]
    for port in languages:
        shutil.copytree(port.folder, root / port.folder.name)
    ports = read_ports(root, plant=plant.name)
    write_programs(plant, languages, root / "build" / plant.name / "programs")
    return ports


def test_page_of_a_plant_has_its_own_derivation_code_and_playground(browser: Browser, tmp_path: Path) -> None:
    plant = read_experiment(ROOT / "plants" / "khalil.toml")
    ports = ports_of(plant, tmp_path)
    write_page(tmp_path / "index.html", ports, judge_all(ports, plant), plant)
    other = open_page(browser, tmp_path / "index.html")
    page = other.page
    assert page.locator("h1").inner_text() == plant.title
    assert page.locator(".derivation-step").count() == len(plant.states)
    assert page.locator("#row-u .cell-code").count() == len(ports) == 2
    assert page.locator("#exercises").count() == 0 and page.locator("#playground .chart").count() > 3
    assert page.evaluate("all('small, .code b').flatMap((place) => cited(place.textContent)).includes('(0)')")
    assert page.evaluate("all('main small, .code b').every((p) => sectionsAt(p).length >= cited(p.textContent).length)")
    page.locator("#playground").scroll_into_view_if_needed()
    assert other.complaints == []
    page.context.close()


def test_plant_without_programs_is_refused(tmp_path: Path) -> None:
    plant = read_experiment(ROOT / "plants" / "khalil.toml")
    ports = ports_of(plant, tmp_path)
    ports["cpp"].source_path.unlink()
    with pytest.raises(ValueError, match="khalil: found no program for cpp, expected that of make all"):
        write_page(tmp_path / "index.html", ports, judge_all(ports, plant), plant)
    assert not (tmp_path / "index.html").exists()


# ---- Trajectories ----


def test_programs_are_switched_on_and_off(page: Page) -> None:
    before = picture(page, "error_x2")
    button = page.locator(f"#trajectories [data-port={next(iter(PORTS))}]")
    button.press("Space")
    assert button.get_attribute("aria-pressed") == "false" and picture(page, "error_x2") != before
    button.click()
    drawn(page)
    assert picture(page, "error_x2") == before


def test_time_is_zoomed_in_all_charts(page: Page) -> None:
    before = picture(page, "x2"), picture(page, "V")
    page.locator("#to").fill("3")
    page.locator("#to").press("Enter")
    drawn(page)
    assert all(old != new for old, new in zip(before, (picture(page, "x2"), picture(page, "V")), strict=True))
    page.locator("#whole").click()
    drawn(page)
    assert (picture(page, "x2"), picture(page, "V")) == before


def test_dragging_across_a_chart_zooms(page: Page) -> None:
    chart = page.locator("#trajectories [data-signal=x1] .u-over")
    chart.scroll_into_view_if_needed()
    box = box_of(chart)
    page.mouse.move(box["x"] + box["width"] / 4, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 20, steps=3)
    page.mouse.up()
    horizon = float(LESSON.horizon)
    ends = [float(page.locator(end).input_value()) for end in ("#from", "#to")]
    assert ends == pytest.approx([horizon / 4, horizon / 2], rel=0.05)
    page.locator("#whole").click()


# ---- Code ----


BOTH = pytest.mark.skipif(not {"java", "matlab"} <= PORTS.keys(), reason="PORTS leaves out java or matlab")


def texts(page: Page, highlight: str) -> list[str]:
    """What a highlight marks."""
    found: list[str] = page.evaluate(f"[...(CSS.highlights.get('{highlight}') ?? [])].map(String)")
    return found


def top(page: Page, selector: str) -> float:
    return float(page.evaluate("(s) => document.querySelector(s).getBoundingClientRect().top", selector))


def click_in_place(page: Page, selector: str) -> None:
    """Click what is in view; Playwright's own click may scroll before."""
    box = box_of(page.locator(selector))
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)


@BOTH
def test_two_clicks_set_java_beside_matlab_and_mark_what_differs(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1300, 900, "light"))
    page = other.page
    assert texts(page, "differs") == []
    page.get_by_role("link", name="Step 2").last.click()
    before = top(page, "#row-z2")
    for port in ("java", "matlab"):
        click_in_place(page, f"[data-code={port}]")
    assert abs(top(page, "#row-z2") - before) < 2, "the reader's place is lost"
    java, matlab = (box_of(page.locator(f"#row-tau2 [data-port={port}]")) for port in ("java", "matlab"))
    assert java["y"] == matlab["y"]
    assert all(
        not page.locator(f"#row-tau2 [data-port={port}]").is_visible() for port in PORTS.keys() - {"java", "matlab"}
    )
    assert {"final", "K1", "k1"} <= set(texts(page, "differs")) and "tau2" not in texts(page, "differs")
    assert texts(page, "same").count("tau2") == 4
    expect(page).to_have_url(re.compile(r"\?compare=java,matlab#row-z2$"))
    page.reload()
    assert page.locator("#code [data-code][aria-pressed=true]").all_inner_texts() == ["Java", "MATLAB"]
    page.locator("#all-languages").click()
    assert page.locator("#row-tau2 .cell-code:visible").count() == len(PORTS)
    expect(page).not_to_have_url(re.compile("compare"))
    page.context.close()


@BOTH
def test_phone_shows_one_language_and_two_that_are_compared(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (390, 844, "light"))
    page, cells = other.page, other.page.locator("#row-tau2 .cell-code:visible")
    pressed = page.locator("#code [data-code][aria-pressed=true]")
    ports = "(cells) => cells.map((cell) => cell.dataset.port)"
    assert cells.evaluate_all(ports) == [next(name for name in SIX if name in PORTS)] and pressed.count() == 1
    page.locator("#derivation [data-choose-lead=java]").click()
    assert cells.evaluate_all(ports) == ["java"] and pressed.all_inner_texts() == ["Java"]
    page.locator("[data-code=matlab]").click()
    assert cells.evaluate_all(ports) == ["matlab"]
    page.locator("[data-code=java]").click()
    assert cells.evaluate_all(ports) == ["java", "matlab"] and "final" in texts(page, "differs")
    page.reload()
    page.evaluate(LAID_OUT)
    assert cells.evaluate_all(ports) == ["java", "matlab"] and pressed.count() == 2
    page.locator("#all-languages").click()
    assert cells.count() == pressed.count() == len(PORTS)
    page.reload()
    page.evaluate(LAID_OUT)
    assert cells.count() == len(PORTS), "all, as he has chosen"
    page.goto(report.as_uri())
    page.evaluate(LAID_OUT)
    page.set_viewport_size({"width": 1200, "height": 800})
    expect(cells).to_have_count(len(PORTS))
    assert other.complaints == []
    page.context.close()


def test_copy_and_download_give_the_whole_program(page: Page) -> None:
    port = next(iter(PORTS.values()))
    page.locator(f".copy[data-program={port.name}]").click()
    drawn(page)
    assert page.evaluate("navigator.clipboard.readText()") == source(port)
    with page.expect_download() as download:
        page.locator(f"a[download='{port.source}']").click()
    assert download.value.path().read_text() == source(port)


# ---- Derivation ----


def test_statements_stand_in_the_language_that_is_chosen(browser: Browser, report: Path) -> None:
    name = list(PORTS)[-1]
    other = open_page(browser, report)
    page = other.page
    page.locator("#step-2").scroll_into_view_if_needed()
    page.locator(f"#derivation [data-choose-lead={name}]").click()
    law = page.locator("#step-2 [data-row=theta_hat_dot] .lead:visible")
    assert law.get_attribute("data-lead") == name and law.count() == 1
    expect(page).to_have_url(re.compile(f"[?&]in={name}\\b"))
    page.reload()
    assert page.locator("#step-2 [data-row=theta_hat_dot] .lead:visible").get_attribute("data-lead") == name
    page.context.close()


def test_term_points_at_the_statement_that_answers_it(page: Page) -> None:
    page.locator("#step-2 tr[data-by=u]").first.hover()
    assert page.locator("#step-2 .statement.lit").get_attribute("data-row") == "u"


def test_symbol_lights_up_everywhere_with_its_meaning(page: Page) -> None:
    page.locator("#step-2 .equation [data-symbol=tau2]").first.hover()
    lit = page.evaluate("[...document.querySelectorAll('.lit[data-symbol]')].map((place) => place.dataset.symbol)")
    assert set(lit) == {"tau2"} and len(lit) == page.locator("[data-symbol=tau2]").count() > 2 * len(PORTS)
    assert page.locator("#meaning").inner_text().endswith("tuning function (7)")
    page.keyboard.press("Escape")
    assert not page.locator("#meaning").is_visible() and page.locator(".lit[data-symbol]").count() == 0
    page.mouse.move(0, 0)
    page.locator("#symbols button[data-symbol=phi]").focus()
    assert "regressor" in page.locator("#meaning").inner_text()
    page.keyboard.press("Escape")


def test_section_that_is_cited_says_what_it_holds(page: Page) -> None:
    box = page.locator("#meaning")
    page.locator("#why-title small").hover()
    held = {f"({n})": f"{section}: {section.words}" for section in SECTIONS for n in section.numbers}
    assert box.inner_text() == "\n".join(held[number] for number in ("(9)", "(16)", "(17)"))
    page.keyboard.press("Escape")
    assert not box.is_visible()
    summary = page.locator("#exercise-half-step summary")
    summary.evaluate("(summary) => summary.focus({ focusVisible: true })")
    assert box.inner_text() == held["(11)"] == held["(14)"]
    page.keyboard.press("Enter")
    assert not box.is_visible() and page.locator("#exercise-half-step .diff").first.is_visible()
    page.keyboard.press("Enter")
    page.locator("#part-controller .whole > summary").click()
    assert not box.is_visible(), "a click opens, and covers nothing"
    page.locator("#part-controller .code b:visible", has_text="(5)").first.hover()
    assert box.inner_text() == held["(5)"]
    page.locator("#step-1-title small").hover(position={"x": 1, "y": 1})
    assert "as if it were" not in box.inner_text()
    page.locator("#part-controller .whole > summary").click()
    page.mouse.move(0, 0)


def test_symbol_lights_up_in_captions_legends_curves_and_at_the_axis(page: Page) -> None:
    page.locator("#trajectories [data-signal=theta_hat] .u-axis").last.hover()
    places = [
        "#trajectories [data-signal=theta_hat] figcaption",  # captions
        "#playground [data-drawing=estimates] figcaption",
        "#first .key",  # a legend
        "#question-1 summary",  # words
        "#step-1 .equation",
    ]
    assert all(page.locator(f"{place} [data-symbol=theta_hat].lit").count() for place in places)
    assert page.locator("#first path.lit").get_attribute("data-symbol") == "theta_hat"
    assert page.locator("#meaning .katex").count() == 2, "the meaning names theta, and is typeset"
    strip = "(axis) => getComputedStyle(axis, '::before').backgroundColor"
    axes = [page.locator(f"#trajectories [data-signal={signal}] .u-axis").last for signal in ("theta_hat", "x2")]
    assert len({axis.evaluate(strip) for axis in axes}) == 2, "its axis alone lights up"
    page.keyboard.press("Escape")
    page.mouse.move(0, 0)


def test_search_goes_to_a_statement_and_keys_choose_languages(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (1440, 900, "light"))
    page = other.page
    page.keyboard.press("/")
    page.keyboard.type("nothing of the kind")
    assert page.locator("#search output").inner_text() == "Nothing of that name."
    page.locator("#search input").fill("tuning tau2")
    assert page.locator("#search li").first.inner_text() == "tuning function statement tau2"
    page.keyboard.press("Enter")
    assert page.url.endswith("#row-tau2") and 0 < top(page, "#row-tau2") < 200
    assert not page.locator("#search").is_visible()
    for digit in ("1", "2"):
        page.keyboard.press(digit)
    shown = page.locator("#code [data-code][aria-pressed=true]")
    assert shown.evaluate_all("(buttons) => buttons.map((b) => b.dataset.code)") == [n for n in SIX if n in PORTS][:2]
    page.keyboard.press("0")
    assert shown.count() == len(PORTS)
    page.evaluate("document.querySelector('#step-1').scrollIntoView()")
    page.keyboard.press("n")
    assert 0 < top(page, "#step-2") < 200
    page.keyboard.press("p")
    assert 0 < top(page, "#step-1") < 200
    page.keyboard.press("2")
    second = page.locator("#derivation [data-choose-lead]").nth(1).inner_text()
    assert page.locator("#derivation [data-choose-lead][aria-pressed=true]").inner_text() == second
    assert other.complaints == []
    page.context.close()


def test_search_has_what_is_there_and_the_phrase_first_on_a_phone_too(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, NARROW_DARK)
    page = other.page
    page.locator("#open-search").click()
    field, found = page.locator("#search input"), page.locator("#search li")
    for words, answer in {"(16)": "(16): common", "section 12": "(10) to (14)", "Barbalat": "Theorem"}.items():
        field.fill(words)
        assert found.first.inner_text().startswith(answer)
    field.fill("excitation")
    assert "Why the estimate need not converge" in " ".join(found.all_inner_texts())
    field.fill("tuning function Java MATLAB")  # which every row has
    assert found.first.inner_text().startswith("tuning function")
    field.fill("gamma")
    assert "What the gains do" in " ".join(found.all_inner_texts())
    field.fill("nowhere")
    assert found.count() == 0 and page.locator("#search output").inner_text() == "Nothing of that name."
    field.fill("6 problem")
    assert found.count() > 2
    field.fill("problem 6")
    assert found.first.inner_text().startswith("Problem 6")
    hidden = page.locator("#playground .changed h3").first.text_content() or ""
    field.fill(hidden)
    assert "Playground" not in " ".join(found.all_inner_texts())
    page.keyboard.press("Escape")
    assert not page.locator("#search").is_visible()
    page.locator("#open-search").click()
    field.fill("four times k1")
    page.keyboard.press("Enter")
    question = page.locator("#question-4")
    expect(question).to_have_attribute("open", "")
    question.get_by_role("link", name="See it.").click()
    expect(page.locator("#playground .budget .plot")).to_be_in_viewport(ratio=0.9)
    assert other.complaints == []
    page.context.close()


def test_tab_stops_are_few_and_targets_large_enough(page: Page) -> None:
    stops = page.evaluate(
        """() => Object.fromEntries([...document.querySelectorAll("nav, header, main > section")].map((part) => {
          const found = [...part.querySelectorAll("a, button, input, summary, [tabindex]")]
            .filter((e) => e.tabIndex >= 0 && e.checkVisibility() && !e.matches("[type=radio]:not(:checked)"));
          return [part.id || part.tagName, found.length];
        }))"""
    )
    assert sum(stops.values()) - stops["exercises"] - stops["verdict"] < 72, stops
    assert stops["trajectories"] < 10 and stops["code"] < 20, stops
    small = page.evaluate(
        """() => [...document.querySelectorAll("a, button, input, summary")]
          .filter((e) => e.checkVisibility() && !e.closest("p, td, label, figcaption, footer, .skip")).filter((e) => {
            const { width, height } = e.getBoundingClientRect();
            return Math.min(width, height) < 23.5;
          }).map((e) => e.outerHTML.slice(0, 80))"""
    )
    assert small == []


LAND = """(link) => new Promise((done) => {
  document.addEventListener("scrollend", done, { once: true });
  setTimeout(done, 3000);
  link.click();
})"""


@pytest.mark.parametrize("motion", ["reduce", "no-preference"])
def test_links_land_on_their_target(browser: Browser, report: Path, motion: Literal["reduce", "no-preference"]) -> None:
    other = open_page(browser, report, motion=motion)
    page = other.page
    links = ["#derivation", "#trajectories", "#verdict", "#code", "#row-tau2", "#part-report", "#step-2", "#exercises"]
    for target in links:
        page.locator(f"a[href='{target}']").first.evaluate(LAND)
        end = page.evaluate("scrollY + innerHeight >= document.documentElement.scrollHeight - 2")
        assert 0 <= top(page, target) <= 200 or end, (target, top(page, target))
    page.context.close()


def test_link_lands_before_the_page_is_laid_out(browser: Browser, report: Path) -> None:
    page = open_page(browser, report, motion="no-preference", laid_out=False).page
    found = page.evaluate(
        f"""async () => {{
          const unlaid = {UNLAID};
          await ({LAND})(document.querySelector("nav a[href='#exercises']"));
          return unlaid;
        }}"""
    )
    assert found
    assert not page.evaluate(UNLAID)
    assert 0 <= top(page, "#exercises") <= 200
    page.context.close()


def test_address_of_a_part_is_laid_out_as_it_comes(browser: Browser, report: Path) -> None:
    page = browser.new_page(viewport={"width": 1440, "height": 900}, reduced_motion="reduce")
    page.goto(f"{report.as_uri()}#row-tau2")
    assert not page.evaluate(UNLAID)
    assert 0 <= top(page, "#row-tau2") <= 200
    page.close()


def test_page_that_is_loaded_again_keeps_its_place(browser: Browser, report: Path) -> None:
    page = open_page(browser, report).page
    page.locator("#row-tau2").evaluate("(row) => row.scrollIntoView()")
    before = top(page, "#row-tau2")
    page.wait_for_timeout(500)  # in which the browser notes where the page stands
    page.reload()
    assert not page.evaluate(UNLAID)
    assert abs(top(page, "#row-tau2") - before) < 50
    page.context.close()


def test_page_without_script_shows_derivation_and_code(browser: Browser, report: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(report.as_uri())
    assert page.locator("#step-2 [data-row=u] .lead:visible").count() == 1
    assert page.locator("#row-tau2 .cell-code:visible").count() == len(PORTS)
    assert page.locator("#first svg.still:visible").count() == 3
    context.close()


# ---- Charts by hand ----


def times_drawn(page: Page) -> list[float]:
    return [float(page.locator(end).input_value()) for end in ("#from", "#to")]


def test_chart_is_read_and_zoomed_by_keys(page: Page) -> None:
    plot = page.locator("#trajectories [data-signal=x1] .plot")
    plot.focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert re.fullmatch(r"t = 0\.20 s: .*", plot.get_attribute("aria-valuetext") or "")
    assert plot.get_attribute("aria-valuetext") == page.locator("#trajectories [data-signal=x1] .readout").inner_text()
    page.keyboard.press("+")
    assert times_drawn(page)[1] < 11
    page.keyboard.press("0")
    assert times_drawn(page) == [0, float(LESSON.horizon)]
    page.keyboard.press("ArrowDown")
    focused = "document.activeElement.closest('.chart')?.dataset.signal"
    assert page.evaluate(focused) == "x2" and page.locator("#trajectories .plot[tabindex='0']").count() == 1
    assert page.evaluate("document.activeElement.role") == "slider"
    page.keyboard.press("ArrowUp")
    assert page.evaluate(focused) == "x1"


def test_error_at_the_pointer_is_the_largest_of_its_span(page: Page) -> None:
    """Also where the end of the span is nearer than its start."""
    port, solution = next(iter(PORTS.values())), exact(LESSON)
    chart = page.locator("#trajectories [data-signal=error_x1]")
    chart.scroll_into_view_if_needed()
    box = box_of(chart.locator(".u-over"))
    page.mouse.move(box["x"] + 0.545 * box["width"], box["y"] + 20)
    named = rf"(?:.*, )?(?:{re.escape(port.language)} )?"
    pattern = rf"t = (\S+) to (\S+) s, at most: {named}([\d.]+)e\N{{MINUS SIGN}}(\d+)"
    read = re.match(pattern, chart.locator(".readout").inner_text())
    assert read
    start, end, figure = float(read[1]), float(read[2]), float(read[3]) * 10 ** -int(read[4])
    trajectory = trajectory_of(port)
    off = np.abs(trajectory.states[0] - solution.evaluate(trajectory.t)[0])
    assert start < 0.545 * float(LESSON.horizon) < end
    assert figure == pytest.approx(off[(trajectory.t >= start) & (trajectory.t < end)].max(), rel=0.01)


def test_two_fingers_zoom_a_chart(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, NARROW_DARK)
    show_charts(other.page.locator("#trajectories [data-signal=x1]"))
    box = box_of(other.page.locator("#trajectories [data-signal=x1] .u-over"))
    session = other.page.context.new_cdp_session(other.page)

    def touch(kind: str, *shares: float) -> None:
        y = box["y"] + box["height"] / 2
        fingers = [{"x": box["x"] + s * box["width"], "y": y, "id": i} for i, s in enumerate(shares)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    touch("touchStart", 0.4)
    touch("touchStart", 0.4, 0.6)
    for apart in (0.15, 0.2, 0.3):
        touch("touchMove", 0.5 - apart, 0.5 + apart)
    touch("touchEnd")
    drawn(other.page)
    start, end = times_drawn(other.page)
    assert 0 < start < end < float(LESSON.horizon) and end - start == pytest.approx(float(LESSON.horizon) / 3, rel=0.1)
    other.page.context.close()


@pytest.mark.skipif(len(PORTS) < len(SIX), reason="PORTS leaves out some")
def test_legend_says_which_programs_lie_on_one_another(page: Page) -> None:
    assert page.locator("#trajectories [data-signal=x1] .key").all_inner_texts() == ["r", "exact", "all 6 on one line"]
    keys = page.locator("#trajectories [data-signal=error_x1] .key").all_inner_texts()
    assert keys[0] == "tolerance, same colour" and "C++, Java on one line" in keys and len(keys) > 3


def test_exact_solution_is_seen_in_the_band_of_the_programs(page: Page) -> None:
    """In most columns of pixels, ink that is darker than what is two pixels above and below it."""
    show_charts(page.locator("#trajectories [data-signal=x1]"))
    share = page.evaluate(
        """() => {
          const canvas = document.querySelector("#trajectories [data-signal=x1] canvas"), { width, height } = canvas;
          const points = canvas.getContext("2d").getImageData(0, 0, width, height).data;
          const at = (x, y, i) => points[4 * (y * width + x) + i];
          const band = (x, y) => at(x, y, 3) > 150 && at(x, y, 2) - at(x, y, 0) > 90;
          const line = (x, y) => at(x, y, 3) > 150 && at(x, y, 2) < 110 && at(x, y, 0) < 60;
          const among = (x) => [...Array(height).keys()].some((y) => y > 2 && y < height - 3
            && line(x, y) && band(x, y - 2) && band(x, y + 2));
          return [...Array(width).keys()].filter(among).length / width;
        }"""
    )
    assert share > 0.5


TOO_SMALL = """() => [...document.querySelectorAll("#trajectories, #exercises, #playground")].flatMap((part) =>
  [...part.querySelectorAll("button, input, summary")].filter((e) => e.checkVisibility())
    .map((e) => [e, (e.closest("label") ?? e).getBoundingClientRect()])
    .filter(([, box]) => box.width < 24 || box.height < 24).map(([e]) => e.outerHTML.slice(0, 80)))"""


def test_targets_are_large_enough_for_a_finger(page: Page) -> None:
    assert page.evaluate(TOO_SMALL) == []
    style = page.add_style_tag(content="#playground .keep { min-height: 0; height: 20px; padding: 0 }")
    assert len(page.evaluate(TOO_SMALL)) == 1
    style.evaluate("(style) => style.remove()")


# ---- Without script, and on paper ----


def test_charts_and_answers_are_there_without_script_and_on_paper(browser: Browser, report: Path, page: Page) -> None:
    plain = browser.new_context(java_script_enabled=False)
    bare = plain.new_page()
    bare.goto(report.as_uri())
    stills = bare.locator("#trajectories .still, #playground .still")
    assert stills.count() == bare.locator("#trajectories .chart, #playground .chart").count() > 10
    assert all(still.is_visible() for still in stills.all())
    assert bare.locator("#playground noscript p").is_visible() and not bare.locator("[name=k1]").is_visible()
    plain.close()
    page.emulate_media(media="print")
    assert page.locator("#trajectories .still").first.is_visible()
    assert not page.locator("#trajectories .uplot").first.is_visible()
    page.emulate_media(media="screen")
    assert not page.locator("#trajectories .still").first.is_visible()


ON_PAPER = {  # what is there, and what is not
    ".whole pre": True,
    ".questions details p": True,
    ".exercise pre": True,
    "#verdict .cell:not(.self) .figure": True,
    ".playground .chart .still": True,
    ".hint": False,
    ".inspector": False,
    "main button:not(.cell, #symbols *)": False,
    ".look a": False,
}
WITHIN = """(pictures) => pictures.every((picture) => {
  const { left, right } = picture.getBoundingClientRect();
  return left >= 0 && right <= innerWidth;
})"""


def test_paper_has_what_is_folded_away_and_no_hint_for_the_hand(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, (720, 1000, "light"))  # about as wide as a sheet
    page = other.page
    assert not page.locator(".whole pre").first.is_visible() and page.locator(".hint").first.is_visible()
    page.emulate_media(media="print")
    for places, there in ON_PAPER.items():
        assert page.locator(places).count(), places
        seen = [place.is_visible() for place in page.locator(places).all()]
        assert all(seen) if there else not any(seen), places
    assert page.locator(".playground .still").evaluate_all(WITHIN), "charts beyond the edge of the sheet"
    page.context.close()


# ---- Exercises ----


def test_exercise_opens_with_its_curves_and_its_diffs(page: Page) -> None:
    name = next(iter(read_variants()))
    details = page.locator(f"#exercise-{name}")
    details.locator("summary").click()
    assert details.locator(".diff").first.is_visible()
    show_charts(details.locator(".chart"))


def test_address_opens_an_exercise(page: Page) -> None:
    details = page.locator("#exercise-problem-6")
    page.evaluate("location.hash = '#exercise-problem-6'")
    expect(details.locator(".diff").first).to_be_visible()
    expect(details).to_be_in_viewport()


def test_mistake_is_played_from_its_exercise(page: Page) -> None:
    page.evaluate("location.hash = '#exercise-half-done-problem-6'")
    page.locator("#exercise-half-done-problem-6 .play").click()
    expect(page.locator("#playground [value=half-done-problem-6]")).to_be_checked()
    assert page.evaluate("playground.figures().settled") is None


def test_missing_excitation_is_played_from_the_derivation(page: Page) -> None:
    page.locator("#derivation [data-play]").click()
    assert page.locator("#playground [data-start=no_excitation]").get_attribute("aria-pressed") == "true"
    assert page.evaluate("playground.figures().estimate") == pytest.approx(2.777, abs=0.001)
    page.locator("#playground [data-start=Chapter17_Lesson1]").click()


# ---- Playground ----


def told(page: Page, where: str = "#playground") -> str:
    """What the page says of a run, as it is seen."""
    text: str = page.locator(f"{where} .outcome").evaluate(
        """(place) => {
          const copy = place.cloneNode(true);
          for (const unseen of copy.querySelectorAll(".katex-mathml")) unseen.remove();
          return copy.textContent.replaceAll("\u200b", "");
        }"""
    )
    return text


def start(page: Page, name: str, mistake: str = "", **constants: float) -> None:
    page.evaluate("(to) => playground.set(to)", {"start": name, "mistake": mistake, "constants": constants})
    drawn(page)


def write_csv(page: Page, path: Path) -> Path:
    path.write_text(page.evaluate("playground.csv()"))
    return path


@pytest.mark.parametrize("experiment", [LESSON, NO_EXCITATION, PROBLEM_6], ids=lambda experiment: experiment.name)
def test_playground_passes_every_check(page: Page, experiment: Experiment, tmp_path: Path) -> None:
    page.locator(f"#playground [data-start={experiment.name}]").click()
    verdict = judge_file(write_csv(page, tmp_path / "playground.csv"), experiment)
    assert verdict.conforms, verdict.reason


def test_mistake_in_the_playground_is_refused_and_shows_its_code(page: Page, tmp_path: Path) -> None:
    titles = playground(exact(LESSON), read_variants().values()).titles
    mistakes = [name for name, variant in titles.items() if variant.experiment.reference == LESSON.reference]
    assert len(mistakes) > 3
    changed = page.locator("#playground .changed:visible")
    for mistake in mistakes:
        page.locator("#playground [data-start=Chapter17_Lesson1]").click()
        page.locator(f"input[name=mistake][value={mistake}]").check()
        verdict = judge_file(write_csv(page, tmp_path / "playground.csv"), LESSON)
        assert not verdict.conforms, mistake
        assert changed.count() == 1 and changed.locator(".added, .removed").count() >= 2
        assert "do not add up to V(0): the theorem" in told(page), mistake


def test_start_clears_a_mistake(page: Page) -> None:
    page.locator("input[name=mistake][value=sign-in-tau2]").check()
    page.locator("#playground [data-start=Chapter17_Lesson1]").click()
    assert page.locator("input[name=mistake][value='']").is_checked()
    assert page.locator("#playground .changed:visible").count() == 0
    assert re.fullmatch(r"At 20 s: z1 = .2\.69e.9, .*V and what is dissipated add up to V\(0\)\.", told(page))


@pytest.mark.parametrize("i", range(len(QUESTIONS)))
def test_question_sets_what_its_answer_speaks_of(page: Page, i: int) -> None:
    asked = QUESTIONS[i]
    page.locator(f"[data-question='{i}'] summary").click()
    drawn(page)
    assert page.locator(f"[data-question='{i}'] .look").is_visible()
    found = page.evaluate("playground.figures()")
    for name, value in asked.figures.items():
        assert found[name] == pytest.approx(value, rel=0.006, abs=0.006), name


def test_address_of_a_question_sets_what_it_speaks_of(browser: Browser, report: Path) -> None:
    page = browser.new_page()
    for _ in range(3):  # whatever the browser does first
        page.goto("about:blank")
        page.goto(f"{report.as_uri()}#question-2")
        expect(page.locator("#question-2")).to_have_attribute("open", "")
        expect(page).to_have_url(re.compile(r"[?&]gamma=30\b"))
        rows = page.locator("#playground .runs tbody th").all_inner_texts()
        assert [row.split(",")[0] for row in rows] == ["this run: the lesson", "the run before: the lesson"]
    page.close()


def test_sliders_move_the_curves_and_keep_the_zoom_and_the_run_before(page: Page) -> None:
    start(page, "Chapter17_Lesson1")
    plot = page.locator("#playground [data-drawing=errors] .plot")
    plot.focus()
    page.keyboard.press("Home")
    page.keyboard.press("+")
    page.keyboard.press("+")
    zoomed = plot.get_attribute("aria-valuenow")
    charts = [f"[data-drawing={name}]" for name in ("errors", "estimates", "budget", "control", "rate", "logarithm")]
    before = [pictured(page, chart) for chart in charts]
    page.locator("#playground input[name=k1]").press("ArrowRight")
    drawn(page)
    assert all(pictured(page, chart) != one for chart, one in zip(charts, before, strict=True))
    expect(page).to_have_url(re.compile(r"[?&]pt=0%7E5\b"))
    assert zoomed is not None
    rows = page.locator("#playground .runs tbody th").all_inner_texts()
    assert [row.split(":")[0] for row in rows] == ["this run", "the run before"]
    page.locator("#playground .keep").click()
    start(page, "problem_6")
    rows = page.locator("#playground .runs tbody th").all_inner_texts()
    assert len(rows) == 3 and rows[2].startswith("kept: the lesson, k₁ = 2.0")
    page.get_by_role("button", name="Let go").click()
    page.locator("#playground .whole").click()


def test_first_screen_is_alive(browser: Browser, report: Path) -> None:
    other = open_page(browser, report)
    page, slider = other.page, other.page.locator("#first input[name=theta_true]")
    assert page.locator("#first svg.still:visible").count() == 3
    slider.press("ArrowRight")
    expect(page.locator("#first canvas")).to_have_count(3)
    assert page.locator("#first svg.still:visible").count() == 0
    assert "= 1.230, " in told(page, "#first"), "what the estimate has found"
    grey = """() => [...document.querySelectorAll("#first canvas")].map((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return data.some((_, i) => i % 4 === 0 && data[i] === 154 && data[i + 1] === 161 && data[i + 2] === 170);
    })"""
    assert any(page.evaluate(grey)), "the run before stays as a grey line"
    expect(page).to_have_url(re.compile(r"[?&]theta_true=1\.23\b"))
    assert page.locator("#playground input[name=theta_true]").input_value() == slider.input_value()
    linked = browser.new_page()
    linked.goto(page.url)
    expect(linked.locator("#first canvas")).to_have_count(3)
    linked.locator("#first .start").click()
    expect(linked).not_to_have_url(re.compile("theta_true"))
    assert "= 1.200, " in told(linked, "#first")
    assert other.complaints == []
    linked.close()
    page.context.close()


def pictured(page: Page, chart: str) -> str:
    return str(page.evaluate("(c) => document.querySelector(c + ' canvas').toDataURL()", f"#playground {chart}"))


def test_address_keeps_what_is_set(browser: Browser, report: Path, page: Page) -> None:
    start(page, "problem_6", "no-reference-rate", gamma=30)
    expect(page).to_have_url(re.compile("no-reference-rate"))
    query = page.evaluate("location.search")
    other = browser.new_page()
    other.goto(report.as_uri() + query)
    show_charts(other.locator("#playground .budget"))
    figures = [each.evaluate("playground.figures()") for each in (page, other)]
    assert figures[0] == figures[1]
    other.goto(report.as_uri() + "?gamma=nonsense&start=nowhere&mistake=none&pt=9~3&t=x~y")
    show_charts(other.locator("#playground .budget"))
    assert other.evaluate("playground.figures().max_u") == pytest.approx(25.9, rel=0.01)
    other.close()


def test_blow_up_is_drawn_as_far_as_it_goes_and_told(page: Page) -> None:
    start(page, "Chapter17_Lesson1", "sine-of-x2")
    assert "The integration fails after 0.46 s" in told(page)
    inked = """(chart) => {
      const canvas = document.querySelector(`#playground ${chart} canvas`), {width, height} = canvas;
      const points = canvas.getContext("2d").getImageData(0, 0, width, height).data;
      const blue = (x, y) => points[4 * (y * width + x) + 2] > 150 && points[4 * (y * width + x)] < 60;
      return [...Array(width).keys()].filter((x) => [...Array(height).keys()].some((y) => blue(x, y))).length / width;
    }"""
    assert page.evaluate(inked, "[data-drawing=output]") > 0.4
    start(page, "Chapter17_Lesson1")


def test_figures_of_the_checks_are_read_on_a_phone(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, NARROW_DARK)
    table = other.page.locator("#checks + .inspected .scroll")
    last, head = table.locator("tbody tr").first.locator(".figure").last, table.locator("tbody th").first
    table.evaluate("(table) => { table.scrollIntoView(); table.scrollLeft = table.scrollWidth; }")
    expect(last).to_be_in_viewport()
    assert float(last.inner_text()) >= 0
    assert box_of(head)["x"] == pytest.approx(box_of(table)["x"], abs=3), "the claim stays beside it"
    assert other.page.evaluate("document.documentElement.scrollWidth") == NARROW_DARK[0]
    other.page.context.close()


def test_slider_and_curve_share_a_phones_screen(browser: Browser, report: Path) -> None:
    other = open_page(browser, report, NARROW_DARK)
    for name in ("theta_true", "theta_hat_start"):
        other.page.locator(f"#playground input[name={name}]").scroll_into_view_if_needed()
        other.page.locator(f"#playground input[name={name}]").focus()
        expect(other.page.locator("#playground .budget .plot")).to_be_in_viewport(ratio=0.9)
    other.page.context.close()
