"""A regulator that adds up what it is told, as a pump does: what it gives less of is lost for good."""

from collections.abc import Callable

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects._effect import Run


def given(x: Array, run: Run, of: Callable[[Array], Array]) -> Array:
    """What is there (n,) where of every step from sample to sample of ``x`` a pump gives what ``of`` makes of
    it."""
    made = np.empty(len(x))
    for a, b in run.spans:
        made[a:b] = x[a] + np.cumsum(of(np.diff(x[a:b], prepend=x[a])))
    return made
