"""Long memories by fast online convolution: block by block, older blocks through the FFT.

A relaxed (online) convolution after Hairer, Lubich & Schlichte (1985): once block m is complete, its last 2^k
blocks are spread over as many future ones, 2^k being the largest power of two that divides m. O(N log² N) and
exact.
"""

from __future__ import annotations

import math

import numpy as np

from focgen.arrays import Array, Complex

BLOCK = 256


class Memory:
    """A signal's increments ``d`` (n,), the weights ``w`` of its past, and ``far`` (n,), what past blocks
    contribute.
    """

    def __init__(self, weights: Array) -> None:
        count = len(weights)
        self.w = np.ascontiguousarray(weights)
        self.d, self.far = np.zeros(count), np.zeros(count)
        self._spectra: dict[int, Complex] = {}

    def spread(self, blocks: int) -> None:
        """Add what the finished ``blocks`` owe to the steps after them."""
        reach = (blocks & -blocks) * BLOCK
        now = blocks * BLOCK
        if now >= len(self.d):
            return
        past = np.fft.rfft(self.d[now - reach : now], 2 * reach)
        owed = np.fft.irfft(past * self._spectrum(reach), 2 * reach)[reach:]
        target = self.far[now : now + reach]
        target += owed[: len(target)]

    def _spectrum(self, reach: int) -> Complex:
        if reach not in self._spectra:
            self._spectra[reach] = np.fft.rfft(self.w[: 2 * reach], 2 * reach)
        return self._spectra[reach]


def l1_weights(alpha: float, count: int) -> Array:
    """(j + 1)^(1 − alpha) − j^(1 − alpha), j = 0 … count − 1: the L1 scheme for 0 < alpha < 1."""
    return np.diff(np.arange(count + 1.0) ** (1.0 - alpha))


def l1_factor(alpha: float, h: float) -> float:
    """h^−alpha / Gamma(2 − alpha), by which the L1 sum becomes the Caputo derivative."""
    made: float = h**-alpha / math.gamma(2.0 - alpha)
    return made


def log_kernel(onset: float, full: float, h: float, count: int) -> Array:
    """ln(1 + t/onset), scaled to 1 at ``full`` s, in the middle of each step."""
    t = (np.arange(count) + 0.5) * h
    made: Array = np.log1p(t / onset) / np.log1p(full / onset)
    return made


def stretched_kernel(tau: float, power: float, h: float, count: int) -> Array:
    """exp(−(t/tau)^power) in the middle of each step."""
    t = (np.arange(count) + 0.5) * h
    made: Array = np.exp(-((t / tau) ** power))
    return made
