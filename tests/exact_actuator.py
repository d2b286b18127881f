"""Logs of K(p) p through e^(−Ls)/(T s^α + 1), exact at every sample: truth for the identification.

A power t^m/m! answers by t^m (1/m! − E_{α,m+1}(−t^α/T)), and e^(−ct) by Gauss–Legendre quadrature of the
convolution with the impulse response, sample for sample; in the first one v = t^α takes the singularity at 0
away. Nothing here is shared with the identification.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from focgen.fractional.responses import mittag_leffler
from focgen.logs.experiment import Experiment

T, ALPHA, GAIN = 1.32, 0.6, (0.0015, 0.345)
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS


@dataclass(frozen=True)
class Truth:
    """K(p) = gain[0] + gain[1] p, T in s^alpha, dead time in s."""

    T: float = T
    alpha: float = ALPHA
    gain: tuple[float, ...] = GAIN
    delay: float = 0.0

    def K(self, p: float) -> float:
        return sum(g * p**m for m, g in enumerate(self.gain))


def power_answer(t: np.ndarray, m: int, of: Truth = Truth()) -> np.ndarray:
    """The answer (n,) at times ``t`` (n,) in s to t^m/m! that sets in at 0, a step or a ramp."""
    answer, after = np.zeros(len(t)), t > 1e-9
    late = t[after]
    answer[after] = late**m * (
        1.0 / math.factorial(m) - mittag_leffler(of.alpha, m + 1.0, -(late**of.alpha) / of.T)
    )
    return answer


@cache
def decay_answer(
    rate: complex, step: float, count: int, of: Truth = Truth(), late: float = 0.0
) -> np.ndarray:
    """The answer (count,) at ``late`` + 0, h, 2h, … to e^(−rate t) that sets in at 0; 0 ≤ ``late`` < h, s."""
    alpha, T = of.alpha, of.T
    impulse = lambda v: mittag_leffler(alpha, alpha, -v / T) / (T * alpha)
    ends = late + step * np.arange(count)
    first = 0 if late else 1
    answer = np.zeros(count, complex if isinstance(rate, complex) else float)
    held = lambda v: impulse(v) * np.exp(-rate * (ends[first] - v ** (1.0 / alpha)))
    answer[first] = _on_halves(held, ends[first] ** alpha)
    times = ends[first:-1, None] + step * _POINTS
    h = impulse((times**alpha).ravel()).reshape(times.shape) * alpha * times ** (alpha - 1.0)
    for n, part in enumerate(step * (h * np.exp(-rate * step * (1.0 - _POINTS))) @ _WEIGHTS, first + 1):
        answer[n] = np.exp(-rate * step) * answer[n - 1] + part
    return answer


def _on_halves(function, end: float) -> complex:
    """The integral from 0 to ``end``, on parts that halve towards 0, where the integrand is not smooth."""
    edges = end * np.r_[0.0, 0.5 ** np.arange(30, -1, -1)]
    widths = np.diff(edges)
    places = edges[:-1, None] + widths[:, None] * _POINTS
    return np.sum(widths * (function(places.ravel()).reshape(places.shape) @ _WEIGHTS))


def decaying(
    parts: dict[complex, complex], t: np.ndarray, of: Truth = Truth()
) -> tuple[np.ndarray, np.ndarray]:
    """Pressure Σ c e^(−rate t) from t = 0 on, 0 ahead, and its answer, both (n,) at uniform times ``t``."""
    drive: dict[complex, complex] = {0.0: 0.0j}
    for m, gain in enumerate(of.gain, 1):
        for chosen in itertools.product(parts.items(), repeat=m):
            rate = sum(rate for rate, _ in chosen)
            drive[rate] = drive.get(rate, 0.0) + gain * math.prod(c for _, c in chosen)
    value = lambda at: sum(c * np.exp(-rate * at) for rate, c in parts.items())
    pressure = np.where(t >= -1e-9, value(np.maximum(t, 0.0)), 0.0).real
    step, late = t[1] - t[0], t - of.delay
    begin = int(np.argmax(late > -1e-9))
    part = max(float(late[begin]), 0.0)
    part = 0.0 if part < 1e-9 else part
    answer = np.zeros(len(t))
    answer += drive.pop(0.0, 0.0).real * power_answer(late, 0, of)
    for rate, c in drive.items():
        answer[begin:] += (c * decay_answer(rate, round(step, 12), len(t) - begin, of, round(part, 12))).real
    return pressure, answer


def rise(level: float, tau: float, t: np.ndarray, of: Truth = Truth()) -> tuple[np.ndarray, np.ndarray]:
    """A pressure that rises to ``level`` with time constant ``tau`` in s, and the answer; a step where it is
    0."""
    if tau == 0.0:
        return level * (t >= -1e-9), of.K(level) * level * power_answer(t - of.delay, 0, of)
    return decaying({0.0: level, 1.0 / tau: -level}, t, of)


def straight(
    knots: list[tuple[float, float]], t: np.ndarray, of: Truth = Truth()
) -> tuple[np.ndarray, np.ndarray]:
    """A pressure in straight lines through ``knots`` (s, pressure), at rest before the first and after the
    last, and the answer beyond that rest; two knots at one time are a jump. K(p) is a line."""
    pressure, answer = np.full(len(t), float(knots[0][1])), np.zeros(len(t))
    p, slope = knots[0][1], 0.0
    for i, (when, q) in enumerate(knots):
        new = 0.0
        if i + 1 < len(knots) and knots[i + 1][0] > when:
            new = (knots[i + 1][1] - q) / (knots[i + 1][0] - when)
        before, after = _derivatives(p, slope, of), _derivatives(q, new, of)
        for m, change in enumerate(after - before):
            if change:
                answer += change * power_answer(t - when - of.delay, m, of)
        pressure = np.where(t >= when - 1e-9, q + new * (t - when), pressure)
        p, slope = (q if new == 0.0 else knots[i + 1][1]), new
    return pressure, answer


def _derivatives(p: float, slope: float, of: Truth) -> np.ndarray:
    """K(p) p and its first two derivatives in time, where p rises by ``slope``."""
    a, b = (*of.gain, 0.0)[:2]
    return np.array([(a + b * p) * p, (a + 2.0 * b * p) * slope, 2.0 * b * slope**2])


def log_of(
    name: str, t: np.ndarray, made: tuple[np.ndarray, np.ndarray], noise=(0.0, 0.0), rng=None, **signals
) -> Experiment:
    """The pressure and curvature of ``made``; white ``noise`` on each, as a share of their largest."""
    pressure, curvature = made
    if rng is not None:
        pressure = pressure + noise[0] * np.abs(pressure).max() * rng.normal(size=len(t))
        curvature = curvature + noise[1] * np.abs(curvature).max() * rng.normal(size=len(t))
    step = float(t[1] - t[0])
    return Experiment(
        name, step, {"pressure": pressure, "curvature": curvature, "output": curvature, **signals}
    )
