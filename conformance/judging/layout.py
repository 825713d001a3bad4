# SPDX-License-Identifier: MIT
"""What a header, a row or a cell is that does not belong into a CSV of the contract's form: ordered tables of traits.

The first trait that fits names it. What no trait fits is told in general words.
"""

import csv
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

ALIASES = {"referenceSignal": "reference"}  # the lesson's, beside camel case
COUNTED = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
NUMBER = re.compile(r"[ \t]*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?[ \t]*", re.ASCII)
LOOKED_AT = 200  # characters of a cell that is no number
COMMENT = ("#", "%", "//", "!", "*")
INDEX = "an index column stands before t; pandas leaves it out with index=False, R with row.names=FALSE"
CARRIAGE_RETURNS = "the lines end in a carriage return alone"
SEPARATORS = {  # beside the comma
    ";": "semicolons stand between the columns: the separator is a comma, the decimal sign a point",
    "\t": "tabs stand between the columns: the separator is a comma",
    "|": "pipes stand between the columns: the separator is a comma",
    " ": "spaces stand between the columns: the separator is a comma",
}
BEGINNINGS = (  # of files that are something else
    (b"\xff\xfe", "UTF-16, as PowerShell's > writes"),
    (b"\xfe\xff", "UTF-16"),
    (b"\x1f\x8b", "a file compressed by gzip"),
    (b"BZh", "a file compressed by bzip2"),
    (b"\xfd7zXZ", "a file compressed by xz"),
    (b"\x28\xb5\x2f\xfd", "a file compressed by zstd"),
    (b"PK\x03\x04", "a zip file or an Excel workbook"),
    (b"\xd0\xcf\x11\xe0", "an Excel workbook"),
    (b"MATLAB 5.0 MAT-file", "a MAT-file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"\x93NUMPY", "a NumPy file"),
    (b"PAR1", "a Parquet file"),
    (b"%PDF", "a PDF"),
    (b"\x89PNG", "a picture"),
    (b"\x7fELF", "a program"),
    (b"SQLite format", "a data base"),
)


def columns_of(names: Sequence[str]) -> tuple[str, ...]:
    """The columns of a log of these states and estimates."""
    return ("t", *names, "reference", "tracking_error")


def numbers_of(columns: Sequence[str]) -> str:
    """How many numbers a row has, in words."""
    return f"{COUNTED[len(columns)] if len(columns) < len(COUNTED) else len(columns)} numbers"


@dataclass(frozen=True)
class Line:
    """A line of a file as text, and its cells, out of their quotes and without the spaces around them.

    `columns` are those that the file ought to have.
    """

    text: str
    cells: tuple[str, ...]
    columns: tuple[str, ...]
    last: bool = False

    @property
    def numbers(self) -> list[bool]:
        """For each cell whether it is a number."""
        return [is_number(cell) for cell in self.cells]

    @property
    def names(self) -> tuple[str, ...]:
        """The cells as names of columns, in the contract's spelling."""
        return tuple(canonical(cell, self.columns) for cell in self.cells)

    @property
    def extra(self) -> int:
        """How many cells there are more than columns."""
        return len(self.cells) - len(self.columns)

    @property
    def quoted(self) -> bool:
        """Whether it is one cell, with as many commas in it as a row has."""
        return len(self.cells) == 1 and self.text.count(",") == len(self.columns) - 1


def line_of(text: str, columns: tuple[str, ...], last: bool = False) -> Line:
    """A line without its end, split at the commas that are in no quotes (RFC 4180)."""
    if '"' not in text:
        return Line(text, tuple(cell.strip(" \t") for cell in text.split(",")), columns, last)
    try:
        (cells,) = csv.reader([text], skipinitialspace=True, strict=True)
    except (csv.Error, ValueError):
        cells = text.split(",")
    return Line(text, tuple(cell.strip(" \t") for cell in cells), columns, last)


def is_number(cell: str) -> bool:
    """Whether it is a decimal number and nothing else."""
    return NUMBER.fullmatch(cell) is not None


def canonical(name: str, columns: tuple[str, ...]) -> str:
    """The contract's spelling of a column's name, which may stand in camel case."""
    camel = (column for column in columns if re.sub(r"_([a-z])", lambda found: found[1].upper(), column) == name)
    return name if name in columns else ALIASES.get(name, next(camel, name))


Trait = tuple[Callable[[Line], bool], str]


def named(line: Line, traits: tuple[Trait, ...]) -> str:
    """What the first trait that fits says, "" where none does."""
    return next((words for fits, words in traits if fits(line)), "")


def _split_by(separator: str) -> Callable[[Line], bool]:
    """Whether this separator, and no comma but a decimal one, makes all the columns or more."""

    def fits(line: Line) -> bool:
        text = line.text.replace('"', "").strip(" ")
        parts = text.split() if separator == " " else text.split(separator)
        words = [part for part in parts if part.strip()]
        names = {canonical(word.strip(), line.columns) for word in words} & set(line.columns)
        numeric = all(re.fullmatch(r"\s*[-+.,\deE]*[\d.]\s*", word) for word in words)
        return len(words) >= len(line.columns) and (len(names) > 2 or numeric)

    return fits


BY_SEPARATOR = tuple((_split_by(separator), words) for separator, words in SEPARATORS.items())


# ---- Headers ----

SIMILAR = {  # other names of the columns, in lower case and without what is no letter or digit
    "time": "t", "times": "t", "ts": "t", "tsec": "t",
    "r": "reference", "ref": "reference", "referencesignal": "reference", "yr": "reference", "yref": "reference",
    "e": "tracking_error", "error": "tracking_error", "trackingerror": "tracking_error", "z1": "tracking_error",
}  # fmt: skip


def _similar(line: Line) -> tuple[str, ...]:
    """The columns that the cells of a header seem to name."""
    bare = [re.sub(r"[^a-z0-9]", "", re.sub(r"[\[(].*", "", name.lower())) for name in line.cells]
    own = {column.replace("_", "").lower(): column for column in line.columns}
    estimates = [column for column in line.columns if column.endswith("_hat")]
    own |= {column.removesuffix("_hat").replace("_", "").lower(): column for column in estimates}
    if len(estimates) == 1:
        own |= dict.fromkeys(("estimate", "parameterestimate"), estimates[0])
    return tuple(own.get(name, SIMILAR.get(name, "")) for name in bare)


HEADERS: tuple[Trait, ...] = (
    (lambda line: not line.text.strip(), "the line is empty"),
    (lambda line: "\r" in line.text, CARRIAGE_RETURNS),
    (lambda line: re.match(r"\s*<(!doctype|html|\?xml)", line.text, re.IGNORECASE) is not None, "it is a web page"),
    (lambda line: line.text.lstrip()[:1] in ("{", "["), "it is JSON"),
    (lambda line: line.text.startswith("version https://git-lfs"), "it is a pointer of Git LFS, not the file"),
    (lambda line: re.match(r"sep=[^,]", line.text) is not None, SEPARATORS[";"]),
    (lambda line: line.cells[-1] == "" and line.names[:-1] == line.columns, "a comma stands at the end of the line"),
    (lambda line: line.extra == 1 and line.names[1:] == line.columns, INDEX),
    (lambda line: len(line.cells) > 1 and all(line.numbers), "there is no header: the first line holds numbers"),
    (lambda line: line.quoted, "the whole line stands in quotes"),
    *BY_SEPARATOR,
    (
        lambda line: line.text.startswith(COMMENT) and not set(line.names) & set(line.columns),
        "a remark stands before the header",
    ),
    (lambda line: sorted(line.names) == sorted(line.columns), "the columns are in another order"),
    (lambda line: len(set(line.cells)) < len(line.cells), "a column stands twice"),
    (
        lambda line: _similar(line) == line.columns,
        "the columns have other names, or units or capitals in them",
    ),
)


# ---- Rows ----

ROWS: tuple[Trait, ...] = (
    (lambda line: not line.text.strip(), "the line is empty"),
    (lambda line: not any(line.cells), "a row of empty cells, as spreadsheets leave them"),
    (lambda line: len(line.cells) > 3 and set(line.names) <= set(line.columns), "the header once more"),
    (lambda line: "\r" in line.text, CARRIAGE_RETURNS),
    (lambda line: line.text.startswith(COMMENT), "a remark"),
    (
        lambda line: line.extra == 1 and line.cells[-1] == "" and any(line.numbers),
        "a comma stands at the end of the row",
    ),
    *BY_SEPARATOR,
    (lambda line: line.extra == 1 and line.cells[0].isdecimal() and "." not in line.cells[0]
        and all(line.numbers) and any("." in cell for cell in line.cells[1:]), INDEX),
    (lambda line: line.extra == 1 and line.text.startswith('"') and all(line.numbers[1:]), INDEX),
    (lambda line: line.quoted, "the whole line stands in quotes"),
    (lambda line: not any(line.numbers) and line.last, "a footer"),
    (lambda line: not any(line.numbers) and line.extra != 0, "a remark"),
    (lambda line: line.extra > 0, "a decimal comma or a thousands separator adds columns"),
    (lambda line: line.extra < 0, "the line is cut off"),
)  # fmt: skip


# ---- Cells ----

PLAIN = r"[-+]?(?:\d+\.?\d*|\.\d+)"
FLOAT = rf"{PLAIN}(?:[eE][-+]?\d+)?"
CELLS = tuple(
    (re.compile(pattern, re.IGNORECASE), words)
    for pattern, words in (
        (r"\s*", "an empty cell"),
        (
            r"[-+]?(nan|qnan|snan)\d*(\([^)]*\))?|[-+]?\d?\.?#(qnan|snan|ind|nan)\d*|[-+]?ind|indeterminate",
            "not a number: the integration failed",
        ),
        (
            r"[-+]?(inf|infinity|infty|\u221e)|[-+]?\d?\.?#inf\d*|(directed|complex)infinity.*",
            "infinite: the integration blew up",
        ),
        (r"#?n/?a|<na>|none|null|nil|nat|missing|undefined|undef|-+|\.|\?", "a missing value"),
        (r"#(div/0|num|value|ref|name|null)[!?]|=.*", "a spreadsheet's formula or error"),
        (r"\*+", "a number that did not fit into Fortran's field"),
        (r"\.?(true|false)\.?|[tf]|yes|no|on|off", "a truth value, no number"),
        (r"[-+]?0x[0-9a-f.]+(p[-+]?\d+)?", "a hexadecimal number; write decimals"),
        (r"0[bo]\d+", "no decimal number"),
        (r"\d{4}-\d\d?-\d\d?.*|\d+/\d+/\d+.*|\d+:\d\d.*|\d+\.\d+\.\d{4}", "a date or a time of day"),
        (
            rf"\(?{FLOAT}\s*[-+]\s*(\d+\.?\d*|\.\d+)?(e[-+]?\d+)?\s*\*?\s*[ij]\)?|\(?{FLOAT}\s*\*?\s*[ij]\)?"
            rf"|complex.*|\({FLOAT},\s*{FLOAT}\)",
            "a complex number",
        ),
        (rf"{PLAIN}\*\^[-+]?\d+", "in the Wolfram Language's notation; write 1.2e-9"),
        (rf"{FLOAT}`.*", "with the Wolfram Language's mark of precision"),
        (rf"{PLAIN}[dq][-+]?\d+", "with Fortran's exponent letter d; write e"),
        (rf"{PLAIN}[-+]\d+", "with an exponent that has lost its letter, as Fortran prints 1e-103; write e"),
        (rf"{PLAIN}\s*(\*|x|\u00d7|\u00b7)\s*10\s*(\^|\*\*).*", "with a power of ten written out; write 1.2e-9"),
        (rf"{PLAIN}\s+e[-+]?\d+|{PLAIN}e\s+[-+]?\d+|[-+]\s+.*\d.*", "with a space within; write 1.2e-9"),
        (rf"{PLAIN}e[-+]?(\d*\.\d*)?", "with an exponent that is no whole number"),
        (r"[-+]?\d{1,3}([ '_.\u00a0\u202f\u2009\u2019]\d{3})+([.,]\d*)?|[-+]?\d{1,3}(,\d{3})+\.\d*|[-+]?\d+(_\d+)+.*",
         "with thousands separators"),
        (r"[-+]?\d*,\d+(e[-+]?\d+)?", "with a decimal comma"),
        (rf"{FLOAT}\s*%", "a percentage"),
        (r"[-+]?\d+\s*/\s*\d+", "a fraction; write decimals"),
        (rf"{FLOAT}[fl]", "with the suffix of a literal in C or Java"),
        (r".*[\u2212\u2010-\u2015\ufe63\uff0d].*", "with a minus sign, or a dash, that is not ASCII; write -"),
        (r".*[\u00a0\u200b-\u200f\u202a-\u202f\u2060-\u2069\ufeff].*", "with a character that is not seen"),
        (r".*(np\.|numpy|tensor|array|decimal|fraction|float).*|\[.*\]?|.*\]|\(.*\)",
         "a printed object, where its number is wanted"),
        (r"['\"\u2018-\u201f`].*|.*['\"\u2018-\u201f`]", "a text in quotes"),
        (rf"{FLOAT}\s*[a-z\u00b5/]+\d*", "a number with a unit, or another letter behind it"),
        (r"\+?-?[-+]{2,}.*", "with two signs"),
    )
)  # fmt: skip


def cell_trait(cell: str) -> str:
    """What a cell is that is no number."""
    some = cell.strip(" \t")[:LOOKED_AT]
    known = next((words for pattern, words in CELLS if pattern.fullmatch(some)), "")
    if not known and any(c.isdigit() and not c.isascii() for c in some):
        return "with digits that are not ASCII"
    return known or "no number"
