"""Readings in a row that leave and come back at once while the command rests: a loose plug, a lost frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.logs.answers import WIDEST
from focgen.logs.drives import Drive, jump_of, jumped
from focgen.logs.outliers import are_many, least_noise, noisiest_near, outliers

_LONGEST = 50  # readings in a row, unless the command rests; so far apart leaps are looked at together
_SETTLED = 100  # readings behind a jump of the command: what is quick has answered by then
_FAR = 8.0  # times the usual change from one reading to the next, made a standard deviation
_BLOCK = 128  # readings over which that is taken as even
_PART = _BLOCK << 6  # readings that are looked at at a time
_SIDE = 5  # readings on either side whose median counts
_AGREE = 0.25  # of how far it leaves: so near it comes back
_FEWEST = 20  # readings
_STILL = 8.0  # times the usual change of a command from one reading to the next: no more is noise of it
_ROUNDED = 1e-9  # of the span of a command
_EARLY = 300  # readings: what begins so early may answer a pulse that began ahead of the log
_SMALL = 0.05  # of the span of the signal: what leaves by less at rest is left


def strays(y: Array, command: Array) -> list[slice]:
    """The stretches of ``y`` (n,) that leave and come back while ``command`` (n,) does not jump, nor has just
    done so, nor has the log just begun.

    They leave and come back from one reading to the next, by more than the signal does so anywhere else.
    Where the command moves at all, or they are shorter than four readings, they are also farther off than all
    that the signal does elsewhere, and no longer than 50 readings. Where the command rests they may be as
    long as that lasts, and leave by less than behind a jump of it. Then no pulse of the command ahead is
    as long, whose answer might come late, nor could one have been that began ahead of the log.
    """
    if len(y) < _FEWEST or np.ptp(y) == 0.0:
        return []
    moving = jumped(command, _SETTLED)
    moving[:_SETTLED] = True  # what was before is not known
    leaps, own = _leaps(y, moving[1:])
    far = _that_come_back(y, leaps[_sizes(y, leaps) > own], moving)
    near = _that_come_back(y, leaps, moving)
    found = _farther(y, command, [part for part in far if _length(part) <= _LONGEST])
    asked, small = _Asked.of(command), _SMALL * float(np.ptp(y))
    found += [part for part in [*far, *near] if _in_a_rest(y, asked, part, small)]
    return _apart(found, len(y))


def astray(y: Array, command: Array) -> Bools:
    """Which readings of ``y`` (n,) are told of and not mended: strays, and outliers where these are many."""
    drive = Drive.by(command)
    found = outliers(y, drive.barred, drive.never, drive.answers)
    if not are_many(found):
        found[:] = False
    for part in strays(y, command):
        found[part] = True
    return found


def _leaps(y: Array, moving: Bools) -> tuple[Ints, float]:
    """The rows that are farther from the one ahead than noise is, and not where the signal is ``moving``
    (n − 1,); and how far the farthest there is."""
    own, medians = 0.0, []
    for begin, steps in _steps(y):
        own = max(own, float(steps.max(where=moving[begin : begin + len(steps)], initial=0.0)))
        medians += [np.median(steps[at : at + _BLOCK]) for at in range(0, len(steps), _BLOCK)]
    noise = _noisiest(np.array(medians), least_noise(y))
    found = [np.empty(0, int)]
    for begin, steps in _steps(y):
        there = noise[begin // _BLOCK : -(-(begin + len(steps)) // _BLOCK)]
        least = _FAR * np.repeat(there, _BLOCK)[: len(steps)]
        found.append(np.flatnonzero((steps > least) & ~moving[begin : begin + len(steps)]) + begin + 1)
    return np.concatenate(found), own


def _that_come_back(y: Array, leaps: Ints, moving: Bools) -> list[slice]:
    """The stretches between some ``leaps`` at whose end ``y`` (n,) is the same again, and which leap farther
    than any that does not come back."""
    if not len(leaps):
        return []
    back, lasting = _paired(y, np.split(leaps, np.flatnonzero(np.diff(leaps) > _LONGEST) + 1), moving)
    own = max((float(_sizes(y, g).min()) for g in lasting), default=0.0)  # it moves so by itself
    return [slice(int(g[0]), int(g[-1])) for g in back if _sizes(y, g[[0, -1]]).min() > own]


def _paired(y: Array, groups: list[Ints], moving: Bools) -> tuple[list[Ints], list[Ints]]:
    """The groups of leaps that come back, alone or with the next one ahead of any jump, and the others."""
    back: list[Ints] = []
    lasting: list[Ints] = []
    waiting: Ints | None = None
    for group in groups:
        if _comes_back(y, group):
            back.append(group)
            continue
        if waiting is not None and not moving[waiting[-1] : group[0]].any():
            both = np.concatenate([waiting, group])
            if _comes_back(y, both):
                back.append(both)
                waiting = None
                continue
        lasting += [] if waiting is None else [waiting]
        waiting = group
    return back, lasting if waiting is None else [*lasting, waiting]


def _length(part: slice) -> int:
    return int(part.stop - part.start)


def _apart(parts: list[slice], count: int) -> list[slice]:
    """Of stretches of ``count`` readings that overlap the first named, all in the order of time."""
    kept, taken = [], np.zeros(count, bool)
    for part in parts:
        if not taken[part].any():
            taken[part] = True
            kept.append(part)
    return sorted(kept, key=lambda part: int(part.start))


@dataclass(frozen=True, eq=False)
class _Asked:
    """A ``command`` (n,), the ``least`` that is no rounding of it, the readings ``at`` (m,) behind which it
    jumps, and where two such jumps in a row (m − 1,) are a ``pulse``, for they go opposite ways."""

    command: Array
    least: float
    at: Ints
    pulse: Bools

    @classmethod
    def of(cls, command: Array) -> _Asked:
        steps = np.diff(command)
        at = np.flatnonzero(np.abs(steps) > jump_of(command))
        return cls(command, _ROUNDED * float(np.ptp(command)), at, np.diff(np.sign(steps[at])) != 0.0)


def _in_a_rest(y: Array, asked: _Asked, part: slice, small: float) -> bool:
    """Whether the command rests around a stretch of ``y`` (n,) that is no late answer to a pulse of it, and
    leaves by more than is ``small``."""
    there = asked.command[max(part.start - _SETTLED, 0) : part.stop + 1]
    noise = max(_STILL * float(np.median(np.abs(np.diff(there)))), asked.least)
    if _length(part) <= WIDEST or float(np.ptp(there)) > noise:
        return False
    leaves = _sizes(y, np.array([part.start, part.stop])).min()
    return bool(leaves >= small) and not _may_be_late(asked, part)


def _may_be_late(asked: _Asked, part: slice) -> bool:
    """Whether a stretch is as long as a pulse of the command ahead of it, or as one that may have begun ahead
    of the log."""
    at, length = asked.at[: np.searchsorted(asked.at, part.start - 1)], _length(part)
    near = WIDEST + _AGREE * length
    if part.start < _EARLY and (not len(at) or at[0] < length + near):
        return True
    pulses = np.diff(at)[asked.pulse[: max(len(at) - 1, 0)]]
    return bool(np.any(np.abs(pulses - length) <= near))


def _steps(y: Array) -> Iterator[tuple[int, Array]]:
    """Yield (where it begins, part): how far each of ``y`` (n,) is from the one ahead; a log may be long."""
    for begin in range(0, len(y) - 1, _PART):
        yield begin, np.abs(np.diff(y[begin : begin + _PART + 1]))


def _noisiest(medians: Array, least: float) -> Array:
    """Of blocks (k,) the deviation that stands for the noise of each: of the noisiest of it and its
    neighbours, or of most."""
    made: Array = np.maximum(1.4826 * np.maximum(noisiest_near(medians), np.median(medians)), least)
    return made


def _sizes(y: Array, rows: Ints) -> Array:
    """The changes of ``y`` (n,) from the reading ahead of each row."""
    made: Array = np.abs(y[rows] - y[rows - 1])
    return made


def _sides(y: Array, leaps: Ints) -> tuple[float, float]:
    """What ``y`` (n,) is ahead of the first leap and behind the last."""
    before, after = y[max(leaps[0] - _SIDE, 0) : leaps[0]], y[leaps[-1] : leaps[-1] + _SIDE]
    return float(np.median(before)), float(np.median(after))


def _comes_back(y: Array, leaps: Ints) -> bool:
    """Whether ``y`` (n,) is the same again behind the last of some leaps."""
    if leaps[0] < _SIDE or len(y) - leaps[-1] < _SIDE:
        return False
    before, after = _sides(y, leaps)
    away = np.abs(y[leaps[0] : leaps[-1]] - before).max(initial=0.0)
    return bool(leaps[-1] > leaps[0] and abs(after - before) <= _AGREE * away)


def _farther(y: Array, command: Array, found: list[slice]) -> list[slice]:
    """Those of the stretches that are farther off than all that ``y`` (n,) does elsewhere, or need not be."""
    if not found:
        return []
    elsewhere = np.delete(y, np.concatenate([np.arange(part.start, part.stop) for part in found]))
    reach = max(elsewhere.max(), 0.0) - min(elsewhere.min(), 0.0)
    least = jump_of(command)

    def free(part: slice) -> bool:
        moves = np.ptp(command[max(part.start - _SETTLED, 0) : part.stop + 1])
        return bool(part.stop - part.start > WIDEST and (moves <= least or np.ptp(command) == 0.0))

    def size(part: slice) -> float:
        before, after = _sides(y, np.array([part.start, part.stop]))
        return float(np.abs(y[part] - 0.5 * (before + after)).max())

    return [part for part in found if free(part) or size(part) > reach]
