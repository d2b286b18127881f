"""The second memory form: a fractional operator of unlimited memory at the price of a few states.

(1 − z⁻¹)^α is split into m whole differences and (1 − z⁻¹)^(−β), 0 < β < 1. The weights of the latter are
positive and fall like j^(β−1); a sum of exponentials follows them over any number of decades, so a few
first-order recursions take the place of thousands of taps. Because the differences come first, a constant
input gives exactly zero (m ≥ 1) and nothing cancels.

Cutting the history off after L samples leaves a bias of L^−α / Γ(1−α) for ever. Here only changes older
than the horizon are forgotten wrongly, by no more than the certificate says. Further exact taps, besides the
one at lag 0, do not pay: two of them save one exponential, at as many multiplications and one word more.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import lfilter

from focgen.arrays import Array
from focgen.fractional import elementary
from focgen.fractional.exponential_certificate import Certificate, certify
from focgen.fractional.exponential_fit import Alternation, eased, ladder

HORIZONS = (100, 10**8)  # samples
TOLERANCES = (1e-8, 0.1)
CLOSEST_TO_INTEGER = 1e-7


@dataclass(frozen=True)
class ExponentialMemory:
    """D^``order`` at unit sample time by ``differences`` differences and n exponentials; times h^−α for h.

    One step: v_k = ∇^differences x_k, y_k = v_k + Σ weights_i · m_i, then m_i ← poles_i · m_i + v_k. So the
    weight of v_{k−j} is 1 for j = 0, as it is exactly, and h_j = Σ weights_i · poles_i^(j−1) from j = 1 on.
    ``poles`` in (0, 1), the fastest first, ``weights`` > 0. ``horizon`` in samples. ``tolerance`` bounds
    |h_j/g_j − 1| up to the horizon, g_j being the exact weights: the relative error of the output where v
    keeps its sign.
    """

    order: float
    horizon: int
    tolerance: float
    differences: int
    poles: tuple[float, ...]
    weights: tuple[float, ...]

    @property
    def states(self) -> int:
        """How many exponentials there are."""
        return len(self.poles)

    @property
    def lead(self) -> float:
        """The weight of v_k itself."""
        return 1.0

    @property
    def multiplies(self) -> int:
        """Multiplications in one step; a factor in front of the operator costs one more."""
        return 2 * self.states

    @property
    def words(self) -> int:
        """Numbers kept from one step to the next: the states, and the past inputs of the differences."""
        return self.states + self.differences

    @property
    def beta(self) -> float:
        """β of (1 − z⁻¹)^(−β), in (0, 1)."""
        return self.differences - self.order

    @functools.cached_property
    def certificate(self) -> Certificate:
        """The bounds that hold for these poles and weights."""
        return certify(self.beta, self.differences, self.horizon, self.poles, self.weights)

    def kernel(self, lags: ArrayLike) -> Array:
        """Return h_j at the whole numbers ``lags`` ≥ 0, shape of ``lags``."""
        lags = np.asarray(lags)
        powers = np.array(self.poles) ** np.maximum(lags[..., None] - 1.0, 0.0)
        # not a matrix product, whose last bit depends on how many lags are asked for
        return np.where(lags == 0, 1.0, np.einsum("...k,k->...", powers, np.array(self.weights)))

    def frequency_response(self, omega: ArrayLike) -> Any:
        """Complex gain at ``omega`` in rad per sample, 0 … π, shape of ``omega``."""
        delay = np.exp(-1j * np.asarray(omega, dtype=float))
        modes = np.array(self.weights) / (1.0 - np.array(self.poles) * delay[..., None])
        return (1.0 - delay) ** self.differences * (1.0 + delay * modes.sum(axis=-1))

    def run(self, x: ArrayLike) -> Array:
        """Return the output for the samples ``x``, at rest at 0 before them; float64, both (samples,)."""
        v = np.asarray(x, dtype=float)
        for _ in range(self.differences):
            v = np.diff(v, prepend=0.0)
        y = v.copy()
        for pole, weight in zip(self.poles, self.weights):
            y += lfilter([0.0, weight], [1.0, -pole], v)
        return y


@functools.lru_cache(maxsize=256)
def fit_exponential(order: float, horizon: int, tolerance: float) -> ExponentialMemory:
    """Find the memory with the fewest exponentials for D^``order`` within ``tolerance`` up to ``horizon``.

    ``order`` in (−1, 2), not whole; ``horizon`` 100 … 1e8 samples; ``tolerance`` 1e-8 … 0.1, the largest
    |h_j/g_j − 1|. That fewer cannot do it is certain, to within 1 % of the tolerance. What is left of it
    goes to the last lags, which weigh least in the output, so the others come out better.
    Raises ValueError outside these ranges, or where float64 poles are too coarse for the tolerance.
    """
    differences = checked_differences(order, horizon)
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ValueError(f"the tolerance {tolerance} is not between {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
    for fit in ladder(differences - order, horizon):
        if fit.error > tolerance:
            continue
        for candidate in (eased(differences - order, horizon, fit, tolerance), fit):
            memory = _memory(order, horizon, tolerance, candidate)
            if memory.certificate.kernel <= tolerance:
                return memory
    raise ValueError(f"float64 poles miss the tolerance {tolerance:g} at the horizon {horizon}; allow more")


@functools.lru_cache(maxsize=256)
def fit_states(order: float, horizon: int, states: int) -> ExponentialMemory:
    """Find a memory with this many exponentials; its ``tolerance`` is what its certificate proves.

    The lags near the horizon may err up to six times as much as those in the middle, the first ones less.
    Raises ValueError for orders and horizons as :func:`fit_exponential` does, and where the states are none,
    or more than float64 can tell apart.
    """
    beta = checked_differences(order, horizon) - order
    fit = next((f for f in ladder(beta, horizon) if f.modes == states), None)
    if fit is None:
        raise ValueError(f"no best fit with {states} states exists in float64 at the horizon {horizon}")
    return memory_of(order, horizon, *_poles_and_weights(eased(beta, horizon, fit, math.inf)))


def checked_differences(order: float, horizon: int) -> int:
    """Return the number of whole differences of ``order``. Raises ValueError for what cannot be fitted."""
    if not (-1.0 < order < 2.0 and abs(order - round(order)) >= CLOSEST_TO_INTEGER):
        raise ValueError(f"the order {order} is not between -1 and 2, or within 1e-7 of a whole one")
    if not HORIZONS[0] <= horizon <= HORIZONS[1]:
        raise ValueError(f"the horizon {horizon} is not between {HORIZONS[0]} and {HORIZONS[1]} samples")
    return math.ceil(order)


def _poles_and_weights(fit: Alternation) -> tuple[Array, Array]:
    return elementary.exp(-elementary.exp(fit.log_rates[::-1])), elementary.exp(fit.log_weights[::-1])


def _memory(order: float, horizon: int, tolerance: float, fit: Alternation) -> ExponentialMemory:
    poles, weights = _poles_and_weights(fit)
    return ExponentialMemory(
        order, horizon, tolerance, math.ceil(order), tuple(poles.tolist()), tuple(weights.tolist())
    )


def memory_of(
    order: float, horizon: int, poles: Sequence[float] | Array, weights: Sequence[float] | Array
) -> ExponentialMemory:
    """Return the memory with these ``poles`` and ``weights``, and the tolerance its certificate proves."""
    differences = math.ceil(order)
    tolerance = certify(differences - order, differences, horizon, poles, weights).kernel
    return ExponentialMemory(
        order, horizon, tolerance, differences, tuple(map(float, poles)), tuple(map(float, weights))
    )
