# SPDX-License-Identifier: MIT
"""The enclosure holds the solution, and each fault put into its proof is caught."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from math import factorial as fac

import flint
import numpy as np
import pytest
import sympy as sp
from flint import arb, arb_mat

from conformance.tests.truth.problems import CLOSED, Closed, R, t, x
from conformance.truth import enclosure, tails, taylor
from conformance.truth.taylor import precision
from conformance.truth.truth import Ball, InitialValueProblem, ProofEnded, enclose

GROWTH, PERIODIC = CLOSED["exponential growth"], CLOSED["harmonic oscillator"]


@pytest.mark.beyond
@pytest.mark.parametrize("target", [1e-6, 1e-12, 1e-18, 1e-30])
@pytest.mark.parametrize("name", CLOSED)
def test_closed_solution_lies_in_its_enclosure(name: str, target: float) -> None:
    enclosed = enclose(CLOSED[name].problem, target)
    assert enclosed.largest_radius <= target
    assert CLOSED[name].lies_in(enclosed)


@pytest.mark.parametrize("edge", [-1, 1])
def test_every_solution_from_a_ball_of_starts_lies_in_the_enclosure(edge: int) -> None:
    start = Ball(R(1), R(1, 10**6))
    enclosed = enclose(replace(GROWTH.problem, start=(start,)), 1e4)
    value = 1 + edge * arb(10) ** -6
    assert Closed(GROWTH.problem, lambda s: (value * s.exp(),)).lies_in(enclosed)


def test_precision_of_ball_arithmetic_is_restored() -> None:
    before = flint.ctx.prec
    enclose(GROWTH.problem).at("0.5")
    assert flint.ctx.prec == before


# --- The proof ends, and says where --------------------------------------------------------------


@pytest.mark.parametrize(
    ("rhs", "start", "pole", "why"),
    [
        (x**2, R(1), 1.0, "a priori enclosure|remainder"),
        (-1 / x, R(1), 0.5, "contains 0|a priori enclosure|remainder"),
        (-sp.sqrt(x), R(1), 2.0, "not positive|contains 0|a priori enclosure|remainder"),
        (1 / x, R(0), 0.0, "division by an interval that contains 0"),
        (sp.sqrt(x), R(-1), 0.0, "power 1/2 of an interval that is not positive"),
        (sp.log(x - 1), R(1, 2), 0.0, "logarithm of an interval that is not positive"),
    ],
    ids=str,
)
def test_proof_ends_with_the_time_reached(rhs: sp.Expr, start: sp.Rational, pole: float, why: str) -> None:
    with pytest.raises(ProofEnded, match=why) as ended:
        enclose(InitialValueProblem(t, (x,), (rhs,), (start,), R(3)))
    assert pole - 1e-5 <= ended.value.reached <= pole


def test_unstable_problem_ends_with_the_time_reached() -> None:
    with pytest.raises(ProofEnded) as ended:
        enclose(InitialValueProblem(t, (x,), (100 * x,), (R(1),), R(20)))
    assert 1 < ended.value.reached < 20


def test_target_below_the_radius_of_the_start_is_refused() -> None:
    with pytest.raises(ProofEnded, match="radius"):
        enclose(replace(GROWTH.problem, start=(Ball(R(1), R(1, 10**6)),)), 1e-8)


WILD = {
    "fast reference": InitialValueProblem(t, (x,), (sp.cos(10**6 * t) - x,), (R(1),), R(20)),
    "long horizon": InitialValueProblem(t, (x,), (sp.cos(t) - x,), (R(1),), R(10**9)),
    "unstable and fast": InitialValueProblem(t, (x,), (10**6 * x * (1 - x**2),), (R(1, 10),), R(20)),
}


@pytest.mark.parametrize("name", WILD)
def test_budget_ends_a_long_proof_in_one_line(name: str) -> None:
    with pytest.raises(ProofEnded) as ended:
        enclose(WILD[name], budget=0.3)
    assert re.search(r"its 0\.3 s of CPU time are spent; to reach t = \S+ takes about \S+ s at", str(ended.value))
    assert 0 < ended.value.reached < WILD[name].end


def test_progress_is_told_now_and_then_and_rises(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(enclosure, "OFTEN", 0.0)
    told: list[float] = []
    enclosed = enclose(PERIODIC.problem, progress=told.append)
    assert told == enclosed.edges[1:].tolist()
    monkeypatch.setattr(enclosure, "OFTEN", 1e9)
    enclose(PERIODIC.problem, progress=lambda reached: pytest.fail("too often"))


def test_slow_problem_takes_wide_steps() -> None:
    problem = InitialValueProblem(t, (x,), (-x / 10**7,), (R(1),), R(10**7))
    enclosed = enclose(problem)
    assert np.diff(enclosed.edges).max() > 1e6
    assert Closed(problem, lambda s: ((-s / 10**7).exp(),)).lies_in(enclosed)


def test_flow_that_expands_beyond_reach_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(enclosure, "GUARD_BITS", (20,))
    with pytest.raises(
        ProofEnded, match=r"radius there is \S+, above 1\.0e-18; the start, or errors of 2\^-20 of that"
    ):
        enclose(InitialValueProblem(t, (x,), (10 * x,), (R(1),), R(10)))


# --- Faults --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("table", "rule", "fault"),
    [
        (taylor.RULES, "mul", "x{i} = convolve(v{a}[:-1], v{b})"),
        (taylor.RULES, "mul square", "x{i} = square(v{a}) * 2"),
        (taylor.RULES, "function", "x{i} = convolve(v{b}, v{w}[:k])"),
        (taylor.RULES, "div constant", "x{i} = convolve(v{b}[1:], v{i}) / v{b}[0]"),
        (taylor.FUNCTIONS, "sin", taylor.FUNCTIONS["sin"]._replace(derivative=lambda p, v, u: v)),
    ],
    ids=["product", "square", "chain rule", "quotient", "derivative of sine"],
)
def test_wrong_taylor_rule_is_caught(
    monkeypatch: pytest.MonkeyPatch, table: dict[str, object], rule: str, fault: object
) -> None:
    monkeypatch.setitem(table, rule, fault)
    assert not all(_survives(closed) for closed in CLOSED.values())


def _survives(closed: Closed) -> bool:
    try:
        return closed.lies_in(enclose(closed.problem, 1e-12))
    except ProofEnded:
        return False


def one_round(image: Callable[[list[float]], list[float]], candidate: list[float]) -> list[float]:
    """A search that forgets the fixed-point test."""
    return image(candidate)


@pytest.mark.parametrize("closed", [GROWTH, PERIODIC], ids=["growth", "oscillator"])
def test_tail_left_out_is_caught(monkeypatch: pytest.MonkeyPatch, closed: Closed) -> None:
    monkeypatch.setattr(tails, "search", lambda image, candidate: [0.0 for _ in candidate])
    assert not _survives(closed)


@pytest.mark.parametrize("shrunk", ["self._radii(r, norm, t, head)", "last"])
def test_term_left_out_of_the_tail_is_caught(monkeypatch: pytest.MonkeyPatch, shrunk: str) -> None:
    """Of image(r) = (last + share rates(r)), each is needed: the true tail of exp, term by term, is the judge."""
    order, h = 8, 1.5
    program = taylor.with_rates(taylor.compile_program(t, [x], [x]))
    with precision(200):
        stepper, point = tails.Tails(program), taylor.coefficients(program, arb(0), [arb(1)], order - 1)
        norms = stepper.norms(point, order, 1.0)
        true = float(arb(h).exp() - sum((arb(h) ** k / fac(k) for k in range(order)), arb(0)))
        assert true <= stepper.radii(norms, h)[0][0] <= 1.5 * true
        if shrunk == "last":
            norms = replace(norms, terms=norms.terms * (np.arange(order) < order - 1))
        else:
            monkeypatch.setattr(stepper, "_radii", lambda *_: [0.0])
        assert stepper.radii(norms, h)[0][0] < true


def test_fixed_point_test_that_is_skipped_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the pole of x' = x^2 nothing exists, whatever a bound says that was never tested."""
    problem = InitialValueProblem(t, (x,), (x**2,), (R(1),), R(3))
    with pytest.raises(ProofEnded):
        enclose(problem, 1e12)
    monkeypatch.setattr(tails, "search", one_round)
    monkeypatch.setattr(enclosure, "SHARP", 1e300)
    assert enclose(problem, 1e90).end == 3


