"""Single readings far off both neighbours: a bit lost on the wire, a spark, a frame misread."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from focgen.arrays import Array, Bools, Ints
from focgen.logs.answers import WIDEST, Answers
from focgen.logs.ends import CLEAR, FAR, ROWS, SIDE, ahead_of_line, at_an_end

_LEVEL = 3.0  # times what the two sides differ by
_EVEN = 0.6  # of the farthest of several in a row is the nearest: they come and go at once
_BLOCK = 128  # readings over which the noise is taken as even
_RARE = 0.01  # of the readings: more of them are the signal's own
_FEWEST = 20  # readings
_BEHIND = WIDEST + 2 * SIDE  # readings of which the command has to rest where there is one side only
_ALIKE = 3  # readings as many rows behind jumps of the command, at least: they answer it …
_BY_CHANCE = 4.0  # … and more than come there by chance, by so many of its standard deviations
_PART = 1 << 16  # windows that are looked at side by side
_FINE = 1e-3  # of the span: what noise there is at least
_FAR_OFF = 0.2  # of the span: so far off both sides is a number that stands for no reading …
_AGREE = 0.25  # … times that, the two sides differ by at most
_STRETCH = 10  # rows of it in a row, at most
_AGAIN = 5  # stretches of exactly the same number, at least …
_ALONE = 0.9  # … and of all that are so far off: what swings has two ends


@dataclass(frozen=True)
class _Bounds:
    """How far off an outlier is in some places, and in which; ``answers`` count in ``jump``."""

    barred: Bools
    never: Bools
    answers: Answers | None
    jump: float
    reach: float

    def allow(self, size: Array, begin: int, width: int) -> Bools:
        """Whether pulses (k,) of ``width`` readings and ``size`` (k,) may be outliers, in windows from
        ``begin`` on."""
        whole = 2 * SIDE + width
        rows = slice(begin, begin + len(size) + whole - 1)
        barred, never = (_touched(where[rows], whole) for where in (self.barred, self.never))
        far: Bools = size > self.reach
        if self.answers is None or not (barred | never).any():
            return ~never & (~barred | far)
        near, along = (self.jump * x for x in self.answers.between(rows.start, rows.stop))
        beyond = size > sliding_window_view(near, whole).max(axis=1)
        found: Bools = _together(along, size, width) | ((~barred | far | beyond) & (~never | (far & beyond)))
        return found

    def least(self, rows: slice) -> float:
        """What a pulse within ``rows`` at an end of the signal has to exceed."""
        if not self.never[rows].any():
            return self.reach
        if self.answers is None:
            return np.inf
        return max(self.reach, self.jump * float(self.answers.between(rows.start, rows.stop)[0].max()))


def _together(along: Array, size: Array, width: int) -> Bools:
    """Whether pulses (k,) leave and come back as the command does, farther off than they could be ``along``
    with it."""
    windows = sliding_window_view(along, 2 * SIDE + width)
    inside = windows[:, SIDE:-SIDE]
    there = (inside.min(axis=1) > 0.0) & (windows[:, SIDE - 1] == 0.0) & (windows[:, -SIDE] == 0.0)
    found: Bools = there & (size > inside.max(axis=1))
    return found


def outliers(
    y: Array, barred: Bools | None = None, never: Bools | None = None, answers: Answers | None = None
) -> Bools:
    """Which readings of ``y`` (n,) are outliers, a mask (n,). Near a jump of the command (``barred``, (n,))
    only those are that are farther off than all that the signal does, or than the ``answers`` to the command
    could be; three as many rows behind jumps are none. Near a pulse of it (``never``, (n,); as ``barred``
    unless given) they have to be farther off than both, or leave and come back together with the command;
    without ``answers`` none is.

    One to three readings in a row count that lie on one side of the line through three neighbours on either
    side, farther off than noise could (a Hampel test on that distance, with the noise of the place), than the
    neighbours scatter, and than the two sides differ. So corners, overshoot and edges are none. At its ends a
    signal has neighbours on one side only. There, too, it has to be farther off than all that the signal
    does, which has to be more than to rest, while the command is known to rest. More than one in a hundred
    may be the signal's own: see ``are_many``.
    """
    found = np.zeros(len(y), bool)
    if len(y) < _FEWEST or np.ptp(y) == 0.0:
        return found
    known = barred is not None
    barred = found.copy() if barred is None else barred
    never = barred if never is None else never
    least, reach = least_noise(y), _reach(y)
    jump = _jump_beside_sparks(y) if answers is not None and (barred | never).any() else np.inf
    bounds = _Bounds(barred, never, answers if jump < np.inf else None, jump, reach)
    for width in range(1, WIDEST + 1):
        for at in _pulses(y, bounds, width, least):
            found[at : at + width] = True
    for way, ends in _at_ends(y, bounds, known, least):
        found[way][:ROWS] |= ends
    return found if answers is None else found & ~_alike(found, answers)


def _alike(found: Bools, answers: Answers) -> Bools:
    """Which of the readings ``found`` (n,) come as many rows behind a jump of the command as others do: they
    answer it, as a valve's knock does. Sparks do not wait for it."""
    jumps = np.flatnonzero(np.abs(np.diff(answers.command)) > answers.jump) + 1
    rows = np.flatnonzero(found)
    if not len(jumps) or len(rows) < _ALIKE:
        return np.zeros(len(found), bool)
    behind = rows - jumps[np.maximum(np.searchsorted(jumps, rows, side="right") - 1, 0)]
    near = (behind >= 0) & (behind <= _BEHIND)
    chance = len(rows) * len(jumps) / len(found)  # that so many of them come behind jumps by as much
    often = np.bincount(behind[near], minlength=_BEHIND + 1) >= max(
        _ALIKE, chance + _BY_CHANCE * np.sqrt(chance)
    )
    made = np.zeros(len(found), bool)
    made[rows[near][often[behind[near]]]] = True
    return made


