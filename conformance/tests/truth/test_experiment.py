# SPDX-License-Identifier: MIT
"""The truth of the lesson's experiment, through the derived closed loop: no formula of the lesson stands here."""

import io
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from flint import arb

from conformance.programs.ports import ROOT
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.truth import cache
from conformance.truth.exact import Exact, exact, packed
from conformance.truth.experiment import loop_of, problem, truth
from conformance.truth.functions import module
from conformance.truth.piecewise import Table
from conformance.truth.taylor import precision
from conformance.truth.truth import Enclosure, ball_function, enclose

POINTS = {  # lesson (10), 15 significant digits of x1, x2, theta_hat
    "0.1": ("1.17342048378473", "-2.96869266344466", "1.87081572148824"),
    "0.5": ("0.291281352221132", "-1.3840585242084", "2.12499724390726"),
    "2": ("0.448120205499685", "-0.355976931611338", "1.14692101257012"),
    "10": ("0.328478949459429", "-0.130333573188115", "1.20008581890017"),
    "20": ("0.495303675161773", "-0.546506377914894", "1.1999999977729"),
}


@pytest.mark.parametrize("time", POINTS)
def test_truth_meets_the_lessons_reference_points(time: str) -> None:
    for ball, printed in zip(truth(LESSON).at(time)[:3], POINTS[time], strict=True):
        unit = Fraction(1, 10 ** len(printed.split(".")[1]))
        assert abs(ball - arb(printed)) < arb(float(unit)), (time, printed)


def test_radius_is_at_most_1e_18_at_every_time() -> None:
    assert truth(LESSON).largest_radius <= 1e-18


def test_error_of_the_doubles_is_at_most_1e_15_of_each_states_scale() -> None:
    assert (truth(LESSON).bound[:3] <= 1e-15 * truth(LESSON).scale[:3]).all()


def lyapunov_function(time: Fraction) -> arb:
    V = ball_function(problem(LESSON), [loop_of(LESSON).V])
    return V(time, truth(LESSON).at(time))[0]


@pytest.fixture(scope="module")
def dissipated() -> Enclosure:
    """The closed loop with the integral of k1 z1^2 + k2 z2^2 as a fourth state, which no formula of V enters."""
    three, loop = problem(LESSON), loop_of(LESSON)
    dissipation = loop.dissipation
    states, rhs = (*three.states, sp.Symbol("dissipated")), (*three.rhs, dissipation)
    return enclose(replace(three, states=states, rhs=rhs, start=(*three.start, sp.S.Zero)))


@pytest.mark.parametrize("time", ["0.05", "0.1", "1/3", "7", "20"])
def test_lyapunov_function_falls_by_what_is_dissipated(time: str, dissipated: Enclosure) -> None:
    with precision(256):
        fallen = lyapunov_function(Fraction(0)) - lyapunov_function(Fraction(time))
        integral = dissipated.at(time)[3]
        assert fallen.contains(integral.mid()) and integral.contains(fallen.mid())
        assert fallen.rad() < 1e-17


def test_lyapunov_function_starts_at_the_lessons_value() -> None:
    assert abs(exact(LESSON).lyapunov(np.zeros(1), exact(LESSON).evaluate(np.zeros(1)))[0] - 2.16125) < 1e-14


def test_derivatives_of_the_field_are_those_of_the_solution() -> None:
    h, t = 1e-3, np.linspace(0.1, 19.9, 500)
    lesson = exact(LESSON)
    before, at, after = (lesson.evaluate(t + s) for s in (-h, 0.0, h))
    second = (after - 2 * at + before) / h**2
    assert np.allclose((after - before) / (2 * h), lesson.first(t, at), rtol=1e-3, atol=1e-2)
    assert np.allclose(second, lesson.second(t, at), rtol=1e-3, atol=1e-1)


def test_functions_of_the_states_agree_with_the_enclosure() -> None:
    t, lesson = np.linspace(0, 20, 2001), exact(LESSON)
    states = lesson.evaluate(t)
    loop = loop_of(LESSON)
    balls = ball_function(problem(LESSON), [*loop.z, loop.V])
    for i in range(0, t.size, 100):
        wanted = [float(ball) for ball in balls(Fraction(t[i]), truth(LESSON).at(t[i]))]
        found = (*lesson.errors(t, states)[:, i], lesson.lyapunov(t, states)[i])
        assert np.allclose(found, wanted, rtol=0, atol=1e-14)
    rate, slope = lesson.dissipation(t, states)
    h = t[1]
    assert np.allclose(np.gradient(rate, h)[50:-1], slope[50:-1], atol=1e-2)
    assert np.allclose(lesson.first(t, states)[1], lesson.control(t, states), atol=1e-13)


