# SPDX-License-Identifier: MIT
"""A validated Taylor method: steps that enclose the solution of an initial-value problem.

One step of width h, from t_j, for all starts x(t_j) in the set X = m + A R (a point, a matrix, a box around 0):

    a priori   balls B hold every solution of z' = F(t, z) from Z on all of [t_j, t_j + h] if the Picard-Lindeloef
               operator, taken to order q by Taylor's theorem, maps B into its own interior:
               sum_{k<q} z_k(Z) [0, h]^k + z_q(B) [0, h]^q inside B   (q = 1: Z + [0, h] F([t_j, t_j + h], B));
               here z is x together with Y = dx / dx(t_j), Y(t_j) = I
    point      x(t_j + s; m) in sum_{k<K} x_k(m) s^k + x_K(B) s^K     (Taylor, with Lagrange's remainder)
    spread     x(t_j + s; X) in x(t_j + s; m) + Y(s) (X - m)          (mean value theorem)

The set at the end is written as m + A R again, A being the orthogonal factor of a QR decomposition: this keeps
the wrapping effect small. Sources: Moore 1966; Lohner 1987; Nedialkov, Jackson & Corliss 1999, sections 4 to 6;
Johansson 2017 for the arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_mat

from conformance.truth.taylor import Coefficients, Program, coefficients, precision, variational

SHORTEST = 2.0**-40  # of the horizon: the proof ends where it would need a shorter step
MARGINS = (2.0**-10, 2.0**-20, 2.0**-40, 2.0**-100)  # of the boxes tried as an a priori enclosure, one by one
SHARP = 2.0**-7  # largest remainder allowed in Y, which is of the order of 1: it widens R by this factor per step
GUARD_BITS = (16, 48, 112, 240, 496)  # log2(target / remainder allowed per step), one attempt after the other


class ProofEnded(ArithmeticError):
    """The enclosure could not be continued: proven on [0, reached] (s), and why no further."""

    def __init__(self, reached: float, why: str) -> None:
        super().__init__(f"the proof reached t = {reached!r} and could not be continued: {why}")
        self.reached = reached
        self.why = why


class TooWide(ProofEnded):
    """The enclosure could be continued, but its radius exceeds the target."""


class NoEnclosure(ArithmeticError):
    """No a priori enclosure was found for a step of this width."""


@dataclass(frozen=True)
class Settings:
    """Orders, tolerances and precision of one attempt; radii are absolute, in the units of the states."""

    target: float  # radius to hold at every time
    tolerance: float  # Lagrange remainder allowed per step
    order: int  # K, of the solution from the midpoint
    low_order: int  # q, of the variational equation and of the tightened box
    bits: int  # working precision


@dataclass(frozen=True)
class Step:
    """|x_i(start + s) - sum_k polynomial[i][k] s^k| <= radius[i] for 0 <= s <= width; coefficients are exact."""

    start: float
    width: float
    polynomial: tuple[tuple[arb, ...], ...]
    radius: tuple[float, ...]


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


# --- A priori enclosure --------------------------------------------------------------------------


def up_to(h: float) -> arb:
    """A ball that contains [0, h]."""
    return arb(h / 2, h / 2)


def remainder(over_box: Coefficients, s: arb, order: int) -> arb:
    """Lagrange's remainder x_order(box) s^order."""
    return over_box[order] * s**order


def expansion(points: Coefficients, over_box: Coefficients, s: arb, order: int) -> arb:
    """sum_{k<order} points[k] s^k + remainder, for all s in the ball."""
    total = arb(0)
    for c in reversed(points[:order]):
        total = total * s + c
    return total + remainder(over_box, s, order)


def candidate(image: arb, last: arb, margin: float) -> arb:
    """A ball to try: the image, wider by a share of itself, by its last term, and by a margin, so never a point."""
    return image + arb(0, image.rad() / 8 + last.abs_upper() + (image.abs_upper() + 1) * margin)


def is_inside(inner: Sequence[arb], outer: Sequence[arb]) -> bool:
    """The fixed-point test: each inner ball is in the interior of its outer ball."""
    return all(b.contains_interior(a) for a, b in zip(inner, outer, strict=True))


