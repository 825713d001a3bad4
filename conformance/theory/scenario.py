# SPDX-License-Identifier: MIT
"""An experiment, (10): the lesson's closed loop under given parameters, reference, start and horizon."""

from dataclasses import dataclass, fields
from fractions import Fraction
from pathlib import Path

from conformance.foreign import kind, plain, read_toml, shown
from conformance.theory.numbers import double, exact_value

WAVES = ("sin", "cos")
POSITIVE = ("k1", "k2", "gamma", "horizon")


@dataclass(frozen=True)
class Scenario:
    """Parameters of the lesson's experiment, exact: a decimal is what it says, not its double.

    theta, k1 and k2 in 1/s; r(t) = amplitude wave(omega t + phase), omega in rad/s, phase in rad; horizon in s.
    Raises ValueError for a gain or a horizon that is not positive, and for a wave that is neither sin nor cos.
    """

    theta: Fraction = Fraction("1.2")
    k1: Fraction = Fraction("2")
    k2: Fraction = Fraction("2.5")
    gamma: Fraction = Fraction("3")
    amplitude: Fraction = Fraction("0.5")
    omega: Fraction = Fraction("0.7")
    phase: Fraction = Fraction("0")
    x1_start: Fraction = Fraction("1.2")
    x2_start: Fraction = Fraction("-0.5")
    theta_hat_start: Fraction = Fraction("0")
    horizon: Fraction = Fraction("20")
    wave: str = "sin"

    def __post_init__(self) -> None:
        for name in POSITIVE:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}: found {plain(getattr(self, name), 40)}, expected a positive number")
        if self.wave not in WAVES:
            raise ValueError(f"wave: found {shown(self.wave)}, expected one of {', '.join(WAVES)}")


PARAMETERS = ("theta", "k1", "k2", "gamma", "amplitude", "omega", "phase")  # of the closed loop
NUMBERS = tuple(f.name for f in fields(Scenario) if f.name != "wave")
SCENARIOS = {
    "lesson": Scenario(),
    "problem-6": Scenario(amplitude=Fraction("0.4"), omega=Fraction("0.5"), wave="cos"),
    "no-excitation": Scenario(amplitude=Fraction(0)),
}
LESSON = SCENARIOS["lesson"]
RANGES = {  # of random scenarios: lowest, highest, grain; docs/campaign.md tells why
    "theta": ("-1.5", "1.5", "0.01"),
    "k1": ("0.5", "2.5", "0.01"),
    "k2": ("0.5", "2.5", "0.01"),
    "gamma": ("0.5", "3", "0.01"),
    "amplitude": ("0", "1", "0.01"),
    "omega": ("0.1", "2", "0.01"),
    "phase": ("-3.1", "3.1", "0.1"),
    "x1_start": ("-1.2", "1.2", "0.01"),
    "x2_start": ("-1", "1", "0.01"),
    "theta_hat_start": ("-1", "1", "0.01"),
    "horizon": ("4", "20", "0.5"),  # a multiple of every program's step
}


def scenario_named(name: str) -> Scenario:
    """The scenario of that name, or of that TOML file; raises ValueError where there is none."""
    if name in SCENARIOS:
        return SCENARIOS[name]
    if name.endswith(".toml"):
        return read_scenario(Path(name))
    raise ValueError(f"--scenario: found {shown(name)}, expected one of {', '.join(SCENARIOS)}, or a TOML file")


def read_scenario(path: Path) -> Scenario:
    """The table [scenario] of a TOML file; what it does not name is the lesson's. Raises ValueError."""
    table = read_toml(path)
    if not isinstance(table.get("scenario"), dict):
        found = f"{kind(table['scenario'])} under that name" if "scenario" in table else "none"
        raise ValueError(f"{plain(path.name)}: expected a table [scenario], found {found}")
    try:
        return scenario(table["scenario"])
    except ValueError as error:
        raise ValueError(f"{plain(path.name)}, [scenario], {error}") from None


def scenario(table: dict[str, object]) -> Scenario:
    """A scenario of names and values; a number is a number or a text such as "6/5". Raises ValueError."""
    given: dict[str, Fraction] = {}
    for name, value in table.items():
        if name not in NUMBERS and name != "wave":
            raise ValueError(f"found {shown(name)}, expected one of {', '.join((*NUMBERS, 'wave'))}")
        if name != "wave":
            try:
                given[name] = exact_value(value)
                double(given[name])
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
    wave = table.get("wave", "sin")
    if not isinstance(wave, str):
        raise ValueError(f"wave: found {kind(wave)}, expected one of {', '.join(WAVES)}")
    return Scenario(**given, wave=wave)


def to_toml(experiment: Scenario) -> str:
    """The scenario as a TOML table that `read_scenario` reads back exactly."""
    numbers = [f'{name} = "{getattr(experiment, name)}"' for name in NUMBERS]
    return "\n".join(["[scenario]", *numbers, f'wave = "{experiment.wave}"']) + "\n"
