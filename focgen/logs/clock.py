"""Time stamps: checked, counted, recognised as uniform, or resampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum

import numpy as np

from focgen.arrays import Array, Ints
from focgen.errors import LogError
from focgen.logs.notes import Note
from focgen.logs.stamps import skips_frames
from focgen.logs.units import in_unit

HELD = ("command", "reference")  # set by a controller and held until the next sample
SHORT = 5  # samples: a longer hole is never bridged. On a response whose fastest time constant spans ten
# samples, a straight line over six sample times errs by 3 % of a step at most, unless it jumps inside.
FEWEST = 8  # samples: less shows neither a rate nor a response
_JITTER = 0.1  # of a sample: time stamps this close to a uniform grid are rounding, not jitter
_COARSE = 0.2  # of a sample: a resolution of the stamps that hides a uniform clock
_TOLD = 0.005  # relative: so well do rounded stamps have to tell the time between samples
_FEW = 0.1  # of the samples are lost: more are taken for a clock that ticks otherwise, if there is one
_TICKING = 0.75  # of the steps within half of their median: holes are told from an irregular clock
_IRREGULAR = 0.95  # quantile of the steps that stands for the pace of an irregular clock
_SAME_RATE = 1e-4  # relative
_NEAR = 0.02  # relative: a clock's rate is the rig's
_PLAUSIBLE = 99.0  # a log is recorded at a rate within this factor of the rig's
_PART = 4096  # samples looked at together
_SLIGHT = 1e-9  # of a signal's reach: less is rounding
_LONGEST = 5_000_000  # samples that few rows may be resampled to; many rows, twice as many as they are
_COUNTABLE = 2**53  # ticks that float64 tells apart
_OTHERS = {
    "ms": 1e-3,
    "us": 1e-6,
    "h": 3600.0,
    "day": 86400.0,
}  # s: too far from one to pass for it
_UNITS = {"ms": "milliseconds", "us": "microseconds", "h": "hours", "day": "days"}

Line = Callable[[int], str]


def check_complete(time: Array, where: str, line: Line) -> None:
    """Raise LogError where a time stamp is missing; ``line`` names a row."""
    if np.isnan(time).any():
        raise LogError(
            where, f"has no time stamp in {line(int(np.argmax(np.isnan(time))))}", "complete the column"
        )


def check_increasing(time: Array, where: str, line: Line) -> None:
    """Raise LogError where a time stamp is not later than the one before it."""
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.argmax(steps <= 0)) + 1
        what = f"goes from {time[row - 1]:g} to {time[row]:g} s in {line(row)}: time has to increase"
        remedy = "sort the rows, or name the column that tells the runs apart as run in [signals]"
        if steps.min() == 0:
            remedy = "log finer time stamps, or drop the rows that repeat one"
        raise LogError(where, what, remedy)


def sittings(time: Array) -> list[slice]:
    """Where the clock starts anew: the rows of each part.

    It starts anew where the time falls back by more than a short hole, and then runs on at the log's own
    pace. A single stamp, or a few rows out of order, that fall back are left for ``check_increasing``.
    """
    steps = np.diff(time)
    forward = steps[steps > 0]
    reach = (SHORT + 1) * (float(np.median(forward)) if len(forward) else 0.0)
    falls = [int(row) + 1 for row in np.flatnonzero(steps < -reach)]
    begins = [row for row in falls if _runs_on(steps[row : row + FEWEST - 1], reach)]
    return [slice(a, b) for a, b in zip([0, *begins], [*begins, len(time)])]


def _runs_on(steps: Array, reach: float) -> bool:
    return len(steps) > 0 and bool(np.all((steps >= 0) & (steps <= reach)))


def counted(time: Array) -> Array | None:
    """The stamps (m,) of the uniform clock behind rounded ones, or None where it is not evident.

    Stamps rounded to 10 ms repeat when samples are 5 ms apart, and alternate between steps of 10 and 20 ms
    when those are 15 ms apart. The clock is evident where no stamp is off it by more than its resolution,
    where the stamps are not those of a clock with a few samples lost, and where they tell its step well.
    """
    steps = np.diff(time)
    if steps.min() < 0 or not steps.max() > 0 or (steps.min() > 0 and _few_lost(time)):
        return None
    rows = np.arange(len(time))
    resolution = float(steps[steps > 1e-6 * steps.max()].min())
    step, begin, error = _clock_of(rows, time, steps, resolution)
    if not error <= _TOLD:
        return None
    off = time - (begin + step * rows)
    whole = np.abs(steps / resolution - np.round(steps / resolution)).max() < 1e-3
    if not whole or resolution < _COARSE * step or np.ptp(off) > 1.01 * resolution:
        return None
    made: Array | None = time[0] + step * rows
    return made


def _clock_of(rows: Ints, time: Array, steps: Array, resolution: float) -> tuple[float, float, float]:
    """Step and begin (s) of the clock that is nearest to rounded stamps, and three standard deviations of the
    step over it.

    Of samples closer than the resolution the rows at which the stamp changes tell of the clock, each to a
    sample; else every row does, to the resolution. Either error is uniform, of a deviation of 1/√12.
    """
    usual = float(time[-1] - time[0]) / rows[-1]
    at, stamps, width = rows.astype(float), time, min(resolution, usual)
    if resolution > usual:
        at, stamps = np.flatnonzero(steps > 0.0) + 0.5, time[1:][steps > 0.0] - 0.5 * resolution
    if len(at) < 2:
        return usual, float(time[0]), np.inf
    step, begin = _line(at, stamps)
    return step, begin, 3.0 * width / (np.sqrt(12.0 * len(at)) * float(np.std(at)) * step)


def _few_lost(time: Array) -> bool:
    ticks, _ = _ticks(time)
    return ticks is not None and ticks[-1] + 1 <= (1.0 + _FEW) * len(ticks)


def uniform_step(time: Array) -> float | None:
    """The sample time in s where the stamps are uniform up to rounding, else None."""
    step = (time[-1] - time[0]) / (len(time) - 1)
    grid = np.arange(len(time), dtype=float)  # in place: a log may have ten million rows
    grid *= step
    off = time - time[0]
    off -= grid
    return step if np.abs(off, out=off).max() <= _JITTER * step else None


def _line(x: Array | Ints, y: Array) -> tuple[float, float]:
    """Slope and value at 0 of the line that is nearest to ``y`` (m,) over ``x`` (m,)."""
    middle, mean = float(np.mean(x)), float(np.mean(y))
    off = x - middle
    slope = float(off @ (y - mean)) / float(off @ off)
    return slope, mean - slope * middle


def check_unit(time: Array, sample_time: float, where: str, column: str | None) -> None:
    """Raise LogError where samples lie so far apart, or so close, that the unit of time must be wrong;
    ``column`` counts the time, None where dates or the log's own clock give it."""
    ratio = float(np.median(np.diff(time))) / sample_time
    if 1.0 / _PLAUSIBLE < ratio < _PLAUSIBLE:
        return
    likely = next((unit for unit, size in _OTHERS.items() if 0.5 < ratio * size < 2.0), None)
    guess = f" ({_UNITS[likely]}?)" if likely else ""
    what = (
        f"has samples {ratio * sample_time:g} s apart{guess} where the rig's sample_time is {sample_time:g} s"
    )
    told = "" if column is None else f"give time in seconds, or {in_unit(column, likely or 'ms')}, or "
    raise LogError(where, what, f"{told}correct sample_time")


