# SPDX-License-Identifier: MIT
"""How far a proof is, as a bar on a terminal."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

LATE = 2.0  # s before a bar is worth showing


@contextmanager
def bar(end: float) -> Iterator[Callable[[float], None]]:
    """A callback for the time reached (s), of `end`; what takes less than 2 s, or is no terminal, shows nothing."""
    form = "{desc}: t = {n:.4g} of {total:g} s |{bar}| {elapsed}"
    shown: list[Any] = []
    with ExitStack() as closing:

        def reached(time: float) -> None:
            if not shown:
                from tqdm import tqdm  # which takes a while, and no proof is needed where one was kept

                made = tqdm(total=end, desc="proof", delay=LATE, disable=None, leave=False, bar_format=form)
                shown.append(closing.enter_context(made))
            shown[0].n = time
            shown[0].update(0)
            shown[0].refresh()

        yield reached
