"""Stability and l1 norms of the truncated recursion v + Σ a_j v_{k−j} = p.

With A(z) = 1 + Σ a_j z^−j and g the first N samples of 1/A, the residual A g − 1 has some l1 norm ρ. If ρ < 1
then 1/A = g / (1 + residual) is absolutely summable (Wiener), the recursion is stable, and

    ‖1/A‖₁ ≤ ‖g‖₁ / (1 − ρ),      ‖B/A‖₁ ≤ ‖B g‖₁ + ‖B‖₁ ‖1/A‖₁ ρ.

These hold for every bounded input, from any bounded history, and they are what ranges and error bounds rest
on. Where A goes on beyond the coefficients that are written out, by a sum of magnitudes τ, ρ grows by τ ‖g‖₁.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import fftconvolve

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.errors import PlanError
from focgen.fractional.discrete import (
    UnprovenStability,
    inverse_residual,
    poles_outside,
    power_series_inverse,
    shortest_stable_length,
)
from focgen.fractional.elementary import l1
from focgen.fractional.transfer import TransferFunction
from focgen.plan.canonical import Table, Tables, realise

_LONGEST = 1 << 18
_WANTED = 1e-6  # residual at which a longer inverse gains nothing
_GROWN = 1e12  # beyond this no fixed or floating format is of use
_SLACK = 1.0 + 1e-6  # over the rounding of the transforms
# of a norm: the transforms of different libraries agree in 40 or more, so that hardly ever, once in a million
# norms, a step of this size lies between what they find
_BITS = 20


@dataclass(frozen=True)
class Inverse:
    """A finite inverse of a stable recursion. ``response`` is g; ``residual`` is ρ; ``norm`` ≥ ‖1/A‖₁."""

    response: Array
    residual: float
    norm: float

    def norm_after(self, numerator: Array, left_out: float = 0.0) -> float:
        """Bound on ‖B/A‖₁ for the numerator's weights, shape (taps,), and ``left_out``, Σ|weights| of
        more."""
        own = l1(fftconvolve(numerator, self.response))
        rest = l1(numerator) * self.residual + left_out
        return _outward((own + rest * self.norm) * _SLACK)


def inverse(coefficients: Array, left_out: float = 0.0) -> Inverse | None:
    """Invert 1 + Σ a_j z^−j, given as (1, a_1, …); None where it is not, or not provably, stable.

    ``left_out``: Σ |a_j| of the coefficients that are not given.
    """
    return _inverse(np.asarray(coefficients, dtype=float).tobytes(), left_out)


@lru_cache(maxsize=16)
def _inverse(data: bytes, left_out: float) -> Inverse | None:
    """A plan asks for the same inverse several times."""
    coefficients = np.frombuffer(data)
    count, best = max(1024, 4 * len(coefficients)), None
    while count <= max(_LONGEST, 4 * len(coefficients)):
        found = _attempt(coefficients, count, left_out)
        if best is not None and (found is None or found.residual > 0.5 * best.residual):
            break
        best = found
        if best is not None and best.residual < _WANTED:
            break
        count *= 4
    return best


def _attempt(coefficients: Array, count: int, left_out: float) -> Inverse | None:
    with np.errstate(over="ignore", invalid="ignore"):
        response = power_series_inverse(coefficients, count)
    if not np.abs(response).max() < _GROWN:
        return None
    size = l1(response)
    residual = inverse_residual(coefficients, response) + left_out * size
    if not residual < 0.9:
        return None
    return Inverse(response, residual, _outward(size / (1.0 - residual) * _SLACK))


def _outward(bound: float) -> float:
    """Round a bound up to ``_BITS``, so that what follows from it is the same on every machine."""
    if not math.isfinite(bound):
        return bound
    part, exponent = math.frexp(bound)
    return math.ldexp(math.ceil(math.ldexp(part, _BITS)), exponent - _BITS)


def inverse_of(table: Table) -> Inverse | None:
    """Invert a denominator's table, modes included."""
    return inverse(table.response.weights, table.response.left_out)


def check_stable(controller: Controller, tables: Tables, length: int) -> None:
    """Raise PlanError where the truncated recursion is unstable, naming a memory length that works."""
    if tables.feedback is None or inverse_of(tables.feedback) is not None:
        return
    if tables.feedback.modes:
        what = "nothing proves that the recursion with this exponential memory is stable"
        remedy = "check the signs in den, shorten the horizon, or use memory short"
        raise PlanError(controller.name, what, remedy)
    try:
        outside = poles_outside(tables.feedback.weights)
    except UnprovenStability:
        outside = 0
    if not outside:
        what = "the recursion is so near to instability that nothing bounds it"
        raise PlanError(controller.name, what, "check the signs in den, or lengthen sample_time")
    poles = f"{outside} pole{'s' * (outside != 1)} outside the unit circle"
    what = f"the recursion cut off at length {length} is unstable ({poles})"
    raise PlanError(controller.name, what, _remedy(controller, length))


def _remedy(controller: Controller, length: int) -> str:
    den = TransferFunction(((1.0, 0.0),), realise(controller).den)
    works = shortest_stable_length(den, controller.sample_time, length)
    return f"use a length of {works}" if works else "check the signs in den: no longer memory helps"
