"""Whether what a model leaves depends on what was done to the rig, and on what of it.

Noise cannot be predicted from the input. A flexible regression on level, rate, direction, history and time,
fitted on some stretches and scored on others, can predict only what a model should have explained.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.diagnosis.problem.segments import Segment
from focgen.rig import kernels
from focgen.rig.linear import oscillator

_POINTS = 6000
_FOLDS = 8
_PERIODS = np.geomspace(0.03, 2.0, 16)  # of the response: of modes that may ring,
_DAMPING = 0.1  # so damped that each is heard as far as the next
_SAMPLES = 6.0  # of a period: a shorter one does not show
_QUIETEST = 0.1  # of the median stretch's mean square: a stretch counts as no quieter
_RIDGES = (1e-4, 1e-2)  # of the mean square of a regressor, added to it


@dataclass(frozen=True)
class Predictability:
    """``share``: the part of the residual's mean square that inputs predict, 0 … 1; ``depends``: that part
    by the group of regressors (level, rate, direction, history, time)."""

    share: float
    depends: dict[str, float]


def _groups(segment: Segment, response: float) -> dict[str, np.ndarray]:
    """Regressors (n, k) by what they stand for, of order one."""
    x, run = segment.asked, segment.run
    lags = [
        kernels.lag(x, run.rest, run.h, tau, tau) for tau in response * np.array([0.05, 0.2, 1.0, 4.0, 16.0])
    ]
    slow, quick = lags[2], lags[0]
    rate = (x - lags[1]) * 3
    direction = np.tanh(20 * (lags[0] - lags[1]))
    play = [kernels.play(x, run.rest, w) - x for w in (0.03, 0.1, 0.25)]
    most = np.maximum.accumulate(np.abs(x))
    clock = (run.clock - run.clock[0]) / max(run.clock[-1] - run.clock[0], run.h)
    knots = [np.maximum(slow - k, 0.0) for k in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9)]
    quick_knots = [np.maximum(quick - k, 0.0) for k in (0.25, 0.5, 0.75)]
    edges = [np.maximum(rate, 0.0), np.minimum(rate, 0.0), np.abs(rate) * rate, rate * slow]
    groups = {
        "level": np.stack([slow, slow**2, quick, *knots, *quick_knots], axis=1),
        "rate": np.stack([x - a for a in lags] + edges + _jumps(x, run.rest), axis=1),
        "direction": np.stack([direction, direction * slow, *play], axis=1),
        "history": np.stack([lags[3], lags[4], most, most * slow, lags[4] * slow], axis=1),
        "time": np.stack([clock, clock**2, clock**3, clock * slow, clock**2 * slow], axis=1),
    }
    return {name: _kept(columns, segment) for name, columns in groups.items()}


def _kept(columns: np.ndarray, segment: Segment) -> np.ndarray:
    """Regressors (n, k), with what a rig that integrates keeps of them for as long as its residual counts."""
    if not segment.pace:
        return columns
    run, pace = segment.run, segment.pace
    kept = [kernels.lag(np.ascontiguousarray(c), run.rest, run.h, pace, pace) for c in columns.T]
    return np.hstack([columns, np.stack(kept, axis=1)])


def _ringing(segment: Segment, response: float) -> list[np.ndarray]:
    """What lightly damped modes would make of the input: their lag behind it and their speed, by period."""
    x, run = segment.asked, segment.run
    periods = [p for p in response * _PERIODS if p > _SAMPLES * run.h]
    made = [[oscillator(x, run.rest, run.h, p, _DAMPING, speed=s) for s in (False, True)] for p in periods]
    return [column for place, speed in made for column in (x - place, speed)]


def _jumps(x: np.ndarray, rest: np.ndarray) -> list[np.ndarray]:
    """What changed in the last samples: regressors for what is faster than the rig."""
    now = np.where(rest, 0.0, np.diff(x, prepend=0.0)) * 3
    return [np.roll(now, k) for k in (0, 1, 2, 3)]


def predictable_share(segment: Segment, residual: np.ndarray, response: float) -> float:
    """Only the ``share`` of :func:`predictability`: faster."""
    return _Regression.of(segment, residual, response).most


def even_share(segment: Segment, residual: np.ndarray, response: float) -> float:
    """The same where every stretch of the session counts alike: a few large moves that no regression
    foretells hide what it foretells of all the rest."""
    return _Regression.of(segment, residual, response).even.most


def predictability(segment: Segment, residual: np.ndarray, response: float) -> Predictability:
    """What of ``residual`` (n,), weighed by trust, the segment's input predicts; ``response`` in s."""
    regression = _Regression.of(segment, residual, response)
    depends = {name: max(0.0, regression.share([name])) for name in regression.groups}
    return Predictability(regression.most, depends)


