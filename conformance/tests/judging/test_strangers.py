# SPDX-License-Identifier: MIT
"""Files as strangers send them: what is benign is read, anything else is named for what it is, in one short line."""

import itertools
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from conformance.judging.layout import columns_of, is_number
from conformance.judging.report import read_report, report_problems
from conformance.judging.trajectory import TrajectoryError, _read_quickly, load
from conformance.judging.verdict import judge_file
from conformance.tests.judging.test_corruptions import LINES, RIGHT, RIGHT_TEXT, cell, judged, single, text
from conformance.tests.under_test import NO_EXCITATION
from conformance.theory.lesson import LESSON

COLUMNS = columns_of(LESSON.names)
HEAD = ",".join(COLUMNS)
GOOD = HEAD + "\n0,1.5,0,0,0.5,1\n1,0.5,0,0,0.25,0.25\n20,0.25,0,0,0.25,0\n"


def loaded(content: str | bytes, folder: Path) -> list[float]:
    path = folder / "sent.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "surrogateescape"))
    return load(path, LESSON)["x1"].tolist()


def refusal(content: str | bytes, folder: Path) -> str:
    with pytest.raises(TrajectoryError) as refused:
        loaded(content, folder)
    message = str(refused.value)
    assert message.isprintable() and len(message) < 400
    return message


# ---- Cells ----

CELLS = {
    "False": "a truth value",
    "TRUE": "a truth value",
    ".true.": "a truth value",
    '"True"': "a truth value",
    "": "an empty cell",
    '""': "an empty cell",
    "nan": "not a number: the integration failed",
    "-nan(ind)": "not a number: the integration failed",
    "nan(0x8000)": "not a number: the integration failed",
    "1.#QNAN": "not a number: the integration failed",
    "-1.#IND": "not a number: the integration failed",
    "1.#INF": "infinite",
    "-inf": "infinite",
    "Infinity": "infinite",
    "infinity": "infinite",
    "DirectedInfinity[1]": "infinite",
    "#N/A": "a missing value",
    "NA": "a missing value",
    "None": "a missing value",
    "null": "a missing value",
    "#DIV/0!": "a spreadsheet's formula or error",
    "=A1": "a spreadsheet's formula or error",
    "********": "Fortran's field",
    "0.12-103": "an exponent that has lost its letter",
    "1.5d0": "Fortran's exponent letter d",
    "1d5": "Fortran's exponent letter d",
    "\u22121.5": "a minus sign, or a dash, that is not ASCII",
    "0x1p3": "a hexadecimal number",
    "0x1F": "a hexadecimal number",
    "1+2j": "a complex number",
    "(1.5+0j)": "a complex number",
    "1.5 - 0.5*I": "a complex number",
    "2j": "a complex number",
    "2020-01-01": "a date or a time of day",
    "12:30:00": "a date or a time of day",
    "15%": "a percentage",
    "3/2": "a fraction",
    "1_000": "thousands separators",
    "1'000.5": "thousands separators",
    "1 000.5": "thousands separators",
    "1.5*^-3": "Wolfram Language's notation",
    "1.5`": "mark of precision",
    "1.5x10^3": "a power of ten written out",
    "1e5.5": "an exponent that is no whole number",
    "1e": "an exponent that is no whole number",
    "1.5 e3": "a space within",
    "- 1.5": "a space within",
    '"1,5"': "with a decimal comma",
    "\u0661\u0662": "digits that are not ASCII",
    "\uff11.\uff15": "digits that are not ASCII",
    "1.5f": "the suffix of a literal",
    "1.5 s": "a unit",
    "\u00a01.5": "a character that is not seen",
    "1.5\u200b": "a character that is not seen",
    "np.float64(1.5)": "a printed object",
    "[1.5]": "a printed object",
    "'1.5'": "a text in quotes",
    "--1.5": "two signs",
    "1e999": "beyond 1.8e308",
    "one": "no number",
}