def a_priori(
    program: Program, t: arb, low: list[Coefficients], order: int, h: float
) -> tuple[list[arb], list[Coefficients]]:
    """Balls that hold every solution on all of [t, t + h], and Taylor coefficients over balls that hold these.

    low: the coefficients at the start, to the order given. Raises NoEnclosure where no candidate passes the test.
    """
    s = up_to(h)
    image, last = low_image(program, low, low, s, order)
    why = ""
    for margin in MARGINS:
        box = [candidate(x, r, margin) for x, r in zip(image, last, strict=True)]
        over_box = coefficients(program, t + s, box, order)
        if all(c.is_finite() for z in program.states for c in over_box[z]):
            image, last = low_image(program, low, over_box, s, order)
            if is_inside(image, box):
                return image, over_box
            why = "no a priori enclosure passes the fixed-point test, so the solution may not exist further on"
        else:
            why = program.trouble(over_box)
    raise NoEnclosure(why)


def low_image(
    program: Program, low: list[Coefficients], over_box: list[Coefficients], s: arb, order: int
) -> tuple[list[arb], list[arb]]:
    """Per state: its expansion to this order over the times s, and the remainder in it."""
    image = [expansion(low[z], over_box[z], s, order) for z in program.states]
    return image, [remainder(over_box[z], s, order) for z in program.states]


# --- One step ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Expanded:
    """The Taylor coefficients at a StartSet, which serve for a step of any width."""

    time: float
    start: StartSet
    extended: list[arb]  # hull of the set, then Y = I
    low: list[Coefficients]  # of x and Y over that hull, order q
    point: list[Coefficients]  # of x from the midpoint, order K


@dataclass(frozen=True)
class Flow:
    """What holds for all solutions from the set, over one step."""

    width: float
    tight: list[arb]  # x and Y on the whole step
    end: list[arb]  # x and Y at its end
    over_box: list[Coefficients]  # Taylor coefficients of x over `tight`, order K
    fitting: float  # the factor by which the width would just meet the tolerances


def factor(limit: float, terms: Sequence[arb], order: int) -> float:
    """The factor by which s may grow until the largest of the terms c s^order meets the limit, 1000 at most."""
    sizes = [term.abs_upper() for term in terms if not term.is_zero()]
    return min([1000.0] + [float((arb(limit) / size) ** (arb(1) / order)) for size in sizes])


class Stepper:
    """The validated Taylor method for one program, with one choice of settings."""

    def __init__(self, program: Program, settings: Settings) -> None:
        self.program = program
        self.extended = variational(program)
        self.settings = settings

    def expand(self, time: float, start: StartSet) -> Expanded:
        """Expands at the set; raises ProofEnded where the right-hand side is not defined on it."""
        n = len(start.middle)
        extended = start.hull() + [arb(i == j) for i in range(n) for j in range(n)]
        low = coefficients(self.extended, arb(time), extended, self.settings.low_order)
        point = coefficients(self.program, arb(time), start.middle, self.settings.order)
        for program, values in ((self.extended, low), (self.program, point)):
            if not all(c.is_finite() for x in program.states for c in values[x]):
                raise ProofEnded(time, program.trouble(values))
        return Expanded(time, start, extended, low, point)

    def flow(self, at: Expanded, h: float) -> Flow:
        """Encloses all solutions over a step of width h; raises NoEnclosure where h is too wide for that."""
        q, order = self.settings.low_order, self.settings.order
        time = arb(at.time)
        tight, over_box = a_priori(self.extended, time, at.low, q, h)
        end = [expansion(at.low[z], over_box[z], arb(h), q) for z in self.extended.states]
        over_tight = coefficients(self.program, time + up_to(h), tight[: len(self.program.states)], order)
        if not all(c.is_finite() for x in self.program.states for c in over_tight[x]):
            raise NoEnclosure(self.program.trouble(over_tight))
        entries = self.extended.states[len(self.program.states) :]
        remainders = [remainder(over_tight[x], arb(h), order) for x in self.program.states]
        fitting = min(
            factor(self.settings.tolerance, remainders, order),
            factor(SHARP, [remainder(over_box[y], arb(h), q) for y in entries], q),
        )
        return Flow(h, tight, end, over_tight, fitting)

    def first_width(self, at: Expanded) -> float:
        """The width (s) at which the coefficient of order K at the midpoint would meet the tolerance."""
        order = self.settings.order
        return factor(self.settings.tolerance, [at.point[s][order] for s in self.program.states], order)

    def step(self, at: Expanded, h: float, shortest: float) -> tuple[Flow, float]:
        """The flow over the widest step up to h that meets the tolerance, and a width for the next step.

        Raises ProofEnded where that would be shorter than `shortest`.
        """
        while h >= shortest:
            try:
                flow = self.flow(at, h)
            except NoEnclosure:
                h = round_down(h / 2, shortest)
                continue
            if flow.fitting >= 1:
                return flow, h * min(0.95 * flow.fitting, 1.5)
            h = round_down(h * max(0.95 * flow.fitting, 0.25), shortest)
        raise ProofEnded(at.time, self.obstacle(at, shortest))

    def obstacle(self, at: Expanded, h: float) -> str:
        """What is in the way of a step of width h."""
        try:
            self.flow(at, h)
        except NoEnclosure as reason:
            return str(reason)
        return "the remainder exceeds its tolerance over the shortest step allowed"

    def dense(self, at: Expanded, flow: Flow) -> Step:
        """The polynomials of the states from the midpoint, and radii that hold on the whole step."""
        order, h = self.settings.order, arb(flow.width)
        spread = [(x - m).abs_upper() for x, m in zip(at.extended, at.start.middle, strict=False)]
        polynomials, radii = [], []
        for x, Y in zip(self.program.states, self.jacobian(flow.tight).tolist(), strict=True):
            points = at.point[x][:order]
            radius = remainder(flow.over_box[x], h, order).abs_upper()
            radius += sum((c.rad() * h**k for k, c in enumerate(points)), arb(0))
            radius += sum((y.abs_upper() * r for y, r in zip(Y, spread, strict=True)), arb(0))
            polynomials.append(tuple(c.mid() for c in points))
            radii.append(upper(radius))
        return Step(at.time, flow.width, tuple(polynomials), tuple(radii))

    def end_set(self, at: Expanded, flow: Flow) -> StartSet:
        """The set at the end of the step, by the mean value theorem about the midpoint, in QR form."""
        n, order = len(self.program.states), self.settings.order
        ends = [expansion(at.point[s], flow.over_box[s], arb(flow.width), order) for s in self.program.states]
        middle = [e.mid() for e in ends]
        local = arb_mat(n, 1, [e - m for e, m in zip(ends, middle, strict=True)])
        spread = self.jacobian(flow.end) * at.start.basis
        basis = orthogonal_factor(spread, at.start.box)
        inverse = basis.inv()
        box = (inverse * spread) * at.start.box + inverse * local
        return StartSet(middle, basis, arb_mat(n, 1, [arb(0, r.abs_upper()) for r in box.entries()]))

    def jacobian(self, extended: Sequence[arb]) -> arb_mat:
        """Y as a matrix, from x and Y."""
        n = len(self.program.states)
        return arb_mat(n, n, extended[n:])


