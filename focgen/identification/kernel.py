"""Responses of e^(−Ls)/((τ s)^α + 1) to a step, with their derivatives in log τ and α, at every sample at
once.

Each is inverted from its own Laplace transform, so the derivatives are as exact as the response. For α > 1
the pair of poles p = e^{±iπ/α}/τ leaves the negative real axis and is taken out in closed form.

With S the step response and h the sample time, an input that does this in the sample 0 … 1 answers m samples
after its begin with

    a jump at 0                      S(m)
    a straight rise to 1             ∫₀¹ S(m − x) dx                  "means"
    a bend x (x − 1)                 ∫₀¹ S(m − x) (2x − 1) dx         "bends"
    a bend x (x − 1)(2x − 1)         ∫₀¹ S(m − x) (6x² − 6x + 1) dx   "twists"

Far from their begin the last two are the first and second derivative of S, over 6 and 60.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex
from focgen.fractional.contour import TOLERATED, inverse_laplace
from focgen.fractional.loggrid import DIRECT, log_grid

_GAUSS = np.polynomial.legendre.leggauss(5)
_WEIGHTS: dict[str, Callable[[Array], Any]] = {  # of S(m − x) over the sample, as functions of x
    "means": lambda x: 1.0,
    "bends": lambda x: 2.0 * x - 1.0,
    "twists": lambda x: 6.0 * x * x - 6.0 * x + 1.0,
}


class Kernels:
    """The kernels for ``count`` samples of ``step`` s and a ``delay`` ≥ 0 in s, each made when it is asked
    for.

    Rows: the response, its derivatives in log τ and α. ``steps`` at 0, h, … and ``means``, ``bends``,
    ``twists`` at h, 2h, …, each (3, count); ``late``: whole samples by which all of it is still to be
    delayed.
    """

    def __init__(self, log_tau: float, alpha: float, step: float, count: int, delay: float = 0.0) -> None:
        self._at, self.count = (log_tau, alpha, step), count
        self.late = math.floor(delay / step)
        self._part = delay / step - self.late

    @cached_property
    def steps(self) -> Array:
        """The response (n,) to a step at every sample."""
        return _steps(*self._at, self.count, self._part)

    @cached_property
    def means(self) -> Array:
        """The response (n,) to a straight line over one sample."""
        return _means(*self._at, self.count, self._part)

    @cached_property
    def bends(self) -> Array:
        """The response (n,) to what a line's bend adds within one sample."""
        return self._curved[0]

    @cached_property
    def twists(self) -> Array:
        """The response (n,) to what its twist adds."""
        return self._curved[1]

    @cached_property
    def _curved(self) -> tuple[Array, Array]:
        return _curved(*self._at, self.means, self._part)


@lru_cache(maxsize=3)
def kernels(log_tau: float, alpha: float, step: float, count: int, delay: float = 0.0) -> Kernels:
    """The :class:`Kernels`, kept for the next call."""
    return Kernels(log_tau, alpha, step, count, delay)


def _steps(log_tau: float, alpha: float, step: float, count: int, part: float) -> Array:
    """S at (j − part) h, j = 0 … count − 1; 0 ahead of 0."""
    grid = log_grid(max(count - 1, 1))
    values = _inverted(log_tau, alpha, (np.concatenate([grid.head, grid.tail]) - part) * step, lambda s: 1.0)
    out = np.zeros((3, count))
    for row, value in zip(out, values):
        row[1:] = grid.spread(value[: len(grid.head)], value[len(grid.head) :])[: count - 1]
    if _pole_counts(alpha):
        out[:, 1:] += _oscillation(log_tau, alpha, step * (np.arange(1, count) - part))
    return out


def _means(log_tau: float, alpha: float, step: float, count: int, part: float) -> Array:
    grid = log_grid(count)
    integrals = _inverted(log_tau, alpha, (grid.head - part) * step, lambda s: 1.0 / s)
    heads = np.diff(integrals, prepend=0.0) / step
    # beyond the first samples the contour bears the growth of e^{-sh}
    tails = _inverted(log_tau, alpha, (grid.tail - part) * step, lambda s: -np.expm1(-s * step) / (s * step))
    out = np.array([grid.spread(head, tail) for head, tail in zip(heads, tails)])
    if _pole_counts(alpha):
        out += _swung(log_tau, alpha, step, count, part, "means")
    return out


