"""Whether what is left is louder where the rig moves than where it rests.

A gauge's noise does not know whether the rig moves. What acts on the rig does, however little of it a
regression on the input foretells: a catch, a tracker that loses fast motion, a damper that warms.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from focgen.arrays import Array
from focgen.diagnosis.hypotheses.converter import is_rounded
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS

_REACH = 2.0  # response times that a motion is felt for
_RESTS, _MOVES = 0.2, 0.6  # quantiles of the motion: it rests below the first, and moves above the second,
_STILL = 0.02  # or this part of the largest one: less is a rest
_STRETCHES = 6  # of either, at least
_SURE = 2.5  # standard errors by which the two are apart


def is_restless(e: Explanation) -> bool:
    """Whether what is left of a segment is far louder where it moves. What rounds is so by nature; errors
    that add up, or go round in a loop, are left where they come about by neither."""
    if e.segment.closed or e.segment.pace or e.segment.withheld or e.converter is not None:
        return False
    return not is_rounded(e.causes) and louder(e) > NUMBERS.loudest


@lru_cache(maxsize=16)
def louder(e: Explanation) -> float:
    """How many times as large the mean square is where the rig moves; 1 where that is not sure."""
    segment, response = e.segment, e.nominal.problem.references.clocks["response"]
    reach = max(int(_REACH * response / segment.run.h), 8)
    made = segment.parts(e.best.problem.simulate(e.best.vector))
    left = [part - part.mean() for part in segment.parts(e.best.weighed)]
    motion = np.concatenate([_motion(part, reach) for part in made])
    squares = np.concatenate(left) ** 2
    still = max(float(np.quantile(motion, _RESTS)), _STILL * float(np.max(motion)))
    moved = max(float(np.quantile(motion, _MOVES)), still)
    rests, moves = (
        _in_stretches(squares[motion <= still], reach),
        _in_stretches(squares[motion > moved], reach),
    )
    if min(len(rests), len(moves)) < _STRETCHES:
        return 1.0
    # in logarithms, for a few stretches may be far louder than the others
    logs = [np.log(np.maximum(s, 1e-300)) for s in (rests, moves)]
    more = float(np.mean(logs[1]) - np.mean(logs[0]))
    error = float(np.hypot(*(np.std(s) / np.sqrt(len(s) - 1.0) for s in logs)))
    return float(np.mean(moves)) / max(float(np.mean(rests)), 1e-300) if more > _SURE * error else 1.0


def _motion(made: Array, reach: int) -> Array:
    """By how much a signal (n,) changed within the last samples, ``reach`` of them."""
    ahead = np.concatenate([np.full(reach, made[0]), made])
    highest, lowest = (f(ahead, reach + 1, origin=reach // 2) for f in (maximum_filter1d, minimum_filter1d))
    moved: Array = (highest - lowest)[reach:]
    return moved


def _in_stretches(squares: Array, reach: int) -> Array:
    """The means (k,) over stretches that are as good as independent."""
    return np.array([np.mean(part) for part in np.array_split(squares, max(len(squares) // reach, 1))])
