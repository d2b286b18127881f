"""An actuator that is driven the more strongly, or the less, the further it has gone.

T D^α y + y = x g(y) is the response to x g. Of a linear one g is solved for at every sample (``lever.c``).
Where friction or another spring come in, g is taken at the y found last: what is missing falls at each turn
by the part of y that g changes by.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import linear
from focgen.rig.dynamics import SAME, Lever
from focgen.rig.effects import Run

_TURNS = 40
_FEW = 4  # where hypotheses are only ranked
_CLOSE = 1e-8  # of the largest response: what a turn may still change


def run(transfer: TransferFunction, x: Array, run: Run, lever: Lever, between: Between | bool) -> Array:
    """The response (n,) of a linear stage."""
    return linear.run_levered(transfer, x, run.rest, run.h, run.duration, between, lever)


def levered(steps: Sequence[Any], lever: Lever) -> list[Any]:
    """The ``steps`` of an actuator with what drives it changed where it is; the same steps where it is
    not."""
    if lever == SAME:
        return list(steps)
    return [((lever, *(key for key, *_ in steps)), _driven([act for _, act, _ in steps], lever), None)]


def _driven(acts: Sequence[Callable[[Array, Run], Array]], lever: Lever) -> Callable[[Array, Run], Array]:
    def nominal(x: Array, run: Run) -> Array:
        for act in acts:
            x = act(x, run)
        return x

    def respond(x: Array, run: Run) -> Array:
        y = nominal(x, run)
        for _ in range(_FEW if run.rough else _TURNS):
            before, y = y, nominal(x * lever.strength(y), run)
            if np.max(np.abs(y - before)) <= _CLOSE * np.max(np.abs(y)):
                break
        return y

    return respond
