"""Readings that repeat the last one: a sensor slower than the log, or one that has frozen."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Ints

_CHANGES = 20  # fresh readings at least
_REGULAR = 0.98  # of the gaps between changes agree with one rate
_SINGLE = 0.8  # of them are one period long: a fresh reading rarely equals the last
_FINE = 0.5  # of the changes, at most, are the smallest there is: more are a converter's
_SLOWEST = 50  # rows a reading
_LONG = 20  # rows: a shorter stretch is not called frozen
_UNUSUAL = 10.0  # times the longest of the usual repetitions
_MOVES = 0.1  # of its span: by as much another signal moves meanwhile
_INSIDE = 0.02  # of the span: nearer to an end a signal rests or saturates


def fresh_rows(y: Array) -> tuple[float, Array] | None:
    """(rows per reading, the rows with a fresh one) where ``y`` (n,) is updated at a steady lower rate than
    it is logged, or None.

    A coarse converter repeats values as well: its changes come at any row, or nearly all are by one count.
    """
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    if len(changes) < _CHANGES:
        return None
    gaps, sizes = np.diff(changes), np.abs(np.diff(y)[changes - 1])
    period = float(np.median(gaps))
    if not 2.0 <= period <= _SLOWEST or _coarse(sizes):
        return None
    for _ in range(3):
        periods = np.maximum(1, np.round(gaps / period))
        period = float(np.sum(gaps[periods < 10]) / np.sum(periods[periods < 10]))
    regular = np.abs(gaps - periods * period) < 0.999
    if period < 1.9 or np.mean(regular) < _REGULAR or np.mean(periods == 1) < _SINGLE:
        return None
    return period, _slots(changes, periods.astype(int), gaps)


def _coarse(sizes: Array) -> bool:
    """Whether most changes are by one count of a converter."""
    return bool(np.mean(sizes < 1.5 * sizes.min()) > _FINE)


def _slots(changes: Ints, periods: Array, gaps: Array) -> Array:
    """The changes, and in longer gaps the rows where a reading came and equalled the last."""
    between = [
        row + np.round(np.arange(count) * gap / count).astype(int)
        for row, count, gap in zip(changes, periods, gaps)
    ]
    return np.unique(np.concatenate([[0], *between, changes[-1:]]))


def frozen(y: Array, others: list[Array]) -> tuple[int, int] | None:
    """The longest stretch (first row, rows) over which ``y`` (n,) repeats one value, far longer than it
    usually does, while one of ``others`` moves; None where there is none.

    A value at either end of the signal's span is rest or saturation; a converter so coarse that values
    repeat anyway proves nothing.
    """
    ends = np.concatenate([[0], np.flatnonzero(np.diff(y) != 0.0) + 1, [len(y)]])
    lengths = np.diff(ends)
    if len(lengths) < _CHANGES or _coarse(np.abs(np.diff(y[ends[:-1]]))):
        return None
    span = float(np.ptp(y))
    inside = np.abs(y[ends[:-1]] - (y.min() + y.max()) / 2) < (0.5 - _INSIDE) * span
    usual = float(np.median(lengths))
    for run in np.argsort(-lengths):
        first, rows = int(ends[run]), int(lengths[run])
        if rows < max(_LONG, _UNUSUAL * usual):
            return None
        stretch = slice(first, first + rows)
        if inside[run] and any(np.ptp(other[stretch]) > _MOVES * np.ptp(other) > 0 for other in others):
            return first, rows
    return None
