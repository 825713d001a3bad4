# SPDX-License-Identifier: MIT
"""The playground's program, the mistakes that it can be given, and the ranges of its sliders."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from conformance.programs.ports import Port
from conformance.programs.spelling import spelled
from conformance.theory.scenario import SCENARIOS
from conformance.trials.edits import Edit, edited
from conformance.trials.variant import EVERY, Variant

PROGRAM = Port(
    name="playground",
    folder=Path(__file__).parent / "static",
    language="JavaScript",
    source="closed_loop.js",
    method="RK4, written out, h = 0.002",
    comment=("// ", ""),
    section="// ---- {} ----",
    products=(),
    engines=(),
    names="camel",
    functions=(("sin", "Math.sin({})"), ("cos", "Math.cos({})")),
)


@dataclass(frozen=True)
class Slider:
    """A parameter of the scenario that the reader moves: its label (LaTeX), unit and range."""

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float = 0.05


SLIDERS = (
    Slider("theta", r"\theta", "1/s", -2, 3),
    Slider("k1", "k_1", "1/s", 0.1, 6),
    Slider("k2", "k_2", "1/s", 0.1, 6),
    Slider("gamma", r"\gamma", "", 0.05, 10),
    Slider("amplitude", "A", "", 0, 1.5),
    Slider("omega", r"\omega", "rad/s", 0, 3),
    Slider("x1_start", "x_1(0)", "", -2, 2),
    Slider("x2_start", "x_2(0)", "1/s", -3, 3),
    Slider("theta_hat_start", r"\hat\theta(0)", "1/s", -2, 4),
)


def mistakes(variants: Iterable[Variant]) -> dict[str, Variant]:
    """The mistakes, by name, that are the same edit in every program, under the lesson's parameters and reference."""
    return {
        variant.name: variant
        for variant in variants
        if variant.refused_by
        and variant.edits
        and not variant.constants
        and variant.scenario.wave == "sin"
        and all(port == EVERY for port, _ in variant.edits)
    }


def program_text(variant: Variant | None = None) -> str:
    """The program, or the one that makes a mistake; raises ValueError where the mistake's text is not in it once."""
    text = PROGRAM.source_path.read_text(encoding="utf-8")
    edits = variant.edits if variant else ()
    return edited(text, (Edit(spelled(PROGRAM, edit.old), spelled(PROGRAM, edit.new)) for _, edit in edits))


def presets() -> dict[str, dict[str, float]]:
    """The values of the sliders in each scenario that they can set, by the scenario's name."""
    return {
        name: {slider.name: float(getattr(scenario, slider.name)) for slider in SLIDERS}
        for name, scenario in SCENARIOS.items()
        if scenario.wave == "sin" and scenario.phase == 0
    }
