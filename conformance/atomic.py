# SPDX-License-Identifier: MIT
"""Files that are written at once or not at all."""

import os
import tempfile
from pathlib import Path


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write beside and rename, so that no half-written file is left, whoever else writes it; text is UTF-8."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f"{path.name}.", delete=False) as part:
        part.write(content.encode() if isinstance(content, str) else content)
    os.chmod(part.name, 0o644)
    os.replace(part.name, path)
