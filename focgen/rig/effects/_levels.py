"""The levels of a coarse converter, read off at sight: the step between them, and where one lies."""

import numpy as np
from scipy.special import erfc

from focgen.arrays import Array
from focgen.rig.effects._effect import Values

_COARSE = 0.006  # of the range: finer steps are the resolution of any converter
_COVERED = 0.6  # of the samples lie on a few levels
_COVERED_BY_TWO = 0.999  # the same of two levels, which may be rests of a finer reading
# of the noise of a reading whose levels are blurred
_OF_NOISE = 0.954  # what half of all steps between neighbours are below, where both are noise
_BIN = 0.25  # a bin of the histogram,
_BINS = 50_000  # of which there are so many at most: of a finer reading no step is that small
_RESOLVED = 4.0  # bins of a step, at least
_APART = 5.0  # two levels, at least
_FINE = 8  # times as many frequencies as bins
_TALL = 0.9  # of what noise leaves of a comb; of rests that happen to be even, with passages, less is left
_WIDE, _HALF_WAY = 4.5, 0.45  # a level, either way; of a step at most
_PASSES = 2  # samples between two levels, for each change of level: what resampling leaves there
_LEVELS, _SELDOM = 3, 5e-4  # levels at least, for two may be the rests of a rig, with so many of all samples


def seen(y: Array) -> Values | None:
    """Step and phase where most samples lie on a few evenly spaced levels, or about them: what is noisy
    behind the converter, as a wire is, blurs its levels."""
    return _exactly(y) or _blurred(y)


def _blurred(y: Array) -> Values | None:
    """The same of levels that noise has widened. Their histogram is a comb: at one over the step its Fourier
    transform is as tall as it is at 0, but for the noise, whose own factor is exp(−2 (π noise/step)²)."""
    noise = float(np.median(np.abs(np.diff(y)))) / _OF_NOISE
    span = float(np.ptp(y))
    if not 0.0 < _APART * noise < span / 2.0:
        return None
    width = max(_BIN * noise, span / _BINS)
    histogram = np.bincount(((y - y.min()) / width).astype(int))
    tall = np.abs(np.fft.rfft(histogram, _FINE * len(histogram))) / len(y)
    often = np.arange(len(tall)) / (_FINE * len(histogram) * width)
    asked = (often >= 2.0 / span) & (often <= 1.0 / max(_APART * noise, _RESOLVED * width))
    comb = np.where(asked, tall * np.exp(2.0 * (np.pi * noise * often) ** 2), 0.0)
    if comb.max() < _TALL:
        return None
    first = int(np.argmax(comb > _TALL))  # at twice as often, and so on, it may be as tall
    highest = often[first + int(np.argmax(comb[first : first + _FINE]))]
    near = highest + often[1] * np.linspace(-1.0, 1.0, 4 * _FINE + 1)
    turns = np.array([np.mean(np.exp(2j * np.pi * f * y)) for f in near])
    tallest = int(np.argmax(np.abs(turns)))
    step = 1.0 / float(near[tallest])
    phase = step * float(np.angle(turns[tallest])) / (2.0 * np.pi)
    return (step, phase) if _jumps(y, step, phase, noise) else None


def _jumps(y: Array, step: float, phase: float, noise: float) -> bool:
    """Whether a reading jumps from one of a few levels to the next; a rig passes between its rests."""
    level = np.round((y - phase) / step)
    _, counts = np.unique(level, return_counts=True)
    if np.count_nonzero(counts > _SELDOM * len(y)) < _LEVELS:
        return False
    wide = min(_WIDE * noise, _HALF_WAY * step)
    off = np.abs(y - phase - step * level) > wide
    by_noise = len(y) * erfc(wide / noise / np.sqrt(2.0))
    return bool(np.count_nonzero(off) - by_noise <= _PASSES * np.count_nonzero(np.diff(level[~off])))


def _exactly(y: Array) -> Values | None:
    """Step and phase where most samples lie on a few evenly spaced levels."""
    span = float(np.ptp(y))
    values, counts = np.unique(np.round((y - y.min()) / max(span, 1e-300) * 20_000), return_counts=True)
    common = values[counts > 0.002 * len(y)] / 20_000 * span + y.min()
    covered = counts[counts > 0.002 * len(y)].sum() / len(y)
    if len(common) < 2 or covered < (_COVERED_BY_TWO if len(common) == 2 else _COVERED):
        return None
    gaps = np.diff(common)
    gaps = gaps[gaps > 0.25 * np.median(gaps)]
    step = float(np.median(gaps[gaps < 1.5 * gaps.min()]))
    if step < _COARSE * span or np.mean(np.abs(gaps / step - np.round(gaps / step)) < 0.1) < 0.9:
        return None
    number = np.round((common - common[0]) / step)
    step, first = np.polyfit(number, common, 1)
    return float(step), float((first / step - np.round(first / step)) * step)
