"""Step responses of 1/((τ s)^α + 1), with their derivatives in log τ and α, at every sample at once.

Each is inverted from its own Laplace transform, so the derivatives are as exact as the response. For α > 1
the pair of poles p = e^{±iπ/α}/τ leaves the negative real axis and is taken out in closed form.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from focgen.fractional.contour import TOLERATED, inverse_laplace
from focgen.fractional.loggrid import log_grid

_GAUSS = np.polynomial.legendre.leggauss(5)


@lru_cache(maxsize=16)
def step_responses(log_tau: float, alpha: float, step: float, count: int) -> np.ndarray:
    """Return S, ∂S/∂log τ, ∂S/∂α at 0, h, … (count − 1) h, shape (3, count)."""
    grid = log_grid(count)
    places = np.concatenate([grid.head, grid.tail]) * step
    values = _inverted(log_tau, alpha, places, lambda s: 1.0)
    out = np.zeros((3, count))
    for row, value in zip(out, values):
        row[1:] = grid.spread(value[: len(grid.head)], value[len(grid.head) :])[:-1]
    if _pole_counts(alpha):
        out += _oscillation(log_tau, alpha, step * np.arange(count), 0.0)
        out[:, 0] = 0.0
    return out


@lru_cache(maxsize=16)
def step_means(log_tau: float, alpha: float, step: float, count: int) -> np.ndarray:
    """Return the means of S, ∂S/∂log τ, ∂S/∂α over [(j − 1) h, j h], j = 1 … count, shape (3, count)."""
    grid = log_grid(count)
    integrals = _inverted(log_tau, alpha, grid.head * step, lambda s: 1.0 / s)
    heads = np.diff(integrals, prepend=0.0) / step
    # beyond the first samples the contour bears the growth of e^{-sh}
    tails = _inverted(log_tau, alpha, grid.tail * step, lambda s: -np.expm1(-s * step) / (s * step))
    out = np.array([grid.spread(head, tail) for head, tail in zip(heads, tails)])
    if _pole_counts(alpha):
        out += _oscillation(log_tau, alpha, step * np.arange(1, count + 1), step)
    return out


def _pole_counts(alpha: float) -> bool:
    return math.pi - math.pi / alpha > TOLERATED


def _pole(log_tau: float, alpha: float) -> tuple[complex, complex, complex]:
    """The upper pole and its derivatives in log τ and α."""
    pole = np.exp(1j * math.pi / alpha - log_tau)
    return pole, -pole, pole * (-1j * math.pi / alpha**2)


def _inverted(log_tau: float, alpha: float, t: np.ndarray, factor) -> np.ndarray:
    """Invert the three transforms times ``factor(s)`` at ``t``, the poles' share taken out; shape (3, n)."""
    removed = np.array([_pole(log_tau, alpha)[0]]) if _pole_counts(alpha) else None
    known: list[tuple] = []  # the three are inverted on the same places

    def image(which: int):
        def transform(s):
            if not known:
                known.append(tuple(part * factor(s) for part in _images(s, log_tau, alpha)))
            return known[0][which]

        return transform

    if not len(t):
        return np.empty((3, 0))
    return np.array([inverse_laplace(image(which), t, removed) for which in range(3)])


def _images(s: np.ndarray, log_tau: float, alpha: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    log = np.log(s) + log_tau
    power = np.exp(alpha * log)
    response = 1.0 / (s * (1.0 + power))
    common = -power / (1.0 + power) * response
    images = response, alpha * common, log * common
    if not _pole_counts(alpha):
        return images
    return tuple(whole - polar for whole, polar in zip(images, _polar_images(s, log_tau, alpha)))


def _polar_images(s: np.ndarray, log_tau: float, alpha: float) -> tuple:
    """The poles' share −(1/α)/(s − p) + conjugate, and its derivatives."""
    total = [0.0, 0.0, 0.0]
    for pole, by_log_tau, by_alpha in (_pole(log_tau, alpha), np.conj(_pole(log_tau, alpha))):
        single = 1.0 / (s - pole)
        double = single**2
        total[0] += -single / alpha
        total[1] += -by_log_tau / alpha * double
        total[2] += single / alpha**2 - by_alpha / alpha * double
    return tuple(total)


def _oscillation(log_tau: float, alpha: float, t: np.ndarray, span: float) -> np.ndarray:
    """The poles' share at ``t``, or its mean over the ``span`` before it; shape (3, n)."""
    pole, by_log_tau, by_alpha = _pole(log_tau, alpha)
    places, weights = _GAUSS if span else ([1.0], [1.0])
    single, double = np.zeros(len(t), complex), np.zeros(len(t), complex)  # e^{pt} and t e^{pt}
    for place, weight in zip(places, weights):
        at = t + 0.5 * span * (place - 1.0)
        decayed = weight / np.sum(weights) * np.exp(pole * at)
        single, double = single + decayed, double + at * decayed
    rows = (-single / alpha, -by_log_tau / alpha * double, single / alpha**2 - by_alpha / alpha * double)
    return 2.0 * np.array(rows).real
