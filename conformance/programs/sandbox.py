# SPDX-License-Identifier: MIT
"""A sandbox for programs, where the machine has bubblewrap: no network, and nothing writable but the build folder."""

import functools
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from conformance.programs.ports import Engine

NAME = "bubblewrap"
BOX = ("bwrap", "--die-with-parent", "--unshare-net", "--unshare-pid", "--unshare-ipc", "--ro-bind", "/", "/")
FRESH = ("--dev", "/dev", "--proc", "/proc")


@functools.cache
def works() -> bool:
    """Whether a program can be started in one: some containers do not permit it."""
    return bool(shutil.which(BOX[0])) and subprocess.run([*BOX, *FRESH, "true"], capture_output=True).returncode == 0


def boxed(engine: Engine, command: Sequence[str], build: Path) -> tuple[list[str], str]:
    """The command, to be run in `build`, and the sandbox that it now runs in: "" where there is none.

    What a program keeps in its home comes into build/<port>/home; temporary files into memory that ends with it, at a
    path without a space, which not every engine bears. Proprietary engines run outside: they may need the network, or
    their user's home, for their licences.
    """
    if engine.proprietary or not works():
        return list(command), ""
    home = build.resolve() / "home"
    home.mkdir(parents=True, exist_ok=True)
    places = ["--bind", str(build.resolve()), str(build.resolve()), "--chdir", str(build.resolve())]
    homes = {"HOME": str(home), "XDG_CACHE_HOME": str(home), "TMPDIR": "/dev/shm"}
    settings = [word for name, value in homes.items() for word in ("--setenv", name, value)]
    return [*BOX, *FRESH, *places, *settings, "--", *command], NAME
