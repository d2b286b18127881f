"""A fractional operator fitted to s^α itself, over a band of frequencies, at the price of a few states.

The Grünwald–Letnikov weights follow s^α only as far as sampling lets them: (1 − z⁻¹)^α lags by α h/2, 9.4 %
at a tenth of the Nyquist frequency for α = 0.6, whatever the memory. The form of
:mod:`focgen.fractional.exponential`, m whole differences and a sum of exponentials behind them, can be fitted
to (jω)^α directly. A few of its modes then make up for the lag. A constant gives exactly zero, as there.

The error is told in the band: |H(e^{jωh}) / (jω)^α − 1|. Below the band the response falls with ω^m and ends
in exact rest; above it |H| stays within 2 |jω|^α, 4 where α > 1. Both are certified between all frequencies.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array, Complex
from focgen.fractional import elementary
from focgen.fractional.continuous_certificate import BandCertificate, certify_band
from focgen.fractional.continuous_fit import Band, best_rates, best_weights

Rounding = Callable[[Array], Array]
OPERATORS = ("gl", "continuous")
HIGHEST = 0.5 * math.pi  # rad per sample: half of the Nyquist frequency
RATIOS = (10.0, 1e6)  # of a band's ends
DEFAULT_BAND = (math.pi * 1e-5, 0.1 * math.pi)
DEFAULT_TOLERANCE = 1e-3
MOST_STATES = 20
_TOLERANCES = (1e-6, 0.1)
_CLOSEST_TO_INTEGER = 1e-7
_HELD_BACK = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2)  # weights of what is above the band, tried in this order
_SPARED = 0.9  # of the tolerance: what rounding the rates may cost is left over
_PROMISING, _SCREENED = 4.0, 12  # an error this many tolerances large after so many rounds may still fall


@dataclass(frozen=True)
class ContinuousMemory:
    """D^``order`` at unit sample time by ``differences`` differences and n exponentials; times h^−α for h.

    One step: v_k = ∇^differences x_k, y_k = lead · v_k + Σ weights_i · m_i, then m_i ← poles_i · m_i + v_k.
    ``poles`` in (0, 1), the fastest first; ``lead`` and ``weights`` of any sign. ``band`` in rad per sample;
    ``tolerance`` bounds |H/(jω)^α − 1| in it.
    """

    order: float
    band: tuple[float, float]
    tolerance: float
    differences: int
    lead: float
    poles: tuple[float, ...]
    weights: tuple[float, ...]

    @property
    def states(self) -> int:
        """How many exponentials there are."""
        return len(self.poles)

    @functools.cached_property
    def certificate(self) -> BandCertificate:
        """The bounds that hold for these poles and weights."""
        return certify_band(self.order, self.band, 1.0 - np.array(self.poles), (self.lead, *self.weights))

    def frequency_response(self, omega: ArrayLike) -> Complex:
        """Complex gain at ``omega`` in rad per sample, 0 … π, shape of ``omega``."""
        delay = np.exp(-1j * np.asarray(omega, dtype=float))
        modes = np.array(self.weights) / (1.0 - np.array(self.poles) * delay[..., None])
        made: Complex = (1.0 - delay) ** self.differences * (self.lead + delay * modes.sum(axis=-1))
        return made


def growth_limit(order: float) -> float:
    """What |H| may be above the band, in units of |jω|^``order``."""
    return 4.0 if order > 1.0 else 2.0


def _unrounded(rates: Array) -> Array:
    return rates


@functools.lru_cache(maxsize=256)
def fit_band(
    order: float, low: float, high: float, tolerance: float, rounded: Rounding = _unrounded
) -> ContinuousMemory:
    """Find a memory with few exponentials that follows (jω)^``order`` within ``tolerance`` in the band.

    ``order`` in (−1, 2), not whole; ``low`` and ``high`` in rad per sample, a factor of 10 to 1e6 apart, the
    latter at most π/2; ``tolerance`` 1e-6 … 0.1. ``rounded`` takes rates 1 − p, falling, to those that a
    machine can hold; the weights are found, and the certificate is, for these.
    Raises ValueError outside these ranges, and where ``MOST_STATES`` exponentials miss the tolerance; what it
    says is within reach would be kept.
    """
    _check(order, low, high)
    if not _TOLERANCES[0] <= tolerance <= _TOLERANCES[1]:
        ends = " and ".join(f"{end:g}" for end in _TOLERANCES)
        raise ValueError(f"the tolerance {tolerance} is not between {ends}")
    band, smallest = Band(order, low, high), math.inf
    for states in range(2, MOST_STATES + 1):
        _, error = best_rates(band, states, _HELD_BACK[0], _SCREENED)
        if error > _PROMISING * tolerance:
            continue
        for memory in _candidates(band, states, rounded, _SPARED * tolerance):
            smallest = min(smallest, memory.tolerance)
            if memory.tolerance <= tolerance:
                return memory
    # only what is proved keeps its word: errors of a search tell nothing of growth above the band
    reach = f"{elementary.rounded_up(smallest, 2):g} is within reach" if smallest < math.inf else "allow more"
    raise ValueError(f"{MOST_STATES} modes miss the tolerance {tolerance:g} in this band; {reach}")


@functools.lru_cache(maxsize=256)
def fit_band_states(
    order: float, low: float, high: float, states: int, rounded: Rounding = _unrounded
) -> ContinuousMemory:
    """Find a memory with this many exponentials; its ``tolerance`` is what its certificate proves.

    Arguments and limits as of :func:`fit_band`; ``states`` 2 … ``MOST_STATES``.
    """
    _check(order, low, high)
    if not 2 <= states <= MOST_STATES:
        raise ValueError(f"{states} modes are not 2 to {MOST_STATES}")
    best = None
    for memory in _candidates(Band(order, low, high), states, rounded, math.inf):
        if best is not None and memory.tolerance > best.tolerance:
            break
        best = memory
    if best is None:
        raise ValueError(f"no {states} modes keep within {growth_limit(order):g} |jω|^α above the band")
    return best


def _candidates(band: Band, states: int, rounded: Rounding, goal: float) -> Iterator[ContinuousMemory]:
    """Memories that keep the limit above the band, the less held back the earlier; none beyond the first
    whose rates miss ``goal`` in the band."""
    for above in _HELD_BACK:
        rates, error = best_rates(band, states, above)
        if error > goal:
            return
        memory = _held(band, 1.0 - rounded(rates), above)
        if memory is not None and memory.certificate.above <= growth_limit(band.order):
            yield memory


def _held(band: Band, poles: Array, above: float) -> ContinuousMemory | None:
    """With the weights that suit the rounded poles best; None where two poles become one."""
    rates = 1.0 - poles
    if not (np.all(np.diff(rates) < 0.0) and rates[-1] > 0.0 and rates[0] < 1.0):
        return None
    weights = best_weights(band, rates, above)
    if weights is None:
        return None
    proved = certify_band(band.order, (band.low, band.high), rates, weights).error
    lead, *others = weights.tolist()
    ends = band.low, band.high
    return ContinuousMemory(
        band.order, ends, proved, band.differences, lead, tuple(poles.tolist()), tuple(others)
    )


def _check(order: float, low: float, high: float) -> None:
    if not (-1.0 < order < 2.0 and abs(order - round(order)) >= _CLOSEST_TO_INTEGER):
        raise ValueError(f"the order {order} is not between -1 and 2, or within 1e-7 of a whole one")
    check_band(low, high)


def check_band(low: float, high: float) -> None:
    """Raise ValueError for a band, in rad per sample, that nothing can be fitted in."""
    if not (0.0 < low < high <= HIGHEST * (1.0 + 1e-12)):
        raise ValueError("the band does not rise from above 0 to at most half of the Nyquist frequency")
    if not RATIOS[0] * (1 - 1e-12) <= high / low <= RATIOS[1] * (1 + 1e-12):
        raise ValueError(f"the band's ends are not a factor of {RATIOS[0]:g} to {RATIOS[1]:g} apart")
