"""How far noise ahead of a converter blurs its steps.

A reading of a signal with noise in steps of q is, in the mean over the noise, the signal plus a curve with a
period of q. The curve is what the steps hide of a rig, for inputs do not tell it from another effect. Noise
of σ shrinks its k-th harmonic by exp(−2 π² k² (σ/q)²): at half a step next to nothing is left of it, and the
steps are noise like any other (B. Widrow and I. Kollár, Quantization noise, Cambridge University Press,
2008).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d
from scipy.optimize import brentq

_HARMONICS = np.arange(1, 60)
_AROUND = 17  # samples in which a reading is to stay where it is,
_STAYS = 4.0  # to within so many steps
_FEWEST = 50  # samples that stay
_MOST = 1.0  # of a step: the largest noise looked for


def noise_ahead(levels: np.ndarray, spans: Sequence[tuple[int, int]]) -> float:
    """The root mean square, in steps, of the noise ahead of a converter that reads ``levels`` (n,), in steps,
    at most 1; 0 where too few readings tell. White noise makes a reading go and come back. A signal that
    moves on does not, so what it adds counts against noise, and so does what a coloured noise has in common.
    """
    back, stays = (np.concatenate(parts) for parts in zip(*(_back(levels[a:b]) for a, b in spans)))
    seen = max(_mean(back), _mean(back[stays]))
    if seen <= 0.0:
        return 0.0
    return _MOST if seen >= _variance(_MOST) else float(brentq(lambda s: _variance(s) - seen, 0.0, _MOST))


def _mean(back: np.ndarray) -> float:
    return float(np.mean(back)) if len(back) >= _FEWEST else 0.0


def part_that_stays(noise: float) -> float:
    """The root mean square of the curve that steps are in the mean behind ``noise`` (in steps), as a part of
    what they are without: 1 … 0."""
    return float(np.sqrt(_curve(noise) / _curve(0.0)))


def _curve(noise: float) -> float:
    """The mean square of that curve, in steps squared."""
    shrunk = np.exp(-4.0 * (np.pi * _HARMONICS * noise) ** 2)
    return float(np.sum(shrunk / _HARMONICS**2) / (2.0 * np.pi**2))


def _variance(noise: float) -> float:
    """The variance of readings of a signal that stays, averaged over where it does, in steps squared."""
    return noise**2 + _curve(0.0) - _curve(noise)


def _back(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Minus the product of neighbouring changes of ``levels`` (n,), of which the mean is the variance of
    white noise; and where readings stay."""
    span = maximum_filter1d(levels, _AROUND) - minimum_filter1d(levels, _AROUND)
    change = np.diff(levels)
    return -change[:-1] * change[1:], span[1:-1] <= _STAYS
