# SPDX-License-Identifier: MIT
"""How far a proof is, as a bar on a terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

LATE = 2.0  # s before a bar is worth showing


@contextmanager
def bar(end: float) -> Iterator[Callable[[float], None]]:
    """A callback for the time reached (s), of `end`; what takes less than 2 s, or is no terminal, shows nothing."""
    from tqdm import tqdm  # which takes a while

    form = "{desc}: t = {n:.4g} of {total:g} s |{bar}| {elapsed}"
    with tqdm(total=end, desc="proof", delay=LATE, disable=None, leave=False, bar_format=form) as shown:

        def reached(time: float) -> None:
            shown.n = time
            shown.update(0)
            shown.refresh()

        yield reached
