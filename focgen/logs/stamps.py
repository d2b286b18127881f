"""Time stamps written as dates or times of day (ISO 8601), as seconds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, time

import numpy as np

from focgen.arrays import Array

_DAY = 86400.0


def seconds(cells: Sequence[str]) -> Array:
    """Seconds (m,): since 1970 of dates (without a zone: UTC), since midnight of times of day.

    A time of day that falls back by more than half a day has passed midnight. Empty cells become NaN. Raises
    ValueError for anything else, and for "12:34": hours and minutes, or minutes and seconds?
    """
    filled = [cell for cell in cells if cell]
    of = _since_1970 if filled and _has_date(filled[0]) else _since_midnight
    found = np.array([of(cell) if cell else np.nan for cell in cells])
    return found if of is _since_1970 else _past_midnight(found)


def is_packed(values: Array) -> bool:
    """Whether numbers (m,) are times of day written as hhmmss: seconds 60 to 99 are stepped over.

    >>> is_packed(np.array([115958.0, 115959.0, 120000.0])), is_packed(np.array([58.0, 59.0, 102.0]))
    (True, False)
    """
    steps = np.diff(values)
    usual = float(np.median(steps)) if len(steps) else 0.0
    if not (0.0 < usual < 20.0 and values.min() >= 0.0 and values.max() < 240_000.0):
        return False
    minutes, left = np.divmod(values, 100.0)
    if (left >= 60.0).any() or (minutes % 100.0 >= 60.0).any():
        return False
    over = np.diff(minutes) != 0.0
    beyond = np.where(np.diff(minutes // 100.0) != 0.0, 4040.0, 40.0)
    return bool(over.any() and np.all(np.abs(steps - beyond - usual)[over] < 0.5 * usual))


def is_time(values: Array) -> bool:
    """Whether an array of numpy holds instants or spans."""
    return values.dtype.kind in "mM"


def of_numpy(values: Array) -> Array:
    """Times of numpy (m,), instants or spans, in s, NaN where there is none; others as they are."""
    kinds = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}
    kind = kinds.get(values.dtype.kind)
    if kind is None:
        return values
    return np.where(np.isnat(values), np.nan, values.astype(kind).astype(np.int64) * 1e-9)


def _has_date(cell: str) -> bool:
    return "-" in cell or len(cell) > len("23:59:59.999999999")


def _since_1970(cell: str) -> float:
    stamp = datetime.fromisoformat(cell)
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


def _since_midnight(cell: str) -> float:
    if cell.count(":") < 2:
        raise ValueError(f"{cell!r}: hours and minutes, or minutes and seconds")
    hours = cell if cell[1:2] != ":" else f"0{cell}"
    of_day = time.fromisoformat(hours)
    return of_day.hour * 3600.0 + of_day.minute * 60.0 + of_day.second + of_day.microsecond * 1e-6


def _past_midnight(found: Array) -> Array:
    known = np.flatnonzero(~np.isnan(found))
    found[known] += _DAY * np.cumsum(np.diff(found[known], prepend=found[known[:1]]) < -0.5 * _DAY)
    return found