def _curved(log_tau: float, alpha: float, step: float, means: Array, part: float) -> tuple[Array, Array]:
    """Bends and twists: exact for the first samples, by differences of the means beyond."""
    ahead = np.pad(means, ((0, 0), (1, 1)), mode="edge")
    bends = (ahead[:, :-2] - ahead[:, 2:]) / 12.0
    twists = (ahead[:, :-2] - 2.0 * means + ahead[:, 2:]) / 60.0
    first = min(DIRECT, means.shape[1])
    places = (np.arange(1, first + 1) - part) * step
    once, twice, thrice = (
        np.pad(_inverted(log_tau, alpha, places, partial(_integrated, k)) / step**k, ((0, 0), (1, 0)))
        for k in (1.0, 2.0, 3.0)
    )  # repeated integrals of S, at the ends of each sample
    bends[:, :first] = -_sum(once) + 2.0 * np.diff(twice)
    twists[:, :first] = np.diff(once) - 6.0 * _sum(twice) + 12.0 * np.diff(thrice)
    if _pole_counts(alpha):
        bends[:, :first] += _swung(log_tau, alpha, step, first, part, "bends")
        twists[:, :first] += _swung(log_tau, alpha, step, first, part, "twists")
    return bends, twists


def _sum(values: Array) -> Array:
    return values[:, 1:] + values[:, :-1]


def _pole_counts(alpha: float) -> bool:
    return math.pi - math.pi / alpha > TOLERATED


def _pole(log_tau: float, alpha: float) -> tuple[complex, complex, complex]:
    """The upper pole and its derivatives in log τ and α."""
    pole = np.exp(1j * math.pi / alpha - log_tau)
    return pole, -pole, pole * (-1j * math.pi / alpha**2)


def _integrated(times: float, s: Complex) -> Complex:
    return s**-times


def _inverted(log_tau: float, alpha: float, t: Array, factor: Callable[[Complex], Any]) -> Array:
    """Invert the three transforms times ``factor(s)`` at ``t``, the poles' share taken out; shape (3, n)."""
    removed = np.array([_pole(log_tau, alpha)[0]]) if _pole_counts(alpha) else None
    known: list[tuple[Any, ...]] = []  # the three are inverted on the same places

    def image(which: int) -> Callable[[Complex], Complex]:
        def transform(s: Complex) -> Complex:
            if not known:
                known.append(tuple(part * factor(s) for part in _images(s, log_tau, alpha)))
            made: Complex = known[0][which]
            return made

        return transform

    if not len(t):
        return np.empty((3, 0))
    return np.array([inverse_laplace(image(which), t, removed) for which in range(3)])


def _images(s: Complex, log_tau: float, alpha: float) -> tuple[Any, Any, Any]:
    log = np.log(s) + log_tau
    power = np.exp(alpha * log)
    response = 1.0 / (s * (1.0 + power))
    common = -power / (1.0 + power) * response
    images = response, alpha * common, log * common
    if not _pole_counts(alpha):
        return images
    found = (whole - polar for whole, polar in zip(images, _polar_images(s, log_tau, alpha)))
    first, second, third = found
    return first, second, third


def _polar_images(s: Complex, log_tau: float, alpha: float) -> tuple[Any, ...]:
    """The poles' share −(1/α)/(s − p) + conjugate, and its derivatives."""
    total: list[Any] = [0.0, 0.0, 0.0]
    for pole, by_log_tau, by_alpha in (_pole(log_tau, alpha), np.conj(_pole(log_tau, alpha))):
        single = 1.0 / (s - pole)
        double = single**2
        total[0] += -single / alpha
        total[1] += -by_log_tau / alpha * double
        total[2] += single / alpha**2 - by_alpha / alpha * double
    return tuple(total)


def _swung(log_tau: float, alpha: float, step: float, count: int, part: float, kind: str) -> Array:
    """The poles' share of a kind of kernel, (3, count): its weighted mean over each sample."""
    ends = np.arange(1, count + 1) - part
    begins = np.maximum(ends - 1.0, 0.0)
    total = np.zeros((3, count))
    for place, weight in zip(*_GAUSS):
        at = begins + 0.5 * (ends - begins) * (place + 1.0)
        share = 0.5 * weight * (ends - begins) * _WEIGHTS[kind](ends - at)
        total += share * _oscillation(log_tau, alpha, step * at)
    return total


def _oscillation(log_tau: float, alpha: float, t: Array) -> Array:
    """The poles' share at ``t``; shape (3, n)."""
    pole, by_log_tau, by_alpha = _pole(log_tau, alpha)
    single = np.exp(pole * t)
    double = t * single
    rows = (-single / alpha, -by_log_tau / alpha * double, single / alpha**2 - by_alpha / alpha * double)
    return 2.0 * np.array(rows).real
