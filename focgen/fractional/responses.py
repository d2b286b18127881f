"""Exact responses in continuous time: step, ramp, and the Mittag-Leffler function behind them."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.fractional.contour import INNERMOST, TOLERATED, inverse_laplace
from focgen.fractional.decomposition import StepImage, step_image
from focgen.fractional.transfer import TransferFunction


def step_response(transfer: TransferFunction, t: ArrayLike) -> Array:
    """Return the response to a unit step at time 0, from rest, at the times ``t`` (s), shape of ``t``.

    Exact to about 1e-12 of the largest value: poles as exponentials, the rest by a contour integral. At
    t = 0 the value is that of t → 0+, before it is 0.
    Raises ValueError for an improper transfer function.
    """
    t = np.asarray(t, dtype=float)
    after = t > 0.0
    image = step_image(transfer, float(np.max(t, initial=0.0)) or 1.0)
    out = np.where(t == 0.0, image.feedthrough, 0.0)
    out[after] = _values(image, t[after])
    return out


def ramp_response(transfer: TransferFunction, t: ArrayLike) -> Array:
    """Return the response to the ramp u = t (t in s), shape of ``t``; exact, and raises ValueError, as
    :func:`step_response`."""
    return step_response(transfer * TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]), t)


def _values(image: StepImage, t: Array) -> Array:
    total = np.zeros(t.shape)
    for chain in image.chains:
        total += chain.at(t)
    return total if image.remainder is None else total + inverse_laplace(image.remainder, t, image.poles)


def mittag_leffler(alpha: float, beta: float, z: ArrayLike) -> Array:
    """Return the two-parameter function E_{α,β}(z) = Σ z^k / Γ(αk + β) for real ``z``, shape of ``z``.

    Absolute error about 1e-13 for z ≤ 0 and moderate β; for z > 0 the error is relative to the value.
    Raises ValueError unless 0 < α < 100.
    """
    if not 0.0 < alpha < 100.0:
        raise ValueError(f"alpha is {alpha}, it must lie between 0 and 100")
    z = np.asarray(z, dtype=float)
    flat = [_mittag_leffler(alpha, beta, float(value)) for value in z.ravel()]
    return np.array(flat).reshape(z.shape)


def _mittag_leffler(alpha: float, beta: float, z: float) -> float:
    # t^{β−1} E(z t^α) has the transform s^{α−β} / (s^α − z); wanted at t = 1
    poles = [p for p in _mittag_leffler_poles(alpha, z) if abs(p) > INNERMOST]
    residues = [p ** (1.0 - beta) / alpha for p in poles]

    def remainder(s: Array) -> Array:
        polar = sum(r / (s - p) for p, r in zip(poles, residues))
        return s ** (alpha - beta) / (s**alpha - z) - polar

    exponentials = sum((r * cmath.exp(p)).real for p, r in zip(poles, residues))
    return float(inverse_laplace(remainder, np.ones(1), np.array(poles))[0] + exponentials)


def _mittag_leffler_poles(alpha: float, z: float) -> list[complex]:
    first = 0.0 if z > 0 else math.pi
    turns = range(-math.ceil(alpha), math.ceil(alpha) + 1)
    angles = [(first + 2.0 * math.pi * k) / alpha for k in turns]
    size = abs(z) ** (1.0 / alpha)
    return [cmath.rect(size, a) for a in angles if abs(a) <= math.pi - TOLERATED]
