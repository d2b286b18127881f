"""Modes whose frequency response follows (jθ)^α over a band, θ = ωh in rad per sample.

The response is (1 − z⁻¹)^m (c₀ + z⁻¹ Σ c_i / (1 − p_i z⁻¹)) at z = e^{jθ}; over (jθ)^α it is compared with 1.
Rates of the poles move on a logarithmic scale by Gauss and Newton's method, c₀ and the c_i follow by least
squares. Weight is shifted to where the error is largest (Lawson's rule), so that the largest error falls.
Above the band the response is only held back: it weighs ``above`` there, which trades error in
the band for moderate growth beyond. Two poles that meet would need huge weights of opposite signs; a fixed
point could not hold them, so neighbours keep a distance.

All of it is computed by :mod:`focgen.fractional.elementary`, the same on every machine. A complex number is
an array's first axis: real part, imaginary part.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Array
from focgen.fractional import elementary

_DENSITY, _BEYOND = 14, 32  # points in the band per factor of e; points above it
_DISTANCE = 0.5  # of neighbouring log rates, at least
_FASTEST = 1.0986122886681098  # log 3: of rates −ln p
_ROUNDS, _SETTLING, _TRIES = 40, 6, 5
_LONGEST_STEP = 0.5
_LAWSONS = 40


@dataclass(frozen=True)
class Band:
    """The lines of frequency that a fit looks at, for D^``order``; ``low`` and ``high`` in rad per sample."""

    order: float
    low: float
    high: float

    @property
    def differences(self) -> int:
        """m, the order rounded up."""
        return math.ceil(self.order)

    @functools.cached_property
    def count(self) -> int:
        """How many points lie in the band."""
        return math.ceil(_DENSITY * float(elementary.log(self.high / self.low))) + 1

    @functools.cached_property
    def points(self) -> Array:
        """θ, those in the band first, then those above it up to π."""
        return np.concatenate(
            [
                spread(self.low, self.high, self.count),
                spread(self.high, math.pi, _BEYOND + 1)[1:],
            ]
        )

    @functools.cached_property
    def lines(self) -> Lines:
        """What every basis function has in common at the points."""
        return Lines(self.order, self.points)


class Lines:
    """1 − z⁻¹, and with it the lead (1 − z⁻¹)^m / (jθ)^α, at the angles ``theta`` in (0, π]."""

    def __init__(self, order: float, theta: Array) -> None:
        sine, cosine = elementary.sine_cosine(0.5 * theta)
        self.departure = np.stack([2.0 * sine * sine, 2.0 * sine * cosine])
        self.delay = np.stack([1.0 - self.departure[0], -self.departure[1]])
        lead = power_of(-order, theta)
        for _ in range(math.ceil(order)):
            lead = _product(lead, self.departure)
        self.lead = lead
        self.late = _product(lead, self.delay)

    def basis(self, rates: Array) -> Array:
        """The lead and every mode, over (jθ)^α: shape (1 + n, 2, points)."""
        return np.concatenate([self.lead[None], _over(self.late, self._slow(rates))])

    def by_rate(self, rates: Array) -> Array:
        """The modes' derivatives by their rates, shape (n, 2, points)."""
        slow = self._slow(rates)
        return -_product(self.delay, _over(_over(self.late, slow), slow))

    def _slow(self, rates: Array) -> Array:
        """1 − p z⁻¹ without cancellation, shape (n, 2, points)."""
        q = rates[:, None]
        real = q + (1.0 - q) * self.departure[0]
        return np.stack([real, (1.0 - q) * self.departure[1]], axis=1)


def spread(low: float, high: float, count: int) -> Array:
    """Return ``count`` numbers from ``low`` to ``high``, evenly on a logarithmic scale, ends included."""
    reach = float(elementary.log(high / low))
    found = low * elementary.exp(np.arange(count) * (reach / (count - 1)))
    found[-1] = high
    made: Array = np.minimum(found, high)
    return made


def size(complex_: Array) -> Array:
    """Magnitude, of complex numbers on the axis before the last."""
    return np.sqrt(complex_[..., 0, :] * complex_[..., 0, :] + complex_[..., 1, :] * complex_[..., 1, :])


def _product(a: Array, b: Array) -> Array:
    real = a[..., 0, :] * b[..., 0, :] - a[..., 1, :] * b[..., 1, :]
    return np.stack([real, a[..., 0, :] * b[..., 1, :] + a[..., 1, :] * b[..., 0, :]], axis=-2)


def _over(a: Array, b: Array) -> Array:
    square = b[..., 0, :] * b[..., 0, :] + b[..., 1, :] * b[..., 1, :]
    return _product(a, np.stack([b[..., 0, :], -b[..., 1, :]], axis=-2)) / square[..., None, :]


def power_of(order: float, omega: Array) -> Array:
    """Return (jω)^``order`` for ω > 0 and orders in (−2, 2): real and imaginary part, shape (2, points)."""
    sine, cosine = elementary.sine_cosine(0.25 * math.pi * order)
    magnitude = elementary.exp(order * elementary.log(omega))
    return np.stack([magnitude * (1.0 - 2.0 * sine * sine), magnitude * (2.0 * sine * cosine)])


def rates_of(log_rates: Array) -> Array:
    """1 − p of poles p = exp(−e^(log_rates))."""
    return -elementary.expm1(-elementary.exp(log_rates))