def orthogonal_factor(spread: arb_mat, box: arb_mat) -> arb_mat:
    """Q of the midpoints' QR decomposition, longest edge first: any regular matrix would keep the proof."""
    n = spread.nrows()
    edges = np.array([float(x.mid()) for x in spread.entries()]).reshape(n, n)
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


def steps(program: Program, start: Sequence[arb], end: float, settings: Settings) -> Iterator[Step]:
    """The steps from 0 to the end (s), each with the target radius.

    Raises ProofEnded where the proof cannot be continued, TooWide where the radius exceeds the target.
    """
    stepper = Stepper(program, settings)
    shortest = end * SHORTEST
    time, current, h = 0.0, box_set(start), math.inf
    while time < end:
        at = stepper.expand(time, current)
        h = min(h, stepper.first_width(at))
        if h < end - time:
            h = round_down(h, shortest)
        flow, following = stepper.step(at, min(h, end - time), shortest)
        step = stepper.dense(at, flow)
        if max(step.radius) > settings.target:
            raise TooWide(time, f"its radius there is {max(step.radius):.1e}, above {settings.target:.1e}")
        yield step
        current = stepper.end_set(at, flow)
        time, h = time + flow.width, following


def settings_for(target: float, guard_bits: int) -> Settings:
    """Orders and precision for remainders of target / 2^guard_bits."""
    tolerance = target * 2.0**-guard_bits
    digits = -math.log2(tolerance)
    return Settings(target, tolerance, order=max(12, round(0.42 * digits)), low_order=6, bits=round(digits) + 40)


def prove(
    program: Program, start: Callable[[], Sequence[arb]], end: float, target: float
) -> tuple[Settings, list[Step]]:
    """All steps, and the settings that reached the target: remainders and bits shrink and grow until it holds.

    start: gives the balls at the precision of the attempt. end: s. target: absolute radius, for all states.
    Raises ProofEnded: see `steps`.
    """
    ended: ProofEnded | None = None
    for guard_bits in GUARD_BITS:
        settings = settings_for(target, guard_bits)
        try:
            with precision(settings.bits):
                return settings, list(steps(program, start(), end, settings))
        except TooWide as wide:
            ended = wide
    assert ended is not None
    raise ended
