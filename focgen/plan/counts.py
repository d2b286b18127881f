"""Floats in whole counts of a power of two, as integrals of f32 hold them (:mod:`focgen.plan.integrals`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from focgen.arrays import Numbers
from focgen.plan.plan import Format

MOST = 1 << 61
"""Counts of an integral's ends, and of what it takes in."""
NOTHING = -(1 << 63)
"""Counts of NaN and infinity."""


def up_of(state: Format) -> int:
    """n where one count is 2^−n."""
    return 1 - math.frexp(state.lsb)[1]


def counts_of(values: ArrayLike, up: int) -> Numbers:
    """Floats in counts of 2^−``up``, any shape: the nearest, halves away from zero, at most ``MOST``;
    ``NOTHING`` for NaN and infinity."""
    wide = np.ldexp(np.asarray(values, dtype=np.float64), up)  # exact
    finite = np.isfinite(wide)
    size = np.minimum(np.abs(np.where(finite, wide, 0.0)), float(MOST))
    whole = np.where(size < 2.0**30, np.floor(size + 0.5), size)  # a float that large is whole
    found = np.where(wide < 0.0, -whole, whole).astype(np.int64)
    return np.where(finite, found, NOTHING)


def values_of(counts: ArrayLike, state: Format) -> Numbers:
    """The float32 nearest to so many counts, halves to even, any shape."""
    return np.asarray(counts, dtype=np.int64).astype(np.float32) * np.float32(state.lsb)


def taken_in(values: ArrayLike, state: Format) -> Any:
    """What an integral takes in, in its own type: counts where it is counted and the values are not."""
    if state.floating or np.asarray(values).dtype.kind != "f":
        return values
    return counts_of(values, up_of(state))
