"""Stability and l1 norms of the truncated recursion v + Σ a_j v_{k−j} = p.

With A(z) = 1 + Σ a_j z^−j and g the first N samples of 1/A, the residual A g − 1 has some l1 norm ρ. If ρ < 1
then 1/A = g / (1 + residual) is absolutely summable (Wiener), the recursion is stable, and

    ‖1/A‖₁ ≤ ‖g‖₁ / (1 − ρ),      ‖B/A‖₁ ≤ ‖B g‖₁ + ‖B‖₁ ‖1/A‖₁ ρ.

These hold for every bounded input, from any bounded history, and they are what ranges and error bounds rest
on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import fftconvolve

from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.plan.canonical import Tables
from focgen.plan.canonical import tables as fold

_LONGEST = 1 << 18
_WANTED = 1e-6  # residual at which a longer inverse gains nothing
_SLACK = 1.0 + 1e-6  # over the rounding of the transforms


@dataclass(frozen=True)
class Inverse:
    """A finite inverse of a stable recursion. ``response`` is g; ``residual`` is ρ; ``norm`` ≥ ‖1/A‖₁."""

    response: np.ndarray
    residual: float
    norm: float

    def norm_after(self, numerator: np.ndarray) -> float:
        """Bound on ‖B/A‖₁ for the numerator's weights, shape (taps,)."""
        own = float(np.abs(fftconvolve(numerator, self.response)).sum())
        return (own + float(np.abs(numerator).sum()) * self.norm * self.residual) * _SLACK


def inverse(coefficients: np.ndarray) -> Inverse | None:
    """Invert 1 + Σ a_j z^−j, given as (1, a_1, …); None where it is not, or not provably, stable."""
    coefficients = np.asarray(coefficients, dtype=float)
    count, best = max(1024, _power_of_two(4 * len(coefficients))), None
    while count <= max(_LONGEST, 4 * len(coefficients)):
        best = _attempt(coefficients, count) or best
        if best is not None and best.residual < _WANTED:
            break
        count *= 4
    return best


def _power_of_two(count: int) -> int:
    return 1 << (count - 1).bit_length()


def _attempt(coefficients: np.ndarray, count: int) -> Inverse | None:
    response = _series_inverse(coefficients, count)
    if response is None:
        return None
    product = fftconvolve(coefficients, response)
    product[0] -= 1.0
    residual = float(np.abs(product).sum())
    if not residual < 0.9:
        return None
    return Inverse(response, residual, float(np.abs(response).sum()) / (1.0 - residual) * _SLACK)


def _series_inverse(coefficients: np.ndarray, count: int) -> np.ndarray | None:
    """The first ``count`` samples of 1/A by Newton's iteration; None where they grow beyond reason."""
    inverse_ = np.array([1.0 / coefficients[0]])
    while len(inverse_) < count:
        size = min(2 * len(inverse_), count)
        error = fftconvolve(coefficients[:size], inverse_)[:size]
        error[0] -= 1.0
        inverse_ = (
            np.concatenate([inverse_, np.zeros(size - len(inverse_))]) - fftconvolve(inverse_, error)[:size]
        )
        if not np.abs(inverse_).max() < 1e9:
            return None
    return inverse_


def check_stable(controller: Controller, tables: Tables, length: int) -> None:
    """Raise PlanError where the truncated recursion is unstable, naming a memory length that works."""
    if tables.feedback is None or inverse(tables.feedback.weights) is not None:
        return
    works = next((n for n in _longer(length) if _stable_at(controller, n)), None)
    remedy = (
        f"use a length of {works}"
        if works
        else "check the signs of den: no longer memory was found to be stable"
    )
    raise PlanError(controller.name, f"the recursion cut off at length {length} is unstable", remedy)


def _longer(length: int):
    """Lengths to try: up in octaves, then down."""
    up = [length << n for n in range(1, 12) if length << n <= 1 << 16]
    return up + [length >> n for n in range(1, 12) if length >> n >= 1]


def _stable_at(controller: Controller, length: int) -> bool:
    return inverse(fold(controller, length).feedback.weights) is not None
