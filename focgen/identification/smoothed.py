"""A measured input without its noise, which a model passes on and the rig does not.

A fit that is driven by noise chooses the model that passes on less of it: too slow a sensor, or an order that
is too high (T. Söderström, Errors-in-Variables Methods in System Identification, 2018). So a curve is drawn
through the readings, whose third differences count as much as cross-validation says (E. T. Whittaker, Proc.
Edinburgh Math. Soc. 41, 1923; P. Craven and G. Wahba, Numerische Mathematik 31, 1979).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from focgen.arrays import Array, Bools
from focgen.logs.between import noise_level, white_level

_DIFFERENCE = np.array([-1.0, 3.0, -3.0, 1.0])  # the third
_WEIGHTS = 10.0 ** np.arange(-2.0, 9.0, 0.5)  # of third differences, that are tried
# Of that weight: twice the bandwidth. The curve that is closest to the truth on average rounds its turns, and
# that is worse for a model than the noise which this one lets through.
_EASIER = 0.01
_FEWEST = 30  # samples
_SEEN = 1e-4  # of the spread: noise below is as good as none
_MOST = 0.2  # of the standard deviation: what is quicker than a curve and as large may be the signal itself
_MORE = 1.3  # of the white noise: a curve that takes more off the readings has missed a turn
_PLACES = 2048  # of the frequencies that a curve's freedom is counted at


def without_noise(values: Array, jumps: Bools, known: Array | None = None) -> Array:
    """The readings (n,) of a gauge without their white noise; as they are where there is none, or where they
    move too quickly to tell it.

    ``jumps`` (n,): true where they jump, which no curve bridges. ``known`` (n,): what is known to move them,
    but for a gain and a zero; the curve is drawn through the rest.
    """
    if len(values) < _FEWEST or noise_level(values) <= _SEEN * np.ptp(values):
        return values
    if white_level(values) > _MOST * np.std(values):
        return values
    course = np.zeros(len(values)) if known is None else _scaled(known, values)
    rest = values - course
    curve = _curve(rest, jumps if known is None else np.zeros(len(values), bool))
    return course + curve if np.std(rest - curve) <= _MORE * white_level(rest) else values


def _scaled(known: Array, values: Array) -> Array:
    """What is known, with the gain and the zero that leave least of the readings."""
    columns = np.column_stack([np.ones(len(known)), known])
    made: Array = columns @ np.linalg.lstsq(columns, values, rcond=None)[0]
    return made


def _curve(values: Array, jumps: Bools) -> Array:
    """The curve (n,) that bends more easily than that of least generalised cross-validation."""
    bent = _bending(len(values), jumps)
    weight = min(_WEIGHTS, key=lambda w: _score(values, _drawn(values, w * bent), w))
    return _drawn(values, _EASIER * weight * bent)


def _drawn(values: Array, bending: Array) -> Array:
    """The curve of least squares, and least of what ``bending`` (4, n) costs."""
    bands = bending.copy()
    bands[-1] += 1.0
    made: Array = solveh_banded(bands, values, overwrite_ab=True)
    return made


def _score(values: Array, curve: Array, weight: float) -> float:
    """What a curve leaves, over the freedom that is left (Craven and Wahba)."""
    frequencies = 2.0 * np.sin(0.5 * np.pi * (np.arange(_PLACES) + 0.5) / _PLACES)
    free = float(np.mean(1.0 / (1.0 + weight * frequencies**6)))
    return float(np.sum((values - curve) ** 2)) / (len(values) * (1.0 - free) ** 2)


def _bending(count: int, jumps: Bools) -> Array:
    """The upper bands (4, n) of DᵀD, D the third differences but for those across a jump."""
    order = len(_DIFFERENCE) - 1
    kept = np.ones(count - order)
    for place in np.flatnonzero(jumps):
        kept[max(0, place - order) : place] = 0.0
    bands = np.zeros((order + 1, count))
    for i in range(order + 1):
        for j in range(i, order + 1):
            bands[order - j + i, j : j + count - order] += kept * _DIFFERENCE[i] * _DIFFERENCE[j]
    return bands
