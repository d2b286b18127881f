"""Readings that repeat the last one: a sensor slower than the log, or one that has frozen."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array, Ints

_CHANGES = 20  # fresh readings at least
_REGULAR = 0.98  # of the gaps between changes agree with one rate
_SINGLE = 0.8  # of them are one period long: a fresh reading rarely equals the last
_FINE = 0.5  # of the changes, at most, are the smallest there is: more are a converter's
_SLOWEST = 50  # rows a reading
_SELDOM = 0.6  # of all rows, at most, bring a reading that is reported on change
_SMALLEST = 0.02  # quantile of the changes that stands for the smallest
_FLOOR = 1.5  # times as large as that one is no more
_OFTEN = 0.25  # of the changes at least are no larger than that
_NEW = 0.8  # of the levels at least are new ones: those of a converter come again,
_COUNTS = 8.0  # and lie apart by more than this part of its changes
_NEWS = 2e-3  # of the span: smaller changes are of a signal that comes to rest
_LONG = 20  # rows: a shorter stretch is not called frozen
_UNUSUAL = 10.0  # times the longest of the usual repetitions
_MOVES = 0.1  # of its span: by as much another signal moves meanwhile
_INSIDE = 0.02  # of the span: nearer to an end a signal rests or saturates


def fresh_rows(y: Array) -> tuple[float, Ints] | None:
    """(rows per reading, the rows with a fresh one) where ``y`` (n,) is updated at a steady lower rate than
    it is logged, or None.

    A coarse converter repeats values as well: its changes come at any row, or nearly all are by one count.
    """
    changes = _changes(y)
    if len(changes) < _CHANGES:
        return None
    gaps = np.diff(changes)
    period = float(np.median(gaps))
    if not 2.0 <= period <= _SLOWEST or _coarse(np.abs(y[changes] - y[changes - 1])):
        return None
    for _ in range(3):
        periods = np.maximum(1, np.round(gaps / period))
        period = float(np.sum(gaps[periods < 10]) / np.sum(periods[periods < 10]))
    regular = np.abs(gaps - periods * period) < 0.999
    if period < 1.9 or np.mean(regular) < _REGULAR or np.mean(periods == 1) < _SINGLE:
        return None
    return period, _slots(changes, periods.astype(int), gaps)


def _changes(y: Array) -> Ints:
    """The rows that differ from the one before."""
    rows = np.flatnonzero(y[1:] != y[:-1])
    rows += 1
    return rows


def _coarse(sizes: Array) -> bool:
    """Whether most changes are by one count of a converter."""
    return bool(np.mean(sizes < 1.5 * sizes.min()) > _FINE)


def _slots(changes: Ints, periods: Ints, gaps: Ints) -> Ints:
    """The changes, and in longer gaps the rows where a reading came and equalled the last."""
    whole, begins = np.repeat(periods, periods), np.repeat(np.cumsum(periods) - periods, periods)
    later = np.round((np.arange(len(whole)) - begins) * np.repeat(gaps, periods) / whole).astype(int)
    return np.unique(np.concatenate([[0], np.repeat(changes[:-1], periods) + later, changes[-1:]]))


def dead_band(y: Array) -> float:
    """By how much ``y`` (n,) changes at least where a logger reports it on change, in its unit: it repeats a
    reading until one differs by so much. 0 where it does not. A converter's levels come again and again."""
    rows = _changes(y)
    if not _CHANGES <= len(rows) <= _SELDOM * len(y):
        return 0.0
    sizes, levels = np.abs(y[rows] - y[rows - 1]), np.unique(y[rows])
    least = float(np.quantile(sizes, _SMALLEST))
    often = np.mean(sizes < _FLOOR * least) > _OFTEN
    new = len(levels) > _NEW * len(rows) and least > _COUNTS * float(np.min(np.diff(levels)))
    return least if often and new and least > _NEWS * np.ptp(y) else 0.0


def frozen(y: Array, others: list[Array]) -> tuple[int, int] | None:
    """The longest stretch (first row, rows) over which ``y`` (n,) repeats one value, far longer than it
    usually does, while one of ``others`` moves; None where there is none.

    A value at either end of the signal's span is rest or saturation; a converter so coarse that values
    repeat anyway proves nothing.
    """
    ends = np.concatenate([[0], _changes(y), [len(y)]])
    lengths = np.diff(ends)
    if len(lengths) < _CHANGES:
        return None
    long = np.flatnonzero(lengths >= max(_LONG, _UNUSUAL * float(np.median(lengths))))
    if not len(long) or _coarse(np.abs(np.diff(y[ends[:-1]]))):
        return None
    low, high = float(y.min()), float(y.max())
    for run in long[np.argsort(-lengths[long], kind="stable")]:
        first, rows = int(ends[run]), int(lengths[run])
        inside = abs(y[first] - (low + high) / 2) < (0.5 - _INSIDE) * (high - low)
        stretch = slice(first, first + rows)
        if inside and any(np.ptp(other[stretch]) > _MOVES * np.ptp(other) > 0 for other in others):
            return first, rows
    return None
