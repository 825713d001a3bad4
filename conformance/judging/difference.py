# SPDX-License-Identifier: MIT
"""What changed between two results (build/result.json, or what validate --json writes)."""

import json
from pathlib import Path
from typing import Any

from conformance.foreign import plain, read_json

SCHEMA = Path(__file__).with_name("result.schema.json")
NOTABLE = 1.1  # a figure that changes by less than this factor is not told: compilers and libraries round otherwise
SLIGHT = 1e-3  # of the bound: what stays below it is not told


def read_result(path: Path) -> dict[str, Any]:
    """The verdicts of a result file, by name; raises ValueError, naming the key, where it is none."""
    import jsonschema  # which takes a while

    whole = read_json(path)
    found = jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).iter_errors(whole)
    wrong = jsonschema.exceptions.best_match(found)
    if wrong is not None:
        where = plain(wrong.json_path.removeprefix("$").removeprefix(".") or "the whole")
        raise ValueError(
            f"{plain(path.name)}, {where}: found no result of this suite ({plain(wrong.message)}); "
            "check writes build/result.json"
        )
    return {verdict["name"]: verdict for verdict in whole["verdicts"]}


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """One line per change, what got worse before what got better; then their numbers.

    What came or went; a status, engine, claim or bound; a figure by a tenth.
    """
    lines = [f"{plain(name)}: gone" for name in old if name not in new]
    moved: dict[str, list[str]] = {"worse": [], "better": []}
    for name, verdict in new.items():
        if name not in old:
            lines.append(f"{plain(name)}: new, {verdict['status']}")
            continue
        for what in ("status", "engine"):
            if old[name][what] != verdict[what]:
                lines.append(f"{plain(name)}: {what} was '{plain(old[name][what])}', is '{plain(verdict[what])}'")
        for way, line in _changed_results(old[name]["results"], verdict["results"]):
            moved.get(way, lines).append(f"{plain(name)}: {line}")
    counts = [f"{len(told)} {way}" for way, told in moved.items() if told]
    return [*lines, *moved["worse"], *moved["better"], *([", ".join(counts)] if counts else [])]


def _changed_results(old: list[dict[str, Any]], new: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Whether each changed claim got better or worse, "" for neither, and the line that tells it."""
    before = {result["claim"]: result for result in old}
    after = {result["claim"]: result for result in new}
    lines = [("", f"{claim}: no longer measured") for claim in before if claim not in after]
    for claim, result in after.items():
        if claim not in before:
            lines.append(("", f"{claim}: new, {_said(result)}"))
            continue
        way = _way(before[claim], result)
        if way or before[claim]["bound"] != result["bound"]:
            told = f"{claim}: {way + ', ' if way else ''}was {_said(before[claim])}, is {_said(result)}"
            lines.append((way, told + _factor(before[claim], result)))
    return lines


def _way(old: dict[str, Any], new: dict[str, Any]) -> str:
    """Whether a figure got better or worse by a notable factor, or passes now; "" for neither."""
    if old["passed"] != new["passed"]:
        return "better" if new["passed"] else "worse"
    a, b = _figure(old), _figure(new)
    if max(a, b) <= SLIGHT * _float(new["bound"]) or max(a, b) <= NOTABLE * min(a, b):
        return ""
    return "worse" if b > a else "better"


def _said(result: dict[str, Any]) -> str:
    figure = "not finite" if result["figure"] is None else f"{_figure(result):.3g}"
    return f"{figure} of {_float(result['bound']):.3g}, {'holds' if result['passed'] else 'fails'}"


def _factor(old: dict[str, Any], new: dict[str, Any]) -> str:
    a, b = sorted((_figure(old), _figure(new)))
    return f" ({b / a:.3g} times)" if 0 < a < b < float("inf") else ""


def _figure(result: dict[str, Any]) -> float:
    return float("inf") if result["figure"] is None else abs(_float(result["figure"]))


def _float(number: Any) -> float:
    try:
        return float(number)
    except OverflowError:
        return float("inf")
