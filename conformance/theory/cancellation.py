# SPDX-License-Identifier: MIT
"""How V' becomes -sum k_i z_i^2, step by step: which terms each step brings, and which statement takes them away.

With V_i = V_{i-1} + z_i^2 / 2 and V_0 = theta_tilde' Gamma^-1 theta_tilde / 2, the recursion (8) leaves after step i

    V_i' = -sum_{j<=i} k_j z_j^2 + g_i z_i z_{i+1} - theta_tilde' (tau_i - Gamma^-1 theta_hat')
           + sum_{2<=j<=i} z_j alpha_{j-1}_theta_hat (Gamma tau_i - theta_hat')

of which the last step leaves the squares alone: there is no z_{n+1}, and theta_hat' = Gamma tau_n.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import NamedTuple

import sympy as sp

from conformance.theory.experiments import INPUT, Experiment
from conformance.theory.expressions import (
    ZERO,
    Expression,
    Name,
    add,
    names_in,
    negative,
    number,
    power,
    product,
    quotient,
    substitute,
)
from conformance.theory.statements import Recursion, recursion_of


class Fate(Enum):
    """What becomes of a term of V_i'."""

    CANCELS = "cancels"
    STAYS = "stays"
    WAITS = "waits"


class Term(NamedTuple):
    """A term of V_i', where it comes from, and what becomes of it.

    `answer` is what the statement `by` holds against it, times z_i; 0 where the term stays or waits as it is. A term is
    `inherited` if it was there after the step before, and `collected` if it is the sum of terms that have been waiting.
    """

    term: Expression
    cause: str
    fate: Fate
    answer: Expression = ZERO
    by: str = ""
    inherited: bool = False
    collected: bool = False


@dataclass(frozen=True)
class Step:
    """Step i: its terms, and V_i' after it; both hold with the names that the written statements define."""

    i: int
    terms: tuple[Term, ...]
    left: Expression


def cancellation(experiment: Experiment, large: bool = False) -> tuple[Step, ...]:
    """The steps 1 .. n; raises as `statements_of` does."""
    recursion = recursion_of(experiment, large)
    written = {s.name for s in recursion.statements}
    hidden = {name: e for name, e in recursion.chain.definitions.items() if name not in written}

    def shown(e: Expression) -> Expression:
        while any(name in hidden for name in names_in(e)):
            e = substitute(e, hidden)
        return e

    def step(i: int) -> Step:
        terms = (t for t in _terms(recursion, i) if t.term != ZERO)
        return Step(
            i,
            tuple(t._replace(term=shown(t.term), answer=shown(t.answer)) for t in terms),
            shown(_left(recursion, i)),
        )

    return tuple(step(i) for i in range(1, recursion.n + 1))


def _terms(r: Recursion, i: int) -> Iterator[Term]:
    """The terms in the order in which the statement of step i answers them, then what stays and what waits."""
    z, name = r.z[i], INPUT if i == r.n else f"alpha{i}"
    before, states = f"alpha{i - 1}", r.experiment.states

    def cancels(e: Expression, cause: str, inherited: bool = False) -> Term:
        return Term(e, cause, Fate.CANCELS, negative(e), name, inherited)

    known = r.r[1] if i == 1 else Name(f"{before}_dot_known")
    yield cancels(product(r.g[i - 1], r.z[i - 1], z), f"the cross term: {states[i - 1]} is not {before}", True)
    yield cancels(product(r.f[i], z), f"the known part of row {i}")
    yield cancels(product(add(*r.estimated(i)), z), f"row {i}, as the estimate has it")
    yield cancels(negative(product(known, z)), "r moves" if i == 1 else f"{before} moves: what is known of it")
    yield _moving_estimate(r, i, name)
    gain = r.experiment.gamma(1, 1) if r.p == 1 else "Gamma"
    yield cancels(_growth(r, i), f"{_earlier(i)} counted on {gain} tau{i - 1}, and it has grown to {gain} tau{i}", True)
    yield Term(negative(product(Name(f"k{i}"), power(z, Fraction(2)))), f"{name} puts it there", Fate.STAYS)
    if i < r.n:
        yield Term(product(r.g[i], z, r.z[i + 1]), f"the cross term: {states[i]} is not alpha{i}", Fate.WAITS)
    yield from _parameter_errors(r, i)


