"""Whether a signal moves in whole counts: the output of a controller that computes in integers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_FEWEST, _SIZES = 50, 3  # steps, and sizes of them
_SAME = 1e-7  # of the largest: steps that differ by less are of one size
_STARTS = 5  # of the smallest steps: how many may be the count, or twice it
_OFF = 0.08  # of a count, root mean square; 0.29 by chance
_DECIMAL = 1e-3  # relative
_DIGITS = (1.0, 2.0, 2.5, 5.0)


def count_of(parts: Sequence[np.ndarray]) -> float | None:
    """The count in whose multiples the steps of a signal go, from sample to sample; None where there is none
    or the log was rounded to it, which decimal numbers show.
    """
    steps = np.abs(np.concatenate([np.diff(p) for p in parts]))
    same = _SAME * float(steps.max(initial=0.0))
    moves = steps[steps > same]
    steps = np.unique(np.round(moves / same)) * same if len(moves) else moves
    if len(moves) < _FEWEST or len(steps) < _SIZES:
        return None
    found = [c for c in (_grown(steps, start) for start in steps[:_STARTS]) if c is not None]
    largest = max(found, default=None)
    return None if largest is None or _decimal(largest) else largest


def _grown(steps: np.ndarray, count: float) -> float | None:
    """``count`` corrected by ever larger steps, as long as all are whole numbers of it."""
    within = 8.0
    while True:
        near = steps[steps < within * count]
        whole = np.round(near / count)
        count = float(whole @ near / (whole @ whole))
        if np.sqrt(np.mean((near / count - whole) ** 2)) > _OFF:
            return None
        if len(near) == len(steps):
            return count
        within *= 4.0


def _decimal(count: float) -> bool:
    digits = count / 10.0 ** np.floor(np.log10(count))
    return any(abs(digits / d - 1.0) < _DECIMAL for d in (*_DIGITS, 10.0))
