"""Time stamps written as dates or times of day (ISO 8601), as seconds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, time
from typing import Any

import numpy as np

from focgen.arrays import Array

_DAY = 86400.0
_COUNTED_IN_NS = 9.2e9  # s: 64 bits count so many on either side of 1970
_COUNTS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0, "D": _DAY, "W": 7.0 * _DAY}  # s
_PACKED = tuple(10.0**k for k in range(10))  # of a second: what hhmmss may count behind its seconds
_POINTED = (0.01, 0.0001)  # the same of mm.ss and of h.mmss
_PART = 1 << 14  # stamps that are looked at side by side
_MINUTES = 4  # that lack the same seconds: fewer may be chance
_MOST = 0.75  # of the minutes have to show it: a row is lost at the end of some
_HOURS = (1.0, 12.0)  # by which a clock is put back
_NIGHT = (23.0, 0.0, 1.0, 2.0, 3.0)  # hours to which a clock is put back by one
_ROUND = 1e-6  # s: a clock from 1970 is rounded so far
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


def other_reading(values: Array, dated: bool) -> tuple[str, str] | None:
    """What a time (m,) in s may be instead, and how to write it then; None where it shows nothing of that
    kind. ``dated``: it was written as dates or times of day."""
    if lacks_zeros(values):
        return "falls back within its seconds: the digits behind them may lack zeros", "write 50 ms as 0.050"
    if dated and skips_seconds(values):
        what = "lacks the same seconds of every minute: it may be mm:ss and frames, read as hh:mm:ss"
        return what, "write it as 12:00:59.98"
    if not dated and is_packed(values):
        what = "counts to 59 and goes on at 100: it may be a time of day as hhmmss"
        return what, "write it as 12:00:59.98"
    if not dated and is_packed(values, _POINTED):
        return "counts to .59 and goes on at 1.00: it may be minutes as mm.ss", "write it as 12:00:59"
    return None


def lacks_zeros(values: Array) -> bool:
    """Whether a time (m,) in s was written without the zeros of its milliseconds: in every second .50 comes
    ahead of .100, no digit behind the point is a 0 ahead of others, and with its zeros the clock ticks.

    >>> ms = 50 * np.arange(100)
    >>> lacks_zeros(np.array([float(f"{t // 1000}.{t % 1000}") for t in ms])), lacks_zeros(ms / 1000)
    (True, False)
    """
    if not (np.diff(values) < 0.0).any():  # which is all that most clocks need
        return False
    whole = np.floor(values + _ROUND)
    part, same = values - whole, np.diff(whole) == 0.0
    falls = np.concatenate([[False], same & (np.diff(part) < -_ROUND)])
    if len(np.unique(whole[falls])) < 2 or ((part > _ROUND) & (part < 0.1 - _ROUND)).any():
        return False
    begins = np.flatnonzero(np.concatenate([[True], ~same]))
    so_far, count = np.cumsum(falls), np.add.reduceat(falls, begins)
    of_second = np.repeat(np.arange(len(begins)), np.diff([*begins, len(values)]))
    left = (np.cumsum(count)[of_second] - so_far).astype(float)
    steps = np.diff(whole + part * 10.0**-left)
    usual = float(np.median(steps))
    return usual > 0.0 and float(np.mean(np.abs(steps - usual) <= 0.5 * usual)) >= _MOST


def is_packed(values: Array, units: tuple[float, ...] = _PACKED) -> bool:
    """Whether numbers (m,) are times of day written as hhmmss, with a date ahead or decimals behind or not:
    seconds 60 to 99 are stepped over. They count one of ``units`` to a second.

    >>> is_packed(np.array([57.0, 58.0, 59.0, 100.0])), is_packed(np.array([57.0, 58.0, 59.0, 102.0]))
    (True, False)
    >>> is_packed(1e3 * np.array([115957.0, 115958.0, 115959.0, 120000.0]))
    True
    """
    return any(_is_packed(values, unit) for unit in units)


def _is_packed(values: Array, unit: float) -> bool:
    """The same of numbers that count ``unit`` to a second. A part at a time: a log may be long."""
    usual = _usual_step(values[:_PART]) / unit
    if not 0.0 < usual < 20.0:
        return False
    parts = (np.round(values[at : at + _PART + 1] / unit, 6) for at in range(0, len(values), _PART))
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
    return values.max() < 2.0 * _DAY and _leaves_out(values, 60.0)


def skips_frames(values: Array) -> bool:
    """Whether numbers (m,) begin every second at its first hundredth and leave it at the same one, as 12.24
    does that goes on at 13.00.

    >>> skips_frames(np.add.outer(np.arange(9), 0.01 * np.arange(25)).ravel())
    True
    """
    return _leaves_out(np.round(100.0 * values[:_PART], 6), 100.0)


def _leaves_out(values: Array, period: float) -> bool:
    """Whether a count in whole numbers (m,) leaves out the end of each ``period``, always the same one."""
    usual = _usual_step(values)
    if not 0.0 < usual < period / 3.0 or (values % 1.0 != 0.0).any():
        return False
    steps, over = np.diff(values), np.diff(values // period) != 0.0
    within, between, begins = steps[~over], steps[over], values[1:][over] % period
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
    found = _in_its_unit(values)
    if not (np.abs(found[~np.isnat(values)]) < _COUNTED_IN_NS).all():
        return np.where(np.isnat(values), np.nan, found)
    return np.where(np.isnat(values), np.nan, values.astype(kind).astype(np.int64) * 1e-9)


def _in_its_unit(values: Any) -> Array:
    """The same by the unit that the times are stored in: in ns those of 2263 would begin anew in 1678."""
    unit, count = np.datetime_data(values.dtype)
    if unit in _COUNTS:
        found: Array = values.astype(np.int64) * (count * _COUNTS[unit])
    else:
        found = values.astype(f"{values.dtype.kind}8[s]").astype(float)
    return found


def carried_on(values: Array) -> tuple[Array, dict[int, float]]:
    """Dates or times of day (m,) in s without the falls of a clock that is put back, and the hours of each by
    its row.

    By an hour at the end of summer time: at night, to a full hour. By twelve at one o'clock, where no stamp
    is of an hour that a clock of twelve has not. Either way the stamps go on as if nothing had been.
    """
    steps = np.diff(values)
    rows = np.flatnonzero(steps < -1800.0)
    if not len(rows) or not (steps > 0.0).any():
        return values, {}
    reach = _LOST * float(np.median(steps[steps > 0.0]))
    found = {
        row + 1: hours for row in rows.tolist() for hours in _HOURS if _is_put_back(values, row, hours, reach)
    }
    if not found:
        return values, {}
    shift = np.zeros(len(values))
    shift[list(found)] = [3600.0 * hours for hours in found.values()]
    return values + np.cumsum(shift), found


def _is_put_back(values: Array, row: int, hours: float, reach: float) -> bool:
    before, after = values[row], values[row + 1]
    hour, beyond = divmod(after % _DAY, 3600.0)
    if not (-_ROUND <= after + 3600.0 * hours - before <= reach and beyond <= reach):
        return False
    return hour in _NIGHT if hours == 1.0 else hour == 1.0 and _of_twelve(values)


def _of_twelve(values: Array) -> bool:
    hours = values % _DAY // 3600.0
    return bool(((hours >= 1.0) & (hours <= 12.0)).all())


def has_zone(cells: Sequence[str]) -> bool | None:
    """Whether dates have a zone; None of times of day, and of what is no date."""
    filled = next((cell for cell in cells if cell), "")
    try:
        return datetime.fromisoformat(filled).tzinfo is not None if _has_date(filled) else None
    except ValueError:
        return None


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
