# SPDX-License-Identifier: MIT
"""Experiment files: what is read is what stands there; what is wrong is shown at its place, and nothing can hang."""

import os
import random
import time
from contextlib import suppress
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conformance.programs.ports import ROOT
from conformance.theory import admission
from conformance.theory.experiment_file import read_experiment, to_toml
from conformance.theory.experiments import camel, refused_name
from conformance.theory.expressions import text
from conformance.theory.faults import FileFault
from conformance.theory.strict_feedback import Rule
from conformance.theory.symbolic import form_of, reference_of

BAD = Path(__file__).parent / "bad"
BAD_FILES = sorted(BAD.glob("*.toml"))
PLANTS = sorted((ROOT / "plants").glob("*.toml"))
LESSON = ROOT / "plants" / "Chapter17_Lesson1.toml"


def message(path: Path) -> str:
    with pytest.raises(FileFault) as refused:
        read_experiment(path)
    return str(refused.value).replace(f"{path.parent}{os.sep}", "")


# ------------------------------------------------------------------ files that are wrong


@pytest.mark.parametrize("path", BAD_FILES, ids=lambda path: path.stem)
def test_a_bad_file_is_refused_with_the_message_beside_it(path: Path) -> None:
    assert message(path) + "\n" == path.with_suffix(".expected").read_text()


def test_the_folder_of_bad_files_is_whole() -> None:
    assert len(BAD_FILES) > 50
    assert {path.stem for path in BAD_FILES} == {path.stem for path in BAD.glob("*.expected")}


UNREACHABLE = {Rule.HIDDEN_STATE, Rule.UNDECLARED_SYMBOL, Rule.TIME_VARYING_ROW, Rule.GAIN_SIGN_UNKNOWN} | {
    Rule.TIME_VARYING_PARAMETER,
    Rule.UNMODELLED_SIGNAL,
}  # no file can say a hidden state, and all constants have values; the others are refused by name before


def test_every_rule_of_the_classification_has_a_bad_file() -> None:
    from conformance.theory.admission import REMEDIES

    shown = "".join(path.read_text() for path in BAD.glob("*.expected"))
    assert [rule for rule in Rule if rule not in UNREACHABLE and REMEDIES[rule] not in shown] == []
    for words in ("varies with time", "depends on the time", "is not declared"):
        assert words in shown