@pytest.mark.parametrize("content", CELLS)
def test_cell_that_is_no_number_is_named(content: str, tmp_path: Path) -> None:
    message = refusal(GOOD.replace("0,1.5,", f"0,{content},"), tmp_path)
    assert "line 2, column x1: found " in message and CELLS[content] in message


def test_fast_reader_reads_no_more_into_plain_bytes_than_the_strict_one() -> None:
    """Every text of up to five of the characters that reach it: a reader that is a state machine has no other cases."""
    for length in range(1, 6):
        texts = ["".join(some) for some in itertools.product("0.e- ", repeat=length)]
        good, bad = ([some for some in texts if is_number(some) is strict] for strict in (True, False))
        accepted = _read_quickly("\n".join(f"0,{some},0,0,0,0" for some in good).encode(), COLUMNS)
        assert accepted is not None and accepted[1].tolist() == [float(some) for some in good]
        assert not [some for some in bad if _read_quickly(f"0,{some},0,0,0,0".encode(), COLUMNS) is not None]


def test_column_of_false_is_not_a_column_of_zeros(tmp_path: Path) -> None:
    path = tmp_path / "false.csv"
    columns = RIGHT | {"reference": np.zeros_like(RIGHT["t"]), "tracking_error": RIGHT["x1"]}
    path.write_text(re.sub(r",0,(?=[^,]*$)", ",False,", text(columns), flags=re.MULTILINE))
    verdict = judge_file(path, NO_EXCITATION)
    assert verdict.reason.startswith("false.csv, line 2, column reference: found 'False', a truth value, no number")


# ---- Layouts ----

QUOTED_ROWS = "\n".join(",".join(f'"{c}"' for c in line.split(",")) for line in GOOD.splitlines()) + "\n"
BENIGN = {
    "a quoted header": GOOD.replace(HEAD, ",".join(f'"{name}"' for name in COLUMNS)),
    "quoted cells": QUOTED_ROWS,
    "quoted cells with spaces": QUOTED_ROWS.replace(",", ", "),
    "empty lines at the end": GOOD + "\n\n \r\n\t\n",
    "spaces and tabs around separators": GOOD.replace(",", " ,\t"),
    "a header after #": "# " + GOOD,
    "a header after %": "%" + GOOD,
    "sep=,": "sep=,\n" + GOOD,
    "sep=, and CRLF": ("sep=,\n" + GOOD).replace("\n", "\r\n"),
    "a byte-order mark and quotes": "\ufeff" + QUOTED_ROWS,
}


@pytest.mark.parametrize("name", BENIGN)
def test_benign_layout_is_read(name: str, tmp_path: Path) -> None:
    assert loaded(BENIGN[name], tmp_path) == [1.5, 0.5, 0.25]


def test_layout_that_costs_something_is_noted(tmp_path: Path) -> None:
    for name, note in (("quoted cells", "quotes"), ("a header after #", "after #"), ("sep=,", "sep=,")):
        loaded(BENIGN[name], tmp_path)
        assert note in " ".join(load(tmp_path / "sent.csv", LESSON).notes)


def indexed(line: str, number: int) -> str:
    return f"{number - 1 if number else ''},{line}"


