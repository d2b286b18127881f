"""Grünwald–Letnikov weights, eq. (11)–(12), and what cutting them off costs at rest.

The weights of order α are the Taylor coefficients of (1 − x)^α. The recursion of eq. (11) gathers one
rounding a step, so it is used for the head only; the tail follows from
w_j = w_J Γ(j−α) Γ(J+1) / (Γ(J−α) Γ(j+1)) and the asymptotic series of the ratio of two gamma functions in
the symmetric variable j − α/2 (Tricomi and Erdélyi 1951), whose error does not grow with j.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import rgamma

from focgen.arrays import Array
from focgen.fractional import elementary

_HEAD = 128  # weights from the recursion: the series is exact to rounding from here on
_HEAD_PER_ORDER = 40.0
_LARGEST_ORDER = 101.0  # of the bias at order −100
# B_n(x), n = 3, 5, 7, 9: coefficients for np.polyval
_BERNOULLI = {
    3: (1.0, -3 / 2, 1 / 2, 0.0),
    5: (1.0, -5 / 2, 5 / 3, 0.0, -1 / 6, 0.0),
    7: (1.0, -7 / 2, 7 / 2, 0.0, -7 / 6, 0.0, 1 / 6, 0.0),
    9: (1.0, -9 / 2, 6.0, 0.0, -21 / 5, 0.0, 2.0, 0.0, -3 / 10, 0.0),
}


def gl_weights(order: float, count: int) -> Array:
    """Return w_0 … w_count of eq. (11)–(12) for any real ``order``, shape (count + 1,).

    The relative error stays below 1e-12 however many there are, down to the smallest normal number. Whole
    orders from 0 on give binomial coefficients and exact zeros past the order.
    Raises ValueError for an order that is not finite or beyond ±100, or a negative count.
    """
    if count < 0:
        raise ValueError(f"the number of weights is {count}, it must be at least 0")
    return gl_weights_at(order, np.arange(count + 1))


def gl_weights_at(order: float, indices: ArrayLike) -> Array:
    """Return w_j of eq. (11)–(12) at the whole numbers ``indices`` ≥ 0, shape of ``indices``.

    Accurate as :func:`gl_weights`, without computing the weights between. Raises ValueError for orders
    beyond ±100.
    """
    if not abs(order) <= _LARGEST_ORDER:
        raise ValueError(f"the order {order} is not a number between -100 and 100")
    places = np.asarray(indices)
    if order >= 0 and float(order).is_integer():
        return _binomials(int(order), places)
    last = max(_HEAD, math.ceil(_HEAD_PER_ORDER * abs(order)))
    head = _recursion(order, min(last, int(places.max(initial=0))))
    weights: Array = head[np.minimum(places, len(head) - 1)]
    tail = places > last
    weights[tail] = head[-1] * _decay(order, places[tail], last)
    return weights


def _binomials(order: int, indices: Array) -> Array:
    exact: Array = np.array([(-1.0) ** j * math.comb(order, j) for j in range(order + 1)] + [0.0])
    found: Array = exact[np.minimum(indices, order + 1)]
    return found


def _recursion(order: float, count: int) -> Array:
    j = np.arange(1, count + 1)
    # (j − 1 − α)/j, not 1 − (α + 1)/j: the first is exact to rounding where j − 1 is close to α.
    return np.cumprod(np.concatenate([[1.0], ((j - 1) - order) / j]))


def _decay(order: float, indices: Array, start: int) -> Array:
    """Return w_j / w_start."""
    place, place0 = indices - order / 2, start - order / 2
    ratio = elementary.log(place / place0) * -(order + 1.0)
    return elementary.exp(ratio + (_series(order, place) - _series(order, place0)))


def _series(order: float, place: Array | float) -> Any:
    x = 1.0 + order / 2
    inverse_square = 1.0 / np.square(place)
    total: Any = 0.0
    for n in (8, 6, 4, 2):
        total = (total + 2.0 * np.polyval(_BERNOULLI[n + 1], x) / (n * (n + 1))) * inverse_square
    return total


def short_memory_bias(order: float, length: int) -> float:
    """Return Σ_{j ≤ L} w_j = Γ(L+1−α) / (Γ(1−α) L!): what D^α of a constant 1 yields with memory L, step 1 s.

    It is 0 with infinite memory (α > 0). Divide by h^α (h the step in s) for the operator of eq. (10); the
    model T s^α + 1 then reads 1 + T h^−α times this at rest, instead of 1.
    """
    return float(gl_weights_at(order - 1.0, np.array(length)[None])[0])


def short_memory_bias_asymptote(order: float, length: float) -> float:
    """Return L^−α / Γ(1−α), the limit of :func:`short_memory_bias` for long memory."""
    return float(length**-order * rgamma(1.0 - order))
