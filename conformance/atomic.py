# SPDX-License-Identifier: MIT
"""Files that are written at once or not at all."""

import os
import stat
import sys
import tempfile
from pathlib import Path


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write beside and rename, so that no half-written file is left, whoever else writes it; text is UTF-8.

    A link stays, and what it points to is written; an existing file keeps its mode; a pipe or a device is written to as
    it is. Raises OSError, leaving nothing.
    """
    path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file() and not path.is_dir():
        with open(path, "wb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    mode = stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o644
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=".part.", delete=False) as part:
        try:
            part.write(content.encode() if isinstance(content, str) else content)
            part.flush()
            os.chmod(part.name, mode)
            os.replace(part.name, path)
        except BaseException:
            os.unlink(part.name)
            raise


def write_output(path: Path, content: str) -> None:
    """Write where a user says, as above; - is standard output."""
    if str(path) == "-":
        sys.stdout.write(content)
    else:
        write_atomically(path, content)


def withdraw(path: Path) -> None:
    """Remove an old result, so that it does not outlive a run that cannot write a new one; a link to it stays."""
    if path.is_file():
        os.unlink(os.path.realpath(path))


def check_output(path: Path, *inputs: Path | None) -> None:
    """Raise ValueError where the output is one of the inputs, by whatever name, or is a folder."""
    if path.is_dir():
        raise ValueError(f"found the folder {path.name!r}, expected a file to write to")
    for one in inputs:
        if one is not None and path.exists() and one.exists() and path.samefile(one):
            raise ValueError(f"found {path.name!r} to be read and to be written, expected two files")