def _moving_estimate(r: Recursion, i: int, name: str) -> Term:
    """-z_i alpha_{i-1}_theta_hat theta_hat', which alpha_i answers with Gamma tau_i before the law is known."""
    z, slopes = r.z[i], r.by_estimate[i]
    moving = product(r.paired(slopes, _rates(r), scaled=False), z)
    cause = f"alpha{i - 1} moves with the estimate"
    if i == r.n:
        return Term(negative(moving), cause, Fate.CANCELS, moving, name)
    return Term(negative(moving), cause, Fate.WAITS, product(r.paired(slopes, r.tau[i], scaled=True), z), name)


def _growth(r: Recursion, i: int) -> Expression:
    """-sum_{2<=j<i} z_j alpha_{j-1}_theta_hat Gamma w_i z_i: tau_i is w_i z_i more than tau_{i-1}."""
    parts = (product(r.paired(r.by_estimate[j], r.w[i], scaled=True), r.z[j]) for j in range(2, i))
    return negative(product(add(*parts), r.z[i]))


def _earlier(i: int) -> str:
    return "alpha2" if i == 3 else f"alpha2 to alpha{i - 1}"


def _parameter_errors(r: Recursion, i: int) -> Iterator[Term]:
    """-theta_tilde' w_i z_i, which joins tau_i, and what V_0 brings to step 1; the update law answers all of tau_n."""
    for j, parameter in enumerate(r.experiment.unknown):
        tilde, law = Name(f"{parameter.name}_tilde"), f"{parameter.estimate}_dot"
        moving = product(tilde, _scaled_rates(r)[j])
        if i == 1:
            yield Term(moving, "the estimate moves", Fate.WAITS, by=law)
        yield Term(
            negative(product(tilde, r.w[i][j], r.z[i])),
            f"{parameter.estimate} is not {parameter.name}",
            Fate.WAITS,
            by=r.names.component("tau", i, j + 1),
        )
        if i == r.n:
            errors = negative(product(tilde, r.tau[i][j]))
            yield Term(errors, "collected: all that has joined it", Fate.CANCELS, moving, law, collected=True)


def _rates(r: Recursion) -> list[Expression]:
    return [Name(f"{name}_dot") for name in r.experiment.estimates]


def _scaled_rates(r: Recursion) -> list[Expression]:
    """Gamma^-1 theta_hat', with the names of a diagonal Gamma, and the numbers of a full one."""
    p, rates, Gamma = r.p, _rates(r), r.experiment.Gamma
    if not any(Gamma[i][j] for i in range(p) for j in range(p) if i != j):
        return [quotient(rate, Name(r.experiment.gamma(i, i))) for i, rate in enumerate(rates, 1)]
    inverse = sp.Matrix(p, p, [sp.Rational(v) for row in Gamma for v in row]).inv()
    return [
        add(*(product(number(Fraction(int(inverse[i, j].p), int(inverse[i, j].q))), rates[j]) for j in range(p)))
        for i in range(p)
    ]


def _left(r: Recursion, i: int) -> Expression:
    """V_i' after step i."""
    squares = [negative(product(Name(f"k{j}"), power(r.z[j], Fraction(2)))) for j in range(1, i + 1)]
    if i == r.n:
        return add(*squares)
    scaled = _scaled_rates(r)
    errors = [
        negative(product(Name(f"{p.name}_tilde"), add(r.tau[i][j], negative(scaled[j]))))
        for j, p in enumerate(r.experiment.unknown)
    ]
    late = [add(a, negative(b)) for a, b in zip(r.adapted(r.tau[i]), _rates(r), strict=True)]
    moving = [product(r.z[j], r.paired(r.by_estimate[j], late, scaled=False)) for j in range(2, i + 1)]
    return add(*squares, product(r.g[i], r.z[i], r.z[i + 1]), *errors, *moving)
