"""Rows that a logger has filled in: it repeated the last reading until the next one came, or drew a straight
line to it. Such rows are no readings: what they are off by is the logger's doing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array, Ints
from focgen.logs.experiment import Experiment
from focgen.logs.repeats import changes_of, fresh_rows

_MEASURED = ("pressure", "curvature", "output")
_CHANGES = 20  # readings at least
_MOST = 0.6  # of all rows that are readings, at most
_EVEN = 0.9  # of the gaps between corners are of one length; to a row, where that is
_WIDE = 4  # rows at least
_STRAIGHT = 0.55  # of the last digits of a reading and its neighbours: so far off it is still on their line
_DIGITS, _EXACT = 15, 1e-12  # of a number in a computer, and what is lost of its span in a sum

_Rows = Callable[[Array], "Ints | None"]


def with_readings(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with the rows that hold a ``reading`` of their own, by role, where others were filled
    in; and there with straight lines from one reading to the next."""
    found = {}
    for role in _MEASURED:
        if all(role in log for log in logs):
            rows = readings([np.asarray(log[role], float) for log in logs])
            if rows is not None:
                found[role] = rows
    return tuple(_with(log, {role: rows[i] for role, rows in found.items()}) for i, log in enumerate(logs))


def _with(log: Experiment, rows: dict[str, Ints]) -> Experiment:
    at = np.arange(len(log))
    lined = {role: np.interp(at, kept, np.asarray(log[role], float)[kept]) for role, kept in rows.items()}
    return replace(log, signals={**log.signals, **lined}, readings=rows) if rows else log


def readings(parts: Sequence[Array]) -> list[Ints] | None:
    """The rows of each of the ``parts`` (n,) of a signal that are readings, where the others were filled in
    between; None where no logger did."""
    for rows_of in (_held, _cornered):
        rows = [rows_of(part) for part in parts]
        told = sum(len(part) for part, kept in zip(parts, rows) if kept is not None)
        if 2 * told > sum(map(len, parts)):
            return [_ends(part, changes_of(part) if k is None else k) for part, k in zip(parts, rows)]
    return None


def _ends(part: Array, rows: Ints) -> Ints:
    """With the first row, which nothing was repeated in."""
    return np.unique(np.r_[0, rows])


def _held(y: Array) -> Ints | None:
    """Where each reading is held for about as many rows: the rows where a new one came."""
    found = fresh_rows(y)
    return None if found is None else found[1]


def _cornered(y: Array) -> Ints | None:
    """Where every so many rows lie on a straight line: its corners, one for each. What a logger that lays
    readings on a grid of its own leaves of a corner are two rows off the line."""
    bent = np.abs(y[:-2] - 2.0 * y[1:-1] + y[2:])
    last = _last_digit(y)
    near = np.maximum(_STRAIGHT * (last[:-2] + 2.0 * last[1:-1] + last[2:]), _EXACT * np.ptp(y))
    off = np.flatnonzero(bent > near) + 1
    if not _CHANGES <= len(off) <= 2 * _MOST * len(y):
        return None
    first = np.r_[True, np.diff(off) > 1]
    corners = off[first] if np.mean(first) > _MOST else _larger(off, first, bent)
    if not _CHANGES <= len(corners) <= _MOST * len(y):
        return None
    gaps = np.diff(corners)
    usual = float(np.median(gaps))
    even = np.mean(np.abs(gaps - usual) <= (1.0 if usual >= _WIDE else 0.0))
    return corners if usual >= 2.0 and even > _EVEN else None


def _last_digit(y: Array) -> Array:
    """What one more in its last digit is of each reading (n,): all have as many digits, or as many behind the
    point."""
    order = np.floor(np.log10(np.maximum(np.abs(y), 1e-300)))
    fewest = next((d for d in range(_DIGITS) if _is_whole(y / 10.0 ** (order - d), y != 0.0)), _DIGITS)
    first = -int(order.max())
    point = next((d for d in range(first, first + _DIGITS) if _is_whole(y * 10.0**d, y != 0.0)), 300)
    made: Array = np.maximum(10.0 ** (order - fewest), 10.0**-point)
    return made


def _is_whole(numbers: Array, which: Array) -> bool:
    """Whether those of the numbers (n,) are whole, but for what a computer makes of them."""
    few = numbers[which]
    return bool(np.all(np.abs(few - np.round(few)) <= 1e-9 * np.maximum(np.abs(few), 1.0)))


def _larger(off: Ints, first: Array, bent: Array) -> Ints:
    """Of rows next to one another the one that is bent more."""
    starts = np.flatnonzero(first)
    groups = np.split(off, starts[1:])
    return np.array([group[np.argmax(bent[group - 1])] for group in groups])
