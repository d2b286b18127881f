"""Readings in a row that leave and come back at once while the command rests: a loose plug, a lost frame."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.logs.answers import WIDEST
from focgen.logs.drives import Drive, jump_of, jumped
from focgen.logs.outliers import are_many, least_noise, noisiest_near, outliers

_LONGEST = 50  # readings in a row
_SETTLED = 100  # readings behind a jump of the command: what is quick has answered by then
_FAR = 8.0  # times the usual change from one reading to the next, made a standard deviation
_BLOCK = 128  # readings over which that is taken as even
_PART = _BLOCK << 6  # readings that are looked at at a time
_SIDE = 5  # readings on either side whose median counts
_AGREE = 0.25  # of how far it leaves: so near it comes back
_FEWEST = 20  # readings


def strays(y: Array, command: Array) -> list[slice]:
    """The stretches of up to 50 readings of ``y`` (n,) that leave and come back while ``command`` (n,) does
    not jump, nor has just done so, nor has the log just begun.

    They leave and come back from one reading to the next, by more than the signal does so anywhere else.
    Where the command moves at all, or they are shorter than four readings, they are also farther off than all
    that the signal does elsewhere.
    """
    if len(y) < _FEWEST or np.ptp(y) == 0.0:
        return []
    moving = jumped(command, _SETTLED)
    moving[:_SETTLED] = True  # what was before is not known
    leaps = _leaps(y, moving[1:])
    if not len(leaps):
        return []
    groups = np.split(leaps, np.flatnonzero(np.diff(leaps) > _LONGEST) + 1)
    back = [slice(int(g[0]), int(g[-1])) for g in groups if _comes_back(y, g)]
    lasting = [g for g in groups if not _comes_back(y, g)]
    own = max((_least_of(y, g) for g in lasting), default=0.0)  # it moves so by itself
    found = [part for part in back if _least_of(y, [part.start, part.stop]) > own]
    return _farther(y, command, found)


def astray(y: Array, command: Array) -> Bools:
    """Which readings of ``y`` (n,) are told of and not mended: strays, and outliers where these are many."""
    drive = Drive.by(command)
    found = outliers(y, drive.barred, drive.never, drive.answers)
    if not are_many(found):
        found[:] = False
    for part in strays(y, command):
        found[part] = True
    return found


def _leaps(y: Array, moving: Bools) -> Ints:
    """The rows that are farther from the one ahead than noise is, and than any where the signal is ``moving``
    (n − 1,)."""
    own, medians = 0.0, []
    for begin, steps in _steps(y):
        own = max(own, float(steps.max(where=moving[begin : begin + len(steps)], initial=0.0)))
        medians += [np.median(steps[at : at + _BLOCK]) for at in range(0, len(steps), _BLOCK)]
    noise = _noisiest(np.array(medians), least_noise(y))
    found = [np.empty(0, int)]
    for begin, steps in _steps(y):
        there = noise[begin // _BLOCK : -(-(begin + len(steps)) // _BLOCK)]
        least = np.maximum(_FAR * np.repeat(there, _BLOCK)[: len(steps)], own)
        found.append(np.flatnonzero((steps > least) & ~moving[begin : begin + len(steps)]) + begin + 1)
    return np.concatenate(found)


def _steps(y: Array) -> Iterator[tuple[int, Array]]:
    """Yield (where it begins, part): how far each of ``y`` (n,) is from the one ahead; a log may be long."""
    for begin in range(0, len(y) - 1, _PART):
        yield begin, np.abs(np.diff(y[begin : begin + _PART + 1]))


def _noisiest(medians: Array, least: float) -> Array:
    """Of blocks (k,) the deviation that stands for the noise of each: of the noisiest of it and its
    neighbours, or of most."""
    made: Array = np.maximum(1.4826 * np.maximum(noisiest_near(medians), np.median(medians)), least)
    return made


def _least_of(y: Array, rows: Ints | list[int]) -> float:
    """The least of the changes of ``y`` (n,) from the reading ahead of each row."""
    return float(min(abs(y[row] - y[row - 1]) for row in rows))


def _sides(y: Array, leaps: Ints) -> tuple[float, float]:
    """What ``y`` (n,) is ahead of the first leap and behind the last."""
    before, after = y[max(leaps[0] - _SIDE, 0) : leaps[0]], y[leaps[-1] : leaps[-1] + _SIDE]
    return float(np.median(before)), float(np.median(after))


def _comes_back(y: Array, leaps: Ints) -> bool:
    """Whether ``y`` (n,) is the same again behind the last of some leaps, and no more than briefly away."""
    if leaps[0] < _SIDE or len(y) - leaps[-1] < _SIDE:
        return False
    before, after = _sides(y, leaps)
    away = np.abs(y[leaps[0] : leaps[-1]] - before).max(initial=0.0)
    return bool(0 < leaps[-1] - leaps[0] <= _LONGEST and abs(after - before) <= _AGREE * away)


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
