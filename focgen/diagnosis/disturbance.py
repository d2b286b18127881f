"""Whether what is left is more than noise although nothing that was done to the rig foretells it.

Noise of sensors is steady and forgets within a response of the rig. A loose plug comes in bursts, a room's
temperature in slow swings: neither depends on the input, and both are there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz

from focgen.diagnosis.noise import autocovariance, whiten
from focgen.logs.between import white_level

# kurtosis of the innovations, 3 for noise, and loudest stretch of a response over the usual one
BURSTS = (12.0, 5.0)
RESTLESS = (6.0, 4.0)  # kurtosis and loudest of what may be an effect that is a little wrong, but is no noise
HUMS = 0.25  # of the power in one line, in the greater part of the long experiments; up to a tenth for noise
SLOWEST = 100.0  # samples: slower than that, and than four responses, is no tone
_LONG = 400  # samples of an experiment in which a line stands out
# root mean square over that of what is white, and power at periods of two to ten responses over that at an
# eighth to half a one: of sound rigs, their sensors' noise coloured, at most 2.4 and 40
PUSHED = (3.0, 80.0)
SWINGS = 20.0  # power at periods beyond eight responses over that between one and four; 1 for noise


@dataclass(frozen=True)
class Disturbance:
    """``kurtosis`` and ``loudest`` of the innovations, ``slow``: the ratio of slow power to that about the
    response; ``line``: the part of the power in the strongest line, in the median of the long experiments;
    ``above``: the root mean square over that of what is white; ``paced``: the power at the pace of the rig
    over that of what is faster."""

    kurtosis: float
    loudest: float
    slow: float
    line: float
    above: float = 1.0
    paced: float = 1.0

    @property
    def hums(self) -> bool:
        """Whether it is a tone."""
        return self.line > HUMS

    @property
    def bursts(self) -> bool:
        """Whether it comes and goes."""
        return self.kurtosis > BURSTS[0] and self.loudest > BURSTS[1]

    @property
    def restless(self) -> bool:
        """Whether it is less steady than noise."""
        return self.kurtosis > RESTLESS[0] and self.loudest > RESTLESS[1]

    @property
    def pushed(self) -> bool:
        """Whether it is far above the sensor's noise, and as slow as what has passed through the rig."""
        return self.above > PUSHED[0] and self.paced > PUSHED[1]

    @property
    def swings(self) -> bool:
        """Whether it is slower than noise is."""
        return self.slow > SWINGS


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
    loudest = float(np.max(local) / max(np.median(local), 1e-300))
    return Disturbance(
        float(np.mean(joined**4) / variance**2),
        loudest,
        _slow(parts, h, response),
        _line(parts, h, response),
        _above(parts),
        _paced(parts, h, response),
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


def _line(parts: list[np.ndarray], h: float, response: float) -> float:
    """The part of the power within two bins of the strongest line, slow ones left out; the median over
    experiments. Slow is a period beyond four responses, whatever the samples, or beyond a
    hundred samples where these are more."""
    shares, slow = [], max(SLOWEST, 4.0 * response / h)
    for p in parts:
        if len(p) >= _LONG:
            power = np.abs(np.fft.rfft((p - p.mean()) * np.hanning(len(p)))) ** 2
            near = np.convolve(power, np.ones(5), "same")
            shares.append(float(near[math.ceil(len(p) / slow) :].max() / max(power.sum(), 1e-300)))
    return float(np.median(shares)) if shares else 0.0


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
