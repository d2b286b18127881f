"""The impulse responses of sums that remember by modes.

A mode with rate q = 1 − p and m differences answers a unit sample by ∇^(m−1) of (0, 1, −q, −q p, −q p², …).
They go on for ever; what follows after ``LAGS`` samples is bounded by its sum of magnitudes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array
from focgen.fractional.elementary import exact_sum, l1, powers, total

LAGS = 1 << 15  # up to here a response is written out


@dataclass(frozen=True)
class Modes:
    """Modes of a term of ``order`` s^β with ``rates`` q and ``weights`` c, both of shape (n,)."""

    order: float
    rates: Array
    weights: Array

    def scaled(self, factor: float) -> Modes:
        """With all weights times ``factor``."""
        return Modes(self.order, self.rates, self.weights * factor)

    @property
    def differences(self) -> int:
        """m, the order rounded up: 1 or 2."""
        return math.ceil(self.order)

    def response(self, lags: int = LAGS) -> Array:
        """By lag from 0 to ``lags``."""
        parts = [w * q * _powers(1.0 - q, lags - 1) for q, w in zip(self.rates, self.weights)]
        found = np.concatenate([[0.0, exact_sum(self.weights)], -total(parts)])
        return np.diff(found, prepend=0.0) if self.differences == 2 else found

    def left_out(self, lags: int = LAGS) -> float:
        """Bound on the sum of magnitudes beyond ``lags``."""
        late = np.abs(self.weights) * powers(1.0 - self.rates, np.array([lags - 1.0]))[:, 0]
        return exact_sum(late * (2.0 if self.differences == 2 else 1.0))


@dataclass(frozen=True)
class Response:
    """Weights by lag from 0 on, and a bound on the sum of magnitudes of those that are not written out."""

    weights: Array
    left_out: float = 0.0

    @property
    def l1(self) -> float:
        """Σ |w_j|."""
        return l1(self.weights) + self.left_out


def response_of(
    taps: Sequence[float] | Array, first: int, modes: Sequence[Modes], lags: int = LAGS
) -> Response:
    """What taps from lag ``first`` on and modes answer to a unit sample, up to ``lags`` where there are
    modes."""
    taps = np.concatenate([np.zeros(first), np.asarray(taps, dtype=float)])
    if not modes:
        return Response(taps)
    whole = sum((m.response(lags) for m in modes), np.zeros(lags + 1))
    whole[: len(taps)] += taps
    return Response(whole, exact_sum([m.left_out(lags) for m in modes]))


def _powers(base: float, count: int) -> Array:
    """The powers 0 … ``count`` − 1, twice as many with every product."""
    found, next_power = np.ones(1), float(base)
    while len(found) < count:
        found = np.concatenate([found, next_power * found])
        next_power *= next_power
    return found[:count]
