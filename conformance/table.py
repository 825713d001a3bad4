# SPDX-License-Identifier: MIT
"""The table of programs: what ran, on which engine, and what came out."""

from collections.abc import Iterable

from conformance.ports import Port

HEAD = ("port", "engine and version", "rows", "final tracking error", "final estimate", "seconds")


def table(ports: Iterable[Port]) -> str:
    """One line per port, from run.json and the CSV's last row; a port that did not run says so."""
    return layout([HEAD, *map(row, ports)])


def row(port: Port) -> tuple[str, ...]:
    """The table's cells for one port."""
    run = port.run()
    if run is None:
        return (port.name, "did not run", "", "", "", "")
    engine = f"{run['engine']}: {run['engine_version']}"
    if run["exit_status"] != 0:
        return (port.name, engine, "", f"failed, status {run['exit_status']}", "", f"{run['seconds']:.1f}")
    lines = port.csv.read_text().splitlines()
    last = lines[-1].split(",")
    return (
        port.name,
        engine,
        str(len(lines) - 1),
        f"{float(last[5]):.3e}",
        f"{float(last[3]):.10f}",
        f"{run['seconds']:.1f}",
    )


def layout(rows: list[tuple[str, ...]]) -> str:
    """Columns as wide as their widest cell."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip() for cells in rows
    )