ROWS = GOOD.splitlines()
FOREIGN: dict[str, tuple[str | bytes, str]] = {
    "pandas' index": ("\n".join(indexed(line, i) for i, line in enumerate(ROWS)), "an index column stands before t"),
    "R's row names": (ROWS[0] + "\n" + "\n".join(f'"{i}",{line}' for i, line in enumerate(ROWS[1:])), "index column"),
    "an index without a name": (ROWS[0] + "\n" + "\n".join(f"{i},{line}" for i, line in enumerate(ROWS[1:])), "index"),
    "a comma at the end of rows": (GOOD.replace("\n", ",\n").replace(HEAD + ",", HEAD), "at the end of the row"),
    "a comma at the end of lines": (GOOD.replace("\n", ",\n"), "a comma stands at the end of the line"),
    "semicolons": (GOOD.replace(",", ";"), "semicolons stand between the columns"),
    "semicolons in rows": (HEAD + "\n" + "\n".join(ROWS[1:]).replace(",", ";"), "semicolons stand between the columns"),
    "semicolons and decimal commas": (GOOD.replace(",", ";").replace(".", ","), "semicolons stand between"),
    "tabs": (GOOD.replace(",", "\t"), "tabs stand between the columns"),
    "spaces": (GOOD.replace(",", "  "), "spaces stand between the columns"),
    "spaces in rows": (HEAD + "\n" + "\n".join(ROWS[1:]).replace(",", " "), "spaces stand between the columns"),
    "pipes": (GOOD.replace(",", "|"), "pipes stand between the columns"),
    "a Markdown table": ("| " + GOOD.replace(",", " | ").replace("\n", " |\n| ")[:-2], "pipes stand between"),
    "sep=;": ("sep=;\n" + GOOD.replace(",", ";"), "semicolons stand between the columns"),
    "no header": ("\n".join(ROWS[1:]), "there is no header"),
    "the header again": (GOOD + GOOD, "line 5: found 6 columns in 't,x1,x2,theta_hat,reference,tracking_error'"),
    "a footer": (GOOD + "Total: 3 rows\n", "line 5: found 1 columns in 'Total: 3 rows', expected 6; a footer"),
    "a remark": (GOOD.replace("\n20", "\n# half of it\n20"), "a remark"),
    "a remark first": ("# made by a program\n" + GOOD, "a remark stands before the header"),
    "an empty line": (GOOD.replace("\n1,", "\n\n1,"), "line 3: found 1 columns in '', expected 6; the line is empty"),
    "an empty first line": ("\n" + GOOD, "line 1: found '', expected"),
    "empty cells at the end": (GOOD + ",,,,,\n", "a row of empty cells"),
    "decimal commas": (GOOD.replace(".", ","), "a decimal comma or a thousands separator"),
    "lines in quotes": ("\n".join(f'"{line}"' for line in ROWS), "the whole line stands in quotes"),
    "carriage returns alone": (GOOD.replace("\n", "\r"), "a carriage return alone"),
    "units": (GOOD.replace("t,x1", "t [s],x1 [m]"), "other names, or units or capitals"),
    "capitals": (GOOD.replace(HEAD, HEAD.upper()), "other names, or units or capitals"),
    "other names": (GOOD.replace(HEAD, "time,x1,x2,thetahat,ref,error"), "other names, or units or capitals"),
    "JSON": ('{"t": [0, 1]}\n', "it is JSON"),
    "a web page": ("<!DOCTYPE html>\n<html>\n", "it is a web page"),
    "UTF-16": (GOOD.encode("utf-16"), "UTF-16"),
    "gzip": (b"\x1f\x8b\x08\x00\x00", "compressed by gzip"),
    "an Excel workbook": (b"PK\x03\x04\x14\x00", "Excel"),
    "Latin 1": (GOOD.encode() + b"\xe9", "the byte 0xe9"),
    "an escape sequence": (GOOD.replace("x1", "x1\x1b[2K\rrun.csv conforms"), r"\x1b[2K\rrun.csv conforms"),
    "a mark of direction": (GOOD.replace("x1", "\u202ex1"), r"\u202ex1"),
    "300 columns": (",".join(f"a_rather_long_name_{i}" for i in range(300)) + "\n", "missing t x1"),
    "one long line": ('"' + "x" * 60000 + '"\n', "..."),
}  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_foreign_layout_is_named(name: str, tmp_path: Path) -> None:
    content, reason = FOREIGN[name]
    assert reason in refusal(content, tmp_path)


def test_name_of_a_file_forges_no_line(tmp_path: Path) -> None:
    path = tmp_path / "a\nrun.csv conforms\x1b[31m\u202e.csv"
    path.write_text("t,x1\n")
    verdict = judge_file(path, LESSON)
    assert verdict.name.isprintable() and "\n" not in verdict.reason and "\x1b" not in verdict.reason


# ---- Digits are no verdict ----

