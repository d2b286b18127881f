"""A convolution whose input arrives sample by sample, in O(n log² n) instead of O(n²)."""

from __future__ import annotations

import numpy as np
from scipy import fft

from focgen.arrays import Array

BLOCK = 128  # a power of two: samples within one block are summed directly


class OnlineConvolution:
    """y_k = Σ_{j ≤ k} W_j x_{k−j} for many columns at once; x_k may depend on y_0 … y_{k−1}.

    ``kernel`` is W, shape (lags, outputs, inputs); every step takes x_k of shape (inputs, columns) and
    gives y_k of shape (outputs, columns), for at most ``samples`` steps. A completed block's share of the
    future is added at once, blocks of doubling size by FFT; a short kernel is summed directly.
    """

    def __init__(self, kernel: Array, columns: int, samples: int) -> None:
        lags, outputs, inputs = kernel.shape
        self._kernel, self._samples, self._now = kernel, samples, 0
        self._x = np.zeros((samples, inputs, columns))
        self._ahead = np.zeros((samples, outputs, columns))
        self._spectra: dict[int, Array] = {}
        self._block = lags if lags <= 2 * BLOCK else BLOCK
        self._direct = lags <= 2 * BLOCK
        self._recent = np.ascontiguousarray(
            kernel[: self._block][::-1].transpose(1, 0, 2)
        )  # oldest lag first

    def past(self) -> Array:
        """Return Σ_{j ≥ 1} W_j x_{k−j}: what y_k is but for x_k."""
        k = self._now
        lags = min(k, self._block - 1) if self._direct else k % BLOCK
        if lags < 1:
            ahead: Array = self._ahead[k]
            return ahead
        weights = self._recent[:, -1 - lags : -1].reshape(self._recent.shape[0], -1)
        made: Array = self._ahead[k] + weights @ self._x[k - lags : k].reshape(weights.shape[1], -1)
        return made

    def push(self, x: Array) -> None:
        """Take in x_k."""
        self._x[self._now] = x
        self._now += 1
        if not self._direct and self._now % BLOCK == 0 and self._now < self._samples:
            self._carry(self._now & -self._now)

    def step(self, x: Array) -> Array:
        """Take in x_k and return y_k."""
        y: Array = self.past() + self._kernel[0] @ x
        self.push(x)
        return y

    def _carry(self, size: int) -> None:
        """Add what the latest ``size`` samples contribute to the next ``size``."""
        now = self._now
        ahead = min(size, self._samples - now)
        spectrum = fft.rfft(self._x[now - size : now], 2 * size, axis=0)
        product = np.einsum("foi,fic->foc", self._spectrum(size), spectrum)
        self._ahead[now : now + ahead] += fft.irfft(product, 2 * size, axis=0)[size : size + ahead]

    def _spectrum(self, size: int) -> Array:
        if size not in self._spectra:
            self._spectra[size] = fft.rfft(self._kernel[: 2 * size], 2 * size, axis=0)
        return self._spectra[size]