def predicted(segment: Segment, residual: np.ndarray, response: float, share: float) -> np.ndarray:
    """What the segment's input predicts of ``residual`` (n,), in its unit: by all but what rings, fitted to
    every sample by its trust, as far as it holds on stretches not fitted, to a ``share`` of the mean square.
    """
    columns = np.hstack([np.ones((len(residual), 1)), *_groups(segment, response).values()])
    columns /= np.sqrt(np.mean(columns**2, axis=0)) + 1e-12
    weighed, target = columns * segment.trust[:, None], segment.trust * residual
    normal = weighed.T @ weighed + _RIDGES[0] * len(residual) * np.eye(columns.shape[1])
    numbers = np.linalg.solve(normal, weighed.T @ target)
    fitted = 1.0 - float(np.mean((target - weighed @ numbers) ** 2)) / max(float(np.mean(target**2)), 1e-300)
    made: np.ndarray = columns @ numbers * np.clip(share / max(fitted, 1e-300), 0.0, 1.0)
    return made


@dataclass(frozen=True, eq=False)
class _Regression:
    """``groups`` of regressors (n, k), those that are ``ringing`` (n, k), the residual ``target`` (n,) and
    the regressor of its ``level`` (n,), all thinned, and the ``ridges`` to try."""

    groups: dict[str, np.ndarray]
    ringing: np.ndarray
    target: np.ndarray
    ridges: Sequence[float]
    level: np.ndarray

    @classmethod
    def of(cls, segment: Segment, residual: np.ndarray, response: float) -> _Regression:
        """Of references, which rest for long, a tighter regression may tell more."""
        groups, ringing = _regressors(segment, response)
        target = _thinned(residual[:, None], _thin(segment))[:, 0]
        ridges = _RIDGES if segment.led else _RIDGES[:1]
        return cls(groups, ringing, target, ridges, np.ones(len(target)))

    @property
    def even(self) -> _Regression:
        """The same with each stretch as a share of its own root mean square."""
        stretch = np.arange(len(self.target)) // max(8, len(self.target) // (12 * _FOLDS))
        squares = np.bincount(stretch, self.target**2) / np.bincount(stretch)
        least = _QUIETEST * np.median(squares)
        weight = 1.0 / np.sqrt(np.maximum(squares, max(least, 1e-300)))[stretch]
        groups = {name: columns * weight[:, None] for name, columns in self.groups.items()}
        ringing, target = self.ringing * weight[:, None], self.target * weight
        return _Regression(groups, ringing, target, self.ridges, self.level * weight)

    @property
    def whole(self) -> float:
        """What all groups predict, be it with or without those that ring: they are many."""
        return max(self.share(self.groups), self.share(self.groups, self.ringing))

    @property
    def most(self) -> float:
        """What all groups predict, or one of the input's: what bends a little with the level alone is lost
        among the coefficients of all. The clock alone follows any slow path, also one that no input made."""
        return max(self.whole, 0.0, *(self.share([name]) for name in self.groups if name != "time"))

    def share(self, names: Iterable[str], *more: np.ndarray) -> float:
        """What the groups ``names`` predict."""
        columns = [self.level[:, None], *(self.groups[name] for name in names), *more]
        return _predictable_share(np.hstack(columns), self.target, self.ridges)


@lru_cache(maxsize=4)
def _regressors(segment: Segment, response: float) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The groups and what rings, thinned: the same for every fit to a segment."""
    thin, trust = _thin(segment), segment.trust[:, None]
    groups = {k: _thinned(v * trust, thin) for k, v in _groups(segment, response).items()}
    ringing = np.stack([np.zeros(len(trust)), *_ringing(segment, response)], axis=1)
    return groups, _thinned(ringing * trust, thin)


def _thin(segment: Segment) -> int:
    return max(1, len(segment.y) // _POINTS)


def _thinned(values: np.ndarray, thin: int) -> np.ndarray:
    count = len(values) // thin
    made: np.ndarray = values[: count * thin].reshape(count, thin, -1).mean(axis=1)
    return made


def _predictable_share(matrix: np.ndarray, target: np.ndarray, ridges: Sequence[float]) -> float:
    """1 − (error on stretches not fitted)/(mean square) with the best of the ``ridges``; stretches
    interleaved, so that each fold sees the whole session."""
    stretch = max(8, len(target) // (12 * _FOLDS))
    fold = (np.arange(len(target)) // stretch) % _FOLDS
    scale = np.sqrt(np.mean(matrix**2, axis=0)) + 1e-12
    matrix, error = matrix / scale, np.zeros((len(ridges), len(target)))
    normal, slope = matrix.T @ matrix, matrix.T @ target
    for f in range(_FOLDS):
        out = fold == f
        part, right = matrix[out], target[out]
        left, rest = normal - part.T @ part, slope - part.T @ right
        for row, tight in zip(error, ridges):
            row[out] = right - part @ np.linalg.solve(left + tight * len(target) * np.eye(len(rest)), rest)
    return float(1.0 - np.min(np.mean(error**2, axis=1)) / max(np.mean(target**2), 1e-300))
