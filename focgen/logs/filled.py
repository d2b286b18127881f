"""Rows that a logger has filled in: it repeated the last reading until the next one came, or drew a straight
line to it. Such rows are no readings: what they are off by is the logger's doing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array, Ints
from focgen.logs.experiment import Experiment
from focgen.logs.repeats import fresh_rows

_MEASURED = ("pressure", "curvature", "output")
_CHANGES = 20  # readings at least
_MOST = 0.6  # of all rows that are readings, at most
_EVEN = 0.9  # of the gaps between corners are of one length; to a row, where that is
_WIDE = 4  # rows at least
_STRAIGHT = 0.55  # of the last digits of a reading and its neighbours: so far off it is still on their line
_TWO = 2.2  # rows in the mean that a corner leaves off the line, at most
_SLOWEST = 50  # rows a reading
_JUMP = 0.02  # of the span: a drive that is on or off is written in a digit as large as it is
_DRIVEN, _SELDOM, _SOON = 0.7, 0.35, 4  # of the readings, of all rows, and rows: where a drive has just bent
_DIGITS, _EXACT = 15, 1e-12  # of a number in a computer, and what is lost of its span in a sum
_LEAST = 1e-280  # of a number that is none


def with_readings(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with the rows that hold a ``reading`` of their own, by role, where others were filled
    in; and there with straight lines from one reading to the next."""
    found = {}
    for role in _MEASURED:
        if all(role in log for log in logs):
            rows = readings([np.asarray(log[role], float) for log in logs])
            if rows is not None and not _is_driven(logs, role, rows):
                found[role] = rows
    return tuple(_with(log, {role: rows[i] for role, rows in found.items()}) for i, log in enumerate(logs))


def _with(log: Experiment, rows: dict[str, Ints]) -> Experiment:
    at = np.arange(len(log))
    lined = {role: np.interp(at, kept, np.asarray(log[role], float)[kept]) for role, kept in rows.items()}
    return replace(log, signals={**log.signals, **lined}, readings=rows) if rows else log


def _is_driven(logs: Sequence[Experiment], role: str, rows: Sequence[Ints]) -> bool:
    """Whether the rows are those at which what drives the signal turns or jumps, as it seldom does: then a
    cycle of the experiment is seen in them, and no logger's."""
    drive = next((r for r in ("command", "pressure") if r != role and all(r in log for log in logs)), None)
    if drive is None:
        return False
    near = [_soon_after(np.asarray(log[drive], float)) for log in logs]
    at_them = np.mean(np.concatenate([rows_near[kept] for rows_near, kept in zip(near, rows)]))
    return bool(at_them > _DRIVEN and np.mean(np.concatenate(near)) < _SELDOM)


def _soon_after(drive: Array) -> Array:
    """Which rows (n,) are at a bend of ``drive`` (n,) or soon after it; the first one is."""
    near, bends = np.zeros(len(drive) + _SOON, bool), _off_line(drive, _JUMP)
    for later in range(-1, _SOON):
        near[bends + later] = True
    near[0] = True
    return near[: len(drive)]


def readings(parts: Sequence[Array]) -> list[Ints] | None:
    """The rows of each of the ``parts`` (n,) of a signal that are readings, where the others were filled in
    between; None where no logger did."""
    for rows_of in (_held, _cornered):
        rows = [rows_of(part) for part in parts]
        told = sum(len(part) for part, kept in zip(parts, rows) if kept is not None)
        if 2 * told > sum(map(len, parts)):
            every = float(np.median(np.concatenate([np.diff(kept) for kept in rows if kept is not None])))
            # what is too short or at rest to tell has the others' pace
            at_pace = [np.arange(0, len(part), max(1, round(every))) for part in parts]
            return [_ends(len(part), p if k is None else k) for part, p, k in zip(parts, at_pace, rows)]
    return None


def _ends(count: int, rows: Ints) -> Ints:
    """With the first of ``count`` rows, which nothing was repeated in, and the last one where that is all: a
    part that is shorter than a reading takes has an end, too."""
    kept = np.unique(np.r_[0, rows])
    return kept if len(kept) > 1 else np.unique(np.r_[kept, count - 1])


def _held(y: Array) -> Ints | None:
    """Where each reading is held for about as many rows: the rows where a new one came."""
    found = fresh_rows(y)
    return None if found is None else found[1]


def _cornered(y: Array) -> Ints | None:
    """Where every so many rows lie on a straight line: its corners, one for each. What a logger that lays
    readings on a grid of its own leaves of a corner are two rows off the line."""
    off = _off_line(y)
    if not _CHANGES <= len(off) <= 2 * _MOST * len(y):
        return None
    first = np.r_[True, np.diff(off) > 1]
    if len(off) > _TWO * np.sum(first):
        return None  # what answers to a step is bent for longer
    corners = off[first] if np.mean(first) > _MOST else _larger(off, first, y)
    if not _CHANGES <= len(corners) <= _MOST * len(y):
        return None
    gaps = np.diff(corners)
    usual = float(np.median(gaps))
    even = np.mean(np.abs(gaps - usual) <= (1.0 if usual >= _WIDE else 0.0))
    return corners if 2.0 <= usual <= _SLOWEST and even > _EVEN else None


def _off_line(y: Array, most: float = 4.0) -> Ints:
    """The rows off the line of their neighbours, beyond the last digit, or by more than this part of the
    span."""
    if len(y) < 3:
        return np.zeros(0, int)
    last = _last_digit(y)
    near = np.maximum(_STRAIGHT * (last[:-2] + 2.0 * last[1:-1] + last[2:]), _EXACT * np.ptp(y))
    return np.flatnonzero(_bent(y) > np.minimum(near, most * np.ptp(y))) + 1


def _bent(y: Array) -> Array:
    """By how much each row but the ends is off the line of its neighbours, twice."""
    made: Array = np.abs(y[:-2] - 2.0 * y[1:-1] + y[2:])
    return made


def _last_digit(y: Array) -> Array:
    """What one more in its last digit is of each reading (n,): all have as many digits, or as many behind the
    point."""
    order = np.floor(np.log10(np.maximum(np.abs(y), _LEAST)))
    fewest = next((d for d in range(_DIGITS) if _is_whole(y / 10.0 ** (order - d), y != 0.0)), _DIGITS)
    first = -int(order.max())
    point = next((d for d in range(first, first + _DIGITS) if _is_whole(y * 10.0**d, y != 0.0)), 300)
    made: Array = np.maximum(10.0 ** (order - fewest), 10.0**-point)
    return made


def _is_whole(numbers: Array, which: Array) -> bool:
    """Whether those of the numbers (n,) are whole, but for what a computer makes of them."""
    few = numbers[which]
    return bool(np.all(np.abs(few - np.round(few)) <= 1e-9 * np.maximum(np.abs(few), 1.0)))


def _larger(off: Ints, first: Array, y: Array) -> Ints:
    """Of rows next to one another the one that is bent more."""
    starts, bent = np.flatnonzero(first), _bent(y)
    groups = np.split(off, starts[1:])
    return np.array([group[np.argmax(bent[group - 1])] for group in groups])
