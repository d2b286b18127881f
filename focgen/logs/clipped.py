"""Readings that end at one number, as those of a gauge or a converter do whose range is too small."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array

_LONG = 8  # readings in a row at the end of the range
_OFTEN = 3.0  # times as many as stand in a row at any other number
_FINE = 1e-6  # of the span: by less a rig without noise comes to rest in floating numbers


def end_of_range(y: Array) -> tuple[float, int, int] | None:
    """The number at which the readings (n,) end, how many are there and the first of them; None where they
    end at none.

    It is the largest or the smallest one, whichever is farther from the first reading: a rig at rest may well
    read nothing. Without noise, or where it is rounded away, a number stands at rest as well, and nothing is
    told.

    >>> y = np.sin(0.01 * np.arange(900.0))
    >>> end_of_range(y), end_of_range(np.minimum(y, 0.75))
    (None, (0.75, 290, 85))
    """
    if len(y) < _LONG:
        return None
    begins = np.flatnonzero(np.concatenate([[True], y[1:] != y[:-1]]))
    counts = np.diff([*begins, len(y)])
    values = y[begins]
    low, high = float(y.min()), float(y.max())
    end = high if high - y[0] >= y[0] - low else low
    there = values == end
    elsewhere = counts[~there]
    longest = int(counts[there].max())
    if not len(elsewhere) or longest < max(_LONG, _OFTEN * int(elsewhere.max())):
        return None
    into = np.abs(np.diff(values))[there[1:]]
    if not len(into) or into.max() < _FINE * (high - low):
        return None
    return end, int(counts[there].sum()), int(begins[there][0])
