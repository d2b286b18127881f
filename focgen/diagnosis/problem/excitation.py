"""What the experiments do to the rig, in the terms of the identifiability checks."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from focgen.rig.effects import Excitation

_STEADY = 0.03  # of the range: the root mean square about its mean of a level that is held


def excitation(parts: Sequence[np.ndarray], h: float, response: float) -> Excitation:
    """Summary of input signals (experiments in order), sampled every ``h`` s, of a rig that responds in
    ``response`` s."""
    top = max(float(np.max(np.abs(p))) for p in parts) or 1.0
    coarse = [np.round(np.abs(p) / top * 10).astype(int) for p in parts]
    changes = [c[np.flatnonzero(np.diff(c, prepend=c[0] - 1))] for c in coarse]
    visited = sorted({int(v) for c in coarse for v in np.unique(c) if v > 0})
    stays = max(3, int(0.5 * response / h))
    path = np.concatenate([_held(p / top, stays) for p in parts])
    return Excitation(
        levels=len(visited),
        lowest=visited[0] / 10 if visited else 1.0,
        unloads=int(sum(np.sum(np.diff(c) < 0) for c in changes)),
        reversals=int(sum(_reversals(c) for c in changes)),
        hold=max(_longest(c) for c in coarse) * h / response,
        fastest=min(_fastest(p / top, h) for p in parts) / response,
        experiments=len(parts),
        repeats=_repeats(path),
        revisits=_revisits(path),
        duration=sum(map(len, parts)) * h / response,
        samples=response / h,
    )


def _reversals(levels: np.ndarray) -> int:
    step = np.sign(np.diff(levels))
    turned = np.flatnonzero(step[1:] * step[:-1] < 0) + 1
    return int(np.sum(levels[turned] > 0))


def _longest(levels: np.ndarray) -> int:
    held = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1, append=levels[-1] + 1))
    loaded = [int(b - a) for a, b in pairwise(held) if levels[a] > 0]
    return max(loaded, default=0)


def _fastest(x: np.ndarray, h: float) -> float:
    """Seconds that the fastest change by a tenth of the range takes, or by half of what ``x`` spans where
    that is less. What one sample shows may be its noise, or the rounding of the log."""
    change = min(0.1, 0.5 * float(np.ptp(x)))
    lag = 1
    while change and lag < len(x):
        if np.max(np.abs(x[lag:] - x[:-lag])) >= change:
            return lag * h
        lag = max(lag + 1, lag * 9 // 8)
    return np.inf


def _held(x: np.ndarray, stays: int) -> np.ndarray:
    """The levels, in tenths, at which the input stays for ``stays`` samples, without those that it passes;
    before the first it was at rest."""
    parts = np.abs(x[: len(x) // stays * stays]).reshape(-1, stays)
    levels = np.round(10.0 * parts.mean(axis=1)[parts.std(axis=1) < _STEADY]).astype(int)
    made: np.ndarray = np.r_[0, levels[np.flatnonzero(np.diff(levels, prepend=-1))]]
    return made


def _repeats(path: np.ndarray) -> int:
    """How often a level is reached from below again after a higher one was."""
    most, count = 0, 0
    for before, now in pairwise(path):
        count += int(0 < now < most and now > before)
        most = max(most, int(now))
    return count


def _revisits(path: np.ndarray) -> int:
    """How often a level is reached from below after a higher one that it had been reached before."""
    since: dict[int, int] = {}  # the highest level since each was first reached
    count = 0
    for before, now in pairwise(path):
        since = {level: max(most, int(now)) for level, most in since.items()}
        if now > before:
            count += int(since.setdefault(int(now), int(now)) > now)
    return count
