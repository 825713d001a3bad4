# SPDX-License-Identifier: MIT
"""What changed between two results (build/result.json, or what validate --json writes)."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from conformance.foreign import plain, read_json

SCHEMA = Path(__file__).with_name("result.schema.json")
NOTABLE = 1.1  # a figure that changes by less than this factor is not told: compilers and libraries round otherwise
CLAIMED = ("status", "engine")  # what a verdict says beside its results
SLIGHT = 1e-3  # of the bound: what stays below it is not told


class Change(NamedTuple):
    """What changed of a program: its status, its engine or a claim; `what` is "" where the program came or went.

    None is before what came, and after what went. `way` is worse, better, or "" for neither.
    """

    name: str
    what: str
    was: str | None
    now: str | None
    way: str = ""
    factor: str = ""

    def __str__(self) -> str:
        of = f"{self.name}: {self.what}: " if self.what else f"{self.name}: "
        if self.now is None:
            return f"{of}{'no longer measured' if self.what else 'gone'}"
        if self.was is None:
            return f"{of}new, {self.now}"
        if self.what in CLAIMED:
            return f"{self.name}: {self.what} was '{self.was}', is '{self.now}'"
        factor = f" ({self.factor})" if self.factor else ""
        return f"{of}{self.way + ', ' if self.way else ''}was {self.was}, is {self.now}{factor}"


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
    return by_name(whole)


def by_name(result: Mapping[str, Any]) -> dict[str, Any]:
    """The verdicts of a result."""
    return {verdict["name"]: verdict for verdict in result["verdicts"]}


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """One line per change, and their numbers."""
    found = changes(old, new)
    return [*map(str, found), *filter(None, [counted(found)])]


def counted(found: Iterable[Change]) -> str:
    """How many got worse and better; "" where none did."""
    ways = Counter(change.way for change in found)
    return ", ".join(f"{ways[way]} {way}" for way in ("worse", "better") if ways[way])


def changes(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Change]:
    """What came or went: a status, engine, claim or bound, a figure by a tenth; then what got worse, then better."""
    found = [*_changes(old, new)]
    return sorted(found, key=lambda change: ("", "worse", "better").index(change.way))


def _changes(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[Change]:
    for name in old:
        if name not in new:
            yield Change(plain(name), "", "there", None)
    for name, verdict in new.items():
        if name not in old:
            yield Change(plain(name), "", None, verdict["status"])
            continue
        for what in CLAIMED:
            if old[name][what] != verdict[what]:
                yield Change(plain(name), what, plain(old[name][what]), plain(verdict[what]))
        yield from _changed_results(plain(name), old[name]["results"], verdict["results"])


def _changed_results(name: str, old: list[dict[str, Any]], new: list[dict[str, Any]]) -> Iterator[Change]:
    before = {result["claim"]: result for result in old}
    after = {result["claim"]: result for result in new}
    for claim, result in before.items():
        if claim not in after:
            yield Change(name, claim, _said(result), None)
    for claim, result in after.items():
        if claim not in before:
            yield Change(name, claim, None, _said(result))
            continue
        way = _way(before[claim], result)
        if way or before[claim]["bound"] != result["bound"]:
            yield Change(name, claim, _said(before[claim]), _said(result), way, _factor(before[claim], result))


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
    return f"{b / a:.3g} times" if 0 < a < b < float("inf") else ""


def _figure(result: dict[str, Any]) -> float:
    return float("inf") if result["figure"] is None else abs(_float(result["figure"]))


def _float(number: Any) -> float:
    try:
        return float(number)
    except OverflowError:
        return float("inf")