def are_many(found: Bools) -> bool:
    """Whether so many outliers (n,) were found that the signal may be like that: they are left."""
    return bool(found.sum() > max(WIDEST, _RARE * len(found)))


def first_stands_out(y: Array, barred: Bools) -> bool:
    """Whether the first reading of ``y`` (n,) is far off those behind it, as if left from before: while the
    command rests, not at rest itself, and farther than any change that lasts."""
    if len(y) < _FEWEST or barred[:_BEHIND].any():
        return False
    off, rough = ahead_of_line(y, 1)
    least = FAR * max(rough, least_noise(y))
    return bool(abs(off[0]) > max(least, 2.0 * largest_jump(y)) and abs(y[0]) > least)


def straightened(time: Array, y: Array, wrong: Bools) -> Array:
    """``y`` (n,) with the readings that are ``wrong`` (n,) on the straight line between their neighbours."""
    made = y.copy()
    made[wrong] = np.interp(time[wrong], time[~wrong], y[~wrong])
    return made


def _at_ends(y: Array, bounds: _Bounds, known: bool, least: float) -> Iterator[tuple[slice, Bools]]:
    """Yield (view, mask): which readings are outliers among the first in a view of ``y`` (n,), forwards and
    backwards; ``known``: there is a command."""
    for way, rows in ((slice(None), slice(0, ROWS)), (slice(None, None, -1), slice(len(y) - ROWS, len(y)))):
        resting = known and not bounds.barred[way][:_BEHIND].any()
        calm = known and not bounds.never.any()
        yield way, at_an_end(y[way], least, bounds.least(rows), resting, calm)


def _pulses(y: Array, bounds: _Bounds, width: int, least: float) -> Ints:
    """Where outliers of ``width`` readings begin that the ``bounds`` allow."""
    whole = 2 * SIDE + width
    if len(y) < whole:
        return np.zeros(0, int)
    found, sizes, off = [], [], np.empty(len(y) - whole + 1)
    for begin, part in _parts(y, whole):
        first, size, hit = _standing_out(part, width)
        hit &= bounds.allow(size, begin, width)
        off[begin : begin + len(first)] = first
        found.append(begin + np.flatnonzero(hit))
        sizes.append(size[hit])
    at, size = np.concatenate(found), np.concatenate(sizes)
    far = size > FAR * np.maximum(_noise(off, at), least)
    if width > 1 and far.any():  # pulses as high as the jumps of the signal itself are its own
        far &= size > 2.0 * largest_jump(y)
    return at[far] + SIDE


def _touched(where: Bools, width: int) -> Bools:
    """Whether a window of ``width`` readings has one of those."""
    return np.asarray(sliding_window_view(where, width).any(axis=1), bool)


def _parts(y: Array, width: int) -> Iterator[tuple[int, Array]]:
    """Yield (where it begins, part): all windows of ``y`` (n,), each in one part."""
    for begin in range(0, len(y) - width + 1, _PART):
        yield begin, y[begin : begin + _PART + width - 1]


def _standing_out(y: Array, width: int) -> tuple[Array, Array, Bools]:
    """For each window of ``y`` (n,): how far its first reading inside is off the line through the neighbours,
    how far the nearest of ``width`` is, and whether these stand out as an outlier does."""
    whole = 2 * SIDE + width
    windows = sliding_window_view(y, whole)
    beside = np.r_[:SIDE, SIDE + width : whole]
    places = np.arange(whole) - (whole - 1) / 2.0
    level = windows[:, beside].mean(axis=1)
    slope = windows[:, beside] @ places[beside] / np.sum(places[beside] ** 2)
    off = windows - level[:, None] - slope[:, None] * places
    inside, rough = off[:, SIDE:-SIDE], np.abs(off[:, beside]).max(axis=1)
    size = np.abs(inside).min(axis=1)
    differ = np.abs(windows[:, :SIDE].mean(axis=1) - windows[:, -SIDE:].mean(axis=1))
    hit = (np.abs(np.sign(inside).sum(axis=1)) == width) & (size > CLEAR * rough) & (size > _LEVEL * differ)
    if width > 1:  # pulses that swell are the signal's own
        hit &= size > _EVEN * np.abs(inside).max(axis=1)
    return np.abs(inside[:, 0]), size, hit


