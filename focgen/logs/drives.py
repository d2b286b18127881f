"""What a command does to the readings around it: its jumps, its pulses, and how large an answer may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array, Bools, Ints
from focgen.logs.answers import WIDEST, Answers
from focgen.logs.outliers import ends_of_medians, largest_jump

_AHEAD, _AFTER = 3, 10  # readings around a jump of the command that are left alone
_LATE = 40  # readings behind a jump, in which rigs with a dead time answer
_EVEN = 0.5  # times as often at rest as anywhere: what comes from outside knows no command
_JUMP = 0.05  # of the span: so much from one reading to the next is a jump
_FEWEST = 16  # readings: of fewer, nothing lasts


@dataclass(frozen=True)
class Drive:
    """The ``signal`` (n,) that the others answer, and how they are to be judged by it: see ``outliers``."""

    signal: Array
    barred: Bools
    never: Bools
    answers: Answers | None

    @classmethod
    def by(cls, command: Array) -> Drive:
        """The drive of a ``command`` (n,), or of a pressure where there is none."""
        return cls(command, barred_by(command), turned_by(command), answers_to(command))

    def of(self, rows: slice | Ints, whole: bool) -> Drive:
        """The same at some ``rows``; unless these are the ``whole`` of what was logged, a pulse may lie
        between two, and no answer is known."""
        answers = None if self.answers is None or not whole else self.answers.of(rows)
        return Drive(self.signal[rows], self.barred[rows], self.never[rows], answers)

    def is_elsewhere(self, found: Bools) -> bool:
        """Whether what was ``found`` (n,) is at rest nearly as often as behind jumps of the signal: else it
        is an answer, perhaps a late one."""
        resting = ~jumped(self.signal, _LATE)
        return bool(found[resting].mean() >= _EVEN * found.mean()) if resting.any() else True


def barred_by(command: Array) -> Bools:
    """Where ``command`` (n,) jumps, and shortly after: a signal may move fast there."""
    return jumped(command, _AFTER)


def jumped(command: Array, after: int) -> Bools:
    """The readings (n,) from three ahead of a jump of ``command`` (n,) to ``after`` behind it."""
    return _around(np.abs(np.diff(command)) > jump_of(command), after)


def turned_by(command: Array) -> Bools:
    """Where ``command`` (n,) jumps there and back within a few readings, and shortly after: what answers a
    pulse is as short as an outlier."""
    steps, least = np.diff(command), jump_of(command)
    at = np.flatnonzero(np.abs(steps) > least)
    turned = (np.diff(at) <= _AFTER) & (np.diff(np.sign(steps[at])) != 0.0)
    ends = np.zeros(len(steps), bool)
    ends[at[:-1][turned]] = ends[at[1:][turned]] = True
    return _around(ends, _AFTER)


def jump_of(command: Array) -> float:
    """The change of ``command`` (n,) from one reading to the next that is a jump: a part of the span of what
    lasts, so that one garbled reading hides none."""
    low, high = ends_of_medians(command, 2 * WIDEST + 1) if len(command) >= _FEWEST else (0.0, 0.0)
    return _JUMP * (high - low or float(np.ptp(command)) or np.inf)


def answers_to(command: Array) -> Answers | None:
    """What may be an answer to ``command`` (n,), or None where no jump of it lasts."""
    largest = largest_jump(command)
    return Answers(command, largest, jump_of(command)) if 0.0 < largest < np.inf else None


def _around(jumps: Bools, after: int) -> Bools:
    """The readings (n,) around changes (n − 1,) from one to the next."""
    count, found = len(jumps), np.zeros(len(jumps) + 1, bool)
    for late in range(1 - _AHEAD, 2 + after):  # of a change, after the reading ahead of it
        first, last = max(-late, 0), min(count, count + 1 - late)
        if first < last:
            found[first + late : last + late] |= jumps[first:last]
    return found
