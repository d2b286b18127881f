"""A converter's own steps: levels of a real one change a little early or late, each by itself, and on the way
up elsewhere than on the way down.

They are a curve and a play of its own. What a fit leaves with such steps is no converter's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.fitting.fit import Fit


def left_by_own_steps(of: Fit) -> float:
    """The mean square, as a share of the output's level, each sample by its trust, that a fit whose last
    effect is a rounding leaves where each level begins at the place that suits the readings best: one on the
    way up, and one on the way down. All other numbers stay."""
    problem, segment = of.problem, of.problem.segment
    *others, rounding = problem.candidates
    step, phase, *_ = values = problem.values(of.vector)[-1]
    bare = problem.with_candidates(others)
    smooth = bare.simulate(of.vector[: len(of.vector) - len(rounding.form.parameters)])
    read = np.rint((rounding.form.act(segment.y, values, segment.run) - phase) / step).astype(int)
    up, own = _way(smooth, segment.run.spans), np.empty(len(smooth), int)
    for way in (up, ~up):
        own[way] = _levels(smooth[way], read[way], segment.weight[way] ** 2)
    left = segment.recent(segment.y - (step * own + phase)) * segment.weight
    return float(np.mean(left**2))


def _way(x: np.ndarray, spans: Sequence[tuple[int, int]]) -> np.ndarray:
    """Whether a signal (n,) rises, or has risen before it came to rest in the same experiment (n,)."""
    up = np.zeros(len(x), bool)
    for first, last in spans:
        step = np.diff(x[first:last], prepend=x[first])
        moved = np.maximum.accumulate(np.where(step != 0.0, np.arange(len(step)), 0))
        up[first:last] = step[moved] > 0.0
    return up


def _levels(x: np.ndarray, read: np.ndarray, trust: np.ndarray) -> np.ndarray:
    """The levels (n,) where each begins at the place in ``x`` (n,) that suits those ``read`` (n,) best, each
    sample by the ``trust`` (n,) in it."""
    if not len(read):
        return read
    order = np.argsort(x, kind="stable")
    rising, levels, trust = x[order], read[order], trust[order]
    places = [_place(rising, levels > level, trust) for level in range(read.min(), read.max())]
    made: np.ndarray = read.min() + np.searchsorted(np.maximum.accumulate(places), x, side="right")
    return made


def _place(x: np.ndarray, above: np.ndarray, trust: np.ndarray) -> float:
    """The place in ``x`` (n,), which rises, that parts those ``above`` a level from the others best."""
    below = np.cumsum((trust * ~above)[::-1])[::-1]
    wrong = np.r_[0.0, np.cumsum(trust * above)] + np.r_[below, 0.0]
    wrong[1:-1][np.diff(x) == 0.0] = np.inf  # no place is between samples of one value
    least = int(np.argmin(wrong))
    return float(x[least]) if least < len(x) else float(np.inf)
