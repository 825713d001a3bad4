# SPDX-License-Identifier: MIT
"""What others wrote: files read within bounds, and texts from them shown so that they can forge and flood nothing."""

import json
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, NoReturn

SHOWN = 80  # characters of a text that a message shows
LARGEST = 1 << 24  # bytes of a file that is read whole: a result of six ports has 50 kB


def plain(text: object, longest: int = SHOWN) -> str:
    """The text on one line: what does not print is escaped, lone surrogates too, and the middle of a long one left out.

    What does not print are control characters, line ends, marks of direction and all that is not in Unicode.
    """
    some = str(text)
    if len(some) > longest:
        some = f"{some[: longest * 3 // 4]}...{some[-(longest // 4) :]}"
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in some)


def shown(text: str, longest: int = SHOWN) -> str:
    """The text in quotes, as `plain` shows it."""
    some = plain(text, longest)
    return f'"{some}"' if "'" in some else f"'{some}'"


def regular(path: Path) -> None:
    """Raise ValueError unless there is a regular file, which can be read without waiting."""
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        raise ValueError(f"{plain(path.name)}: no such file") from None
    except ValueError:  # a NUL in the name
        raise ValueError(f"{plain(path.name)}: no name of a file") from None
    except OSError as error:
        raise ValueError(f"{plain(path.name)}: cannot be read ({error.strerror})") from None
    if not stat.S_ISREG(mode):
        raise ValueError(f"{plain(path.name or path)}: found a folder, a pipe or a device, expected a file")


def read_bytes(path: Path, largest: int = LARGEST) -> bytes:
    """The bytes of a regular file; raises ValueError where there is none, it cannot be read or is larger."""
    regular(path)
    try:
        with open(path, "rb") as file:
            content = file.read(largest + 1)
    except OSError as error:
        raise ValueError(f"{plain(path.name)}: cannot be read ({error.strerror})") from None
    if len(content) > largest:
        raise ValueError(f"{plain(path.name)}: found more than {largest} bytes, expected a small file")
    return content


def read_text(path: Path, largest: int = LARGEST) -> str:
    """The text of a regular file in UTF-8, without a byte-order mark; raises ValueError."""
    content = read_bytes(path, largest)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        found = f"the byte {content[error.start]:#04x}"
        raise ValueError(f"{plain(path.name)}, line {line}: found {found}, expected text in UTF-8") from None


def read_json(path: Path) -> Any:
    """The value of a JSON file; raises ValueError, naming the place of what is no JSON."""
    text = read_text(path)
    try:
        return json.loads(text, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        _misread(path, text, error.lineno, error.colno, "JSON")
    except (ValueError, RecursionError):
        _beyond(path)


def read_toml(path: Path) -> dict[str, Any]:
    """The table of a TOML file, its decimals as texts; raises ValueError, naming the place of what is no TOML."""
    text = read_text(path)
    try:
        return tomllib.loads(text, parse_float=str)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"\(at line (\d+), column (\d+)\)$", str(error))
        end = text.count("\n") + 1, len(text) - text.rfind("\n")
        line, column = (int(place[1]), int(place[2])) if place else end
        _misread(path, text, line, column, f"TOML ({plain(str(error).partition(' (at')[0])})")
    except (ValueError, RecursionError):
        _beyond(path)


def _misread(path: Path, text: str, line: int, column: int, what: str) -> NoReturn:
    rest = "".join(text.splitlines(keepends=True)[line - 1 : line])[column - 1 :]
    found = shown(rest, 40) if rest.strip() else "nothing more"
    raise ValueError(f"{plain(path.name)}, line {line}, column {column}: found {found}, expected {what}")


def _no_number(text: str) -> NoReturn:
    raise ValueError(f"{text} is no number of JSON")


def _beyond(path: Path) -> NoReturn:
    """What Python's readers say of a number of thousands of digits, or of thousands of brackets, is not for users."""
    found = "a number that is none or has thousands of digits, or brackets nested thousands deep"
    raise ValueError(f"{plain(path.name)}: found {found}") from None


def kind(value: object) -> str:
    """What a value of JSON or TOML is, in a word for messages; numbers and texts show themselves."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        return "a list"
    if isinstance(value, str):
        return shown(value, 40)
    if isinstance(value, int) and abs(value) >= 10**20:
        return "a number of more than 20 digits"
    return plain(value, 40)
