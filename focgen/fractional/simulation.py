"""Simulators of sampled signals: eq. (10) as the paper writes it, and a convolution without its bias."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft, signal

from focgen.arrays import Array
from focgen.fractional.contour import inverse_laplace
from focgen.fractional.decomposition import StepImage, step_image
from focgen.fractional.delay import split_delay
from focgen.fractional.loggrid import log_grid
from focgen.fractional.transfer import Polynomial, TransferFunction
from focgen.fractional.weights import gl_weights


class Simulator(Protocol):
    """What turns a sampled input into a sampled output, from rest."""

    def run(self, u: ArrayLike) -> Array:
        """Return the output at the instants of the input samples ``u``, shape (n,) -> (n,)."""


class Convolution:
    """The exact response to a sampled input, O(n log n).

    ``hold`` says what the input does between its samples: "zero" keeps the last one (zero-order hold),
    "linear" joins them by straight lines. Before the first sample everything rests at 0; the input then
    jumps to it. ``step`` is the sampling interval in s; the response comes later by any ``delay`` ≥ 0 s.
    Raises ValueError for an improper transfer function (from ``run``), a step that is not positive, or an
    unknown hold.
    """

    def __init__(
        self,
        transfer: TransferFunction,
        step: float,
        hold: Literal["zero", "linear"] = "zero",
        delay: float = 0.0,
    ) -> None:
        if not 0.0 < step < np.inf:
            raise ValueError(f"the step is {step} s, it must be positive")
        if hold not in ("zero", "linear"):
            raise ValueError(f"the hold is {hold!r}, it must be 'zero' or 'linear'")
        self.transfer, self.step, self.hold, self.delay = transfer, step, hold, delay
        self._kernel = self._first = np.empty(0)

    def run(self, u: ArrayLike) -> Array:
        """Return the output at the instants of the input samples ``u``, shape (n,) -> (n,), from rest.

        Raises ValueError where the input is no row of samples.
        """
        row = _signal(u)
        if len(row) > len(self._kernel):
            self._prepare(len(row))
        y = _product(self._kernel[: len(row)], row)
        if self.hold == "linear" and len(row):
            y += row[0] * self._first[: len(row)]
        return y

    def _prepare(self, count: int) -> None:
        image = step_image(self.transfer, self.step * count)
        whole, part = split_delay(self.delay, self.step)
        # the instants fall on ``begin`` behind those of the undelayed response, ``whole`` samples earlier
        whole, begin = (whole + 1, (1.0 - part) * self.step) if part else (whole, 0.0)
        steps = _later(_steps(image, self.step, count, begin), whole)
        if self.hold == "zero":
            self._kernel = np.diff(steps, prepend=0.0)
            return
        # means over [(j−1)h, jh]: a line between samples is a stack of ramps, which these differentiate
        means = _means(image, self.step, count, begin)
        first = _first_mean(image, self.step, begin) if begin else 0.0
        means = _later(np.concatenate([[first], means]), whole)
        self._kernel = np.diff(means)
        self._first = steps - means[1:]


def _signal(u: ArrayLike) -> Array:
    row: Array = np.asarray(u, dtype=float)
    if row.ndim != 1:
        raise ValueError(f"the input has {row.ndim} dimensions, it must be one row of samples")
    return row


def _later(values: Array, whole: int) -> Array:
    """Return ``values`` (n,) moved back by ``whole`` places, zeros before them."""
    whole = min(whole, len(values))
    return np.concatenate([np.zeros(whole), values[: len(values) - whole]])


def _steps(image: StepImage, step: float, count: int, begin: float = 0.0) -> Array:
    """Return the step response at ``begin``, ``begin`` + h, …, shape (count,)."""
    out = np.zeros(count)
    for chain in image.chains:
        out += chain.samples(step, count, begin)
    if image.remainder is not None and count > 1:
        grid = log_grid(count - 1)
        places = np.concatenate([grid.head, grid.tail])
        values = inverse_laplace(image.remainder, places * step + begin, image.poles)
        out[1:] += grid.spread(values[: len(grid.head)], values[len(grid.head) :])
    if begin == 0.0:
        out[0] = image.feedthrough
    elif image.remainder is not None:
        out[0] += inverse_laplace(image.remainder, np.array([begin]), image.poles)[0]
    return out


def _means(image: StepImage, step: float, count: int, begin: float = 0.0) -> Array:
    """Return the step response's means over ``begin`` + [(j−1)h, jh], j = 1 … count, shape (count,)."""
    out = np.zeros(count)
    for chain in image.chains:
        out += chain.means(step, count, begin)
    if image.remainder is not None:
        grid = log_grid(count)
        head = _head_means(image, step, len(grid.head), begin)
        out += grid.spread(head, _tail_means(image, step, grid.tail * step + begin))
    return out


def _first_mean(image: StepImage, step: float, end: float) -> float:
    """Return the step response's integral over [0, ``end``], by h."""
    polar = sum(float(chain.means(end, 1)[0]) for chain in image.chains) * end / step
    return polar + (0.0 if image.remainder is None else float(_integrals(image, np.array([end]))[0]) / step)


