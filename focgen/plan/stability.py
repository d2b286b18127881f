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
from scipy.signal import fftconvolve, lfilter

from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.fractional.discrete import UnprovenStability, poles_outside, shortest_stable_length
from focgen.fractional.transfer import TransferFunction
from focgen.plan.canonical import Tables, realise

_LONGEST = 1 << 18
_WANTED = 1e-6  # residual at which a longer inverse gains nothing
_BY_RECURSION = 300_000_000  # products
_GROWN = 1e9
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
    """The first ``count`` samples of 1/A; None where they grow beyond reason."""
    if len(coefficients) * count <= _BY_RECURSION:
        with np.errstate(over="ignore", invalid="ignore"):
            response = lfilter([1.0], coefficients, np.eye(1, count)[0])
        return response if np.abs(response).max() < _GROWN else None
    return _newton(coefficients, count)


def _newton(coefficients: np.ndarray, count: int) -> np.ndarray | None:
    """Newton's iteration for a power series, which doubles the samples that are right."""
    response = np.array([1.0 / coefficients[0]])
    while len(response) < count:
        known, size = len(response), min(2 * len(response), count)
        error = fftconvolve(coefficients[:size], response)[:size]
        error = np.pad(error, (0, size - len(error)))
        error[:known] = 0.0
        response = np.concatenate([response, -fftconvolve(response, error)[known:size]])
        if not np.abs(response).max() < _GROWN:
            return None
    return response


def check_stable(controller: Controller, tables: Tables, length: int) -> None:
    """Raise PlanError where the truncated recursion is unstable, naming a memory length that works."""
    if tables.feedback is None or inverse(tables.feedback.weights) is not None:
        return
    try:
        outside = poles_outside(tables.feedback.weights)
    except UnprovenStability:
        outside = 0
    if not outside:
        what = "the recursion is so near to instability that nothing bounds it"
        raise PlanError(controller.name, what, "check the signs in den, or lengthen sample_time")
    what = f"the recursion cut off at length {length} is unstable ({outside} poles outside the unit circle)"
    raise PlanError(controller.name, what, _remedy(controller, length))


def _remedy(controller: Controller, length: int) -> str:
    den = TransferFunction(((1.0, 0.0),), realise(controller).den)
    works = shortest_stable_length(den, controller.sample_time, length)
    return f"use a length of {works}" if works else "check the signs in den: no longer memory helps"