def _noise(off: Array, at: Ints) -> Array:
    """The robust standard deviation ``at`` places (k,) of what is ``off`` (m,): its median over the noisiest
    of the blocks around, or over all."""
    count = max(1, len(off) // _BLOCK)
    parts = np.array_split(off, count)
    medians = np.array([np.median(part) for part in parts])
    near = noisiest_near(medians)
    block = np.searchsorted(np.cumsum([len(part) for part in parts]), at, side="right")
    made: Array = 1.4826 * np.maximum(near[block], np.median(off))
    return made


def noisiest_near(medians: Array) -> Array:
    """Of blocks (k,) each one's median, or that of a neighbour, whichever is larger."""
    padded = np.concatenate([medians[:1], medians, medians[-1:]])
    near: Array = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return near


def least_noise(y: Array) -> float:
    """Half a step of a quantised signal, or a little of the span: the median of steps that mostly stay away
    is 0. The span is that of medians, so readings of 10⁹ make no step a rounding error."""
    low, high = ends_of_medians(y, 2 * WIDEST + 1)
    if high == low:
        low, high = ends_of_medians(y, 3)
    span = high - low
    steps = np.abs(np.diff(np.asarray(y, float)))
    finest = float(np.min(steps, where=steps > 1e-9 * span, initial=np.inf))
    return max(0.5 * finest, _FINE * span)


def _reach(y: Array) -> float:
    """The span of all that a signal does for longer than an outlier lasts, 0 among it: there it rests."""
    low, high = ends_of_medians(y, 2 * WIDEST + 1)
    return max(high, 0.0) - min(low, 0.0)


def ends_of_medians(y: Array, width: int) -> tuple[float, float]:
    """The least and the largest of the medians of ``width`` readings in a row."""
    middles = [np.median(sliding_window_view(part, width), axis=1) for _, part in _parts(y, width)]
    return min(float(m.min()) for m in middles), max(float(m.max()) for m in middles)


def largest_jump(y: Array) -> float:
    """The largest change of ``y`` (n,) from one reading to the next that lasts; infinite of fewer than 16."""
    return max((_lasting(part) for _, part in _parts(y, 14)), default=np.inf) if len(y) >= 16 else np.inf


def _jump_beside_sparks(y: Array) -> float:
    """The same of the medians of three: a spark beside a jump makes it no larger."""
    return max((_lasting(_middle_of_three(part)) for _, part in _parts(y, 16)), default=np.inf)


def _middle_of_three(y: Array) -> Array:
    low, high = np.minimum(y[:-1], y[1:]), np.maximum(y[:-1], y[1:])
    made: Array = np.maximum(low[:-1], np.minimum(high[:-1], y[2:]))
    return made


def _lasting(y: Array) -> float:
    middle = np.median(sliding_window_view(y, 7), axis=1)
    lasting = np.abs(middle[7:] - middle[:-7])
    return float(np.minimum(lasting, np.abs(np.diff(y))[6 : 6 + len(lasting)]).max())


def stand_in(y: Array) -> tuple[float, int] | None:
    """A number that stands for readings (n,) that are missing, and the first row that has it; None where
    there is none: exactly the same one each time, while what is ahead of it and behind it agree.

    >>> y = np.sin(0.01 * np.arange(900.0))
    >>> stand_in(y), stand_in(np.where(np.arange(900) % 90 == 60, -1.0, y))
    (None, (-1.0, 60))
    """
    least = _FAR_OFF * float(np.ptp(y)) if len(y) else 0.0
    jumps = _leaps(y, least)
    held, ends = jumps[:-1], jumps[1:]  # each stretch between two jumps
    value, before, after = y[held], y[held - 1], y[ends]
    far = np.minimum(np.abs(value - before), np.abs(value - after))
    alike = (y[ends - 1] == value) & (np.abs(after - before) < _AGREE * far) & (ends - held <= _STRETCH)
    values, counts = np.unique(value[alike], return_counts=True)
    if not len(values) or counts.max() < max(_AGAIN, _ALONE * counts.sum()):
        return None
    found = float(values[np.argmax(counts)])
    return found, int(held[alike & (value == found)][0])


def _leaps(y: Array, least: float) -> Ints:
    """The rows that are farther than ``least`` from the one ahead, looked for in parts: a log may be long."""
    parts = [y[at : at + _PART + 1] for at in range(0, len(y), _PART)]
    found = [np.flatnonzero(np.abs(np.diff(part)) > least) + 1 + k * _PART for k, part in enumerate(parts)]
    return np.concatenate([np.empty(0, int), *found])
