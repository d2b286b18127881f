"""One run of a log, and the experiments that are left of it: holes bridged or cut, readings mended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.errors import LogError
from focgen.logs import clock, missing, stamps
from focgen.logs.clock import FEWEST
from focgen.logs.experiment import Experiment
from focgen.logs.mending import mended
from focgen.logs.notes import Note

_TWICE = 0.9  # of the stamps that repeat: fewer with the same readings are rounded ones of a rig at rest
_ANEW = "the clock starts anew, what follows is an experiment of its own"
_SHORT = f"parts of fewer than {FEWEST} samples left out"
Window = tuple[float | None, float | None]


@dataclass(frozen=True, eq=False)
class Raw:
    """Rows of a log as they stand in the file: ``time`` (m,) in s, ``values`` by role (m,), NaN where a
    reading is missing; ``where``, ``stamps`` and ``line`` name log, clock and row in messages; ``column``
    holds the time, where one does."""

    name: str
    where: str
    stamps: str
    time: Array
    values: Mapping[str, Array]
    line: clock.Line
    notes: tuple[str, ...] = ()
    reading: clock.Reading = clock.Reading.TOLD
    column: str | None = None

    def __len__(self) -> int:
        return len(self.time)

    def part(self, kept: slice | Bools | Ints) -> Raw:
        """The rows ``kept``: of a slice views, of a mask (m,) or of row numbers copies."""
        values = {role: y[kept] for role, y in self.values.items()}
        return replace(self, time=self.time[kept], values=values, line=self._line_of(kept))

    def _line_of(self, kept: slice | Bools | Ints) -> clock.Line:
        line = self.line
        if isinstance(kept, slice):
            first = kept.indices(len(self))[0]
            return lambda row: line(first + row)
        rows = np.flatnonzero(kept) if kept.dtype == bool else kept
        return lambda row: line(int(rows[row]))

    def carried_on(self) -> Raw:
        """The same on a clock that nobody puts back, with a note where somebody did."""
        time, found = stamps.carried_on(self.time)
        if not found:
            return self
        row, hours = next(iter(found.items()))
        what = f"the clock is put back by {hours:g} h, the time taken as going on"
        return replace(self, time=time).with_notes(Note(what, len(found), f"in {self.line(row)}"))

    def with_notes(self, *notes: str) -> Raw:
        """The same, with more to be said of it."""
        return replace(self, notes=(*self.notes, *notes))


def experiments_of(run: Raw, sample_time: float, window: Window) -> Iterator[Experiment]:
    """Yield the experiments of a run, in the order of its rows.

    The clock starting anew begins a new one, and so does what follows a hole that is too long to be bridged:
    this one ``continues``. All parts after the first are named "NAME (2)" and so on. ``window``: from and to,
    s since the clock started. Raises LogError where nothing usable is left.
    """
    clock.check_complete(run.time, run.stamps, run.line)
    if len(run) < FEWEST:
        raise LogError(run.where, f"has {len(run)} samples", f"give at least {FEWEST}")
    number = 0
    kept, notes = _long_enough(clock.sittings(run.time), run)
    for rows in kept:
        anew = rows is not kept[0]
        for part, continues in _uncut(_windowed(_counted(run.part(rows)), window), sample_time):
            number += 1
            name = run.name if number == 1 else f"{run.name} ({number})"
            said = replace(part, name=name).with_notes(*notes)
            yield _experiment(said, continues, anew, sample_time)
            anew, notes = False, ()


def _long_enough(sittings: list[slice], run: Raw) -> tuple[list[slice], tuple[Note, ...]]:
    """The parts between two beginnings of the clock that are experiments, and what to say of them. Rows that
    repeat the one before are no samples: arrays are made too long ahead, and end in zeros."""
    kept = [rows for rows in sittings if np.sum(~_repeats(run.part(rows))) >= FEWEST]
    if not kept and len(sittings) == 1:
        what = f"has fewer than {FEWEST} samples, the other rows repeat them"
        raise LogError(run.stamps, what, "log the time of each sample")
    if not kept:
        what = "has a clock that starts anew every few samples"
        raise LogError(run.where, what, "sort the rows, or name the column that tells the runs apart as run")
    short = [rows for rows in sittings if rows not in kept]
    told = [(_ANEW, kept[1:]), (_SHORT, short)]
    return kept, tuple(Note(what, len(of), f"in {run.line(of[0].start)}") for what, of in told if of)


def _counted(run: Raw) -> Raw:
    """The run on time stamps that increase: rows logged twice once, rounded stamps counted."""
    twice = _repeats(run)
    stopped = int(np.sum(np.diff(run.time) == 0.0))
    if twice.any() and twice.sum() > _TWICE * stopped:
        note = Note(
            "rows logged twice, taken once", int(twice.sum()), f"in {run.line(int(np.argmax(twice)))}"
        )
        run = run.part(~twice).with_notes(note)
    even = clock.counted(run.time)
    if even is not None:
        step = even[1] - even[0]
        told = f"time stamps are rounded, {step:.4g} s between samples by their number"
        run = replace(run, time=even).with_notes(told)
    clock.check_increasing(run.time, run.stamps, run.line)
    return run


def _repeats(run: Raw) -> Bools:
    """Which rows (m,) repeat the one before, time stamp and all."""
    same = run.time[1:] == run.time[:-1]
    for y in run.values.values():
        same &= (y[1:] == y[:-1]) | (np.isnan(y[1:]) & np.isnan(y[:-1]))
    return np.concatenate([[False], same])


def _windowed(run: Raw, window: Window) -> Raw:
    if window == (None, None):
        return run
    first, last = (edge if edge is not None else way * np.inf for edge, way in zip(window, (-1, 1)))
    since = run.time - run.time[0]
    kept = (since >= first - 1e-9) & (since <= last + 1e-9)
    if kept.sum() < FEWEST:
        span = f"from {max(first, 0):g} to {min(last, since[-1]):g} s"
        raise LogError(
            run.where, f"has {kept.sum()} samples {span}", f"it lasts {since[-1]:g} s: widen --from and --to"
        )
    return run.part(kept)


def _uncut(run: Raw, sample_time: float) -> Iterator[tuple[Raw, bool]]:
    """Yield (part, whether the rig ran unseen before it) for each part between long holes."""
    counts = run.column if run.reading is not clock.Reading.STAMPS else None  # a date has no unit
    clock.check_unit(run.time, sample_time, run.stamps, counts)
    clock.check_reading(run.time, sample_time, run.stamps, run.column, run.reading)
    kept = missing.keep(run.values, run.time)
    _check_present(run, kept)
    run = replace(run, values={role: run.values[role] for role in kept.roles})
    holes = clock.holes(run.time)
    spans = _spans(kept.rows, holes)
    long = [rows for rows in spans if rows.stop - rows.start >= FEWEST]
    if not long:
        raise LogError(run.where, f"has no {FEWEST} samples in a row without a hole", "log it again")
    notes = (*kept.notes, *_hole_notes(run.time, holes), *_short_notes(run.time, spans))
    for rows in long:
        part = run.part(rows)
        unseen = rows.start > clock.SHORT or rows.start in holes
        yield (part.with_notes(*notes) if rows is long[0] else part), bool(unseen)


def _spans(kept: Bools, holes: Ints) -> list[slice]:
    """The rows that are kept (m,), in a row and without a hole. A span begins at a hole, or where rows are
    kept again: so what it keeps stands at its front."""
    begins = np.union1d(holes, np.flatnonzero(kept[1:] & ~kept[:-1]) + 1)
    edges = [0, *begins.tolist(), len(kept)]
    counts = [int(kept[a:b].sum()) for a, b in pairwise(edges)]
    return [slice(a, a + count) for a, count in zip(edges, counts) if count]


def _hole_notes(time: Array, holes: Ints) -> list[Note]:
    if not len(holes):
        return []
    before, after = time[holes[0] - 1], time[holes[0]]
    what = "holes in time too long to be bridged, what follows is an experiment of its own"
    return [Note(what, len(holes), f"of {after - before:g} s at {before:g} s")]


def _short_notes(time: Array, spans: Sequence[slice]) -> list[Note]:
    short = [rows for rows in spans if rows.stop - rows.start < FEWEST]
    return [Note(_SHORT, len(short), f"at {time[short[0].start]:g} s")] if short else []


def _check_present(run: Raw, kept: missing.Kept) -> None:
    """Raise LogError where a role that is needed has no reading at all."""
    if kept.rows.any():
        return
    inputs = [role for role in ("command", "pressure") if role in run.values]
    role = "output" if "output" not in kept.roles else inputs[0]
    row = int(np.argmax(missing.long_stretches(run.values[role])))
    what = f"{role} is empty or not a number in {run.line(row)} and {len(run) - 1} more"
    raise LogError(run.where, what, "fill the column, or name another in [signals]")


def _experiment(part: Raw, continues: bool, anew: bool, sample_time: float) -> Experiment:
    values, said = mended(part.time, part.values)
    step, even, more = clock.on_grid(part.time, values, sample_time, part.where)
    resampled = any(even[role] is not values[role] for role in values)
    notes = (*part.notes, *said, *more)
    start, rows = float(part.time[0]), values if resampled else None
    return Experiment(part.name, step, even, start, part.time, notes, rows, continues, anew=anew)
