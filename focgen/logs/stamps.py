"""Time stamps written as dates or times of day (ISO 8601), as seconds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, time

import numpy as np

from focgen.arrays import Array

_DAY = 86400.0
_PACKED = tuple(10.0**k for k in range(10))  # of a second: what hhmmss may count behind its seconds
_PART = 1 << 14  # stamps that are looked at side by side
_MINUTES = 4  # that lack the same seconds: fewer may be chance
_MOST = 0.75  # of the minutes have to show it: a row is lost at the end of some
_LOST = 2.5  # samples after which a minute begins at most, one row lost


def seconds(cells: Sequence[str]) -> Array:
    """Seconds (m,): since 1970 of dates (without a zone: UTC), since midnight of times of day.

    A time of day that falls back by more than half a day has passed midnight. Empty cells become NaN. Raises
    ValueError for anything else, for dates of which some have a zone, and for "12:34": hours and minutes, or
    minutes and seconds?
    """
    filled = next((cell for cell in cells if cell), "")
    if _has_date(filled):
        return _since_1970(cells)
    return _past_midnight(np.array([_since_midnight(cell) if cell else np.nan for cell in cells]))


def is_packed(values: Array) -> bool:
    """Whether numbers (m,) are times of day written as hhmmss, with a date ahead or decimals behind or not:
    seconds 60 to 99 are stepped over.

    >>> is_packed(np.array([57.0, 58.0, 59.0, 100.0])), is_packed(np.array([57.0, 58.0, 59.0, 102.0]))
    (True, False)
    >>> is_packed(1e3 * np.array([115957.0, 115958.0, 115959.0, 120000.0]))
    True
    """
    return any(_is_packed(values, unit) for unit in _PACKED)


def _is_packed(values: Array, unit: float) -> bool:
    """The same of numbers that count ``unit`` to a second. A part at a time: a log may be long."""
    usual = _usual_step(values[:_PART]) / unit
    if not 0.0 < usual < 20.0:
        return False
    parts = (values[at : at + _PART + 1] / unit for at in range(0, len(values), _PART))
    over = fit = 0
    for part in parts:
        count = _minutes_over(part, usual)
        if count is None:
            return False
        over, fit = over + count[0], fit + count[1]
    return over > 0 and fit >= _MOST * over


def _minutes_over(values: Array, usual: float) -> tuple[int, int] | None:
    """How often a minute ends, and how often 40 are stepped over then; None of numbers that are no hhmmss."""
    minutes, left = np.divmod(values, 100.0)
    if not values.min() >= 0.0 or (left >= 60.0).any() or (minutes % 100.0 >= 60.0).any():
        return None
    hours = np.diff(minutes // 100.0)
    beyond = np.where(hours != 0.0, 4040.0, 40.0)
    over = (np.diff(minutes) != 0.0) & (np.abs(hours) <= 1.0)  # a new day steps over more
    begins = ((np.diff(values) - beyond) / usual)[over]
    return int(over.sum()), int(((begins > 0.5) & (begins < _LOST)).sum())


def skips_seconds(values: Array) -> bool:
    """Whether times of day (m,) in s begin every minute at its first second and leave it at the same one, as
    mm:ss:ff does that is read as hh:mm:ss: frames, or tenths, never come to 60.

    >>> frames = np.add.outer(60.0 * np.arange(9), np.arange(20)).ravel()
    >>> skips_seconds(np.arange(400.0)), skips_seconds(frames)
    (False, True)
    """
    usual = _usual_step(values)
    if not 0.0 < usual < 20.0 or values.max() >= 2.0 * _DAY or (values % 1.0 != 0.0).any():
        return False
    steps, over = np.diff(values), np.diff(values // 60.0) != 0.0
    within, between, begins = steps[~over], steps[over], values[1:][over] % 60.0
    if len(between) < _MINUTES or (between <= 1.5 * usual).any():
        return False
    alike = np.abs(between - np.median(between)) < usual
    return all(np.mean(each) >= _MOST for each in (within < 1.5 * usual, alike, begins < usual))


def _usual_step(values: Array) -> float:
    steps = np.diff(values)
    return float(np.median(steps)) if len(steps) else 0.0


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


def _since_1970(cells: Sequence[str]) -> Array:
    """Dates in s. Raises ValueError where some have a zone and some have none, which may be hours apart."""
    found, zoned = np.full(len(cells), np.nan), set[bool]()
    for row, cell in enumerate(cells):
        if cell:
            stamp = datetime.fromisoformat(cell)
            zoned.add(stamp.tzinfo is not None)
            found[row] = (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    if len(zoned) > 1:
        raise ValueError("some have a zone, some have none")
    return found


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
