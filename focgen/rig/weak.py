"""An actuator whose spring gives way while it is used: it bends further for it, and more slowly.

With a stiffness s(t) in units of the nominal one, T D^α y + s y = x is T D^α y + y = x + (1 − s) y. So y is
the nominal response to x and to what the spring no longer bears, found by putting in the y found last: what
is missing falls by the part 1 − s each time.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects import Run
from focgen.rig.turns import Act, by_turns, in_a_row

_TURNS = 12
_FEW = 3  # where hypotheses are only ranked: a spring that bears four fifths is then within 2e-3
_CLOSE = 1e-4  # of the largest response: what a turn may still change
_LEAST = 0.2  # of the stiffness: with less, the turns would not come to an end
_MOST = 1.8  # of it


class Weak(Protocol):
    """An effect that gives how much further a weaker spring is bent at rest."""

    @property
    def values(self) -> tuple[float, ...]:
        """Its parameters."""

    def act(self, x: Array, run: Run) -> Array:
        """Where the spring would be with what bends a nominal one by ``x`` (n,)."""


def weakened(steps: Sequence[Any], weak: Sequence[Any], gain: float) -> list[Any]:
    """The ``steps`` of an actuator that answers 1 with ``gain`` when held, with what is ``weak`` in it. Where
    nothing is, the same steps."""
    if not weak:
        return list(steps)
    kept = [(("weak", p.effect, p.form.name, p.values), lambda y, run: y, p) for p in weak]
    keys: tuple[Hashable, ...] = tuple(key for key, *_ in (*steps, *kept))
    return [(keys, _bent([act for _, act, _ in steps], weak, gain), None), *kept]


def _bent(acts: Sequence[Act], weak: Sequence[Weak], gain: float) -> Act:
    nominal = in_a_row(acts)

    def respond(x: Array, run: Run) -> Array:
        def further(y: Array) -> Array:
            return nominal(x + (1.0 - stiffness(y, weak, run)) * y / gain, run)

        return by_turns(nominal(x, run), further, _FEW if run.rough else _TURNS, _CLOSE)

    return respond


def stiffness(y: Array, weak: Sequence[Weak], run: Run) -> Array:
    """Of the spring (n,), in units of the nominal one, as it is bent by ``y`` (n,): at 0 as it was last."""
    held = np.ones(len(y))
    place = np.maximum.accumulate(np.where(y != 0.0, np.arange(len(y)), 0))
    for effect in weak:
        further = effect.act(y, run)
        held = held / np.maximum(np.divide(further, y, out=np.ones(len(y)), where=y != 0.0)[place], 1e-3)
    return np.clip(held, _LEAST, _MOST)
