"""Steps whose input depends on their own response: that is put in as it was found last, turn by turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects import Run

Act = Callable[[Array, Run], Array]


def in_a_row(acts: Sequence[Act]) -> Act:
    """One step after the other."""

    def act(x: Array, run: Run) -> Array:
        for each in acts:
            x = each(x, run)
        return x

    return act


def by_turns(y: Array, again: Callable[[Array], Array], turns: int, close: float) -> Array:
    """The response (n,) that ``again`` makes of itself, from ``y``: after so many ``turns``, or once a turn
    changes no more than ``close`` of the largest. What changes as much as the turn before goes to and fro:
    half of the way is gone then."""
    last = np.inf
    for _ in range(turns):
        before, y = y, again(y)
        change = np.max(np.abs(y - before))
        if change <= close * np.max(np.abs(y)):
            break
        if change >= last:
            y = 0.5 * (y + before)
        last = change
    return y
