"""Truncated Grünwald–Letnikov recursions: frequency response, stability, and their worst amplification.

The recursion Σ_j a_j y_{k−j} = v_k is stable when A(x) = Σ a_j x^j (x = z⁻¹) has no zero with |x| ≤ 1. Then
max|y| ≤ ‖1/A‖₁ max|v|, with ‖·‖₁ the sum of the absolute values of a power series' coefficients.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import fft, signal

from focgen.arrays import Array
from focgen.fractional.simulation import gl_operator
from focgen.fractional.transfer import Polynomial, TransferFunction

_UNIT = np.finfo(float).eps / 2  # relative error of one rounding
_LONGEST = 1 << 21
_RUN = 100_000_000  # products up to which a recursion is run
_SETTLED = 1e-3  # residual at which a longer inverse gains nothing worth having


class UnstableRecursion(ArithmeticError):
    """The recursion amplifies without bound; ``outside`` of its poles z are outside the unit circle."""

    def __init__(self, outside: int) -> None:
        super().__init__(f"the recursion is unstable: {outside} of its poles are outside the unit circle")
        self.outside = outside


class UnprovenStability(ArithmeticError):
    """The recursion is so close to the edge of stability that it could not be proved either way."""


def gl_frequency_response(
    transfer: TransferFunction, step: float, length: int | None, omega: ArrayLike
) -> Any:
    """Return the complex gain of eq. (10) at the angular frequencies ``omega`` (rad/s), shape of ``omega``.

    ``length`` is the memory L, None for infinite memory; ``step`` is h in s. Raises ValueError for orders
    beyond ±100.
    """
    omega = np.asarray(omega, dtype=float)
    delay = np.exp(-1j * omega * step)
    return _response(transfer.num, step, length, delay) / _response(transfer.den, step, length, delay)


def _response(terms: Polynomial, step: float, length: int | None, delay: Array) -> Array:
    if length is None:
        difference = (1.0 - delay) / step
        return sum((t.coefficient * difference**t.order for t in terms), np.zeros(delay.shape, complex))
    return np.polyval(gl_operator(terms, step, length)[::-1], delay)


def poles_outside(coefficients: ArrayLike) -> int:
    """Return how many poles of Σ_j a_j y_{k−j} = v_k are outside the unit circle, 0 where it is stable.

    The argument principle on the unit circle: between neighbouring points A changes by less than its
    absolute value (a Lipschitz bound), rounding counted in, so the number is proved.
    Raises UnprovenStability where a pole is too close to the circle, ValueError where a_0 is 0.
    """
    a = _checked(coefficients)
    lipschitz = math.fsum(np.arange(len(a)) * np.abs(a)) * (1 + 8 * _UNIT)
    rounding = 8 * _UNIT * len(a) * math.fsum(np.abs(a))
    angles, values = _on_the_circle(a)
    for _ in range(60):
        coarse = lipschitz * np.diff(angles) * (1 + 8 * _UNIT) >= np.abs(values[:-1]) - 2 * rounding
        if not coarse.any():
            turn = float(np.sum(np.angle(values[1:] / values[:-1])))
            return -round(turn / math.pi)  # the upper half, run through by e^{−iθ}: clockwise
        if coarse.sum() * len(a) > 1e8 or np.abs(values[:-1][coarse]).min() <= 4 * rounding:
            break
        between = 0.5 * (angles[:-1] + angles[1:])[coarse]
        order = np.argsort(angles := np.concatenate([angles, between]), kind="stable")
        values = np.concatenate([values, np.polyval(a[::-1], np.exp(-1j * between))])[order]
        angles = angles[order]
    raise UnprovenStability("a pole of the recursion is too close to the unit circle to tell its side")


def _checked(coefficients: ArrayLike) -> Array:
    a = np.asarray(coefficients, dtype=float)
    if a.ndim != 1 or not len(a) or a[0] == 0.0 or not np.all(np.isfinite(a)):
        raise ValueError("the coefficients of a recursion are finite and start with one that is not zero")
    return a


def _on_the_circle(a: Array) -> tuple[Array, Array]:
    size = fft.next_fast_len(max(1024, 4 * len(a)), real=True)
    size += size % 2
    return 2.0 * math.pi * np.arange(size // 2 + 1) / size, fft.rfft(a, size)


def inverse_l1_bound(coefficients: ArrayLike) -> float:
    """Return a proved upper bound of ‖1/A‖₁ for A = Σ a_j x^j: how much Σ_j a_j y_{k−j} = v_k amplifies.

    With H a finite piece of the power series 1/A and R = A H − 1, ‖R‖₁ = r < 1 proves
    ‖1/A‖₁ ≤ ‖H‖₁ / (1 − r), whatever the rounding in H; the rounding in R and the sums is added.
    Raises UnstableRecursion, UnprovenStability, or ValueError where a_0 is 0.
    """
    a = _checked(coefficients)
    outside = poles_outside(a)
    if outside:
        raise UnstableRecursion(outside)
    size, bound = 256, math.inf
    while size <= _LONGEST:
        inverse = power_series_inverse(a, size)
        total = math.fsum(np.abs(inverse)) * (1 + 2 * _UNIT)
        residual = inverse_residual(a, inverse)
        if residual < 0.5:
            bound = min(bound, float(total / (1.0 - residual) * (1 + 8 * _UNIT)))
        if residual <= _SETTLED:
            break
        size *= 2
    if math.isinf(bound):
        raise UnprovenStability(f"{_LONGEST} samples do not suffice to bound the recursion's amplification")
    return bound


def power_series_inverse(a: Array, count: int) -> Array:
    """Return the first ``count`` coefficients of 1/A, about.

    By running the recursion; where that would take too long by Newton's iteration H ← H (2 − A H), whose
    rounding is that of its largest number and grows with the square of ‖1/A‖₁.
    """
    if len(a) * count <= _RUN:
        return np.asarray(signal.lfilter([1.0], a, np.eye(1, count)[0]))
    inverse = np.array([1.0 / a[0]])
    while len(inverse) < count:
        size = min(2 * len(inverse), count)
        correction = np.zeros(size)
        product = signal.fftconvolve(a[:size], inverse)[:size]
        correction[: len(product)] = -product
        correction[0] += 2.0
        inverse = signal.fftconvolve(inverse, correction)[:size]
    return inverse


def inverse_residual(a: Array, inverse: Array) -> float:
    """Return an upper bound of ‖A H − 1‖₁, H being a power series' first coefficients."""
    product = signal.fftconvolve(a, inverse)
    product[0] -= 1.0
    # A transform of size n errs by less than ~7 u log2(n) of its 2-norm (Higham, Accuracy and Stability of
    # Numerical Algorithms, theorem 24.2); three of them, in every entry, with a factor 3 in hand.
    size = 2 * len(product)
    per_entry = 64 * _UNIT * math.log2(size) * np.linalg.norm(a) * np.linalg.norm(inverse)
    return (math.fsum(np.abs(product)) + len(product) * per_entry + _UNIT) * (1 + 8 * _UNIT)


def shortest_stable_length(
    transfer: TransferFunction, step: float, at_least: int = 1, limit: int = 1 << 16
) -> int | None:
    """Return a memory length L ≥ ``at_least`` at which eq. (10) is stable, about the shortest; else None.

    Lengths are doubled up to ``limit``, then halved back; the returned one is proved stable. ``step`` is h
    in s.
    """
    length = unstable = at_least
    while not _is_stable(transfer, step, length):
        if length >= limit:
            return None
        length, unstable = min(2 * length, limit), length
    while length - unstable > 1:
        middle = (length + unstable) // 2
        length, unstable = (middle, unstable) if _is_stable(transfer, step, middle) else (length, middle)
    return length


def _is_stable(transfer: TransferFunction, step: float, length: int) -> bool:
    try:
        return poles_outside(gl_operator(transfer.den, step, length)) == 0
    except UnprovenStability:
        return False
