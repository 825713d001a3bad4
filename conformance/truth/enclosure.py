# SPDX-License-Identifier: MIT
"""A validated Taylor method: steps that enclose the solution of an initial-value problem.

One step of width h, from t_j, for all starts x(t_j) in the set X = m + A R (a point, a matrix, a box around 0):

    point      x(t_j + s; m) in sum_{k<K} x_k(m) s^k + [-r, r]        (r by `tails`, which proves that x is analytic)
    spread     x(t_j + s; X) in x(t_j + s; m) + Y(s) (X - m)          (mean value theorem)
    Y(s)       in sum_{k<q} Y_k(X) s^k + [-r, r]                      (of the variational equation from all of X, too)

The set at the end is written as m + A R again, A being the orthogonal factor of a QR decomposition: this keeps
the wrapping effect small. Every step has its own tolerance, order K and precision: what it adds to the set is small
against the target and against the set that it starts from. Sources: Moore 1966; Lohner 1987; Nedialkov, Jackson &
Corliss 1999; Johansson 2017 for the arithmetic.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from flint import arb, arb_mat

from conformance.truth.tails import Floats, NoEnclosure, Norms, Tails
from conformance.truth.taylor import Coefficients, Program, coefficients, precision, variational, with_rates

SHORTEST = 2.0**-40  # of the horizon: the proof ends where it would need a shorter step
SHARP = 2.0**-12  # largest share of the spread that a step may add to it
GUARD_BITS = (30, 70, 180, 540, 800)  # log2(target / tolerance of a step), one attempt after the other
LEAST, LARGEST_STATE = 1e-270, 1e150  # tolerance and state: doubles hold bounds of them and of their products
ORDER_PER_BIT = 0.55  # K, of the solution from the midpoint
LOW_ORDER = 14  # q, of the variational equation, at least; more for few states, where it costs little
SIZE = 40  # log2(size that states are taken to have / target), at least
BITS = 30  # of the arithmetic, more than the tolerance needs
TRIES = 60  # of widths, per step
BUDGET = 120.0  # s of CPU time
OFTEN = 0.25  # s between two reports of progress

Progress = Callable[[float], None]


class ProofEnded(ArithmeticError):
    """The enclosure could not be continued: proven on [0, reached] (s), and why no further."""

    def __init__(self, reached: float, why: str) -> None:
        super().__init__(f"the proof reached t = {reached!r} and could not be continued: {why}")
        self.reached = reached
        self.why = why


class TooWide(ProofEnded):
    """The enclosure could be continued, but its radius exceeds the target."""


@dataclass
class Budget:
    """CPU time of this thread that a proof may take (s), and whom to tell how far it is, now and then."""

    seconds: float = BUDGET
    progress: Progress | None = None
    started: float = field(default_factory=time.thread_time)
    told: float = field(default_factory=time.monotonic)

    def spend(self, reached: float, end: float) -> None:
        """Raises ProofEnded where the time is up."""
        if self.progress and time.monotonic() - self.told > OFTEN:
            self.told = time.monotonic()
            self.progress(reached)
        spent = time.thread_time() - self.started
        if spent > self.seconds:
            needed = f"about {spent * end / reached:.1e} s at this rate" if reached > 0 else "more than that for a step"
            raise ProofEnded(
                reached, f"its {self.seconds:g} s of CPU time are spent; to reach t = {end:g} takes {needed}"
            )


@dataclass(frozen=True)
class Step:
    """|x_i(start + s) - sum_k polynomial[i][k] s^k| <= radius[i] for 0 <= s <= width; coefficients are exact."""

    start: float
    width: float
    polynomial: tuple[tuple[arb, ...], ...]
    radius: tuple[float, ...]
    bits: int  # precision that they were found with


@dataclass(frozen=True)
class StartSet:
    """The set m + A R at one time: m exact, A an exact matrix, R a column of balls around 0."""

    middle: list[arb]
    basis: arb_mat
    box: arb_mat

    def hull(self) -> list[arb]:
        """A box around the set, one ball per state."""
        return [m + r for m, r in zip(self.middle, (self.basis * self.box).entries(), strict=True)]


def box_set(balls: Sequence[arb]) -> StartSet:
    """A box as a StartSet, with the unit matrix."""
    n = len(balls)
    middle = [b.mid() for b in balls]
    box = [arb(0, (b - m).abs_upper()) for b, m in zip(balls, middle, strict=True)]
    return StartSet(middle, arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)]), arb_mat(n, 1, box))


def upper(ball: arb) -> float:
    """A double that is not below the absolute value of any point of the ball."""
    return math.nextafter(float(ball.abs_upper()), math.inf)


def largest(balls: Sequence[arb]) -> float:
    """About the largest absolute value."""
    return max(float(x.abs_upper()) for x in balls)


# --- One step ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Settings:
    """What a step has to keep: a bound of what it adds (in the units of the states), and how it is computed."""

    tolerance: float
    order: int  # K
    bits: int


def settings_for(tolerance: float, size: float) -> Settings:
    """Order and precision for this tolerance and states of this size."""
    digits = max(0.0, math.log2(size) - math.log2(tolerance))
    return Settings(tolerance, max(12, round(ORDER_PER_BIT * digits)), round(digits) + BITS)


@dataclass(frozen=True)
class Expanded:
    """The Taylor coefficients at a StartSet, which serve for a step of any width."""

    time: float
    start: StartSet
    settings: Settings
    spread: list[arb]  # |x - m| over the set
    point: list[Coefficients]  # of the nodes from the midpoint, order K
    low: list[Coefficients]  # of x and Y, from the hull of the set and Y = I, order q
    point_norms: Norms
    low_norms: Norms


@dataclass(frozen=True)
class Flow:
    """What holds for all solutions from the set, over one step."""

    width: float
    tail: list[float]  # of x from the midpoint, behind K terms
    bound: arb_mat  # |Y| on the whole step
    end: arb_mat  # Y at its end
    fitting: float  # the factor by which the width would just meet the tolerances


def total(terms: Sequence[arb], s: arb) -> arb:
    """sum_k terms[k] s^k."""
    value = arb(0)
    for c in reversed(terms):
        value = value * s + c
    return value


def around_zero(radius: float) -> arb:
    """The ball of this radius."""
    return arb(0, radius)


class Stepper:
    """The validated Taylor method for one program."""

    def __init__(self, program: Program) -> None:
        self.program = with_rates(program)
        self.extended, self.entries = variational(self.program)
        self.tails, self.extended_tails = Tails(self.program), Tails(self.extended)
        self.n = len(program.states)
        self.low_order = max(LOW_ORDER, 32 - 3 * self.n)

    def expand(self, time: float, start: StartSet, settings: Settings, limit: float) -> Expanded:
        """Expands at the set, for steps up to the limit (s).

        Raises ProofEnded where the right-hand side is not defined on the set.
        """
        hull = start.hull()
        identity = [arb(i == j) for i, j in self.entries]
        order = settings.order
        point = coefficients(self.program, arb(time), start.middle, order - 1)
        low = coefficients(self.extended, arb(time), hull + identity, self.low_order - 1)
        for program, values in ((self.program, point), (self.extended, low)):
            if not all(c.is_finite() for x in program.states for c in values[x]):
                raise ProofEnded(time, program.trouble(values))
        unit = self.width(point, settings, limit)
        norms = self.tails.norms(point, order, unit), self.extended_tails.norms(low, self.low_order, unit)
        spread = [(x - m).abs_upper() for x, m in zip(hull, start.middle, strict=True)]
        return Expanded(time, start, settings, spread, point, low, *norms)

    def width(self, point: list[Coefficients], settings: Settings, limit: float) -> float:
        """About the width (s) at which the last coefficients at the midpoint meet the tolerance: where tries begin."""
        widths = [limit]
        for k in (settings.order - 1, settings.order - 2):
            sizes = [abs(point[x][k]).upper() for x in self.program.states]
            widths += [float((arb(settings.tolerance) / c) ** (arb(1) / k)) for c in sizes if not c.is_zero()]
        return min(widths)

    def flow(self, at: Expanded, h: float) -> Flow:
        """Encloses all solutions over a step of width h; raises NoEnclosure where h is too wide for that."""
        n = self.n
        tail, _ = self.tails.radii(at.point_norms, h)
        low_tail, norms = self.extended_tails.radii(at.low_norms, h)
        rests = dict(zip(self.extended.rates, low_tail, strict=True))
        bound, end, rest = arb_mat(n, n), arb_mat(n, n), np.zeros((n, n))
        for (i, j), y in zip(self.entries, self.extended.states[n:], strict=True):
            rest[i, j] = rests[y]
            bound[i, j] = arb(float(norms[self.extended_tails.row[y]])) + arb(rests[y])
            end[i, j] = total(at.low[y][: self.low_order], arb(h)) + around_zero(rests[y])
        added = max(tail[:n])
        fitting = (at.settings.tolerance / added) ** (1 / at.settings.order) if added > 0 else 2.0
        widened = self.widened(at, rest, end)
        if widened > 0:
            fitting = min(fitting, (SHARP / widened) ** (1 / self.low_order))
        return Flow(h, tail[:n], bound, end, fitting)

    def widened(self, at: Expanded, rest: Floats, end: arb_mat) -> float:
        """The share by which the tail of Y, (n, n), widens the set, at most over the states; 0 for a point."""
        spread = np.array([float(r) for r in at.spread])
        if not spread.max() > 0:
            return 0.0
        spread = spread / spread.max()
        moved = float((np.abs(doubles(end)) @ spread).max())
        return float((rest @ spread).max()) / moved if moved > 0 else 1.0

    def step(self, at: Expanded, limit: float, shortest: float) -> Flow:
        """The flow over the widest step found that meets the tolerances, up to the limit (s).

        Raises ProofEnded where that would be shorter than `shortest`.
        """
        h, best, why = at.point_norms.unit, None, "its remainder exceeds the tolerance"
        for _ in range(TRIES):
            h = h if h == limit else round_down(h, shortest)
            if h < min(shortest, limit):
                break
            try:
                flow = self.flow(at, h)
            except NoEnclosure as reason:
                if best:
                    break
                h, why = h / 2, str(reason)
                continue
            if flow.fitting >= 1:
                best = flow
                if flow.fitting < 1.15 or h == limit:
                    break
                h = min(limit, h * min(0.97 * flow.fitting, 2.0))
            elif best:
                break
            else:
                h *= min(0.97, max(0.97 * flow.fitting, 0.25))
        if best is None:
            raise ProofEnded(at.time, f"a step of {max(h, shortest):.1e} s is too wide: {why}")
        return best

    def dense(self, at: Expanded, flow: Flow) -> Step:
        """The polynomials of the states from the midpoint, and radii that hold on the whole step."""
        h = arb(flow.width)
        polynomials, radii = [], []
        for x, row, tail in zip(self.program.states, flow.bound.tolist(), flow.tail, strict=True):
            points = at.point[x][: at.settings.order]
            radius = arb(tail) + total([c.rad() for c in points], h)
            radius += sum((y * r for y, r in zip(row, at.spread, strict=True)), arb(0))
            polynomials.append(tuple(c.mid() for c in points))
            radii.append(upper(radius))
        return Step(at.time, flow.width, tuple(polynomials), tuple(radii), at.settings.bits)

    def end_set(self, at: Expanded, flow: Flow) -> StartSet:
        """The set at the end of the step, by the mean value theorem about the midpoint, in QR form."""
        n, h = self.n, arb(flow.width)
        ends = [
            total(at.point[x][: at.settings.order], h) + around_zero(tail)
            for x, tail in zip(self.program.states, flow.tail, strict=True)
        ]
        middle = [e.mid() for e in ends]
        local = arb_mat(n, 1, [e - m for e, m in zip(ends, middle, strict=True)])
        spread = flow.end * at.start.basis
        basis = orthogonal_factor(spread, at.start.box)
        inverse = basis.inv()
        box = (inverse * spread) * at.start.box + inverse * local
        return StartSet(middle, basis, arb_mat(n, 1, [arb(0, r.abs_upper()) for r in box.entries()]))


def doubles(matrix: arb_mat) -> Floats:
    """About the midpoints."""
    return np.array([float(x.mid()) for x in matrix.entries()]).reshape(matrix.nrows(), matrix.ncols())


def orthogonal_factor(spread: arb_mat, box: arb_mat) -> arb_mat:
    """Q of the midpoints' QR decomposition, longest edge first: any regular matrix would keep the proof."""
    n = spread.nrows()
    edges = doubles(spread)
    lengths = np.array([float(x.rad()) for x in box.entries()])
    if lengths.max() > 0:
        edges = edges * (lengths / lengths.max() + 1e-12)
    order = np.argsort(-np.linalg.norm(edges, axis=0))
    return arb_mat(n, n, np.linalg.qr(edges[:, order])[0].ravel().tolist())


