"""Whether a log of a rig that integrates begins while that moves: no first sample tells how fast."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.logs.between import white_level

_FIRST = 8  # samples of the shortest beginning that is looked at,
_MOST = 0.1  # and part of a log that the longest is
_SURE = 6.0  # standard errors that a beginning moves by
_SEEN = 0.003  # of its reach, likewise: less is of no concern
_MADE = 0.5  # of that: its input makes less of a stand


def begun_moving(e: Explanation) -> list[str]:
    """The experiments of a segment with an axis in it which move as they begin, by more than their input
    makes of a stand."""
    problem, segment = e.nominal.problem, e.segment
    if problem.nominals.rig.integrator != "actuator" or "actuator" not in segment.stages:
        return []
    made = problem.simulate(e.nominal.vector)
    pairs = zip(segment.names, segment.parts(segment.y), segment.parts(made))
    return [name for name, y, own in pairs if _moves(y, own)]


def _moves(y: np.ndarray, made: np.ndarray) -> bool:
    """Whether ``y`` (n,) moves from the first, and ``made`` hardly as far."""
    count, noise = _FIRST, white_level(y)
    while count <= _MOST * len(y):
        moved, own = (_moved(part[:count]) for part in (y, made))
        surely = _SURE * noise * np.sqrt(2.0 / (count // 4))  # of two means of a quarter each
        if abs(moved) > max(surely, _SEEN * float(np.ptp(y))):
            return bool(own * np.sign(moved) < _MADE * abs(moved))
        count *= 2
    return False


def _moved(part: np.ndarray) -> float:
    """By how much the last quarter of a beginning lies above the first."""
    quarter = len(part) // 4
    return float(np.mean(part[-quarter:]) - np.mean(part[:quarter]))
