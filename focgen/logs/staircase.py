"""A measured input that only jumps and rests: what it was held at, without its gauge's noise."""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from focgen.arrays import Array
from focgen.logs.between import jumps_of, noise_level

_APART = 5.0  # standard deviations of their difference: so far apart two means are two levels
_LOUDER = 1.5  # times the noise: what is left about the levels is at most so loud
_CHANCE = 1e-3  # that noise alone gives the levels such slopes
_SHORT = 8  # samples: a signal whose levels are shorter on average is on its way, not at rest
_REPEATS = 0.5  # of samples without noise are as the one before


def staircase_of(values: Array) -> Array | None:
    """The levels (n,) of a signal that jumps and rests, or rests throughout, each the mean of its readings;
    None where it does anything else.

    Jumps that stand out are cuts, and so is where the means of what is between differ most (binary
    segmentation; A. J. Scott and M. Knott, Biometrics 30, 1974). A slow ramp may be cut into levels that
    differ by little, but each of them has its slope.
    """
    noise = noise_level(values)
    if noise == 0.0:
        return values if len(values) and np.mean(np.diff(values) == 0.0) > _REPEATS else None
    levels = _levels(np.split(values, np.flatnonzero(jumps_of(values))), noise)
    if levels is None:
        return None
    found: Array = np.concatenate([np.full(len(level), np.mean(level)) for level in levels])
    rests = float(np.std(values - found)) <= _LOUDER * noise and not _sloped(levels, noise)
    return found if rests else None


def _levels(parts: list[Array], noise: float) -> list[Array] | None:
    """Stretches cut wherever their mean changes; None where that leaves more than short ones."""
    most, waiting, levels = sum(map(len, parts)) // _SHORT, parts[::-1], []
    while waiting:
        part = waiting.pop()
        cut = _cut(part, noise)
        if cut:
            waiting += [part[cut:], part[:cut]]
        else:
            levels.append(part)
        if len(levels) + len(waiting) > most:
            return None
    return levels


def _cut(values: Array, noise: float) -> int:
    """Where the means before and behind differ most, 0 where by no more than noise."""
    n = len(values)
    if n < 2:
        return 0
    first = np.arange(1, n)
    sums = np.cumsum(values)
    before, after = sums[:-1] / first, (sums[-1] - sums[:-1]) / (n - first)
    apart = np.abs(before - after) / np.sqrt(1.0 / first + 1.0 / (n - first))
    best = int(np.argmax(apart))
    return best + 1 if apart[best] > _APART * noise else 0


def _sloped(levels: list[Array], noise: float) -> bool:
    """Whether the levels have slopes that noise does not."""
    squares = []
    for level in levels:
        place = np.arange(len(level)) - 0.5 * (len(level) - 1)
        if len(level) >= _SHORT:
            squares.append(float(place @ level) ** 2 / (noise**2 * float(place @ place)))
    return bool(chi2.sf(sum(squares), max(len(squares), 1)) < _CHANCE)
