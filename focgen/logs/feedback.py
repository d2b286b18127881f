"""A loop that was closed though no reference was logged: the command shows the output's noise.

What is white of a reading is in no input that was made ahead of it. So where a command falls in the very
sample in which a reading is too high by its noise, or in the next one, a controller made it of that reading.
A rig that answers within the sample does the like in the open, but there a reading moves with the command as
it does later on, and a controller moves the command against that. One that reads later yet is not found.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array, Bools
from focgen.logs.experiment import Experiment

_NOTE = (
    "the command answers the output's noise, as a controller's does: a loop was closed; log what it was "
    "asked for, too (reference in [signals])"
)
_PAST = 6  # samples of both that the next one is foretold by
_FITTED = 3  # rounds, each without what was far from foretold
_FAR = 3.0  # deviations: what is farther is a step, and no noise
_LATER = (0, 1, 2, 3)  # samples from a reading to the command that is made of it
_TOGETHER = 0.5  # correlation of what is new in both, at least
_TOLD = 5.0  # standard errors: how a rig answers within a few samples is told beyond
_LAGS = np.array([3.0, 10.0, 30.0, 100.0, 300.0])  # samples: how slowly a rig may answer
_FEWEST = 100  # samples
_MOVES = 1e-6  # of its span: a command that is new by less is a program


def unlogged_reference(log: Experiment) -> Array | None:
    """What was asked of a rig whose controller made its command (n,) of its output, where no reference tells:
    the command without its part of the present reading, in its unit. None where no such loop shows.

    Of u = K (r − y) + what adds up, it is K r + what adds up. So the output's noise has no part in it.
    """
    gain, later = _answer(log)
    if not gain:
        return None
    u, y = (np.asarray(log[role], float) for role in ("command", "output"))
    asked = u + gain * np.r_[np.full(later, y[0]), y[: len(y) - later]]
    places, free = np.arange(len(u)), _moving(u)
    made: Array = np.interp(places, places[free], asked[free])
    return made


def answers_reading(log: Experiment) -> bool:
    """Whether a controller made the command of the output's readings, whether its reference was logged or
    not."""
    return _answer(log)[0] != 0.0


def told_of_its_loop(log: Experiment) -> Experiment:
    """The experiment with a note where a loop was closed whose reference tells nothing."""
    lacks = "reference" not in log or not np.ptp(log["reference"]) > 0.0
    if not lacks or _NOTE in log.notes or not answers_reading(log):
        return log
    return replace(log, notes=(*log.notes, _NOTE))


def _answer(log: Experiment) -> tuple[float, int]:
    """By how much the command falls where a reading is one higher, and how many samples later; 0 and 0 where
    no loop shows."""
    if log.open_loop or "command" not in log or "output" not in log or len(log) < _FEWEST:
        return 0.0, 0
    return _told(*(np.asarray(log[role], float).tobytes() for role in ("command", "output")))


@lru_cache(maxsize=32)
def _told(command: bytes, readings: bytes) -> tuple[float, int]:
    """A log is asked for its loop with every segment and rig."""
    u, y = np.frombuffer(command), np.frombuffer(readings)
    if not (np.all(np.isfinite(u)) and np.all(np.isfinite(y)) and min(np.ptp(u), np.ptp(y)) > 0.0):
        return 0.0, 0
    gains = ((_gain(u, y, _moving(u), later), later) for later in _LATER)
    return next((each for each in gains if each[0]), (0.0, 0))


def _moving(u: Array) -> Bools:
    """Where a command (n,) is not held at one of its ends, as by a limit: there it shows no noise."""
    still = np.diff(u, prepend=u[0] - 1.0) == 0.0
    made: Bools = ~(still & ((u == u.max()) | (u == u.min())))
    return made


def _gain(u: Array, y: Array, free: Bools, later: int) -> float:
    """By how much a command falls where the reading so many samples sooner is one higher by its noise, less
    than 0 on a rig of negative gain; 0 where that does not show."""
    u, y, free = u[later:], y[: len(y) - later], free[later:]
    seen = np.convolve(free, np.ones(_PAST + 1), "valid") > _PAST
    if np.count_nonzero(seen) < _FEWEST:
        return 0.0
    _, new = _foretold(u, y, seen)
    answer, read = _foretold(y, u, seen)
    new, read = new[seen], read[seen]
    if not _typical(new) > _MOVES * np.ptp(u) or not _typical(read) > 0.0:
        return 0.0
    together = np.corrcoef(_usual(new), _usual(read))[0, 1]
    if abs(answer) < _TOLD:
        answer = _in_the_end(u, y)
    if not together * np.sign(answer) < -_TOGETHER:
        return 0.0
    usual = (np.abs(new) < _FAR * _typical(new)) & (np.abs(read) < _FAR * _typical(read))
    return -float(new[usual] @ read[usual]) / float(read[usual] @ read[usual])


def _foretold(values: Array, other: Array, seen: Bools) -> tuple[float, Array]:
    """How much of the ``other`` signal's last samples there is in each, in standard errors of that, beside a
    constant and the samples before, all fitted where they are ``seen``, and what is new in it (n − 6,)."""
    count = len(values) - _PAST
    before = [v[_PAST - k - 1 :][:count] for v in (values, other) for k in range(_PAST)]
    rows, target, kept = np.stack([np.ones(count), *before], axis=1), values[_PAST:], seen
    for _ in range(_FITTED):
        shares: Array = np.linalg.lstsq(rows[kept], target[kept], rcond=None)[0]
        left: Array = target - rows @ shares
        kept = seen & (np.abs(left) <= _FAR * _typical(left[seen]))
    along = np.r_[np.zeros(_PAST + 1), np.ones(_PAST)]
    spread = max(along @ np.linalg.pinv(rows[kept].T @ rows[kept]) @ along, 0.0)  # rounding below 0
    error = np.std(left[kept]) * np.sqrt(spread)
    return float(along @ shares) / max(float(error), 1e-300), left


def _in_the_end(u: Array, y: Array) -> float:
    """What the output (n,) comes to for a command of one, by the present command and what lags make of it."""
    lags = [lfilter([1.0 - a], [1.0, -a], u - u[0]) for a in np.exp(-1.0 / _LAGS)]
    rows = np.stack([np.ones(len(u)), u - u[0], *lags], axis=1)
    return float(np.sum(np.linalg.lstsq(rows, y, rcond=None)[0][1:]))


def _usual(values: Array) -> Array:
    far = _FAR * _typical(values)
    made: Array = np.clip(values, -far, far)
    return made


def _typical(values: Array) -> float:
    """A deviation of the usual samples."""
    return 1.4826 * float(np.median(np.abs(values)))
