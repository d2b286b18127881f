"""What the experiments do to the rig, in the terms of the identifiability checks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.rig.effects import Excitation


def excitation(parts: Sequence[np.ndarray], h: float, response: float) -> Excitation:
    """Summary of input signals (experiments in order), sampled every ``h`` s, of a rig that responds in
    ``response`` s."""
    top = max(float(np.max(np.abs(p))) for p in parts) or 1.0
    coarse = [np.round(np.abs(p) / top * 10).astype(int) for p in parts]
    changes = [c[np.flatnonzero(np.diff(c, prepend=c[0] - 1))] for c in coarse]
    visited = sorted({int(v) for c in coarse for v in np.unique(c) if v > 0})
    path = np.concatenate(changes) if changes else np.zeros(0, int)
    return Excitation(
        levels=len(visited),
        lowest=visited[0] / 10 if visited else 1.0,
        unloads=int(sum(np.sum(np.diff(c) < 0) for c in changes)),
        reversals=int(sum(_reversals(c) for c in changes)),
        hold=max(_longest(c) for c in coarse) * h / response,
        fastest=min(_fastest(p / top, h) for p in parts) / response,
        experiments=len(parts),
        repeats=_repeats(path),
        duration=sum(map(len, parts)) * h / response,
        samples=response / h,
    )


def _reversals(levels: np.ndarray) -> int:
    step = np.sign(np.diff(levels))
    turned = np.flatnonzero(step[1:] * step[:-1] < 0) + 1
    return int(np.sum(levels[turned] > 0))


def _longest(levels: np.ndarray) -> int:
    held = np.flatnonzero(np.diff(levels, prepend=levels[0] - 1, append=levels[-1] + 1))
    loaded = [b - a for a, b in zip(held, held[1:]) if levels[a] > 0]
    return max(loaded, default=0)


def _fastest(x: np.ndarray, h: float) -> float:
    """Seconds that the fastest change by a tenth of the range takes."""
    steepest = float(np.max(np.abs(np.diff(x)), initial=0.0))
    return np.inf if steepest == 0 else h * max(1.0, 0.1 / steepest)


def _repeats(path: np.ndarray) -> int:
    """How often a level is reached from below again after a higher one was."""
    most, count = 0, 0
    for before, now in zip(path, path[1:]):
        count += int(0 < now < most and now > before)
        most = max(most, int(now))
    return count
