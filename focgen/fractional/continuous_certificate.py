"""What is certain about modes that follow (jθ)^α: in the whole band and above it, between the lines, too.

With t = ln θ, a basis function B = (1 − z⁻¹)^m z⁻¹ / (1 − p z⁻¹) / (jθ)^α has dB/dt = B L and
d²B/dt² = B (L² + dL/dt), where L = m f − jθ − g − α, f = jθ/(e^{jθ} − 1), g = jθ p/(e^{jθ} − p). On (0, π]:
|f| = (θ/2)/sin(θ/2) =: κ, |df/dt| ≤ κ + κ². Since e^{jθ} is at least sin θ away from [0, 1] up to π/2 and 1
beyond, |jθ/(e^{jθ} − p)| ≤ γ with γ = θ/sin θ or θ, so |g| ≤ γ and |dg/dt| ≤ γ + γ². Hence |L| ≤ K and
|dL/dt| ≤ K' with K = m κ + γ + θ + |α| and K' = m (κ + κ²) + γ + γ² + θ. All rise with θ, if γ keeps π/2
beyond π/2 until θ is larger.

Between two lines δ apart in t the error departs from its chord by at most δ²/8 of the largest second
derivative, and |B| grows by at most e^{Kδ}. So the largest error is a finite computation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.fractional import elementary
from focgen.fractional.continuous_fit import Lines, size, spread

_SLACK = 0.01  # of the error that is seen: what the chords may add
_FINEST, _COARSEST, _ABOVE = 2e-4, 1e-2, 1e-3  # δ
_CHUNK = 4096
_ROUNDING = 1e-12  # of the bend, which is larger than an eighth of the parts' magnitudes


@dataclass(frozen=True)
class BandCertificate:
    """``error``: |H(e^{jθ}) / (jθ)^α − 1| is at most this everywhere in the band. ``above``: |H| ≤ above ·
    θ^α from the band's end to θ = π. In exact arithmetic, unit sample time.
    """

    error: float
    above: float


def certify_band(
    order: float, band: tuple[float, float], rates: ArrayLike, weights: ArrayLike
) -> BandCertificate:
    """Bound the error of (1 − z⁻¹)^m (c₀ + z⁻¹ Σ c_i / (1 − p_i z⁻¹)), m being ``order`` rounded up.

    ``band`` in rad per sample, its end at most π/2; ``rates`` 1 − p in (0, 1], shape (n,); ``weights`` c₀ and
    the c_i, shape (1 + n,), of any sign. Raises ValueError for rates or weights outside these ranges.
    """
    rates, weights = np.asarray(rates, float), np.asarray(weights, float)
    if not (np.all(rates > 0.0) and np.all(rates <= 1.0) and np.all(np.isfinite(weights))):
        raise ValueError("the rates must lie in (0, 1] and the weights must be finite")
    low, high = band
    seen, bend = _largest(order, low, high, rates, weights, _COARSEST, 1.0)
    step = min(max(math.sqrt(_SLACK * seen / bend), _FINEST), _COARSEST) if bend > 0.0 else _COARSEST
    if step < _COARSEST:
        seen, bend = _largest(order, low, high, rates, weights, step, 1.0)
    most, bent = _largest(order, high, math.pi, rates, weights, _ABOVE, 0.0)
    return BandCertificate(
        seen + (step * step + _ROUNDING) * bend, most + (_ABOVE * _ABOVE + _ROUNDING) * bent
    )


def _largest(
    order: float, low: float, high: float, rates: Array, weights: Array, step: float, goal: float
) -> tuple[float, float]:
    """The largest |H/(jθ)^α − goal| at lines at most ``step`` apart, and an eighth of the largest second
    derivative between them."""
    count = math.ceil(float(elementary.log(high / low)) / step) + 2
    theta = spread(low, high, count)
    seen, bend = 0.0, 0.0
    for first in range(0, count, _CHUNK):
        part = theta[first : first + _CHUNK]
        found, parts = _values(order, part, rates, weights)
        found[0] -= goal
        seen = max(seen, float(size(found).max()))
        bend = max(bend, float((parts * _second(order, part, step)).max()))
    return seen, 0.125 * bend


def _values(order: float, theta: Array, rates: Array, weights: Array) -> tuple[Array, Array]:
    """H/(jθ)^α, shape (2, points), and the sum of its parts' magnitudes, shape (points,)."""
    parts = weights[:, None, None] * Lines(order, theta).basis(rates)
    return elementary.total(parts), elementary.total(size(parts))


def _second(order: float, theta: Array, step: float) -> Array:
    """Bound on |d²B/dt²| / |B at a line| from each line to the next."""
    end = np.minimum(theta * float(elementary.exp(step)), math.pi)
    sine, cosine = elementary.sine_cosine(0.5 * end)
    kappa = 0.5 * end / sine
    near = end <= 0.5 * math.pi
    gamma = np.where(near, end / np.where(near, 2.0 * sine * cosine, 1.0), np.maximum(end, 0.5 * math.pi))
    m = math.ceil(order)
    first = m * kappa + gamma + end + abs(order)
    change = m * (kappa + kappa * kappa) + gamma + gamma * gamma + end
    made: Array = (first * first + change) * elementary.exp(first * step)
    return made