class Reading(Enum):
    """Why a column of time is taken for seconds."""

    TOLD = "the rig, the file or the column's name says its unit"
    STAMPS = "texts as hh:mm:ss"
    NUMBERS = "nothing says another unit"
    UNSURE = "nothing says another unit, and points may stand between thousands"


def check_reading(time: Array, sample_time: float, where: str, column: str | None, reading: Reading) -> None:
    """Raise LogError where nothing tells that a time is in seconds, and another reading explains it better.

    Seconds pass at the rig's own rate. At another one, a clock that has the rig's rate in minutes or frames
    is taken for these, and whole numbers may count samples or ticks as well.
    """
    step = float(np.median(np.diff(time)))
    if column is None or reading is Reading.TOLD or _is_near(step, sample_time):
        return
    other = None
    if reading is Reading.STAMPS:
        other = "mm:ss and frames, read as hh:mm:ss" if _is_near(step, 60.0 * sample_time) else None
    elif _is_near(60.0 * step, sample_time):
        other = "minutes"
    elif reading is Reading.UNSURE:
        other = "a thousand times as much, with points between thousands"
    elif skips_frames(time):
        other = "seconds and frames, as 12.24 that goes on at 13.00"
    elif (time % 1.0 == 0.0).all():
        other = "a count of samples or of ticks"
    if other is not None:
        what = f"has steps of {step:g} where the rig's sample_time is {sample_time:g} s: it may be {other}"
        remedy = f"{in_unit(column)}, or another unit or scale there, which says what it is"
        raise LogError(where, what, remedy)


def _is_near(step: float, other: float) -> bool:
    return abs(step / other - 1.0) <= _NEAR


def holes(time: Array) -> Ints:
    """The rows (k,) before which more than ``SHORT`` samples are missing, against the log's own pace."""
    steps = np.diff(time)
    return np.flatnonzero(steps > (SHORT + 1.5) * pace(steps)) + 1


def pace(steps: Array) -> float:
    """The usual step (s) of a clock that may have holes: the median, or of an irregular one nearly the
    longest."""
    usual = float(np.median(steps))
    off = steps - usual
    ticks = np.mean(np.abs(off, out=off) <= 0.5 * usual) >= _TICKING
    return usual if ticks else float(np.quantile(steps, _IRREGULAR))


