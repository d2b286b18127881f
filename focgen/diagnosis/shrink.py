"""How far the gap shrinks on experiments not yet made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

_DRAWS = 400
_WIDEN = 1.0
_FORM = 0.03  # share that a form a little wrong may lose on new experiments


@dataclass(frozen=True)
class Shrink:
    """The predicted share of the explainable mean square, and its 90 % interval."""

    value: float
    interval: tuple[float, float]


def predict(refitted: np.ndarray, explained: np.ndarray, floor: float) -> Shrink | None:
    """From mean squares by experiment (m,) and the floor's mean square; None where nothing can shrink."""
    if not np.mean(refitted) > floor * 1.0001:
        return None
    rng = np.random.default_rng(0)
    value = _share(refitted, explained, floor)
    picks = rng.integers(0, len(refitted), (_DRAWS, len(refitted)))
    draws = [_share(refitted[p], explained[p], floor) for p in picks]
    low, high = np.quantile([d for d in draws if np.isfinite(d)] or [value], [0.05, 0.95])
    gap = 1.0 - value
    low, high = min(low, value - _FORM - 0.3 * gap), max(high, value + 0.5 * _FORM + 0.2 * gap)
    return Shrink(value, (float(max(low, -1.0)), float(min(high, 1.0))))


def _share(refitted, explained, floor: float) -> float:
    could = np.mean(refitted) - floor
    return float(np.clip((np.mean(refitted) - np.mean(explained)) / could, -1.0, 1.0)) if could > 0 else np.nan
