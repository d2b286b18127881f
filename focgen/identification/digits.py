"""As many digits of a fitted number as hold: on every processor the same ones."""

from __future__ import annotations

import math

import numpy as np

from focgen.arrays import Array

_FINE = 1e-3  # of half an interval: finer digits say nothing
_MOST = 9  # digits that hold without any noise: a fit ends at about 1e-11


def told_value(value: float, half: float) -> float:
    """``value`` rounded to a thousandth of ``half`` its 95 % interval, at most to nine digits."""
    if value == 0.0 or not math.isfinite(value):
        return float(value)
    finest = math.floor(math.log10(abs(value))) + 1 - _MOST
    coarse = math.floor(math.log10(_FINE * half)) if 0.0 < half < math.inf else finest
    return round(float(value), -max(finest, coarse))


def told_gain(gain: Array, half: Array) -> tuple[float, ...]:
    """The coefficients of K(p), each rounded as :func:`told_value` does."""
    return tuple(told_value(g, h) for g, h in zip(gain.tolist(), np.asarray(half).tolist()))