def test_radii_that_fail_the_fixed_point_test_end_the_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tails, "holds", lambda found, candidate: False)
    with pytest.raises(ProofEnded, match="fixed-point test"):
        enclose(GROWTH.problem)


def test_start_radius_that_is_not_carried_on_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    flow = enclosure.Stepper.flow

    def frozen(self: enclosure.Stepper, at: enclosure.Expanded, h: float) -> enclosure.Flow:
        return replace(flow(self, at, h), bound=arb_mat([[1]]), end=arb_mat([[1]]))

    monkeypatch.setattr(enclosure.Stepper, "flow", frozen)
    enclosed = enclose(replace(GROWTH.problem, start=(Ball(R(1), R(1, 10**6)),)), 1e4)
    assert not Closed(GROWTH.problem, lambda s: ((1 + arb(10) ** -6) * s.exp(),)).lies_in(enclosed)


@pytest.mark.parametrize(("width", "passes"), [(0.5, True), (0.9, True), (1.0, False), (4.0, False)])
@pytest.mark.parametrize("rhs", [x**2, 1 / (1 - t) ** 2, 1 / sp.cos(sp.pi * t / 2) ** 2], ids=str)
def test_fixed_point_test_knows_where_a_solution_is_analytic(rhs: sp.Expr, width: float, passes: bool) -> None:
    """The pole lies at t = 1; the tail of 1 / (1 - t), which solves two of the three, is h^K / (1 - h)."""
    order = 60
    program = taylor.with_rates(taylor.compile_program(t, [x], [rhs]))
    with precision(200):
        stepper = tails.Tails(program)
        norms = stepper.norms(taylor.coefficients(program, arb(0), [arb(1)], order - 1), order, 1.0)
    if not passes:
        with pytest.raises(tails.NoEnclosure):
            stepper.radii(norms, width)
    elif rhs == x**2:
        assert width**order / (1 - width) <= stepper.radii(norms, width)[0][0] <= 3 * width**order / (1 - width)


