"""Bounds on the error of an exponential memory that hold at every lag, and for its output.

Write g_j for the weights of (1 − z⁻¹)^(−β), h_j for the sum of exponentials, e_j = h_j − g_j and ∇ for the
backward difference. Both g and h are moments of positive measures on [0, 1], so |∇^m g_j| and |∇^m h_j| fall
with j for every m, and ∇^m g_j is itself a Grünwald–Letnikov weight, of order m − β. That makes every bound
here a finite computation:

- Between two lags a < b that are looked at, ∇^m e departs from its chord by at most (b − a)²/8 times the
  largest |∇^(m+2) e_j|, and that is at most |∇^(m+2) e_{a+2}| + (b − a) max(|∇^(m+3) g_{a+3}|,
  |∇^(m+3) h_{a+3}|). So |e| is bounded and, by the trapezoid of the absolute values, Σ |∇^m e_j|. Small lags
  are all looked at.
- Beyond any lag J, Σ |∇^m e_j| ≤ |∇^(m−1) g_J| + |∇^(m−1) h_J| (m ≥ 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array, Ints
from focgen.fractional import elementary
from focgen.fractional.weights import gl_weights_at

_HEAD = 4096  # every lag up to here
_GAPS = (3e-4, 2e-3)  # relative distance of the lags beyond: third differences weigh about 1 % of the error
_FAR = 10**4  # horizons, up to which the error beyond the horizon is followed
_ROUNDING = 3e-13  # of weights and sums, relative to the weights


@dataclass(frozen=True)
class Certificate:
    """What is certain about e_j = h_j − g_j and about the output, unit sample time, exact arithmetic.

    ``kernel``: |e_j| ≤ kernel · g_j at every lag 0 … horizon. Hence the output of an input whose m-th
    difference (m the order's integer part split off) keeps its sign, for m = 1 any input that only rises,
    has at most this relative error in every sample up to the horizon.
    ``largest``: |e_j| ≤ largest, the error of the output after a unit step (m = 1).
    ``per_unit``: Σ |∇^m e_j| over the lags up to the horizon. Whatever the input is, the output's error is at
    most this times the largest |input| of the past, as long as no more than ``horizon`` samples are past.
    ``beyond``: what the lags after the horizon can add to it, for ever; infinite for orders below 0, where
    the exact output itself is unbounded.
    """

    kernel: float
    largest: float
    per_unit: float
    beyond: float

    def output_error(self, largest_input: float, past_horizon: bool = True) -> float:
        """Return a bound on the output's error for inputs within ±``largest_input``, in units of the output.

        Times h^−α for a sample time h. ``past_horizon``: for runs of any length, not only up to the horizon.
        """
        return largest_input * (self.per_unit + (self.beyond if past_horizon else 0.0))


def certify(beta: float, differences: int, horizon: int, poles: ArrayLike, weights: ArrayLike) -> Certificate:
    """Bound the error of h_0 = 1, h_j = Σ_i weights_i · poles_i^(j−1) as the weights of (1 − z⁻¹)^(−beta).

    ``poles`` in [0, 1) and ``weights`` ≥ 0, shape (n,), any: rounded ones, too. ``differences`` is the m of
    :class:`Certificate`.
    Raises ValueError for poles or weights outside these ranges.
    """
    error = _Error(beta, np.asarray(poles, float), np.asarray(weights, float))
    head = np.arange(min(_HEAD, horizon) + 1)
    e, g = error.differences(0, head), error.exact(0, head)
    relative = float(np.max(np.abs(e) / g))
    largest, per_unit = float(np.max(np.abs(e))), elementary.l1(_differenced(e, differences))
    kernel = relative
    if horizon > _HEAD:
        grid = _lags(_HEAD, horizon, max(_cube_root(0.01 * relative), _GAPS[0]))
        sizes = error.sizes(0, grid)
        kernel = max(kernel, float(np.max(sizes / error.exact(0, grid[1:]))))
        largest = max(largest, float(np.max(sizes)))
        per_unit += error.total(differences, grid)
    per_unit += _ROUNDING * 2.0**differences * elementary.l1(g)
    beyond = _beyond(error, differences, horizon)
    return Certificate(kernel + _ROUNDING, largest + _ROUNDING, per_unit, beyond)


@dataclass(frozen=True)
class _Error:
    """e and its differences in closed form, at lags from 0 (m = 0) or beyond the first few (m > 0)."""

    beta: float
    poles: Array
    weights: Array

    def __post_init__(self) -> None:
        if not (
            np.all(self.poles >= 0.0)
            and np.all(self.poles < 1.0)
            and np.all(self.weights >= 0.0)
            and np.all(np.isfinite(self.weights))
        ):
            raise ValueError("the poles must lie in [0, 1) and the weights must not be negative")

    def exact(self, m: int, lags: Ints) -> Array:
        """∇^m g; m = −1 for sums from lag 0."""
        return gl_weights_at(m - self.beta, lags)

    def modelled(self, m: int, lags: Ints) -> Array:
        """∇^m h."""
        parts = self.weights.copy()
        for _ in range(m):
            parts *= self.poles - 1.0
        powers = elementary.powers(self.poles, np.maximum(lags - 1.0 - m, 0.0))
        values = elementary.total(parts[:, None] * powers)
        return np.where(lags == 0, 1.0, values) if m == 0 else values

    def differences(self, m: int, lags: Ints) -> Array:
        """∇^m e."""
        return self.modelled(m, lags) - self.exact(m, lags)

    def off_chord(self, m: int, grid: Ints) -> Array:
        """How far ∇^m e can depart from its chord between the lags of ``grid``, shape (len(grid) − 1,)."""
        start, length = grid[:-1], np.diff(grid)
        second = np.abs(self.differences(m + 2, start + 2))
        third = np.maximum(np.abs(self.exact(m + 3, start + 3)), np.abs(self.modelled(m + 3, start + 3)))
        return np.where(length > 1, length**2 / 8.0 * (second + length * third), 0.0)

    def sizes(self, m: int, grid: Ints) -> Array:
        """Bound |∇^m e| between the lags of ``grid``, shape (len(grid) − 1,)."""
        ends = np.abs(self.differences(m, grid))
        return np.maximum(ends[:-1], ends[1:]) + self.off_chord(m, grid)

    def total(self, m: int, grid: Ints) -> float:
        """Bound Σ |∇^m e_j| over the lags after the first of ``grid`` up to its last."""
        ends, length = np.abs(self.differences(m, grid)), np.diff(grid)
        ends = ends + _ROUNDING * np.abs(self.exact(m, grid))
        chords = 0.5 * length * (ends[:-1] + ends[1:]) + 0.5 * (ends[1:] - ends[:-1])
        return elementary.exact_sum(chords + length * self.off_chord(m, grid))


def _differenced(e: Array, m: int) -> Array:
    for _ in range(m):
        e = np.diff(e, prepend=0.0)
    return e


def _lags(first: int, last: int, gap: float) -> Ints:
    reach = float(elementary.log(last / first))
    count = math.ceil(reach / min(gap, _GAPS[1])) + 1
    between = np.rint(first * elementary.exp(np.arange(count) * (reach / (count - 1)))).astype(np.int64)
    return np.unique(np.concatenate([[first], np.clip(between, first, last), [last]]))


def _cube_root(x: float) -> float:
    return elementary.power(x, 1.0 / 3.0) if x > 0.0 else 0.0


def _beyond(error: _Error, differences: int, horizon: int) -> float:
    if differences == 0:
        return math.inf
    last = np.array([horizon * _FAR])
    rest = np.abs(error.exact(differences - 1, last)) + np.abs(error.modelled(differences - 1, last))
    return error.total(differences, _lags(horizon, int(last[0]), _GAPS[1])) + float(rest[0])