def on_grid(
    time: Array, signals: Mapping[str, Array], sample_time: float, where: str
) -> tuple[float, dict[str, Array], tuple[str, ...]]:
    """Return (sample time in s, signals on a uniform grid, notes).

    Uniform logs keep their own rate, whatever the rig's, and samples that they lack are bridged; others are
    resampled at ``sample_time`` (s): the command in its means over each sample, as it was held from stamp to
    stamp, the reference as held, everything else linear between the stamps.
    """
    ticks, step = _ticks(time)
    if ticks is None:
        return _resampled(time, signals, sample_time, where)
    step, notes = _named_step(step, sample_time, int(ticks[-1]))
    missing = int(ticks[-1]) + 1 - len(ticks)
    if not missing:
        return step, dict(signals), notes
    _check_length(ticks[-1] + 1, step, where, len(time))
    grid = np.arange(ticks[-1] + 1)
    full = {role: between(role, grid, ticks, values) for role, values in signals.items()}
    row = int(np.argmax(np.diff(ticks) > 1))
    what = "samples missing, bridged by straight lines (command and reference held)"
    return step, full, (*notes, Note(what, missing, f"at {time[row] + step:g} s"))


def between(role: str, grid: Array | Ints, at: Array | Ints, values: Array) -> Array:
    """A role's signal at ``grid`` (n,), from ``values`` (m,) ``at`` some of it: held or on straight lines."""
    if role not in HELD:
        return np.interp(grid, at, values)
    made: Array = values[np.maximum(np.searchsorted(at, grid + 1e-9 * (at[-1] - at[0]), side="right") - 1, 0)]
    return made


def _ticks(time: Array) -> tuple[Ints | None, float]:
    """Which sample of a uniform clock each row (m,) is, and its step in s; None where there is no such
    clock."""
    step = uniform_step(time)
    if step is not None:
        return np.arange(len(time)), step
    steps = np.diff(time)
    with np.errstate(all="ignore"):  # of steps that are no clock's
        counts = np.round(steps / np.median(steps))
    if not (counts >= 1).all() or counts.sum() > _COUNTABLE:
        return None, 0.0
    ticks = np.concatenate([[0], np.cumsum(counts.astype(int))])
    step, begin = _line(ticks, time)
    if ticks[-1] == len(time) - 1 or np.abs(time - begin - step * ticks).max() > _JITTER * step:
        return None, 0.0
    return ticks, float(step)


def _named_step(step: float, sample_time: float, last: int) -> tuple[float, tuple[str, ...]]:
    """The rig's sample time where the log has the same but for jitter of both ends, else its own and a
    note."""
    if abs(step / sample_time - 1.0) < max(_SAME_RATE, 2.0 * _JITTER / last):
        return sample_time, ()
    step = float(f"{step:.6g}")
    return step, (f"sampled every {step:g} s and kept so, though the rig runs at {sample_time:g} s",)


def _resampled(
    time: Array, signals: Mapping[str, Array], sample_time: float, where: str
) -> tuple[float, dict[str, Array], tuple[str, ...]]:
    count = int((time[-1] - time[0]) / sample_time + 1e-6) + 1
    _check_length(count, sample_time, where, len(time))
    grid = time[0] + sample_time * np.arange(count)
    resampled = {
        role: _held_means(grid, sample_time, time, x) if role == "command" else between(role, grid, time, x)
        for role, x in signals.items()
    }
    return sample_time, resampled, (f"time stamps not uniform: resampled every {sample_time:g} s",)


def _held_means(grid: Array, step: float, at: Array, values: Array) -> Array:
    """The mean, over the sample that begins at each of ``grid`` (n,), of what is held at ``values`` (m,) from
    ``at`` on: a step between two samples is not put off to the next, which a rig that adds up would keep."""
    slight, base = _SLIGHT * float(np.ptp(values)), values[0]
    if not slight:
        return np.full(len(grid), base)
    summed = np.empty(
        len(at)
    )  # of what is above the first; up to each of ``at``; by parts and in place, for logs may be long
    summed[0] = 0.0
    np.subtract(at[1:], at[:-1], out=summed[1:])
    summed[1:] *= values[:-1] - base
    np.cumsum(summed, out=summed)
    made = np.empty(len(grid))
    for first in range(0, len(grid), _PART):
        ends = np.append(grid[first : first + _PART], grid[min(first + _PART, len(grid)) - 1] + step)
        reached = np.interp(ends, at, summed) + (values[-1] - base) * np.maximum(ends - at[-1], 0.0)
        held, means = between("command", ends[:-1], at, values), base + np.diff(reached) / step
        made[first : first + _PART] = np.where(np.abs(means - held) > slight, means, held)
    return made


def _check_length(count: int, step: float, where: str, rows: int) -> None:
    if count > max(_LONGEST, 2 * rows):
        raise LogError(
            where, f"would take {count} samples of {step:g} s", "shorten the log or set sample_time"
        )
