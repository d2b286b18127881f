"""An actuator that is driven the more strongly, or the less, the further it has gone.

T D^α y + y = x g(y) is the response to x g. Of a linear one g is solved for at every sample
(:func:`~focgen.rig.solved.run_levered`). Where friction or another spring come in, g is taken at the y found
last: what is missing falls at each turn by the part of y that g changes by.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from focgen.arrays import Array
from focgen.rig.dynamics import SAME, Lever
from focgen.rig.effects import Run
from focgen.rig.turns import Act, by_turns, in_a_row

_TURNS = 20
_FEW = 4  # where hypotheses are only ranked
_CLOSE = 1e-6  # of the largest response: what a turn may still change


def levered(steps: Sequence[Any], lever: Lever) -> list[Any]:
    """The ``steps`` of an actuator with what drives it changed where it is; the same steps where it is
    not."""
    if lever == SAME:
        return list(steps)
    return [((lever, *(key for key, *_ in steps)), _driven([act for _, act, _ in steps], lever), None)]


def _driven(acts: Sequence[Act], lever: Lever) -> Act:
    nominal = in_a_row(acts)

    def respond(x: Array, run: Run) -> Array:
        turns = _FEW if run.rough else _TURNS
        return by_turns(nominal(x, run), lambda y: nominal(x * lever.strength(y), run), turns, _CLOSE)

    return respond
