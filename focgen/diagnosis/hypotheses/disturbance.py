"""Whether what is left is more than noise although nothing that was done to the rig predicts it.

Noise of sensors is steady and forgets within a response of the rig. A loose plug comes in bursts, a room's
temperature in slow swings: neither depends on the input, and both are there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz

from focgen.diagnosis.fitting.noise import autocovariance, whiten
from focgen.diagnosis.numbers import NUMBERS
from focgen.logs.between import white_level

SLOWEST = 100.0  # samples: slower than that, and than four responses, is no tone
_LONG = 400  # samples of an experiment in which a line stands out
_STRETCH, _STRETCHES = 256, 8  # samples; how many there are to be at least
_PERIODS = 8  # of a tone in an experiment: fewer are as broad as what any slow noise does


@dataclass(frozen=True)
class Disturbance:
    """``kurtosis`` and ``loudest`` of the innovations, ``slow``: the ratio of slow power to that about the
    response; ``line``: the part of the power by which the strongest line stands out of what is about it, in
    the median of the long experiments, ``astray`` in that of short stretches; ``above``: the root mean square
    over that of what is white; ``paced``: the power at the pace of the rig over that of what is faster."""

    kurtosis: float
    loudest: float
    slow: float
    line: float
    above: float = 1.0
    paced: float = 1.0
    astray: float = 0.0

    @property
    def tonal(self) -> bool:
        """Whether it is a tone, or one that strays: a pump's ripple goes with its load. In a short stretch
        noise has lines, too: there it is to be twice as much of the power."""
        return max(self.line, 0.5 * self.astray) > NUMBERS.tonal

    @property
    def bursts(self) -> bool:
        """Whether it comes and goes."""
        return self.kurtosis > NUMBERS.kurtosis and self.loudest > NUMBERS.loudest

    @property
    def pushed(self) -> bool:
        """Whether it is far above the sensor's noise, and as slow as what has passed through the rig."""
        return self.above > NUMBERS.pushed and self.paced > NUMBERS.paced

    @property
    def low_frequency(self) -> bool:
        """Whether it is slower than noise is."""
        return self.slow > NUMBERS.low_frequency


def disturbance(parts: list[np.ndarray], h: float, response: float) -> Disturbance:
    """Of a residual by experiment, sampled every ``h`` s, of a rig that responds in ``response`` s."""
    parts = [p for p in parts if len(p) > 20] or parts
    r = autocovariance(parts, 2)
    ar = np.r_[1.0, -solve_toeplitz(r[:2], r[1:3])] if r[0] > 0 and min(map(len, parts)) > 20 else np.ones(1)
    quiet = [whiten(p, ar)[len(ar) :] for p in parts]
    joined = np.concatenate(quiet)
    variance = max(float(np.mean(joined**2)), 1e-300)
    count = max(10, int(response / h))
    local = np.array([np.mean(s**2) for p in quiet for s in np.array_split(p, max(1, len(p) // count))])
    stretches = [stretch for p in parts if len(p) >= _LONG for stretch in _stretches(p)]
    loudest = float(np.max(local) / max(np.median(local), 1e-300))
    return Disturbance(
        float(np.mean(joined**4) / variance**2),
        loudest,
        _slow(parts, h, response),
        _line(parts, h, response),
        _above(parts),
        _paced(parts, h, response),
        _line(stretches, h, response, _STRETCH) if len(stretches) >= _STRETCHES else 0.0,
    )


def _above(parts: list[np.ndarray]) -> float:
    """The root mean square over that of what is white: of second differences, in the median experiment."""
    white = np.median([white_level(p) for p in parts if len(p) > 2])
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)) / max(white, 1e-300))


def _paced(parts: list[np.ndarray], h: float, response: float) -> float:
    """Mean power density at two to ten responses over that at an eighth to half a one; 1 where there is too
    little."""
    power, count = np.zeros(2), np.zeros(2)
    for p in parts:
        density = np.abs(np.fft.rfft((p - p.mean()) * np.hanning(len(p)))) ** 2 / len(p)
        pace = np.fft.rfftfreq(len(p), h) * response
        for i, inside in enumerate(((pace > 0.1) & (pace < 0.5), (pace > 2.0) & (pace < 8.0))):
            power[i], count[i] = power[i] + density[inside].sum(), count[i] + inside.sum()
    if min(count) < 6 or power[1] <= 0:
        return 1.0
    return float(power[0] / count[0] / (power[1] / count[1]))


def _stretches(part: np.ndarray) -> list[np.ndarray]:
    """Stretches of an experiment so short that a tone which goes with the load keeps its frequency."""
    whole = len(part) // _STRETCH
    return list(part[: whole * _STRETCH].reshape(whole, _STRETCH))


def _line(parts: list[np.ndarray], h: float, response: float, long: int = _LONG) -> float:
    """The part of the power within two bins of the strongest line, less what its surroundings have there,
    slow ones left out; the median over parts of at least ``long`` samples. Slow is a period beyond four
    responses, whatever the samples, or beyond a hundred samples where these are more, and one of which a part
    holds few."""
    shares, slow = [], max(SLOWEST, 4.0 * response / h)
    for p in parts:
        if len(p) >= long:
            power = np.abs(np.fft.rfft((p - p.mean()) * np.hanning(len(p)))) ** 2
            near = np.convolve(power, np.ones(5), "same")
            first = max(math.ceil(len(p) / slow), _PERIODS)
            line = first + int(np.argmax(near[first:]))
            shares.append(float((near[line] - _around(near, line)) / max(power.sum(), 1e-300)))
    return float(np.median(shares)) if shares else 0.0


def _around(near: np.ndarray, line: int) -> float:
    """What the octaves below and above the bin ``line`` of a spectrum (n,) have: where noise has a colour it
    falls as a power of the frequency, and between the two it is their geometric mean."""
    place = np.arange(len(near))
    apart = np.abs(place - line) > 4
    sides = apart & (2 * place >= line) & (place < line), apart & (place > line) & (place <= 2 * line)
    levels = [max(float(np.median(near[side])), 1e-300) for side in sides if np.any(side)]
    return float(np.exp(np.mean(np.log(levels)))) if levels else 0.0


def _slow(parts: list[np.ndarray], h: float, response: float) -> float:
    """Mean power density at periods beyond eight responses over that at one to four; 1 where there is too
    little."""
    low, low_count, near, near_count = 0.0, 0, 0.0, 0
    for p in parts:
        power = np.abs(np.fft.rfft((p - p.mean()) * np.hanning(len(p)))) ** 2 / len(p)
        period = len(p) * h / np.maximum(np.arange(len(power)), 1e-9)
        inside = np.arange(len(power)) > 0
        slow, about = inside & (period > 8 * response), inside & (period > response) & (period < 4 * response)
        low, low_count = low + float(power[slow].sum()), low_count + int(slow.sum())
        near, near_count = near + float(power[about].sum()), near_count + int(about.sum())
    if low_count < 6 or near_count < 6 or near <= 0:
        return 1.0
    return (low / low_count) / (near / near_count)
