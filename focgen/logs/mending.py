"""Readings as they stand in a part of a log, mended: outliers, slow sensors, short stretches missing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.logs.clipped import end_of_range
from focgen.logs.clock import HELD, between
from focgen.logs.notes import Note
from focgen.logs.outliers import (
    barred_by,
    first_stands_out,
    outliers,
    stand_in,
    straightened,
    turned_by,
)
from focgen.logs.repeats import fresh_rows, frozen

_DRIVES = ("command", "pressure")


def mended(time: Array, values: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Return (signals without holes, notes) of signals (m,) by role, NaN where a reading is missing.

    Outliers of measured signals go to the straight line between their neighbours, and so do readings that are
    missing; set ones (command, reference) are held. A camera or a gauge that is slower than the log is taken
    at its fresh readings, with straight lines between: it would seem late by half of what it repeats. An
    output that repeats is left so, for the controller reads it late.
    """
    found: dict[str, Array] = {}
    notes: list[str] = []
    for role in sorted(values, key=lambda role: (role not in HELD, role not in _DRIVES)):
        found[role], said = _mended(role, time, values[role], found.get("command", found.get("pressure")))
        notes += said
    notes += _frozen(time, values)
    return {role: found[role] for role in values}, tuple(notes)


def _mended(role: str, time: Array, y: Array, drive: Array | None) -> tuple[Array, list[str]]:
    gone, notes = np.isnan(y), []
    there: Ints | slice = np.flatnonzero(~gone) if gone.any() else slice(0, len(y))
    rows: Ints | slice = there
    if role not in HELD:
        slow = fresh_rows(y[there])
        if slow:
            rows = slow[1] if isinstance(there, slice) else there[slow[1]]
            notes.append(_slow_note(role, slow[0] * len(time) / np.sum(~gone), time))
        barred, never = (None if drive is None else by(drive)[rows] for by in (barred_by, turned_by))
        wrong = outliers(y[rows], barred, never)
        if wrong.any():
            what = f"outliers of {role} replaced by the straight line between their neighbours"
            notes.append(Note(what, int(wrong.sum()), f"at {time[rows][np.argmax(wrong)]:g} s"))
            y = _with(y, rows, straightened(time[rows], y[rows], wrong))
        notes += _first_note(role, y[rows], time[rows], barred)
        notes += _stand_in_note(role, y[rows], time[rows])
        notes += _clipped_note(role, y[rows], time[rows])
    if gone.any():
        how = "held" if role in HELD else "bridged by straight lines"
        notes.append(
            Note(f"readings of {role} missing, {how}", int(gone.sum()), f"at {time[np.argmax(gone)]:g} s")
        )
    return _filled(role, time, y, rows, there), notes


def _first_note(role: str, y: Array, time: Array, barred: Bools | None) -> list[str]:
    """A word on a first reading that may be left from before, as the buffers of some loggers give it."""
    if barred is None or not first_stands_out(y, barred):
        return []
    what = f"{role} begins with a reading far off those behind it, while the command rests"
    return [Note(f"{what}: if it is left from before, leave it out with --from", 1, f"at {time[0]:g} s")]


def _stand_in_note(role: str, y: Array, time: Array) -> list[str]:
    """A word on a number that a logger writes where it has no reading: too often there for an outlier."""
    found = stand_in(y)
    if found is None:
        return []
    value, first = found
    what = (
        f"{role} is {value:.6g} again and again, far off the readings on both sides: leave such cells empty"
    )
    return [Note(f"{what} if nothing was read", 1, f"at {time[first]:g} s")]


def _clipped_note(role: str, y: Array, time: Array) -> list[str]:
    """A word on readings that end at one number: a diagnosis takes it for a property of the rig."""
    found = end_of_range(y)
    if found is None:
        return []
    value, count, first = found
    what = (
        f"{role} ends at {value:.6g}, as where the range of a gauge or of the logger ends: what is beyond is"
    )
    return [Note(f"{what} not in the log", count, f"at {time[first]:g} s")]


def _with(y: Array, rows: Ints | slice, straight: Array) -> Array:
    """``y`` (m,) with other readings in ``rows``, which a slice names all of."""
    if isinstance(rows, slice):
        return straight
    y = y.copy()
    y[rows] = straight
    return y


def _filled(role: str, time: Array, y: Array, rows: Ints | slice, there: Ints | slice) -> Array:
    """All rows of a signal from its fresh ``rows``, those of an output held where it was logged; a slice is
    all of them."""
    if isinstance(rows, slice):
        return y
    if rows is not there and role == "output":
        there = np.arange(len(y)) if isinstance(there, slice) else there
        held = y[rows[np.searchsorted(rows, there, side="right") - 1]]
        return np.interp(time, time[there], held)
    return between(role, time, time[rows], y[rows])


def _slow_note(role: str, period: float, time: Array) -> str:
    rate = (len(time) - 1) / (time[-1] - time[0]) / period
    done = "straight lines between"
    if role == "output":
        done = f"left so, it is {(period - 1) / 2:.2g} samples late on average"
    return f"{role} is fresh in every {period:.3g}. row only ({rate:.3g} Hz): {done}"


def _frozen(time: Array, values: Mapping[str, Array]) -> list[str]:
    notes: list[str] = []
    for role in values:
        others = [y for other, y in values.items() if other != role and not np.isnan(y).any()]
        stretch = None if role in HELD or np.isnan(values[role]).any() else frozen(values[role], others)
        if stretch:
            first, rows = stretch
            last = min(first + rows, len(time) - 1)
            place = f"for {time[last] - time[first]:.3g} s from {time[first]:g} s"
            what = f"{role} frozen while the rig moves: cut it off with --from and --to"
            notes.append(Note(what, 1, place))
    return notes
