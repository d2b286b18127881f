"""Powers of two: choosing the size of one count, and integer intervals carried through a step exactly."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from focgen.errors import PlanError
from focgen.plan.plan import Format
from focgen.plan.sums import Count

_FARTHEST = 150  # |log2| of any lsb: what a C double and this module's arithmetic take without a thought


@dataclass(frozen=True)
class Word:
    """The widths of an arithmetic: of samples and weights, and of their sums."""

    bits: int
    sum_bits: int

    @property
    def limit(self) -> int:
        """Largest sample; the smallest is used no lower than its negative."""
        return limit(self.bits)


WORDS = {"q15": Word(16, 32), "q31": Word(32, 64)}
"""Every arithmetic in integers."""
RUNTIME = {16: "q15", 32: "q31"}


def runtime(arithmetic: str) -> str:
    """The ending that names an arithmetic's functions in the C runtime, and its speeds of modes: one for all
    integers of a width.
    """
    return RUNTIME[WORDS[arithmetic].bits] if arithmetic in WORDS else arithmetic


def limit(bits: int) -> int:
    """Largest value of a signed integer of so many bits."""
    return (1 << (bits - 1)) - 1


def integer(bits: int) -> str:
    """Its C type."""
    return f"int{bits}_t"


def nearest(value: float) -> int:
    """The nearest integer, halves away from zero."""
    whole = math.floor(abs(value))
    return int(math.copysign(whole + (abs(value) - whole >= 0.5), value))


def exponent_for(largest: float, counts: int, where: str, what: str) -> int:
    """The smallest k with ``largest`` / 2^k, rounded, ≤ ``counts``. Raises PlanError where 2^k is out of
    reach."""
    if largest == 0.0:
        return -_FARTHEST
    k = math.ceil(math.log2(largest) - math.log2(counts)) - 1 if math.isfinite(largest) else _FARTHEST
    while -_FARTHEST < k < _FARTHEST and nearest(largest * 2.0**-k) > counts:
        k += 1
    if not -_FARTHEST < k < _FARTHEST:
        remedy = "choose units in which it is nearer to 1"
        raise PlanError(where, f"{what} reaches {largest:.3g}, which no fixed-point format covers", remedy)
    return k


@dataclass(frozen=True)
class Interval:
    """All integers from ``low`` to ``high``; the operations are exact."""

    low: int
    high: int

    def __add__(self, other: Interval) -> Interval:
        return Interval(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:
        ends = [a * b for a in (self.low, self.high) for b in (other.low, other.high)]
        return Interval(min(ends), max(ends))

    def hull(self, value: int) -> Interval:
        """With ``value`` taken in."""
        return Interval(min(self.low, value), max(self.high, value))

    def shifted(self, by: int) -> Interval:
        """After shift(x, by) of the model, which is monotone."""
        return Interval(shift(self.low, by), shift(self.high, by))

    def within(self, other: Interval) -> Interval:
        """After clamping to ``other``."""
        return Interval(*(min(max(x, other.low), other.high) for x in (self.low, self.high)))

    @property
    def worst(self) -> int:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))


def shift(count: Any, by: int) -> Any:
    """Right shift rounding half up, on Python integers and int64 arrays."""
    return (count + (1 << (by - 1))) >> by if by else count


def span(format_: Format) -> Interval:
    """The range of a format."""
    return Interval(int(format_.low), int(format_.high))


def weighted(weights: Iterable[Count], each: Interval) -> Interval:
    """The range of Σ w x with every x anywhere in ``each``."""
    positive = sum(int(w) for w in weights if w > 0)
    negative = sum(int(w) for w in weights if w < 0)
    return Interval(positive * each.low + negative * each.high, positive * each.high + negative * each.low)
