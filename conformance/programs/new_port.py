# SPDX-License-Identifier: MIT
"""The skeleton of a port: a folder with a whole small port in AWK, which runs and conforms, to be translated."""

import re
import shutil
import tempfile
from pathlib import Path

from conformance.programs.ports import LESSON, ROOT, read_ports

SKELETON = Path(__file__).with_name("skeleton")
AWK = f"{LESSON}.awk"  # its program, which needs nothing that a machine with make has not


def write_skeleton(name: str, root: Path = ROOT) -> list[Path]:
    """Write the folder of a new port, whole or not at all, and return its files.

    Raises ValueError for a name that is no lower-case identifier, or is taken.
    """
    if not re.fullmatch(r"[a-z][a-z0-9]{0,29}", name):
        raise ValueError(f"found the name {name!r}, expected at most 30 lower-case letters and digits, such as fortran")
    if name in taken(root):
        raise ValueError(f"found the name {name!r}, which a port, a file, or the Makefile has; expected another one")
    with tempfile.TemporaryDirectory(dir=root, prefix=".") as place:
        part = Path(shutil.copytree(SKELETON, Path(place) / name))
        for file in part.iterdir():
            file.write_text(file.read_text().replace("NAME", name))
        part.rename(root / name)
    return sorted((root / name).iterdir())


def taken(root: Path = ROOT) -> set[str]:
    """The names that no new port can have: those of ports, of what stands at the top, and what the Makefile keeps."""
    kept = re.findall(r"^(?:TARGETS|KEPT) := (.*)$", (root / "Makefile").read_text(), flags=re.MULTILINE)
    return {*read_ports(root), *" ".join(kept).split(), *(path.stem.lower() for path in root.iterdir())}