# --- Bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rhs", "message"),
    [(sp.Float(1.2) * x, "exact Rational"), (sp.Abs(x), "no Taylor rule"), (sp.Symbol("c") * x, "neither the time")],
    ids=str,
)
def test_right_hand_side_without_a_rule_is_refused(rhs: sp.Expr, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        enclose(InitialValueProblem(t, (x,), (rhs,), (R(1),), R(1)))


def test_start_given_as_a_double_is_refused() -> None:
    with pytest.raises(ValueError, match="exact rationals"):
        InitialValueProblem(t, (x,), (x,), (sp.Float(1.2),), R(1))


@pytest.mark.parametrize("target", [0.0, -1.0, 1e-290, 1e290, float("inf"), float("nan")])
def test_absurd_target_is_refused(target: float) -> None:
    with pytest.raises(ValueError, match="the target radius must lie between 1e-100 and 1e"):
        enclose(GROWTH.problem, target)


def test_absurd_start_and_horizon_are_refused() -> None:
    with pytest.raises(ValueError, match=r"a start value must not exceed 1e\+100, and one is -1\.00E\+290"):
        replace(GROWTH.problem, start=(-(R(10) ** 290),))
    with pytest.raises(ValueError, match="the horizon must lie between"):
        replace(GROWTH.problem, horizon=R(10) ** 400)


@pytest.mark.parametrize(
    "names", [(x,), (t,), (sp.Symbol("x", positive=True),), (sp.Symbol("a"), sp.Symbol("a"))], ids=str
)
def test_definition_must_not_take_the_name_of_something_else(names: tuple[sp.Symbol, ...]) -> None:
    with pytest.raises(ValueError, match="need names of their own"):
        InitialValueProblem(t, (x,), (x,), (R(1),), R(1), tuple((name, 2 * x) for name in names))
