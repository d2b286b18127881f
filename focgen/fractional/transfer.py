"""Transfer functions with real orders, eq. (8): (Σ bᵢ s^βᵢ) / (Σ aᵢ s^αᵢ)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array


class Term(NamedTuple):
    """One term, ``coefficient * s**order``."""

    coefficient: float
    order: float


Polynomial = tuple[Term, ...]


def polynomial(terms: Iterable[tuple[float, float]]) -> Polynomial:
    """Collect terms: like orders added, zeros dropped, highest order first.

    Raises ValueError for a coefficient or order that is not finite.
    """
    total: dict[float, float] = {}
    for coefficient, order in terms:
        if not (math.isfinite(coefficient) and math.isfinite(order)):
            raise ValueError(f"the term [{coefficient}, {order}] is not finite")
        total[float(order)] = total.get(float(order), 0.0) + float(coefficient)
    return tuple(Term(c, o) for o, c in sorted(total.items(), reverse=True) if c != 0.0)


def _product(left: Polynomial, right: Polynomial) -> Polynomial:
    return polynomial((a.coefficient * b.coefficient, a.order + b.order) for a in left for b in right)


@dataclass(frozen=True, init=False)
class TransferFunction:
    """A fractional transfer function, eq. (8); ``num`` and ``den`` are lists of (coefficient, order).

    Two are equal when their collected terms are equal, number for number. ``*`` is the series
    connection, ``+`` and ``-`` the parallel one; no common factors are cancelled.
    Raises ValueError where the denominator is zero.
    """

    num: Polynomial
    den: Polynomial

    def __init__(
        self, num: Iterable[tuple[float, float]], den: Iterable[tuple[float, float]] = ((1.0, 0.0),)
    ) -> None:
        object.__setattr__(self, "num", polynomial(num))
        object.__setattr__(self, "den", polynomial(den))
        if not self.den:
            raise ValueError("the denominator of a transfer function is zero")

    def __mul__(self, other: TransferFunction | float) -> TransferFunction:
        other = _lifted(other)
        return TransferFunction(_product(self.num, other.num), _product(self.den, other.den))

    __rmul__ = __mul__

    def __add__(self, other: TransferFunction | float) -> TransferFunction:
        other = _lifted(other)
        if self.den == other.den:
            return TransferFunction(self.num + other.num, self.den)
        crossed = _product(self.num, other.den) + _product(other.num, self.den)
        return TransferFunction(crossed, _product(self.den, other.den))

    __radd__ = __add__

    def __neg__(self) -> TransferFunction:
        return self * -1.0

    def __sub__(self, other: TransferFunction | float) -> TransferFunction:
        return self + -_lifted(other)

    def to_frd(self, omega: ArrayLike | None = None, delay: float = 0.0) -> Any:
        """The frequency response as python-control's, :func:`focgen.fractional.to_frd`."""
        return import_module("focgen.fractional.convert").to_frd(self, omega, delay)

    def bode(self, omega: ArrayLike | None = None, delay: float = 0.0, **how: Any) -> Any:
        """Its Bode plot, :func:`focgen.fractional.bode`."""
        return import_module("focgen.fractional.convert").bode(self, omega, delay, **how)

    def nyquist(self, omega: ArrayLike | None = None, delay: float = 0.0, **how: Any) -> Any:
        """Its Nyquist plot, :func:`focgen.fractional.nyquist`."""
        return import_module("focgen.fractional.convert").nyquist(self, omega, delay, **how)

    def inverse(self) -> TransferFunction:
        """Return the reciprocal. Raises ValueError where the numerator is zero."""
        return TransferFunction(self.den, self.num)

    def __call__(self, s: ArrayLike) -> Any:
        """Evaluate at complex ``s`` (rad/s), principal branch; an array gives an array."""
        place = np.asarray(s, dtype=complex)
        return _evaluate(self.num, place) / _evaluate(self.den, place)

    def frequency_response(self, omega: ArrayLike) -> Any:
        """Complex gain at the angular frequencies ``omega`` > 0 (rad/s), shape of ``omega``."""
        return self(1j * np.asarray(omega, dtype=float))

    @property
    def orders(self) -> tuple[float, ...]:
        """Every order that occurs, highest first, each once."""
        return tuple(sorted({t.order for t in self.num + self.den}, reverse=True))

    @property
    def is_integer(self) -> bool:
        """Whether every order is a whole number."""
        return all(order.is_integer() for order in self.orders)

    @property
    def is_proper(self) -> bool:
        """Whether no order of the numerator exceeds the highest of the denominator."""
        return not self.num or self.num[0].order <= self.den[0].order

    @property
    def dc_gain(self) -> float:
        """The limit for s → 0, which may be infinite."""
        lowest_num = self.num[-1] if self.num else Term(0.0, math.inf)
        lowest_den = self.den[-1]
        if lowest_num.order > lowest_den.order:
            return 0.0
        ratio = lowest_num.coefficient / lowest_den.coefficient
        return ratio if lowest_num.order == lowest_den.order else math.copysign(math.inf, ratio)

    def __str__(self) -> str:
        if self.den == (Term(1.0, 0.0),):
            return _text(self.num)
        return f"({_text(self.num)}) / ({_text(self.den)})"


def _lifted(value: TransferFunction | float) -> TransferFunction:
    return value if isinstance(value, TransferFunction) else TransferFunction([(float(value), 0.0)])


def _evaluate(terms: Polynomial, s: Array) -> Array:
    total: Array = sum((t.coefficient * s**t.order for t in terms), np.zeros(s.shape, complex))
    return total


def _text(terms: Polynomial) -> str:
    return " + ".join(_term_text(t) for t in terms).replace("+ -", "- ") or "0"


def _term_text(term: Term) -> str:
    if term.order == 0.0:
        return f"{term.coefficient:.6g}"
    power = "s" if term.order == 1.0 else f"s^{term.order:g}"
    return power if term.coefficient == 1.0 else f"{term.coefficient:.6g} {power}"
