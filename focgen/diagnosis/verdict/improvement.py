"""How far the gap shrinks on experiments not yet made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_DRAWS = 400
_FORM = 0.03  # share that a form a little wrong may lose on new experiments,
_LOUD = 0.12  # what the noise adds to it, in root mean squares of the gap,
_REST = 0.35  # and the part of what is left unexplained that may come or go
_FITTED = 0.04  # share of noise that the best of many fits has taken along, in root mean squares of the gap
_DOUBTED = 0.5  # of what fits lose on parts of the session they did not see: not promised, and doubted, too;
_LOST = 0.3  # a greater loss counts as this in what is promised: a session's parts see less than the session,
_LOST_IN_DOUBT = 0.15  # and as this in the doubt
_AHEAD = 0.1  # share that a drift may cost that goes on as no log can show
_MOST = 1.02  # measured on few experiments, noise may make it more than all


@dataclass(frozen=True)
class Improvement:
    """The predicted share of the explainable mean square, and its 90 % interval; ``lost``: what fits lose of
    that share on parts of the session that they did not see."""

    value: float
    interval: tuple[float, float]
    lost: float = 0.0


def predict(
    refitted: np.ndarray, explained: np.ndarray, foreseen: np.ndarray, floor: float, drifts: bool = False
) -> Improvement | None:
    """From mean squares by experiment (m,), fitted and foreseen by fits that did not see them, and the
    floor's mean square; None where nothing can shrink.

    The interval is at least as wide as the errors of the promise were on simulated rigs of foreign forms: a
    few hundredths, more where the gap is little more than the noise, part of it is unexplained, or part of
    what explains it ``drifts``.
    """
    if not np.mean(refitted) > floor * 1.0001:
        return None
    rng = np.random.default_rng(0)
    value = _share(refitted, explained, floor)
    lost = max(value - _share(refitted, foreseen, floor), 0.0)
    noise = float(np.sqrt(floor / np.mean(refitted)))
    picks = rng.integers(0, len(refitted), (_DRAWS, len(refitted)))
    draws = [_share(refitted[p], explained[p], floor) for p in picks]
    low, high = np.quantile([d for d in draws if np.isfinite(d)] or [value], [0.05, 0.95])
    value -= min(lost, _LOST) + _FITTED * noise
    wide = _FORM + _LOUD * noise + _REST * (1.0 - value) + _DOUBTED * min(lost, _LOST_IN_DOUBT)
    low, high = min(low, value - wide - _AHEAD * drifts), max(high, value + 0.5 * wide)
    low, value, high = (float(np.clip(v, -1.0, _MOST)) for v in (low, value, high))
    return Improvement(value, (low, high), lost)


def _share(refitted: np.ndarray, explained: np.ndarray, floor: float) -> float:
    could = np.mean(refitted) - floor
    return (
        float(np.clip((np.mean(refitted) - np.mean(explained)) / could, -1.0, 1.0)) if could > 0 else np.nan
    )
