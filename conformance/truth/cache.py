# SPDX-License-Identifier: MIT
"""Files that are computed once and kept: used only if key and checksum fit, written at once or not at all."""

import contextlib
import hashlib
from pathlib import Path

from conformance.atomic import write_atomically


def read(path: Path, key: str) -> bytes | None:
    """What was kept in this file, or None where there is none, or one that is damaged or of another key."""
    try:
        head, _, payload = path.read_bytes().partition(b"\n")
    except OSError:
        return None
    return payload if head == _head(key, payload) else None


def write(path: Path, key: str, payload: bytes) -> None:
    """Keep the payload; where that cannot be written, nothing is kept and nothing is lost."""
    with contextlib.suppress(OSError):
        write_atomically(path, _head(key, payload) + b"\n" + payload)


def _head(key: str, payload: bytes) -> bytes:
    return f"{key} {hashlib.sha256(payload).hexdigest()}".encode()
