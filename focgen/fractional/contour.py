"""Inverse Laplace transforms by a hyperbolic contour that scales with 1/t.

With the hyperbola of Weideman and Trefethen (Math. Comp. 76, 2007), 18 points in the upper half plane give
13 digits for any F that is analytic off the negative real axis; singularities elsewhere have to be taken
out first (:mod:`focgen.fractional.modes`). Poles within ``TOLERATED`` of the negative real axis stay in.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from focgen.arrays import Array, Complex

POINTS = 18
TOLERATED = 0.2  # rad
INNERMOST = 0.5  # singularities with |s| t below this are inside the contour wherever they are

_STEP = 1.081792140 / POINTS
_SCALE = 4.492075287 * POINTS
_OPENING = 1.172104229


def _nodes(first: float) -> tuple[Array, Array]:
    """Return places and factors of the trapezoidal rule at ``first``, first + 1, … steps from the vertex."""
    u = 1j * _STEP * (np.arange(POINTS) + first) - _OPENING
    places = _SCALE * (1.0 + np.sin(u))
    factors = _STEP / math.pi * np.exp(places) * 1j * _SCALE * np.cos(u)
    if first == 0.0:
        factors[0] *= 0.5  # the vertex is its own conjugate
    return places, factors


_MIDDLE = _nodes(0.5)
_SHIFTED = _nodes(0.0)  # the places between, for times at which a pole is in the way
_BLOCK = 4096  # times treated at once, so that long arrays stay in the cache


def inverse_laplace(image: Callable[..., Any], t: Array, removed: Array | Complex | None = None) -> Array:
    """Return f(t) for its Laplace transform ``image(s)``, t > 0 of shape (n,), in s; shape (n,).

    ``image`` takes complex s of shape (POINTS, n) and must be real on the positive real axis. ``removed``
    are poles that were subtracted from it: near them it is a difference of large numbers, to be kept off.
    """
    t = np.asarray(t, dtype=float)
    removed = np.empty(0) if removed is None else removed
    parts = [_block(image, t[i : i + _BLOCK], removed) for i in range(0, len(t), _BLOCK)]
    return np.concatenate(parts) if parts else t


def _block(image: Callable[..., Any], t: Array, removed: Array | Complex) -> Array:
    if not len(removed):
        places, factors = _MIDDLE
        straight: Array = (factors @ image(places[:, None] / t)).imag / t
        return straight
    shifted = _clearance(_SHIFTED[0], t, removed) > _clearance(_MIDDLE[0], t, removed)
    places, factors = (np.where(shifted, b[:, None], m[:, None]) for m, b in zip(_MIDDLE, _SHIFTED))
    made: Array = (factors * image(places / t)).sum(axis=0).imag / t
    return made


def _clearance(places: Array, t: Array, removed: Array | Complex) -> Array:
    """Return, for each time, the least distance of a place from a scaled pole."""
    upper = removed.real + 1j * np.abs(removed.imag)
    made: Array = np.abs(places[:, None, None] - t[:, None] * upper).min(axis=(0, 2))
    return made
