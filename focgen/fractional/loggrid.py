"""Functions that are smooth in log t, from a few places to all of many uniform samples.

The part of a fractional response that is not an oscillation is analytic in log t, so Chebyshev
interpolation on panels [16·4^k, 16·4^(k+1)] samples reaches rounding with 20 places a panel: 96 places for
2000 samples, 160 for 100 000.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.polynomial import chebyshev

from focgen.arrays import Array

DIRECT = 16  # the first samples are their own places
_RATIO = 4.0
_PLACES = 20
_CACHED = 1 << 15  # samples up to which the interpolation matrices are kept


class LogGrid:
    """Places, in samples, from which all samples 1 … ``count`` follow."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.head = np.arange(1, min(count, DIRECT) + 1, dtype=float)
        self._panels = _panels(count)
        self.tail = np.concatenate([p.places for p in self._panels]) if self._panels else np.empty(0)

    def spread(self, head: Array, tail: Array) -> Array:
        """Return the values at 1 … count, shape (count,), from those at ``self.head`` and ``self.tail``."""
        out = np.empty(self.count)
        out[: len(head)] = head
        for i, panel in enumerate(self._panels):
            out[panel.first - 1 : panel.last] = panel.spread(tail[i * _PLACES : (i + 1) * _PLACES])
        return out


class _Panel:
    def __init__(self, first: int, last: int) -> None:
        self.first, self.last = first, last
        low, high = math.log(first - 1), math.log(last)
        nodes = chebyshev.chebpts1(_PLACES)
        self.places = np.exp(0.5 * (high + low) + 0.5 * (high - low) * nodes)
        samples = np.arange(first, last + 1)
        self._at = (2.0 * np.log(samples) - high - low) / (high - low)
        self._to_coefficients = np.linalg.inv(chebyshev.chebvander(nodes, _PLACES - 1))
        self._matrix = None
        if last <= _CACHED:
            self._matrix = chebyshev.chebvander(self._at, _PLACES - 1) @ self._to_coefficients

    def spread(self, values: Array) -> Array:
        if self._matrix is not None:
            return self._matrix @ values
        return chebyshev.chebval(self._at, self._to_coefficients @ values)


def _panels(count: int) -> list[_Panel]:
    panels, edge = [], float(DIRECT)
    while edge < count:
        panels.append(_Panel(round(edge) + 1, round(min(edge * _RATIO, count))))
        edge *= _RATIO
    return panels


@functools.lru_cache(maxsize=8)
def log_grid(count: int) -> LogGrid:
    """Return the grid for ``count`` samples, kept for the next call."""
    return LogGrid(count)
