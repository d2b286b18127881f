"""How far off a reading may be in answer to short moves of a command."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Ints

WIDEST = 3  # readings of an outlier, or of a pulse that is like one
_AHEAD, _NEAR = 3, 13  # readings behind and ahead of which the moves of the command add up, so much …
_ROOM = 3.0  # … times what the signal itself answers to a jump that lasts
_ALONG = 1.5  # the same where signal and command leave and come back together
_BACK = 0.25  # of the way out: so near it comes back
_FARTHEST = 1e6  # jumps: a garbled command adds up to no more
_MARGIN = _NEAR + WIDEST + 2  # readings on either side that are looked at along


@dataclass(frozen=True)
class Answers:
    """What a signal may be off in answer to ``command`` (n,), in the largest of its own jumps that last.

    A signal that answers the ``largest`` lasting jump of the command by so much from one reading to the next
    can do no more to a pulse of the same height. ``jump``: what the command does from one reading to the next
    is one.
    """

    command: Array
    largest: float
    jump: float

    def of(self, rows: slice | Ints) -> Answers:
        """The same of some ``rows``."""
        return Answers(self.command[rows], self.largest, self.jump)

    def between(self, first: int, last: int) -> tuple[Array, Array]:
        """Of the readings from ``first`` to ahead of ``last``: what each may be off at most (m,), and the
        same where the command, too, leaves and comes back, 0 elsewhere (m,)."""
        begin = max(first - _MARGIN, 0)
        command = self.command[begin : last + _MARGIN]
        middle = float(np.median(command))
        far = _FARTHEST * self.largest
        command = np.clip(command, middle - far, middle + far) / self.largest
        path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(command)))])
        rows = np.arange(len(command))
        near = path[np.minimum(rows + _AHEAD, len(rows) - 1)] - path[np.maximum(rows - _NEAR - 1, 0)]
        along = self._along(command, path, near)
        kept = slice(first - begin, last - begin)
        return _ROOM * near[kept], along[kept]

    def _along(self, command: Array, path: Array, near: Array) -> Array:
        along = np.zeros(len(command))
        for width in range(min(WIDEST, len(command) - 2), 0, -1):
            begins, height = _pulses(command, width, self.jump / self.largest)
            others = near[begins] - (path[begins + width] - path[begins - 1])
            for row in range(width):
                along[begins + row] = _ALONG * (width * height + np.maximum(others, 0.0))
        return along


def _pulses(command: Array, width: int, jump: float) -> tuple[Ints, Array]:
    """Where ``width`` readings begin that are off those on both sides, which agree; and how far, at most."""
    before, after = command[: -1 - width], command[1 + width :]
    off = np.abs([command[1 + row : len(command) - width + row] - before for row in range(width)])
    nearest = off.min(axis=0)
    at = np.flatnonzero((nearest > jump) & (np.abs(after - before) <= _BACK * nearest))
    return at + 1, off.max(axis=0)[at]
