"""How far the form of a fitted model is off: what another linear equation would follow of what it leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.identification.excitation import Excitation
from focgen.identification.fractional import FractionalFit

_PACES = np.geomspace(0.03, 40.0, 12)  # of the response time: of the lags that another equation may have,
_SAMPLES = 2.0  # and at least so long
_FOLDS = 8  # of stretches that are foretold by the others,
_ROUNDS = 12  # each of so many stretches,
_LEAST = 8  # samples at least
_RIDGE = 1e-4  # of a regressor's mean square, added to it
_SHOWN = 0.04  # of the mean square that is left: less is not told from none
_DIGITS = 2


def lack_of_form(experiments: Sequence[Excitation], fit: FractionalFit) -> float:
    """The root mean square that lags of its drive foretell of what ``fit`` leaves, as a part of the fitted
    signal's standard deviation; 0 where that does not show, and of closed loops, whose drive has what is left
    in it.

    No numbers of K(p)/(T s^α + 1) take that away, and a rig that is as it was keeps it.
    """
    if fit.closed_loop:
        return 0.0
    measured = np.concatenate([x.measured for x in experiments])
    left = np.concatenate([levelled(x.measured - y) for x, y in zip(experiments, fit.simulated, strict=True)])
    drives = [np.asarray(fit.gain) @ x.course.values for x in experiments]
    steps = [x.step for x in experiments]
    response = float(fit.T ** (1.0 / fit.alpha))
    columns = np.hstack(
        [_drawn(drives, steps, response), np.concatenate([*map(levelled, fit.simulated)])[:, None]]
    )
    share = foretold(columns, left)
    if share < _SHOWN or not np.ptp(measured) > 0.0:
        return 0.0
    return float(f"{np.sqrt(share * np.mean(left**2)) / np.std(measured):.{_DIGITS}g}")


def levelled(values: Array) -> Array:
    """Without its mean: each experiment has an offset of its own."""
    made: Array = np.asarray(values, float) - float(np.mean(values))
    return made


def _drawn(drives: Sequence[Array], steps: Sequence[float], response: float) -> Array:
    """The drives, and lags of them (n, 13), of all experiments one after the other."""
    rows = []
    for v, h in zip(drives, steps):
        kept = [np.exp(-h / max(pace * response, _SAMPLES * h)) for pace in _PACES]
        lags = [lfilter([1.0 - a], [1.0, -a], v) for a in kept]
        rows.append(np.stack([levelled(c) for c in (v, *lags)], axis=1))
    return np.concatenate(rows)


def foretold(columns: Array, target: Array) -> float:
    """What part of the mean square of ``target`` (n,) the ``columns`` (n, k) foretell of stretches that they
    are not fitted to."""
    columns = columns / (np.sqrt(np.mean(columns**2, axis=0)) + 1e-300)
    stretch = max(_LEAST, len(target) // (_ROUNDS * _FOLDS))
    fold = np.arange(len(target)) // stretch % _FOLDS
    normal, slope, error = columns.T @ columns, columns.T @ target, np.zeros(len(target))
    loaded = _RIDGE * len(target) * np.eye(columns.shape[1])
    for out in (fold == k for k in range(_FOLDS)):
        part, right = columns[out], target[out]
        numbers = np.linalg.solve(normal - part.T @ part + loaded, slope - part.T @ right)
        error[out] = right - part @ numbers
    return max(0.0, 1.0 - float(np.mean(error**2)) / max(float(np.mean(target**2)), 1e-300))