DIGITS: dict[str, tuple[Callable[[], str], str]] = {
    "12 decimals, as the lesson's Java": (lambda: text(RIGHT, "%.12f"), "printed to"),
    "12 digits, as the lesson's C++": (lambda: text(RIGHT, "%.12g"), "printed to 12 digits"),
    "single precision": (lambda: text({k: single(v) for k, v in RIGHT.items()}), "in single precision"),
    "single precision in 9 digits": (
        lambda: text({k: single(v) for k, v in RIGHT.items()}, "%.9g"),
        "in single precision",
    ),
}


@pytest.mark.parametrize("name", DIGITS)
def test_digits_are_noted_and_no_verdict(name: str, tmp_path: Path) -> None:
    content, note = DIGITS[name]
    verdict = judged(content(), tmp_path)
    assert verdict.conforms, verdict.reason
    assert note in " ".join(verdict.notes)


def test_numbers_that_differ_look_different(tmp_path: Path) -> None:
    value = float(LINES[9].split(",")[5])
    message = refusal(cell(10, 5, repr(value + 1e-9)), tmp_path)
    found, expected = (part.split("; ")[0] for part in message.split("found ")[1].split(", expected x1 - reference = "))
    assert float(found) != float(expected) and found != expected


# ---- Standard output ----

SAID = """\
Final tracking error: -2.685662e-09
Final parameter estimate: 1.1999999978
True parameter: 1.2
Data written to judged.csv
"""
ACCEPTED = {
    "as it is": SAID.encode(),
    "an empty line at the end": SAID.encode() + b"\n",
    "CRLF and spaces": SAID.replace("\n", "  \r\n").encode(),
    "a byte-order mark": SAID.encode("utf-8-sig"),
    "UTF-16 by PowerShell": SAID.encode("utf-16"),
    "UTF-16 without a mark": SAID.encode("utf-16-le"),
    "a Java machine": b"Picked up JAVA_TOOL_OPTIONS: -Xmx1g\n" + SAID.encode(),
    "a warning of a Java machine": b"OpenJDK 64-Bit Server VM warning: sharing is off\n" + SAID.encode(),
    "a path": SAID.replace("judged.csv", r"C:\My runs\judged.csv").encode(),
    "capital E": SAID.replace("e-09", "E-9").encode(),
}
REFUSED = {
    "nothing": (b"", "found none of the four lines, expected the four lines of the contract"),
    "a line more": (SAID.encode() + b"Done.\n", "line 5: found 'Done.', expected nothing more"),
    "a line before": (b"Starting\n" + SAID.encode(), "line 1: found 'Starting', expected 'Final tracking error:"),
    "a decimal comma": (SAID.replace("1.1999", "1,1999").encode(), "line 2: found 'Final parameter estimate: 1,1999"),
    "another file": (SAID.replace("judged", "my judged").encode(), "found 'my judged.csv', expected 'judged.csv'"),
    "another estimate": (SAID.replace("1.1999999978", "1.199000").encode(), "estimate: found 1.199000"),
    "an error beyond doubles": (SAID.replace("-2.685662e-09", "1e999").encode(), "tracking error: found 1e999"),
    "a binary file": (bytes(range(1, 256)) * 1000, "standard output, line 1: found"),
}  # fmt: skip


def problems(content: bytes, folder: Path) -> list[str]:
    (folder / "stdout.txt").write_bytes(content)
    (folder / "judged.csv").write_text(RIGHT_TEXT)
    lines, _ = read_report(folder / "stdout.txt")
    return report_problems(lines, load(folder / "judged.csv", LESSON), LESSON, "judged.csv")


@pytest.mark.parametrize("name", ACCEPTED)
def test_standard_output_is_accepted(name: str, tmp_path: Path) -> None:
    assert problems(ACCEPTED[name], tmp_path) == []


@pytest.mark.parametrize("name", REFUSED)
def test_standard_output_is_named_line_by_line(name: str, tmp_path: Path) -> None:
    content, reason = REFUSED[name]
    found = problems(content, tmp_path)
    assert reason in "\n".join(found) and all(line.isprintable() for line in found) and len("".join(found)) < 2000
