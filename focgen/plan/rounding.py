"""What one operation in floating point can be off by, and a sum in the order in which C takes it.

A result x is rounded to a float beside it: off by at most half of its own last place, u · 2^⌊log2 |x|⌋ with u
= 2^−24 (f32) or 2^−53 (f64), which is up to half of the usual u |x|. A result that is a power of two at most
is one, and exact, or less, and has a last place half as large. A product with a power of two, a sum with 0
and a product with 0 are exact. (Higham, Accuracy and Stability of Numerical Algorithms, 2002, §2.1 and §4.2)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Array
from focgen.fractional.elementary import exact_sum
from focgen.plan.sums import Count

_UP = 1.0 + 2.0**-40  # over the rounding of what is multiplied here, in double


def gamma(count: float, unit: float) -> float:
    """γ_n = n u / (1 − n u)."""
    return count * unit / (1.0 - count * unit)


def half_places(largest: ArrayLike, unit: float) -> Array:
    """What rounding adds to numbers of magnitudes up to ``largest``, any shape; 0 where that is 0."""
    below = np.nextafter(np.asarray(largest, dtype=float), 0.0)
    found: Array = np.where(below > 0.0, np.ldexp(unit, np.frexp(below)[1] - 1), 0.0)
    return found


def half_place(largest: float, unit: float) -> float:
    """The same of one number."""
    return float(half_places(largest, unit))


def products_error(weights: Array, largest: float, unit: float) -> float:
    """What all products of ``weights`` (n,) with numbers up to ``largest`` can be off by together."""
    rounded = np.abs(np.frexp(weights)[0]) != 0.5
    return exact_sum(half_places(np.abs(weights) * largest * _UP, unit) * rounded)


def partial_sums_error(weights: Array, span: tuple[float, float], unit: float) -> float:
    """What adding up products, in the order of ``weights`` (n,), can be off by: each partial sum has its own
    last place. ``span``: the least and the largest factor, 0 between them. The first sum, to 0, is exact.

    A partial sum is where its factors are all at the ends that it is largest for, or γ_n of the magnitudes
    beside that, which is all that rounding has added so far.
    """
    used = weights[weights != 0.0]
    ends = np.outer(used, span)
    sums = (np.add.accumulate(end) for end in (ends.max(axis=1), -ends.min(axis=1), np.abs(ends).max(axis=1)))
    high, low, sizes = sums
    reach = np.maximum(high, low) + gamma(len(used) + 2, unit) * sizes
    return exact_sum(half_places(reach[1:] * _UP, unit))


def taps_error(weights: Sequence[Count], span: tuple[float, float], unit: float) -> float:
    """What the sum of taps is off by, for ``weights`` by rising lag and a history within ``span``."""
    oldest_first = np.array(weights, dtype=float)[::-1]
    largest = max(map(abs, span))
    return products_error(oldest_first, largest, unit) + partial_sums_error(oldest_first, span, unit)
