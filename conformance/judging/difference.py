# SPDX-License-Identifier: MIT
"""What changed between two results (build/result.json, or what validate --json writes)."""

import json
from pathlib import Path
from typing import Any

NOTABLE = 2.0  # a figure that changes by less than this factor is not told


def read_result(path: Path) -> dict[str, Any]:
    """The verdicts of a result file, by name; raises ValueError where it is none."""
    try:
        verdicts = json.loads(path.read_text())["verdicts"]
        return {verdict["name"]: verdict for verdict in verdicts}
    except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError):
        raise ValueError(f"{path}: found no result of this suite; check writes build/result.json") from None


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """One line per change: what came or went; a status, engine, claim or bound; a figure by a factor of 2."""
    lines = [f"{name}: gone" for name in old if name not in new]
    for name, verdict in new.items():
        if name not in old:
            lines.append(f"{name}: new, {verdict['status']}")
            continue
        for what in ("status", "engine"):
            if old[name][what] != verdict[what]:
                lines.append(f"{name}: {what} was {old[name][what]!r}, is {verdict[what]!r}")
        lines += [f"{name}: {line}" for line in _changed_results(old[name]["results"], verdict["results"])]
    return lines


def _changed_results(old: list[dict[str, Any]], new: list[dict[str, Any]]) -> list[str]:
    before = {result["claim"]: result for result in old}
    after = {result["claim"]: result for result in new}
    lines = [f"{claim}: no longer measured" for claim in before if claim not in after]
    for claim, result in after.items():
        if claim not in before:
            lines.append(f"{claim}: new, {_said(result)}")
        elif _notable(before[claim], result):
            lines.append(f"{claim}: was {_said(before[claim])}, is {_said(result)}")
    return lines


def _said(result: dict[str, Any]) -> str:
    figure = "not finite" if result["figure"] is None else f"{result['figure']:.3g}"
    return f"{figure} of {result['bound']:.3g}, {'holds' if result['passed'] else 'fails'}"


def _notable(old: dict[str, Any], new: dict[str, Any]) -> bool:
    if old["passed"] != new["passed"] or (old["figure"] is None) != (new["figure"] is None):
        return True
    if old["bound"] != new["bound"]:
        return True
    a, b = sorted((old["figure"] or 0.0, new["figure"] or 0.0))
    return bool(b > NOTABLE * a and b > 1e-3 * new["bound"])
