# SPDX-License-Identifier: MIT
"""Where things lie: the top of the clone that this package stands in, and what is kept from one run to the next."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
ROOT = PACKAGE.parent
PLANTS = ROOT / "plants"
IN_A_CLONE = all((ROOT / name).is_file() for name in ("Makefile", "pyproject.toml"))

LESSON = PACKAGE / "lesson.toml"  # the experiment that is meant where none is named


def proofs() -> Path:
    """The folder of what was derived and proven: in a clone, or else in the user's cache."""
    if IN_A_CLONE:
        return ROOT / "build" / "truth"
    from platformdirs import user_cache_path

    return user_cache_path("conformance") / "truth"