def test_what_is_no_small_file_is_refused_at_once(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    large, wide, deep = (tmp_path / name for name in ("large.toml", "wide.toml", "deep.toml"))
    large.write_text("# line\n" * 10_000)
    wide.write_text(f"title = '{'a' * 2000}'\n")
    deep.write_text("title = " + "[\n" * 15_000)
    dotted = tmp_path / "dotted.toml"
    dotted.write_text("a." * 15_000 + "a = 1\n")
    assert "pipe" in message(pipe) and "folder" in message(tmp_path)
    assert "no such file" in message(tmp_path / "none.toml")
    assert "more than" in message(large) and "characters" in message(wide) and "characters" in message(dotted)
    assert "nested" in message(deep)


def test_a_file_of_the_worst_kind_is_refused_within_a_second(tmp_path: Path) -> None:
    worst = LESSON.read_text().replace(
        '"u"', '"u + ' + "(" * 20 + "((x1 + x2)^20 + (x1^19 - x2)^20)^20" + ")" * 20 + '"'
    )
    path = tmp_path / "worst.toml"
    path.write_text(worst)
    started = time.process_time()
    message(path)
    assert time.process_time() - started < 1


def test_a_plant_that_takes_too_long_to_classify_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def forever(plant: object) -> None:
        while True:
            with suppress(Exception):
                sum(range(1000))

    monkeypatch.setattr(admission, "classify", forever)
    monkeypatch.setattr(admission, "LONGEST_TIME", 0.2)
    assert "takes more than 0.2 s" in message(LESSON)
    monkeypatch.undo()
    read_experiment(LESSON)


# ------------------------------------------------------------------ files that are right


def test_the_lesson_is_what_its_file_says() -> None:
    lesson = read_experiment(LESSON)
    assert lesson.name == "Chapter17_Lesson1" and lesson.states == ("x1", "x2") and lesson.estimates == ("theta_hat",)
    assert list(map(text, lesson.rows)) == ["x2 + theta * x1", "u"]
    assert lesson.k == (2, Fraction("2.5")) and lesson.Gamma == ((3,),) and lesson.horizon == 20
    assert lesson.start == (Fraction("1.2"), Fraction("-0.5")) and lesson.unknown[0].true == Fraction("1.2")
    assert str(reference_of(lesson)) == "sin(7*t/10)/2"


def test_a_file_extends_another_and_says_only_what_differs() -> None:
    lesson, problem_6 = read_experiment(LESSON), read_experiment(LESSON.with_name("problem_6.toml"))
    assert problem_6.rows == lesson.rows and problem_6.k == lesson.k and problem_6.unknown == lesson.unknown
    assert str(reference_of(problem_6)) == "2*cos(t/2)/5" and problem_6.name == "problem_6"
    assert problem_6.facts != lesson.facts and (lesson.section, problem_6.section) == ("(15)", "")


@pytest.mark.parametrize("path", PLANTS, ids=lambda path: path.stem)
def test_an_experiment_is_written_and_read_back(path: Path, tmp_path: Path) -> None:
    experiment = read_experiment(path)
    assert experiment.name == path.stem
    copy = tmp_path / path.name
    copy.write_text(to_toml(experiment))
    assert read_experiment(copy) == experiment


def test_there_are_plants_of_every_kind() -> None:
    plants = [read_experiment(path) for path in PLANTS]
    assert {len(e.states) for e in plants} >= {1, 2, 3, 4} and {len(e.unknown) for e in plants} >= {0, 1, 2, 5}
    assert any(g.is_number and g < 0 for e in plants for g in form_of(e).g)
    assert any(row[j] for e in plants for i, row in enumerate(e.Gamma) for j in range(len(row)) if i != j)


FREE = ("x1", "angle", "K_B", "lambda", "beta", "end", "R", "tau", "i", "v")
OURS = (
    "u", "t", "r", "r_dot", "z1", "alpha2", "tau_2", "thetaHat", "theta_hat", "phi", "phi_1", "gamma", "k1", "x1_dot",
    "x1_start", "w2_1", "V",
)  # fmt: skip
NONE = ("sin", "x__1", "_x", "x_", "1x", "é", "x-1", "")


@pytest.mark.parametrize("name", FREE + OURS + NONE)
def test_names_of_the_design_are_refused_and_those_of_languages_are_not(name: str) -> None:
    assert (refused_name(name) is None) == (name in FREE)


def test_camel_case_is_that_of_the_lesson() -> None:
    assert [camel(n) for n in ("theta_hat", "r_ddot", "alpha1_x1", "alpha1_dot_known")] == [
        "thetaHat", "rDDot", "alpha1X1", "alpha1DotKnown",
    ]  # fmt: skip


# ------------------------------------------------------------------ files at random


@settings(max_examples=60, deadline=None)
@given(whole=st.sampled_from(PLANTS), seed=st.integers(0, 2**32))
def test_a_damaged_file_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, whole: Path, seed: int) -> None:
    path = tmp_path_factory.mktemp("damaged") / "plant.toml"
    path.write_bytes(damaged(whole.read_bytes(), random.Random(seed)))
    read_or_refuse(path)


def read_or_refuse(path: Path) -> bool:
    """True if a file is read; False if it is refused with a message that has a place and a remedy."""
    try:
        read_experiment(path)
    except FileFault as refused:
        assert all(fault.sentence and fault.remedy for fault in refused.faults)
        assert all(line.isprintable() for line in str(refused).splitlines())
        return False
    return True


WORDS = ("1e999", "^20", "x1", "theta", "sin(", "[[fact]]", "-x1^-1", "k1", "extends = 'problem_6.toml'\n")
PIECES = (*"()^*/+-'\"=[],.9ut#|\0\xe9\n", *WORDS)


def damaged(content: bytes, source: random.Random) -> bytes:
    """A few pieces cut, copied, and put in."""
    copy = bytearray(content)
    for _ in range(source.randint(1, 4)):
        at, gone = source.randrange(len(copy) + 1), source.choice((0, 0, 1, 1, 5, 60))
        piece = (
            source.choice(PIECES).encode("latin-1") if source.random() < 0.8 else bytes(copy[at // 2 : at // 2 + 30])
        )
        copy[at : at + gone] = piece
    return bytes(copy)
