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
from scipy.optimize import brentq

_HARMONICS = np.arange(1, 60)
_STAYS = 0.2  # of a step: by less the model moves from sample to sample where it stays
_SPIKE = 4.0  # steps from one reading to the next, and times what is usual, are no noise that blurs
_FEWEST = 50  # samples that stay
_MOST = 1.0  # of a step: the largest noise looked for


def noise_ahead(levels: np.ndarray, made: np.ndarray, spans: Sequence[tuple[int, int]]) -> float:
    """The root mean square, in steps, of the noise ahead of a converter that reads ``levels`` (n,), where the
    rig's model makes ``made`` (n,), in steps both; at most 1, and 0 where too few readings tell.

    Told by readings of a rig that stays, or moves on slowly. White noise makes them go and come back. A slow
    move does not, so what it adds counts against noise, and so does what a coloured noise has in common.
    """
    back = np.concatenate([np.empty(0), *(_back(levels[a:b], made[a:b]) for a, b in spans)])
    seen = float(np.mean(back)) if len(back) >= _FEWEST else 0.0
    if seen <= 0.0:
        return 0.0
    return _MOST if seen >= _variance(_MOST) else float(brentq(lambda s: _variance(s) - seen, 0.0, _MOST))


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


def _back(levels: np.ndarray, made: np.ndarray) -> np.ndarray:
    """Minus the product of neighbouring changes of ``levels`` (n,), where ``made`` (n,) stays: its mean is
    the variance of white noise."""
    change, moved = np.diff(levels), np.abs(np.diff(made))
    if len(change) < 2:
        return np.empty(0)
    jumps = np.abs(change) > _SPIKE * np.maximum(1.0, np.median(np.abs(change)))
    stays = (np.maximum(moved[:-1], moved[1:]) < _STAYS) & ~jumps[:-1] & ~jumps[1:]
    back: np.ndarray = -(change[:-1] * change[1:])[stays]
    return back
