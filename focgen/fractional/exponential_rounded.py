"""Exponential memories as a machine holds them: their poles rounded, with weights and a certificate of their
own."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from focgen.arrays import Array
from focgen.fractional import elementary
from focgen.fractional.exponential import TOLERANCES, ExponentialMemory, checked_differences, memory_of
from focgen.fractional.exponential_fit import Alternation, best_weights, eased, ladder

Rounding = Callable[[Array], Array]
_SPARED = 0.9  # of the tolerance: what rounding the poles may cost is left over


@functools.lru_cache(maxsize=256)
def fit_rounded(order: float, horizon: int, tolerance: float, rounded: Rounding) -> ExponentialMemory:
    """Find the memory with the fewest exponentials whose rounded poles still keep the tolerance.

    Arguments and limits as of :func:`~focgen.fractional.exponential.fit_exponential`; ``rounded`` takes rates
    1 − p, shape (n,), to those that the machine can hold. The memory's ``tolerance`` is what its certificate
    proves, at most the one asked for.
    Raises ValueError outside the limits, and where no rounded poles keep the tolerance.
    """
    beta = checked_differences(order, horizon) - order
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ValueError(f"the tolerance {tolerance} is not between {TOLERANCES[0]:g} and {TOLERANCES[1]:g}")
    for fit in ladder(beta, horizon):
        if fit.error > tolerance:
            continue
        for candidate in (eased(beta, horizon, fit, _SPARED * tolerance), fit):
            memory = _held(order, horizon, candidate, rounded)
            if memory is not None and memory.tolerance <= tolerance:
                return memory
    what = f"poles as they are held miss the tolerance {tolerance:g} at the horizon {horizon}"
    raise ValueError(f"{what}; allow more")


def _held(order: float, horizon: int, fit: Alternation, rounded: Rounding) -> ExponentialMemory | None:
    """With the weights that suit the rounded poles best, or those of the fit if these are better; None where
    two poles become one.
    """
    poles = 1.0 - rounded(-elementary.expm1(-elementary.exp(fit.log_rates[::-1])))
    if not (np.all(np.diff(poles) > 0.0) and poles[0] >= 0.0 and poles[-1] < 1.0):
        return None
    beta = checked_differences(order, horizon) - order
    weights = [best_weights(beta, horizon, poles), elementary.exp(fit.log_weights[::-1])]
    memories = [memory_of(order, horizon, poles, w) for w in weights if np.all(w >= 0.0)]
    return min(memories, key=lambda memory: memory.tolerance)
