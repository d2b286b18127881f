"""Readings as they stand in a part of a log, mended: outliers, slow sensors, short stretches missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.logs.clipped import end_of_range
from focgen.logs.clock import HELD, between
from focgen.logs.drives import Drive
from focgen.logs.notes import Note
from focgen.logs.outliers import are_many, first_stands_out, outliers, stand_in, straightened
from focgen.logs.repeats import dead_band, fresh_rows, frozen
from focgen.logs.strays import strays

_DRIVES = ("command", "pressure")


@dataclass(frozen=True)
class _Signal:
    """A signal without holes (m,), what to say of it, its readings without outliers (m,), the rows of fresh
    ones and of those ``there``, and the rows in which there were outliers."""

    filled: Array
    notes: list[str]
    readings: Array
    fresh: Ints | slice
    there: Ints | slice
    wrong: Ints

    def logged(self) -> Array:
        """The readings where it was logged: made anew, for a log may be long."""
        return _held(self.readings, self.fresh, self.there)


def mended(time: Array, values: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Return (signals without holes, notes) of signals (m,) by role, NaN where a reading is missing.

    Outliers of measured signals go to the straight line between their neighbours, and so do readings that are
    missing; set ones (command, reference) are held. A camera or a gauge that is slower than the log is taken
    at its fresh readings, with straight lines between: it would seem late by half of what it repeats. An
    output that repeats is left so, for the controller reads it late.
    """
    found: dict[str, _Signal] = {}
    drive = None
    for role in sorted(values, key=lambda role: (role not in HELD, role not in _DRIVES)):
        found[role] = _mended(role, time, values[role], drive)
        if drive is None and role in _DRIVES:
            drive = Drive.by(found[role].filled)
    notes = [note for signal in found.values() for note in signal.notes]
    if drive is not None and "command" in found:
        notes += _row_notes(time, drive, found)
    notes += _frozen(time, {role: found[role] for role in values})
    return {role: found[role].filled for role in values}, tuple(notes)


def _mended(role: str, time: Array, y: Array, drive: Drive | None) -> _Signal:
    gone, notes = np.isnan(y), []
    there: Ints | slice = np.flatnonzero(~gone) if gone.any() else slice(0, len(y))
    rows: Ints | slice = there
    wrong = np.zeros(0, int)
    if role not in HELD:
        slow = fresh_rows(y[there])
        if slow:
            rows = slow[1] if isinstance(there, slice) else there[slow[1]]
            notes.append(_slow_note(role, slow[0] * len(time) / np.sum(~gone), time))
        here = None if drive is None else drive.of(rows, whole=slow is None)
        straight, off, said = _straightened(role, time[rows], y[rows], here)
        notes += _band_note(role, y[there])
        if off.any():
            y, wrong = _with(y, rows, straight), np.arange(len(y))[rows][off]
        notes += said
        notes += _first_note(role, straight, time[rows], None if here is None else here.barred)
        notes += _stand_in_note(role, straight, time[rows])
        notes += _clipped_note(role, straight, time[rows])
    if gone.any():
        how = "held" if role in HELD else "bridged by straight lines"
        notes.append(
            Note(f"readings of {role} missing, {how}", int(gone.sum()), f"at {time[np.argmax(gone)]:g} s")
        )
    return _Signal(_filled(role, time, y, rows, there), notes, y, rows, there, wrong)


def _straightened(role: str, time: Array, y: Array, drive: Drive | None) -> tuple[Array, Bools, list[str]]:
    """Readings (m,) without outliers, which were some (m,), and what to say of these and of what is like
    them and cannot be mended."""
    notes: list[str] = []
    wrong = outliers(y) if drive is None else outliers(y, drive.barred, drive.never, drive.answers)
    many = are_many(wrong)
    if many and (drive is None or drive.is_elsewhere(wrong)):
        what = (
            f"{role} stands out from both sides in more than one reading in a hundred, too many to be mended"
        )
        what += ": mend the log, or leave such cells empty, if nothing was read"
        notes.append(Note(what, int(wrong.sum()), f"at {time[np.argmax(wrong)]:g} s"))
    if many:
        wrong = np.zeros(len(y), bool)
    if wrong.any():
        what = f"outliers of {role} replaced by the straight line between their neighbours"
        notes.append(Note(what, int(wrong.sum()), f"at {time[np.argmax(wrong)]:g} s"))
        y = straightened(time, y, wrong)
    far = [] if drive is None else strays(y, drive.signal)
    if far:
        first = far[0]
        what = f"{role} jumps away and back while the command does not, farther than it does so elsewhere"
        place = f"{first.stop - first.start} readings from {time[first.start]:g} s"
        notes.append(Note(f"{what}: cut it off with --from and --to, or mend the log", len(far), place))
    return y, wrong, notes


def _held(y: Array, rows: Ints | slice, there: Ints | slice) -> Array:
    """The readings at the rows ``there``, each fresh one of ``rows`` until the next."""
    if isinstance(rows, slice) or rows is there:
        return y[there]
    logged = np.arange(len(y))[there]
    return y[rows[np.searchsorted(rows, logged, side="right") - 1]]


def _row_notes(time: Array, drive: Drive, found: Mapping[str, _Signal]) -> list[str]:
    """A word on rows in which the command leaves and comes back together with what is measured."""
    answers = drive.answers
    if answers is None:
        return []
    along = {
        role: [row for row in signal.wrong if answers.between(int(row), int(row) + 1)[1] > 0.0]
        for role, signal in found.items()
    }
    rows = sorted({int(row) for of in along.values() for row in of})
    if not rows:
        return []
    whose = " and ".join(role for role, of in along.items() if of)
    what = f"command leaves and comes back together with {whose}, as where a row is misread: it is left so"
    return [Note(f"{what}; leave its cells empty there", len(rows), f"at {time[rows[0]]:g} s")]


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
        return np.interp(time, time[there], _held(y, rows, there))
    return between(role, time, time[rows], y[rows])


def _slow_note(role: str, period: float, time: Array) -> str:
    rate = (len(time) - 1) / (time[-1] - time[0]) / period
    done = "straight lines between"
    if role == "output":
        done = f"left so, it is {(period - 1) / 2:.2g} samples late on average"
    return f"{role} is fresh in every {period:.3g}. row only ({rate:.3g} Hz): {done}"


def _band_note(role: str, y: Array) -> list[str]:
    """Where a logger reports on change."""
    band = dead_band(y)
    if not band:
        return []
    what = f"{role} is logged only once it has changed by {band:.2g}"
    return [f"{what}: log every reading, for a dead band hides what is smaller, and looks like a loop"]


def _frozen(time: Array, signals: Mapping[str, _Signal]) -> list[str]:
    notes: list[str] = []
    for role, signal in signals.items():
        others = [other.filled[signal.there] for name, other in signals.items() if name != role]
        stretch = None if role in HELD else frozen(signal.logged(), others)
        if stretch:
            first, rows = stretch
            at = time[signal.there]
            last = min(first + rows, len(at) - 1)
            place = f"for {at[last] - at[first]:.3g} s from {at[first]:g} s"
            what = f"{role} frozen while the rig moves: cut it off with --from and --to"
            notes.append(Note(what, 1, place))
    return notes
