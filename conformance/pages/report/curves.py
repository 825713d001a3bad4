# SPDX-License-Identifier: MIT
"""The curves of the page, thinned to one grid for all programs."""

import base64
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from markupsafe import Markup

from conformance.judging.measured import interpolate
from conformance.judging.trajectory import COARSEST, Array, Trajectory
from conformance.pages.report.picture import Line, picture
from conformance.theory.derivation import GREEK, letter
from conformance.theory.experiments import Experiment
from conformance.truth.exact import CONTRACT, Exact

GRID = np.concatenate([np.linspace(0, 0.2, 200, endpoint=False), np.linspace(0.2, 1, 301)])  # shares of the horizon
SPANS = np.concatenate([np.linspace(0, 0.2, 20, endpoint=False), np.linspace(0.2, 1, 33)])  # likewise, between errors

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
SAME = 0.005  # share of the largest value, by which curves that are drawn as one may differ
CLOSE = 1.05  # factor by which they may, on a logarithmic axis
EXACT = "var(--text)"  # the exact solution: a thin line, in the bands of the programs that lie on it
BAND = "color-mix(in srgb, {} 75%, transparent)"


@dataclass(frozen=True)
class Panel:
    """A chart: a signal of every program, its formula (LaTeX), its axis, and what is drawn beside it."""

    signal: str
    formula: str
    axis: str
    beside: str = ""
    logarithmic: bool = False

    @property
    def dashed(self) -> str:
        """What is drawn beside it, in plain letters."""
        known = {"reference": "r", "tolerance": "tolerance, same colour"}
        return known.get(self.beside) or said(self.beside)


def panels(e: Experiment) -> tuple[Panel, ...]:
    """The charts of an experiment: states, error coordinates, estimates, u, V and V'."""
    states = [(name, letter(name), said(name, unit_of(e, name)), "") for name in e.states]
    output, r = e.states[0], (rf"{letter(e.states[0])} \text{{ and }} r", f"{said(e.states[0])}, r", "reference")
    states[0] = (output, *r)
    before = [letter("r"), *(letter(f"alpha{i}") for i in range(1, len(e.states)))]
    errors = [
        (f"z{i}", f"z_{i} = {letter(x)} - {a}", said(f"z{i}"), "")
        for i, (x, a) in enumerate(zip(e.states, before, strict=True), 1)
    ]
    estimates = [
        (q.estimate, rf"{letter(q.estimate)} \text{{ and }} {letter(q.name)}",
         said(f"{q.estimate}, {q.name}", unit_of(e, q.name)), q.name)
        for q in e.unknown
    ]  # fmt: skip
    signals = [*states, *errors, *estimates, ("u", "u", "u", "")]
    losses = " - ".join(f"k_{i} z_{i}^2" for i in range(1, len(e.states) + 1))
    return (
        *(Panel(*signal) for signal in signals),
        Panel("V", "V", "V", logarithmic=True),
        Panel("V_dot", rf"\dot V = -{losses}", "V\u0307"),
    )


def error_panels(e: Experiment) -> tuple[Panel, ...]:
    """The charts of the errors against the exact solution."""
    return tuple(
        Panel(f"error_{name}", rf"|{letter(name)} - {letter(name)}^{{\text{{exact}}}}|",
              f"error of {said(name)}", "tolerance", True)
        for name in (*e.states, *e.estimates)
    )  # fmt: skip


def unit_of(e: Experiment, name: str) -> str:
    """The unit of a symbol, "" where the file says none."""
    return next((symbol.unit for symbol in e.symbols if symbol.name == name), "")


def said(names: str, unit: str = "") -> str:
    """Names as an axis tells them, in plain letters: theta1_hat is a theta with a hat and an index."""
    text = re.sub(r"[A-Za-z]\w*", lambda name: _plain_letters(name[0]), names)
    return f"{text} ({unit})" if unit else text


def _plain_letters(name: str) -> str:
    bare = name.removesuffix("_hat")
    stem = bare.rstrip("0123456789")
    greek = unicodedata.lookup(f"GREEK SMALL LETTER {stem.upper()}") if stem in GREEK and stem.islower() else stem
    return greek + "\N{COMBINING CIRCUMFLEX ACCENT}" * (bare != name) + bare[len(stem) :].translate(SUBSCRIPTS)


def signals(exact: Exact, t: Array, states: Array) -> dict[str, Array]:
    """Every signal of the panels by name, from times, shape (rows,), and states and estimates, shape (m, rows)."""
    errors = {f"z{i}": z for i, z in enumerate(exact.errors(t, states), 1)}
    return {
        **dict(zip(exact.setting.names, states, strict=True)),
        **errors,
        "u": exact.control(t, states),
        "V": exact.lyapunov(t, states),
        "V_dot": -exact.dissipation(t, states)[0],
    }


