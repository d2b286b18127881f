"""Readings that end at one number, as those of a gauge or a converter do whose range is too small."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Bools

_LONG = 8  # readings in a row at the end of the range
_OFTEN = 3.0  # times as many as stand in a row at any other number
_SAME = 0.5  # of the readings elsewhere repeat the last one, at most: the others have noise
_AWAY = 0.2  # of the span: so far from where the log begins
_FINE = 1e-6  # of the span: by less a rig without noise comes to rest in floating numbers


def end_of_range(y: Array) -> tuple[float, int, int] | None:
    """The number at which the readings (n,) end, how many are there and the first of them; None where they
    end at none.

    It is the largest or the smallest one, and no level that the log begins at: a rig at rest may well read
    nothing. Without noise, or where it is rounded away, a number stands elsewhere as well, and nothing is
    told.

    >>> y = np.sin(0.01 * np.arange(900.0))
    >>> end_of_range(y), end_of_range(np.minimum(y, 0.75))
    (None, (0.75, 289, 85))
    """
    if len(y) < _LONG:
        return None
    ends = float(y.min()), float(y.max())
    span = ends[1] - ends[0]
    for end in ends:
        there = y == end
        if abs(float(y[0]) - end) > _AWAY * span and _is_cut(y, there, _FINE * span):
            return end, int(there.sum()), int(np.argmax(there))
    return None


def _is_cut(y: Array, there: Bools, least: float) -> bool:
    """Whether readings (n,) stand at an end of theirs, where they are ``there``, as they do nowhere else, and
    came to it by a step of ``least``."""
    longest = _longest(there)
    if longest < _LONG:
        return False
    again = y[1:] == y[:-1]
    again &= ~there[1:]
    if again.sum() > _SAME * (len(y) - there.sum()) or longest < _OFTEN * (1 + _longest(again)):
        return False
    into = np.flatnonzero(there[1:] & ~there[:-1])
    return bool(np.abs(y[into] - y[into + 1]).max(initial=0.0) >= least)


def _longest(marks: Bools) -> int:
    """How many marks (n,) stand in a row at most."""
    edges = np.flatnonzero(np.diff(marks, prepend=False, append=False))
    return int(np.diff(edges)[::2].max(initial=0))
