"""The colour of the noise: an autoregressive model of what is left, and residuals whitened by it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

_ORDERS = (0, 1, 2, 3, 4, 6, 8, 12, 16, 24)


def autocovariance(parts: Sequence[np.ndarray], lags: int) -> np.ndarray:
    """Autocovariances 0 … lags of the parts together, each about zero."""
    total, count = np.zeros(lags + 1), 0
    for part in parts:
        n = len(part)
        size = 1 << int(np.ceil(np.log2(2 * n)))
        power = np.abs(np.fft.rfft(part, size)) ** 2
        r = np.fft.irfft(power)[: lags + 1]
        total[: len(r)] += r[: len(total)]
        count += n
    return total / max(count, 1)


def fit_ar(parts: Sequence[np.ndarray]) -> np.ndarray:
    """The whitening filter [1, a1, … ap] of the residual, order chosen by BIC (Yule–Walker)."""
    count = sum(len(p) for p in parts)
    most = max(0, min(_ORDERS[-1], min(len(p) for p in parts) // 8, count // 40))
    r = autocovariance(parts, most)
    if not r[0] > 0:
        return np.ones(1)
    r[0] *= 1 + 1e-9
    best, chosen = np.inf, np.ones(1)
    for order in (p for p in _ORDERS if p <= most):
        a = -solve_toeplitz(r[:order], r[1 : order + 1]) if order else np.zeros(0)
        variance = r[0] + a @ r[1 : order + 1]
        if variance <= 0:
            continue
        score = count * np.log(variance) + order * np.log(count)
        if score < best:
            best, chosen = score, np.r_[1.0, a]
    return chosen


def whiten(part: np.ndarray, ar: np.ndarray) -> np.ndarray:
    """The innovations of one part; (n,) or (n, k) by columns."""
    return lfilter(ar, [1.0], part, axis=0) if len(ar) > 1 else part


def coloured(rng: np.random.Generator, count: int, ar: np.ndarray, sigma: float) -> np.ndarray:
    """Noise (count,) of this colour with innovations of standard deviation ``sigma``."""
    lead = 200
    made: np.ndarray = lfilter([1.0], ar, rng.normal(0.0, sigma, count + lead))[lead:]
    return made
