# SPDX-License-Identifier: MIT
"""docs/tolerances.md: what each port is held to, state by state, what was measured, and where it comes from."""

from collections.abc import Iterator

from conformance.judging.checks import LARGEST_RATIO
from conformance.judging.verdict import judge_port
from conformance.programs.ports import ROOT, Engine, Port, the_six
from conformance.theory.lesson import LESSON
from conformance.truth.exact import CONTRACT

PAGE = ROOT / "docs" / "tolerances.md"

HEAD = f"""\
# Tolerances

Written by `.venv/bin/conformance tolerances` from the ports' `port.toml` and their last runs.

A tolerance is how far a logged state may be from the exact solution, at any row. None is looser than {CONTRACT:.0e},
the contract's, and none of an engine that has been measured is looser than {LARGEST_RATIO} times its largest error.
Every other bound follows from these: docstrings in `conformance/judging/checks.py` say how, and `validate` prints it
beside the figure. The exact solution adds nothing: its error is below 1e-15 of each state's scale
([truth.md](truth.md)).

| port | engine | state | tolerance | largest error | ratio | where it comes from |
|---|---|---|---|---|---|---|
"""


def page() -> str:
    """The page, from the last runs; raises ValueError where a port has not run, or does not conform."""
    return HEAD + "".join(f"| {' | '.join(row)} |\n" for port in the_six().values() for row in rows(port))


def rows(port: Port) -> Iterator[tuple[str, ...]]:
    """The page's rows for one port: every state at every engine, measured where the engine ran."""
    verdict = judge_port(port, LESSON)
    if not verdict.conforms:
        raise ValueError(f"{port.name}: {verdict.status}; the page needs a run of every port: make all")
    ran = port.ran_engine(port.run() or {})
    errors = {state: result.figure for state, result in verdict.errors.items()}
    for engine in port.engines:
        for state, tolerance in zip(LESSON.names, engine.tolerance, strict=True):
            measured = (f"{errors[state]:.1e}", f"{tolerance / errors[state]:.1f}") if engine is ran else ("", "")
            yield (port.name, engine.name, state, f"{tolerance:.1e}", *measured, _reason(engine))


def _reason(engine: Engine) -> str:
    return engine.tolerance_from.replace("|", "\\|")
