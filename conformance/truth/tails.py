# SPDX-License-Identifier: MIT
"""What is left of power series behind their first K terms, bounded together with their convergence.

Over a step of width h every node of a program is a power series v = sum_k v_k sigma^k in sigma = s / h, |sigma| <= 1 in
the complex plane, with the norm |v| = sum_k |v_k|, for which |a b| <= |a| |b|. The first K terms v^ are known; the
rest, the tail, has a norm of at most r:

    v = a + b       r_v = r_a + r_b
    v = a b         r_v = |(a^ b^)_{>=K}| + |a^| r_b + |b^| r_a + r_a r_b
    v = a / b       r_v = (r_a + |(b^ v^)_{>=K}| + |v^| r_b) / (2 |b_0| - |b^| - r_b), where that is positive
    x' = f          image(r)_x = h (|f_{K-1}| / K + r_f / (K + 1))
    v = F(u)        as a state, v' = F'(u) u', u' by the chain rule along the solution

Theorem. If image(r) <= r for the states (and functions), then the solution is analytic on the disc and its tails are at
most image(r). Proof. Picard's iteration v <- v(0) + h int f(v), from x^, keeps the first K terms and stays among the
series whose tails are at most r, by the rules above. Term k of an iterate depends on terms before k of the last one, so
every term is final after finitely many iterations, and the series of these terms, which is the formal solution, has
partial sums of norm at most |x^| + r: it converges on the disc, solves the equation there, and has these tails.

The factor 1 / (K + 1) is why the step is limited by little but the disc of convergence. All these numbers are doubles
that are not below what they stand for: they are sums of products of numbers that are not negative, and UP covers the
rounding of each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb
from numpy.typing import NDArray

from conformance.truth.taylor import Coefficients, Program

Floats = NDArray[np.float64]
UP = 1 + 2.0**-48  # more than ten roundings of a double
SUM = 1 + 1e-12  # more than the roundings of a sum of some thousand terms
TINY = 1e-300  # more than what is lost below the range of doubles
ROUNDS = 30  # of the search for radii
WIDER = 1.2  # each next candidate than the last image


class NoEnclosure(ArithmeticError):
    """No radii were found for a step of this width."""


@dataclass(frozen=True)
class Norms:
    """Bounds of |v_k| unit^k for the nodes that `Tails` asks for, (nodes, K), and lower bounds of |v_0|, (nodes,)."""

    unit: float
    terms: Floats
    head: Floats


class Tails:
    """The rules of the head of this module, for one program."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.listed = sorted(program.listed())
        self.row = row = {node: i for i, node in enumerate(self.listed)}
        self.rates = [row[rate] for rate in program.rates.values()]
        products = [i for i in range(len(program.nodes)) if self._convolves(i)]
        factors = [
            program.nodes[i].args if program.nodes[i].kind == "mul" else (program.nodes[i].args[1], i) for i in products
        ]
        self.left, self.right = ([row[pair[side]] for pair in factors] for side in (0, 1))
        scope: dict[str, Any] = {"UP": UP, "TINY": TINY, "inf": float("inf")}
        exec(self._source(row, {node: i for i, node in enumerate(products)}), scope)
        self._radii: Callable[..., list[float]] = scope["radii"]

    def _convolves(self, i: int) -> bool:
        node, degree = self.program.nodes[i], self.program.degree
        return degree[i] > 0 and (node.kind == "div" or (node.kind == "mul" and degree[node.args[0]] > 0))

    def _source(self, row: dict[int, int], product: dict[int, int]) -> str:
        """The Python function radii(r, n, t, head): from the tails of the states to those of their rates."""
        program = self.program
        lines = ["def radii(r, n, t, head):"]
        lines.append("    " + "".join(f"r{x}, " for x in program.rates) + "= r")
        for i, node in enumerate(program.nodes):
            if i in program.rates or node.kind == "slope":
                continue
            if program.degree[i] == 0 or node.kind == "time":
                lines.append(f"    r{i} = 0.0")
                continue
            a, b = node.args
            if node.kind == "add":
                rule = f"(r{a} + r{b}) * UP"
            elif node.kind == "mul" and i in product:
                na, nb = f"n[{row[a]}]", f"n[{row[b]}]"
                rule = f"(t[{product[i]}] + {na} * r{b} + {nb} * r{a} + r{a} * r{b}) * UP + TINY"
            elif node.kind == "mul":
                rule = f"n[{row[a]}] * r{b} * UP + TINY"
            else:
                lines.append(f"    d = 2 * head[{row[b]}] - (n[{row[b]}] + r{b}) * UP")
                rule = f"(r{a} + t[{product[i]}] + n[{row[i]}] * r{b}) / d * UP + TINY if d > 0 else inf"
            lines.append(f"    r{i} = {rule}")
        lines.append(f"    return [{', '.join(f'r{f}' for f in program.rates.values())}]")
        return "\n".join(lines)

    def norms(self, coefficients: Sequence[Coefficients], count: int, unit: float) -> Norms:
        """Of the first `count` coefficients; unit: a width (s) near the step's, so that none overflows."""
        scales = [arb(unit) ** k for k in range(count)]
        terms = np.zeros((len(self.listed), count))
        for i, node in enumerate(self.listed):
            values = coefficients[node][:count]
            terms[i, : len(values)] = [float((c * s).abs_upper()) for c, s in zip(values, scales, strict=False)]
        head = np.array([float(coefficients[node][0].abs_lower()) for node in self.listed])
        return Norms(unit, terms * UP + TINY, head / UP)

    def radii(self, norms: Norms, h: float) -> tuple[list[float], Floats]:
        """Per state and function: a bound of its tail over a step of width h, and of its norm up to the tail.

        Raises NoEnclosure where no candidate passes the test.
        """
        count = norms.terms.shape[1]
        scaled = norms.terms * (h / norms.unit) ** np.arange(count) * SUM + TINY
        suffix = np.cumsum(scaled[:, ::-1], axis=1)[:, ::-1] * SUM  # [.., k]: sum of the terms from k on
        n = suffix[:, 0]
        # (a b)_{>=K} has the terms a_i b_j with i + j >= K: i from 1, j from K - i
        t = (np.einsum("mi,mi->m", scaled[self.left, 1:], suffix[self.right, :0:-1]) * SUM).tolist()
        last = (scaled[self.rates, -1] * (h / count) * UP).tolist()
        share = h / (count + 1)
        norm, head = n.tolist(), norms.head.tolist()

        def image(r: list[float]) -> list[float]:
            return [(g + share * f) * UP for g, f in zip(last, self._radii(r, norm, t, head), strict=True)]

        return search(image, last), n


def search(image: Callable[[list[float]], list[float]], candidate: list[float]) -> list[float]:
    """Radii that pass the test image(r) <= r: the image of such, which are radii, too."""
    for _ in range(ROUNDS):
        found = image(candidate)
        if holds(found, candidate):
            return found
        candidate = [WIDER * r + TINY for r in found]
        if not all(r < 1e300 for r in candidate):
            break
    raise NoEnclosure("no bound of the remainder passes the fixed-point test, so the solution may not exist further on")


def holds(found: Sequence[float], candidate: Sequence[float]) -> bool:
    """The fixed-point test."""
    return all(f <= r for f, r in zip(found, candidate, strict=True))
