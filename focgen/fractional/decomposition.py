"""A transfer function's step response as the sum of its modes and of a part that is smooth in log t."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex
from focgen.fractional.contour import INNERMOST, TOLERATED
from focgen.fractional.modes import Chain, polar_part
from focgen.fractional.poles import first_sheet_zeros
from focgen.fractional.transfer import Polynomial, TransferFunction


@dataclass(frozen=True)
class StepImage:
    """G(s)/s, the Laplace transform of a step response, split for its inversion.

    ``chains`` are its poles; ``remainder(s)`` what is left, analytic off the negative real axis, or None
    where nothing is; ``feedthrough`` the response at t = 0+.
    """

    chains: tuple[Chain, ...]
    remainder: Callable[..., Any] | None
    feedthrough: float

    @property
    def poles(self) -> Complex:
        """The poles that are in ``chains``, rad/s, one of each conjugate pair."""
        return np.concatenate([chain.poles for chain in self.chains] or [np.empty(0, complex)])


def step_image(transfer: TransferFunction, horizon: float) -> StepImage:
    """Split G(s)/s for times up to ``horizon`` (s).

    Raises ValueError for an improper transfer function, which has no step response.
    """
    if not transfer.is_proper:
        top, bottom = transfer.num[0].order, transfer.den[0].order
        raise ValueError(
            f"the transfer function is improper: its numerator has order {top:g}, its denominator {bottom:g}"
        )
    level = _feedthrough(transfer)
    if not transfer.num:
        return StepImage((), None, 0.0)
    num, den = _reduced(transfer.num, transfer.den)
    if all(t.order.is_integer() for t in num + den):
        return StepImage(tuple(_rational(num, den, horizon)), None, level)
    return _fractional(num, den, horizon, level)


def _feedthrough(transfer: TransferFunction) -> float:
    if not transfer.num or transfer.num[0].order < transfer.den[0].order:
        return 0.0
    return transfer.num[0].coefficient / transfer.den[0].coefficient


def _reduced(num: Polynomial, den: Polynomial) -> tuple[Polynomial, Polynomial]:
    """Return numerator and denominator of G/s without a common power of s."""
    den = _shifted(den, 1.0)
    lowest = min(num[-1].order, den[-1].order)
    return _shifted(num, -lowest), _shifted(den, -lowest)


def _shifted(terms: Polynomial, by: float) -> Polynomial:
    return tuple(t._replace(order=t.order + by) for t in terms)


def _values(terms: Polynomial, s: Any) -> Any:
    log = np.log(s)
    return sum(t.coefficient * (np.exp(t.order * log) if t.order else 1.0) for t in terms)


def _slope(terms: Polynomial, s: complex) -> complex:
    return sum(t.coefficient * t.order * s ** (t.order - 1.0) for t in terms)


def _fractional(num: Polynomial, den: Polynomial, horizon: float, level: float) -> StepImage:
    poles = first_sheet_zeros(den, math.pi - TOLERATED)
    poles = poles[np.abs(poles) * horizon > INNERMOST]

    def image(s: Complex) -> Complex:
        made: Complex = _values(num, s) / _values(den, s)
        return made

    def isolated(p: complex, _: Complex) -> complex:
        return complex(_values(num, p) / _slope(den, p))

    chains = tuple(polar_part(image, poles, 0.0, isolated, _to_the_cut))

    def remainder(s: Complex) -> Complex:
        made: Complex = image(s) - sum(chain.image(s) for chain in chains)
        return made

    return StepImage(chains, remainder if chains else image, level)


def _to_the_cut(place: complex) -> float:
    return abs(place.imag) if place.real < 0 else abs(place)


def _rational(num: Polynomial, den: Polynomial, horizon: float) -> list[Chain]:
    top, bottom = dense(num), dense(den)
    poles = np.roots(bottom).astype(complex)  # not polished one by one: near poles are accurate as a set

    def image(s: Complex) -> Complex:
        made: Complex = np.polyval(top, s) / (bottom[0] * np.prod(s - poles[:, None], axis=0))
        return made

    def isolated(p: complex, others: Complex) -> complex:
        made: complex = np.polyval(top, p) / (bottom[0] * np.prod(p - others))
        return made

    return polar_part(image, poles, 2.0 / horizon, isolated, lambda _: math.inf)


def dense(terms: Polynomial) -> Array:
    """The coefficients (highest order + 1,) of a polynomial of whole orders, highest first."""
    found = np.zeros(int(terms[0].order) + 1)
    found[[int(terms[0].order - t.order) for t in terms]] = [t.coefficient for t in terms]
    return found