def round_down(h: float, shortest: float) -> float:
    """A width with few digits, so that sums of widths are exact doubles."""
    grain = max(2.0 ** (math.frexp(h)[1] - 6), 2.0 ** math.frexp(shortest)[1] * 2.0**-10)
    return math.floor(h / grain) * grain


# --- All steps -----------------------------------------------------------------------------------


def steps(
    program: Program, start: Callable[[], Sequence[arb]], end: float, target: float, guard: int
) -> Iterator[Step]:
    """The steps from 0 to the end (s), each with the target radius.

    Raises ProofEnded where the proof cannot be continued, TooWide where the radius exceeds the target.
    """
    stepper = Stepper(program)
    shortest = end * SHORTEST
    reached, current = 0.0, None
    size = max(target * 2.0**SIZE, largest(start()))
    while reached < end:
        tolerance = target * 2.0**-guard
        if current:
            tolerance = max(tolerance, SHARP * max(float(r.rad()) for r in current.box.entries()))
            size = max(size, largest(current.middle))
            if size > LARGEST_STATE:
                raise ProofEnded(reached, f"a state exceeds {LARGEST_STATE:g}")
        settings = settings_for(tolerance, size)
        with precision(settings.bits):
            current = current or box_set(start())
            at = stepper.expand(reached, current, settings, end - reached)
            flow = stepper.step(at, end - reached, shortest)
            step = stepper.dense(at, flow)
            if max(step.radius) > target:
                raise TooWide(reached, f"its radius there is {max(step.radius):.1e}, above {target:.1e}")
            current = stepper.end_set(at, flow)
        yield step
        assert Fraction(reached) + Fraction(flow.width) == Fraction(reached + flow.width)
        reached += flow.width


def prove(
    program: Program, start: Callable[[], Sequence[arb]], end: float, target: float, budget: Budget | None = None
) -> list[Step]:
    """All steps: their remainders shrink from attempt to attempt until the target holds.

    start: gives the balls at the current precision. end: s. target: absolute radius, for all states.
    Raises ProofEnded: see `steps`, `Budget`.
    """
    budget = budget or Budget()
    guards = [guard for guard in GUARD_BITS if target * 2.0**-guard > LEAST]
    for guard in guards:
        done: list[Step] = []
        try:
            for step in steps(program, start, end, target, guard):
                done.append(step)
                budget.spend(step.start + step.width, end)
            return done
        except TooWide as wide:
            ended = wide
    raise ProofEnded(
        ended.reached, f"{ended.why}; the start, or errors of 2^-{guards[-1]} of that, grow so far by there"
    )
