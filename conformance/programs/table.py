# SPDX-License-Identifier: MIT
"""The table of programs: what ran, on which engine, and what came out."""

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from conformance.foreign import plain, regular
from conformance.programs.ports import Port

HOW = "bubblewrap gives one to open engines; its package is bubblewrap"
HEAD = ("port", "engine and version", "rows", "final tracking error", "final estimate", "seconds")


WITHOUT_TEMPLATE = "has no template, and takes part in the lesson alone"  # of a port, where a plant is asked for


def table(ports: Iterable[Port], lacking: Iterable[str] = ()) -> str:
    """One line per port, from run.json and the CSV's last row; a port that did not run says so.

    `lacking` are the names of those that have no template, of which a plant has no program.
    """
    without = [(name, WITHOUT_TEMPLATE, "", "", "", "") for name in lacking]
    return layout([HEAD, *map(row, ports), *without])


def boxes(ports: Iterable[Port]) -> str:
    """Which of the programs that ran did so in a sandbox, and which did not."""
    runs = {}
    for port in ports:
        with suppress(ValueError):  # of a record that cannot be read the table tells
            runs[port.name] = port.run()
    inside = [name for name, run in runs.items() if run and run.get("sandbox")]
    outside = [name for name, run in runs.items() if run and not run.get("sandbox")]
    parts = [f"in a sandbox (no network, its own build folder alone writable): {', '.join(inside)}"] if inside else []
    parts += [f"without a sandbox ({HOW}): {', '.join(outside)}"] if outside else []
    return "\n".join(parts)


def row(port: Port) -> tuple[str, ...]:
    """The table's cells for one port."""
    try:
        run = port.run()
    except ValueError as unreadable:
        return (port.name, plain(unreadable), "", "", "", "")
    if run is None:
        return (port.name, "did not run", "", "", "", "")
    engine, seconds = engine_and_version(run), f"{run['seconds']:.2f}"
    if run["exit_status"] != 0:
        return (port.name, engine, "", f"failed, status {run['exit_status']}", "", seconds)
    try:
        regular(port.csv)
        lines = port.csv.read_text(encoding="utf-8").splitlines()
        last = dict(zip(lines[0].split(","), map(float, lines[-1].split(",")), strict=True))
        error = last["tracking_error"]
        estimates = ", ".join(f"{value:.10f}" for name, value in last.items() if name.endswith("_hat"))
    except (OSError, ValueError, IndexError, KeyError):
        return (port.name, engine, "", "no CSV, or not whole", "", seconds)
    return (port.name, engine, str(len(lines) - 1), f"{error:.3e}", estimates, seconds)


def engine_and_version(run: dict[str, Any]) -> str:
    """The engine of a record and its version, named once."""
    name, version = run["engine"], run["engine_version"]
    return version if version.lower().startswith(name.lower()) else f"{name}: {version}"


def layout(rows: list[tuple[str, ...]]) -> str:
    """Columns as wide as their widest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip() for cells in rows
    )