class _Descent:
    """One step after another towards a smaller largest error."""

    def __init__(self, band: Band, states: int, above: float) -> None:
        self.band, self.states = band, states
        self.held_back = np.full(_BEYOND, above / math.sqrt(_BEYOND))
        self.importance = np.full(band.count, 1.0 / band.count)
        start = spread(0.7 * band.low, min(3.0 * band.high, 2.0), max(states, 2))[-states:]
        self.log_rates, self.damping = _apart(elementary.log(start)), 1e-3

    def best(self, rounds: int) -> tuple[Array, float]:
        """The log rates with the smallest largest error in the band, and that error."""
        found, smallest = self.log_rates, math.inf
        for k in range(rounds):
            self._step()
            sizes = size(self.error)[: self.band.count]
            if sizes.max() < smallest:
                found, smallest = self.log_rates, float(sizes.max())
            if k >= _SETTLING:
                self.importance = self.importance * sizes
                self.importance /= elementary.exact_sum(self.importance)
        return found, smallest

    def _step(self) -> None:
        self.root = np.concatenate([np.sqrt(self.importance), self.held_back])
        here = self._valued(self.log_rates)
        if here is None:
            return
        weights, self.error, square = here
        rates = rates_of(self.log_rates)
        inner = weights[1:] * elementary.exp(self.log_rates) * (1.0 - rates)
        moving = self.band.lines.by_rate(rates) * inner[:, None, None]
        columns = np.concatenate([self.band.lines.basis(rates), moving])
        for _ in range(_TRIES):
            step = self._newton(columns, square)
            if step is None:
                return
            there = _apart(self.log_rates + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
            tried = self._valued(there)
            if tried is not None and tried[2] < square:
                self.log_rates, self.error = there, tried[1]
                self.damping = max(0.2 * self.damping, 1e-8)
                return
            self.damping *= 5.0

    def _newton(self, columns: Array, square: float) -> Array | None:
        """Change of the log rates; damped, in units of the error that is left."""
        n = self.states
        damped = np.zeros((len(columns), n))
        damped[len(columns) - n :] = np.eye(n) * math.sqrt(self.damping * square)
        rows = np.concatenate([_rows(columns, self.root), damped], axis=1)
        right = np.concatenate([-_rows(self.error[None], self.root)[0], np.zeros(n)])
        found = _scaled_least_squares(rows, right)
        return None if found is None else found[len(columns) - n :]

    def _valued(self, log_rates: Array) -> tuple[Array, Array, float] | None:
        """The best weights for these rates, the error they leave, and its weighted square."""
        basis = self.band.lines.basis(rates_of(log_rates))
        weights = _weights(basis, self.root)
        if weights is None:
            return None
        error = _error(basis, weights)
        rows = _rows(error[None], self.root)[0]
        return weights, error, elementary.exact_sum(rows * rows)


def _apart(log_rates: Array) -> Array:
    """Rising log rates, pushed apart from their middle outwards and kept below the fastest."""
    found = log_rates.copy()
    middle = len(found) // 2
    for i in range(middle + 1, len(found)):
        found[i] = max(found[i], found[i - 1] + _DISTANCE)
    found[-1] = min(found[-1], _FASTEST)
    for i in range(len(found) - 2, -1, -1):
        found[i] = min(found[i], found[i + 1] - _DISTANCE)
    return found


def _rows(columns: Array, root: Array) -> Array:
    """Complex columns as twice as many weighted real equations: shape (columns, 2 points)."""
    return (columns * root).reshape(len(columns), -1)


def _scaled_least_squares(rows: Array, right: Array) -> Array | None:
    scale = np.abs(rows).max(axis=1)
    if not np.all(scale > 0.0):
        return None
    found = elementary.least_squares((rows / scale[:, None]).T, right)
    return None if found is None else found / scale


def _weights(basis: Array, root: Array) -> Array | None:
    goal = np.concatenate([root, np.zeros(len(root))])
    return _scaled_least_squares(_rows(basis, root), goal)


def _error(basis: Array, weights: Array) -> Array:
    """Response over (jθ)^α, less 1: shape (2, points)."""
    found = elementary.total(weights[:, None, None] * basis)
    found[0] -= 1.0
    return found


def best_rates(band: Band, states: int, above: float, rounds: int = _ROUNDS) -> tuple[Array, float]:
    """Return rates 1 − p, falling, shape (``states``,), and the largest error at the band's points.

    ``above``: what the response above the band weighs, 1e-5 … 1e-1.
    """
    log_rates, error = _Descent(band, states, above).best(rounds)
    return rates_of(log_rates[::-1]), error


def best_weights(band: Band, rates: Array, above: float) -> Array | None:
    """Return c₀ and the c_i, shape (1 + n,), that make the largest error in the band small for given
    ``rates``; None where two of these are too close to one another for that."""
    basis, held_back = band.lines.basis(rates), np.full(_BEYOND, above / math.sqrt(_BEYOND))
    importance = np.full(band.count, 1.0 / band.count)
    best, smallest = None, math.inf
    for _ in range(_LAWSONS):
        weights = _weights(basis, np.concatenate([np.sqrt(importance), held_back]))
        if weights is None:
            break
        sizes = size(_error(basis, weights))[: band.count]
        if sizes.max() < smallest:
            best, smallest = weights, float(sizes.max())
        importance = importance * sizes
        importance /= elementary.exact_sum(importance)
    return best
