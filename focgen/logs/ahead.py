"""Signals that answer jumps of the command before these come: a command that was logged late."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment

_HELD = 20  # samples of one level ahead of a jump, and behind it
_LATE = 5  # the last of them, before which the level is taken
_SMALL = 0.1  # of the largest jump: smaller ones tell little
_FEWEST = 3  # jumps
_MOST = 0.8  # of them are answered ahead
_SURE = 5.0  # standard errors
_PART = 0.01  # of the response to the jumps: so much of it comes ahead of them


def is_answered_ahead(logs: Sequence[Experiment], role: str) -> bool:
    """Whether a signal goes the way of the command's jumps by the sample before these.

    What is left of an earlier response does not count. Where the next jump goes on, that is short of
    the line through the samples ahead; where it goes back, that is on the far side of their mean. So the
    lesser of both tells.
    """
    of_log = [(np.asarray(log["command"], float), np.asarray(log[role], float)) for log in logs]
    largest = max((float(np.abs(np.diff(u)).max()) for u, _ in of_log if len(u) > 1), default=0.0)
    found = [answer for u, y in of_log for answer in _answers(u, y, _SMALL * largest)]
    if len(found) < _FEWEST:
        return False
    from_line, from_mean, after = np.array(found).T
    gain = float(np.mean(after))
    ahead = np.minimum(np.sign(gain) * from_line, np.sign(gain) * from_mean)
    least = max(_SURE * float(np.std(ahead)) / np.sqrt(len(ahead)), _PART * abs(gain))
    return float(np.mean(ahead > 0.0)) >= _MOST and float(np.mean(ahead)) > least


def _answers(u: Array, y: Array, least: float) -> Iterator[tuple[float, float, float]]:
    """Yield, for each jump of a command (n,) that is held on both sides, where a signal (n,) is at the sample
    before it, from the line and from the mean of those ahead, and how far it comes; each by the jump."""
    steps = np.diff(u)
    moved = np.flatnonzero(steps != 0.0)
    alone = (np.diff(moved, prepend=-_HELD) >= _HELD) & (np.diff(moved, append=len(u)) > _HELD)
    at = np.arange(_LATE - _HELD, 0.0) + 0.5 * (_HELD - _LATE + 1)
    for last in moved[alone & (np.abs(steps[moved]) >= least) & (moved >= _HELD)].tolist():
        ahead = y[last + 1 - _HELD : last + 1 - _LATE]
        mean, slope = float(ahead.mean()), float(at @ ahead) / float(at @ at)
        line = mean + slope * (float(at[-1]) + _LATE)
        parts = np.array([y[last] - line, y[last] - mean, y[last + _HELD] - mean]) / steps[last]
        yield float(parts[0]), float(parts[1]), float(parts[2])
