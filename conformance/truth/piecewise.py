# SPDX-License-Identifier: MIT
"""Piecewise polynomials in doubles, with a bound of their error; `dense` makes them from a proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
DEGREE = 8
CHUNK = 8192  # times evaluated together, so that they stay in the cache of a core


@dataclass(frozen=True)
class Table:
    """Piecewise polynomials for all rows, in doubles.

    edges: (pieces + 1,) s. centre, half: (pieces,) s. polynomial: (rows, DEGREE + 1, pieces).
    bound: (rows,), of |double - solution| at every time. scale: (rows,), not above max |row| over the horizon.
    """

    edges: Floats
    centre: Floats
    half: Floats
    polynomial: Floats
    bound: Floats
    scale: Floats

    def __call__(self, times: ArrayLike, rows: Sequence[int]) -> Floats:
        """The rows at the times (s), in any order: shape (len(rows), *times.shape).

        Raises ValueError for a time outside of the horizon.
        """
        t = np.asarray(times, dtype=float)
        if not np.all((t >= self.edges[0]) & (t <= self.edges[-1])):
            raise ValueError(f"times must lie in [{self.edges[0]!r}, {self.edges[-1]!r}]")
        flat = t.ravel()
        out = np.empty((len(rows), flat.size))
        for first in range(0, flat.size, CHUNK):
            part = flat[first : first + CHUNK]
            piece = np.searchsorted(self.edges[1:-1], part, side="right")
            v = (part - self.centre.take(piece)) / self.half.take(piece)
            for value, row in zip(out[:, first : first + CHUNK], rows, strict=True):
                self._horner(value, row, piece, v)
        return out.reshape(len(rows), *t.shape)

    def _horner(self, value: Floats, row: int, piece: NDArray[np.intp], v: Floats) -> None:
        value[:] = self.polynomial[row, -1].take(piece)
        for k in range(DEGREE - 1, -1, -1):
            value *= v
            value += self.polynomial[row, k].take(piece)

    def arrays(self) -> dict[str, Any]:
        """The fields by name, for storage."""
        return {f.name: getattr(self, f.name) for f in fields(self)}
