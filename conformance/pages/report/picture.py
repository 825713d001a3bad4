# SPDX-License-Identifier: MIT
"""Charts as vectors, made with the page: they are there at first sight, on paper, and without script."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.path import Path
from matplotlib.ticker import Locator, LogLocator, MaxNLocator

from conformance.judging.trajectory import Array

WIDTH, HEIGHT = 480, 230  # of a picture, in its own units
LEFT, RIGHT, TOP, BOTTOM = 46, 8, 8, 34  # margins
SLACK = 0.01  # by which a tick may stand outside of it
ROOM = 0.06  # share of the range of the values above and below them
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MINUS = str.maketrans("-", "\N{MINUS SIGN}")


@dataclass(frozen=True)
class Line:
    """A curve: values, shape (points,), NaN where there are none; its colour in CSS, width, dashes, and symbol's name.

    A filled one has the area to `down_to`, shape (points,), in its colour, and no outline.
    """

    values: Array
    colour: str
    width: float = 1.75
    dash: str = ""
    down_to: Array | None = None
    symbol: str = ""


def picture(x: Array, lines: Sequence[Line], words: str, logarithmic: bool = False, across: str = "t (s)") -> Markup:
    """The curves over x, shape (points,), as SVG; `words` say what is seen, for those who do not see it."""
    low, high = span([line.values for line in lines] + [line.down_to for line in lines if line.down_to is not None],
                     logarithmic)  # fmt: skip
    horizontal = Scale(float(np.nanmin(x)), float(np.nanmax(x)), LEFT, WIDTH - RIGHT)
    vertical = Scale(low, high, HEIGHT - BOTTOM, TOP, logarithmic)
    parts = [*grid(horizontal, vertical), *(drawn(line, x, horizontal, vertical) for line in lines)]
    parts.append(Markup('<text class="name" x="{}" y="{}">{}</text>').format(WIDTH - RIGHT, HEIGHT - 4, across))
    opening = Markup(
        '<svg class="still" preserveAspectRatio="xMinYMid" viewBox="0 0 {} {}" role="img" aria-label="{}">'
    )
    opening = opening.format(WIDTH, HEIGHT, words)
    return opening + Markup("").join(parts) + Markup("</svg>")


@dataclass(frozen=True)
class Scale:
    """From values to places."""

    low: float
    high: float
    first: float
    last: float
    logarithmic: bool = False

    def __call__(self, values: Array) -> Array:
        """Where these values stand."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ends, at = np.array([self.low, self.high]), np.asarray(values)
            (low, high), at = (np.log10(v) if self.logarithmic else v for v in (ends, at))
            places: Array = self.first + (self.last - self.first) * (at - low) / (high - low)
        return places

    def ticks(self) -> list[float]:
        """Round values within it."""
        locator: Locator = LogLocator(numticks=6) if self.logarithmic else MaxNLocator(5, steps=[1, 2, 5, 10])
        ends = sorted((self.first, self.last))
        ticks = np.array([float(value) for value in locator.tick_values(self.low, self.high)])
        places = self(ticks)
        return [float(v) for v in ticks[(places >= ends[0] - SLACK) & (places <= ends[1] + SLACK)]]


def span(values: Iterable[Array], logarithmic: bool) -> tuple[float, float]:
    """From below the least to above the largest value, or whole powers of ten."""
    known = np.concatenate([np.empty(0), *(v[np.isfinite(v) & ((v > 0) | (not logarithmic))] for v in values)])
    if not known.size:
        return (1e-12, 1.0) if logarithmic else (0.0, 1.0)
    low, high = float(known.min()), float(known.max())
    if logarithmic:
        return 10.0 ** np.floor(np.log10(low)), 10.0 ** max(np.ceil(np.log10(high)), np.floor(np.log10(low)) + 1)
    room = ROOM * (high - low) or ROOM * abs(high) or 1.0
    return low - room, high + room


def grid(horizontal: Scale, vertical: Scale) -> Iterator[Markup]:
    """The rules and their values."""
    rule = Markup('<path class="rule" d="M{} {}{}{}"/>')
    for value in horizontal.ticks():
        x = f"{float(horizontal(np.array(value))):.1f}"
        yield rule.format(x, TOP, "V", HEIGHT - BOTTOM)
        yield Markup('<text x="{}" y="{}" text-anchor="middle">{}</text>').format(x, HEIGHT - BOTTOM + 14, told(value))
    for value in vertical.ticks():
        y = float(vertical(np.array(value)))
        yield rule.format(LEFT, f"{y:.1f}", "H", WIDTH - RIGHT)
        text = power_of_ten(value) if vertical.logarithmic else told(value)
        yield Markup('<text x="{}" y="{}" text-anchor="end">{}</text>').format(LEFT - 6, f"{y + 4:.1f}", text)


def told(value: float) -> str:
    """A round value."""
    return f"{value:.6g}".translate(MINUS)


def power_of_ten(value: float) -> str:
    """A power of ten."""
    return f"10{str(round(np.log10(value))).translate(SUPERSCRIPTS)}"


def drawn(line: Line, x: Array, horizontal: Scale, vertical: Scale) -> Markup:
    """A curve, with the points alone that are seen."""
    places = horizontal(x)
    if line.down_to is not None:
        known = np.isfinite(line.values) & np.isfinite(line.down_to)
        upper, lower = vertical(line.values[known]), vertical(line.down_to[known])
        area = path_of(np.concatenate([places[known], places[known][::-1]]), np.concatenate([upper, lower[::-1]]))
        return Markup('<path class="area" style="fill:{}" d="{}Z"/>').format(line.colour, area)
    dash = f";stroke-dasharray:{line.dash}" if line.dash else ""
    style = f"stroke:{line.colour};stroke-width:{line.width}{dash}"
    symbol = Markup(' data-symbol="{}"').format(line.symbol) if line.symbol else ""
    path = path_of(places, vertical(line.values))
    return Markup('<path class="curve"{} style="{}" d="{}"/>').format(symbol, style, path)


def path_of(x: Array, y: Array) -> str:
    """A path through the points, those left out that no eye would miss, interrupted where there are none."""
    seen = Path(np.column_stack([x, y])).cleaned(simplify=True, remove_nans=True)
    letters = {int(Path.MOVETO): "M", int(Path.LINETO): "L"}
    points = zip(np.asarray(seen.vertices).tolist(), np.asarray(seen.codes).tolist(), strict=True)
    return "".join(f"{letters[code]}{a:.1f} {b:.1f}" for (a, b), code in points if code in letters)