def _remainder(image: StepImage) -> Callable[[Array], Array]:
    """What no pole makes; asked for only where there is something."""
    assert image.remainder is not None
    return image.remainder


def _integrals(image: StepImage, t: Array) -> Array:
    """Return the integral of what no pole makes, from 0 to the times ``t`` (s)."""

    def integral(s: Array) -> Array:
        values: Array = _remainder(image)(s) / s
        return values

    return inverse_laplace(integral, t, image.poles)


def _head_means(image: StepImage, step: float, count: int, begin: float) -> Array:
    ends = step * np.arange(1.0, count + 1.0) + begin
    before = _integrals(image, np.array([begin]))[0] if begin else 0.0
    return np.diff(_integrals(image, ends), prepend=before) / step


def _tail_means(image: StepImage, step: float, times: Array) -> Array:
    def mean(
        s: Array,
    ) -> Array:  # (1 − e^{−sh})/(sh): beyond the first samples the contour bears its growth
        made: Array = _remainder(image)(s) * -np.expm1(-s * step) / (s * step)
        return made

    return inverse_laplace(mean, times, image.poles)


def _product(kernel: Array, u: Array) -> Array:
    """Return the first len(u) values of their convolution."""
    n = len(u)
    size = fft.next_fast_len(2 * n, real=True)
    made: Array = fft.irfft(fft.rfft(kernel, size) * fft.rfft(u, size), size)[:n] if n else u.copy()
    return made


class GrunwaldLetnikov:
    """Eq. (10): the transfer function with every power of s replaced by its Grünwald–Letnikov sum.

    Each sum remembers the past samples j = 1 … ``length``, or all where it is None. ``step`` is h in s. The
    first input sample counts in full, as the paper writes it. The result is biased by O(h) near jumps, and
    at rest by the short memory (:func:`focgen.fractional.weights.short_memory_bias`).
    Raises ValueError for an improper transfer function, a step that is not positive, a length below 1, or
    where the sum of the leading coefficients A_i vanishes.
    """

    _PLAIN = 512  # weights up to which the plain recursion is quicker

    def __init__(self, transfer: TransferFunction, step: float, length: int | None = None) -> None:
        if not 0.0 < step < np.inf:
            raise ValueError(f"the step is {step} s, it must be positive")
        if length is not None and length < 1:
            raise ValueError(f"the memory length is {length}, it must be at least 1")
        if not transfer.is_proper:
            raise ValueError("the transfer function is improper")
        self.transfer, self.step, self.length = transfer, step, length

    def coefficients(self, count: int) -> tuple[Array, Array]:
        """Return Σ B_i w_{j,i+n+1} and Σ A_i w_{j,i} for j = 0 … min(count, length), eq. (10)–(14)."""
        count = count if self.length is None else min(count, self.length)
        num, den = (gl_operator(terms, self.step, count) for terms in (self.transfer.num, self.transfer.den))
        if den[0] == 0.0:
            raise ValueError("the sum of the leading coefficients A_i is zero at this step")
        return num, den

    def run(self, u: ArrayLike) -> Array:
        """Return the output at the instants of the input samples ``u``, shape (n,) -> (n,), from rest.

        Raises ValueError where the input is no row of samples.
        """
        row = _signal(u)
        if not len(row):
            return row.copy()
        num, den = self.coefficients(len(row) - 1)
        if len(den) <= self._PLAIN:
            return np.asarray(signal.lfilter(num, den, row))
        padded = np.zeros((2, len(row)))
        padded[0, : len(num)], padded[1, : len(den)] = num, den
        return divided(_product(padded[0], row), padded[1])


def gl_operator(terms: Polynomial, step: float, length: int) -> Array:
    """Return the coefficients c_0 … c_L of Σ aᵢ s^αᵢ as one Grünwald–Letnikov sum, shape (length + 1,).

    ``step`` is h in s. Raises ValueError for orders beyond ±100, as :func:`gl_weights` does.
    """
    total = np.zeros(length + 1)
    for term in terms:
        total += term.coefficient * step**-term.order * gl_weights(term.order, length)
    return total


def divided(right: Array, den: Array) -> Array:
    """Solve Σ_j den_j y_{k−j} = right_k, both of shape (n,), the past entering by blocks of doubling size.

    Unlike a power series inverse it amplifies rounding no more than the plain recursion does.
    """
    y, block = right.copy(), GrunwaldLetnikov._PLAIN
    for start in range(0, len(y), block):
        stop = min(start + block, len(y))
        y[start:stop] = signal.lfilter([1.0], den[:block], y[start:stop])
        done = stop // block
        reach = block * (done & -done)  # the largest block that has just been completed
        if stop < len(y):
            y[stop : stop + reach] -= _carried(y[stop - reach : stop], den, len(y) - stop)
    return y


def _carried(past: Array, den: Array, remaining: int) -> Array:
    """Return what the block ``past`` contributes to as many samples after it."""
    reach = len(past)
    ahead = min(reach, remaining)
    size = fft.next_fast_len(2 * reach, real=True)
    kernel = den[: 2 * reach]
    made: Array = fft.irfft(fft.rfft(past, size) * fft.rfft(kernel, size), size)
    return made[reach : reach + ahead]
