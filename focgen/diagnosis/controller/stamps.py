"""Lost and late samples, read off the raw time stamps, which no resampling has touched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from focgen.logs.experiment import Experiment
from focgen.present import present

LOST = 1e-3  # of the samples
UNSTEADY = 0.03  # of a sample, standard deviation of the time stamps
_NEAR = 9  # samples: a lost one shifts all that come after it, a late one only itself
_FOLLOWING = 0.02  # of what the next sample is late by on the whole: clocks drift, a loss is sudden
_NEIGHBOURS = 51  # samples over which a drift of the clock is taken out


def lost(logs: Sequence[Experiment], step: float) -> float:
    """The share of samples, ``step`` seconds apart, that the logs lack between their first and last."""
    taken = [slots(present(log.raw_time), step) for log in _stamped(logs)]
    due = sum(int(t[-1]) + 1 for t in taken)
    return 1.0 - sum(map(len, taken)) / due if due else 0.0


def unsteadiness(logs: Sequence[Experiment], step: float) -> float:
    """By how much samples are early or late: a standard deviation in s."""
    late = [_lateness(present(log.raw_time), step) for log in _stamped(logs)]
    return float(np.std(np.concatenate(late))) if late else 0.0


def slots(time: np.ndarray, step: float) -> np.ndarray:
    """Which sample every time stamp (m,) is, from 0, those that were lost counted."""
    rows = np.arange(len(time))
    behind = median_filter((time - time[0]) / step - rows, _NEAR, mode="nearest")
    missing, phase, found = 0, float(behind[0]), []
    for late in behind.tolist():
        missing += max(0, round(late - phase - missing))
        phase += _FOLLOWING * (late - phase - missing)
        found.append(missing)
    made: np.ndarray = rows + np.array(found)
    return made


def _lateness(time: np.ndarray, step: float) -> np.ndarray:
    """How late each sample is (m,), s, the clock's own drift taken out."""
    late = time - step * slots(time, step)
    made: np.ndarray = late - uniform_filter1d(late, min(_NEIGHBOURS, len(late)), mode="nearest")
    return made


def _stamped(logs: Sequence[Experiment]) -> list[Experiment]:
    return [log for log in logs if log.raw_time is not None and len(log.raw_time) > 2]