def curves(exact: Exact, trajectory: Trajectory) -> dict[str, Array]:
    """The signals on the grid, interpolated as the harness does; of the errors the largest of all rows in each span.

    Where the program has no row, or its rows stand so far apart that exact ones would be missed by more than COARSEST,
    there is NaN: the page shows no figure that is not known.
    """
    t, states = trajectory.t, trajectory.states
    grid = GRID * exact.setting.horizon
    truth = exact.evaluate(t)
    edges = [*np.searchsorted(t, SPANS[:-1] * exact.setting.horizon), t.size]
    with np.errstate(all="ignore"):  # a program that failed may have left anything
        between = interpolate(trajectory, exact, grid)
        missed = np.abs(interpolate(trajectory, exact, grid, truth) - exact.evaluate(grid))
        missed *= CONTRACT / exact.tolerance[:, None]
        between[:, (grid > t[-1]) | ~(missed.max(axis=0) <= COARSEST)] = np.nan
        off = np.abs(states - truth)
        largest = [off[:, i:j].max(axis=1) if j > i else np.full(len(off), np.nan) for i, j in pairwise(edges)]
        drawn = signals(exact, grid, between)
    return drawn | {f"error_{name}": row for name, row in zip(exact.setting.names, np.transpose(largest), strict=True)}


def exact_curves(exact: Exact) -> dict[str, Array]:
    """The signals of the exact solution on the grid, and the reference."""
    grid = GRID * exact.setting.horizon
    return {**signals(exact, grid, exact.evaluate(grid)), "reference": exact.reference(grid)}


def pictures(
    panels: Iterable[Panel],
    solution: Exact,
    known: dict[str, Array],
    drawn: Mapping[str, Mapping[str, Array]],
    bounds: Mapping[str, Mapping[str, float]],
    lines: Mapping[str, Iterable[str]],
    colours: int,
) -> dict[str, Markup]:
    """The charts of all programs as vectors, by signal.

    `known` are the exact curves, `bounds` the tolerances, `lines` the programs whose curves are drawn, by signal. Of
    tolerances that are the same, that of the first program is seen.
    """
    t, spans = GRID * solution.setting.horizon, SPANS * solution.setting.horizon
    exact = known | {
        name: np.full_like(t, value)
        for name, value in zip(solution.setting.unknown, solution.setting.theta, strict=True)
    }
    colour = {name: f"var(--colour-{i % colours})" for i, name in enumerate(bounds)}
    found = {}
    for panel in panels:
        of_errors, state = panel.beside == "tolerance", panel.signal.removeprefix("error_")
        beside = [(exact[panel.beside], "var(--quiet)")] if panel.beside in exact else []
        if of_errors:
            whose = [name for name in reversed([*drawn]) if state in bounds[name]]
            beside = [(np.full(spans.size - 1, bounds[name][state]), colour[name]) for name in whose]
        own = [(drawn[name][panel.signal], colour[name]) for name in lines[panel.signal]]
        shape = stepped if of_errors else np.asarray
        found[panel.signal] = picture(
            np.repeat(spans, 2)[1:-1] if of_errors else t,
            [
                *(Line(shape(values), of, 1.25, "4 4") for values, of in beside),
                *(Line(shape(v), of) if of_errors else Line(v, BAND.format(of), 5) for v, of in own),
                *([] if of_errors else [Line(exact[panel.signal], EXACT, 1)]),
            ],
            f"{panel.signal.replace('_', ' ')} over time, of {', '.join(drawn)}",
            panel.logarithmic,
        )
    return found


def stepped(values: Array) -> Array:
    """Of one value per span those at both its ends."""
    return np.repeat(values, 2)


def leaders(drawn: Mapping[str, Mapping[str, Array]], panel: Panel) -> dict[str, list[str]]:
    """The programs whose curves do not lie on that of one before, each with those that lie on its own."""
    found: dict[str, list[str]] = {}
    for name, values in drawn.items():
        same = (o for o in found if coincide(drawn[o][panel.signal], values[panel.signal], panel.logarithmic))
        found.setdefault(next(same, name), []).append(name)
    return found


def legend(
    panel: Panel, found: Mapping[str, Iterable[str]], languages: Mapping[str, str], colours: int
) -> list[tuple[str, str]]:
    """The colour of each curve that is drawn, and what it is: the exact solution, or the languages that lie on it.

    `found` are the panel's leaders, `languages` those of all programs.
    """
    colour = {name: f"var(--colour-{i % colours})" for i, name in enumerate(languages)}
    exact = [] if panel.beside == "tolerance" else [(EXACT, "exact")]
    own = [(colour[leader], together([languages[name] for name in names])) for leader, names in found.items()]
    return exact + own


def together(names: Sequence[str]) -> str:
    """Programs on one line, as the script says it too."""
    if len(names) == 1:
        return names[0]
    return f"{f'all {len(names)}' if len(names) > 3 else ', '.join(names)} on one line"


def coincide(a: Array, b: Array, logarithmic: bool) -> bool:
    """Whether two curves are drawn as one: everywhere by a factor near 1, or by little of the largest value."""
    shown = np.isfinite(a) & np.isfinite(b)
    if logarithmic:
        shown &= (a > 0) & (b > 0)
        return bool(np.all(np.maximum(a, b)[shown] <= CLOSE * np.minimum(a, b)[shown]))
    return bool(np.all(np.abs(a - b)[shown] <= SAME * np.max(np.abs(a[shown]), initial=0)))


def packed(values: Mapping[str, Array]) -> dict[str, str]:
    """The arrays in single precision, base64; what single precision cannot hold becomes NaN."""
    with np.errstate(over="ignore"):
        narrow = {name: array.astype("<f4") for name, array in values.items()}
    return {
        name: base64.b64encode(np.where(np.isfinite(array), array, np.nan).astype("<f4").tobytes()).decode()
        for name, array in narrow.items()
    }