def test_closed_loop_in_the_sources_is_the_derived_one() -> None:
    """If not: python -m conformance.truth.functions"""
    assert (ROOT / "conformance/truth/closed_loop.py").read_text() == module()


SHORT = with_values(LESSON, {"horizon": Fraction(1)})


@pytest.fixture(scope="module")
def proven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The one file of a cache of its own."""
    folder = tmp_path_factory.mktemp("proven")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("conformance.truth.exact.KEPT", folder)
        read_again()
    (path,) = folder.iterdir()
    return path


@pytest.fixture
def kept(proven: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it, which is what is read."""
    monkeypatch.setattr("conformance.truth.exact.KEPT", tmp_path)
    return Path(shutil.copy(proven, tmp_path))


def read_again() -> Exact:
    exact.cache_clear()
    return exact(SHORT)


def test_what_is_kept_is_proven_again_when_damaged(kept: Path) -> None:
    whole = kept.read_bytes()
    kept.write_bytes(whole[:-100] + bytes(100))
    assert read_again().evaluate(1.0).shape == (3,) and kept.read_bytes() == whole


def bent(table: Table) -> Table:
    """One piece with another course, which has the values and slopes of the table in its middle and at its ends."""
    polynomial = table.polynomial.copy()
    for power, part in ((2, 1), (4, -2), (6, 1)):  # v^2 (1 - v^2)^2
        polynomial[0, power, table.half.size // 2] += 0.1 * part
    return replace(table, polynomial=polynomial)


FORGERIES = {
    "a piece that is bent": lambda e: replace(e, table=bent(e.table)),
    "a solution off by 1e-10": lambda e: replace(e, table=replace(e.table, polynomial=e.table.polynomial + 1e-10)),
    "another solution": lambda e: replace(e, table=exact(with_values(SHORT, {"gamma": Fraction("3.0000001")})).table),
    "another start": lambda e: replace(e, table=exact(with_values(SHORT, {"x2_start": Fraction("-0.5000001")})).table),
    "a bound that is too wide": lambda e: replace(e, table=replace(e.table, bound=e.table.bound + 1e-6)),
    "a table of nothing": lambda e: replace(
        e, table=replace(e.table, polynomial=np.full_like(e.table.polynomial, np.nan))
    ),
    "gains that are too large": lambda e: replace(e, gains=replace(e.gains, field=1.1 * e.gains.field)),
    "gains that are too small": lambda e: replace(e, gains=replace(e.gains, V=0.9 * e.gains.V)),
    "sensitivities of another experiment": lambda e: replace(
        e, sensitivity=exact(with_values(SHORT, {"theta": Fraction("1.3")})).sensitivity
    ),
    "sensitivities exchanged": lambda e: replace(
        e, sensitivity=replace(e.sensitivity, polynomial=e.sensitivity.polynomial[..., ::-1].copy())
    ),
}


@pytest.mark.beyond
@pytest.mark.parametrize("forge", FORGERIES.values(), ids=FORGERIES)
def test_what_is_forged_is_proven_again(forge: Callable[[Exact], Exact], kept: Path) -> None:
    """The key and the checksum fit: what is read is checked against the equations."""
    whole = kept.read_bytes()
    head = whole.partition(b"\n")[0].split()[0].decode()
    cache.write(kept, head, packed(forge(read_again())))
    assert kept.read_bytes() != whole
    read_again()
    assert kept.read_bytes() == whole


@pytest.mark.beyond
def test_two_threads_prove_as_one_does(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The precision of ball arithmetic, and the length of its series, are the process's."""
    several = [with_values(SHORT, {"gamma": Fraction(gamma)}) for gamma in (2, 4)]
    tables = []
    for threads in (1, 2):
        monkeypatch.setattr("conformance.truth.exact.KEPT", tmp_path / str(threads))
        exact.cache_clear()
        with ThreadPoolExecutor(threads) as executor:
            tables.append([(one.table.polynomial, one.gains.field) for one in executor.map(exact, several)])
    for alone, beside in zip(*tables, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(alone, beside, strict=True))


def test_nothing_that_is_kept_is_executed(kept: Path) -> None:
    """A pickle in the place of numbers is refused unread."""
    head = kept.read_bytes().partition(b"\n")[0].split()[0].decode()
    stream = io.BytesIO()
    np.savez(stream, **{"Table.edges": np.array([print], dtype=object)})
    cache.write(kept, head, stream.getvalue())
    assert read_again().table.edges.dtype == float


def test_judging_from_the_cache_needs_neither_sympy_nor_ball_arithmetic() -> None:
    exact(LESSON)
    program = "import sys; from conformance.truth.exact import exact; from conformance.theory.lesson import LESSON; "
    program += "exact(LESSON); sys.exit(bool({'sympy', 'flint', 'scipy'} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", program], cwd=ROOT).returncode == 0
