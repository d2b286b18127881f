"""An actuator whose spring gives way while it is used: it bends further for it, and more slowly.

With a stiffness s(t) in units of the nominal one, T D^α y + s y = x is T D^α y + y = x + (1 − s) y. So y is
the nominal response to x and to what the spring no longer bears, found by putting in the y found last: what
is missing falls by the part 1 − s each time.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.rig.effects import Run

_TURNS = 12
_CLOSE = 1e-4  # of the largest response: what a turn may still change
_LEAST = 0.2  # of the stiffness: with less, the turns would not come to an end
_MOST = 1.8  # of it


class Weak(Protocol):
    """An effect that gives by what the drive is larger for the weaker spring."""

    @property
    def values(self) -> tuple[float, ...]:
        """Its parameters."""

    def act(self, x: Array, run: Run) -> Array:
        """The drive (n,) that would bend a nominal spring as far."""


def weakened(steps: Sequence[Any], weak: Sequence[Any], gain: float) -> list[Any]:
    """The ``steps`` of an actuator that answers 1 with ``gain`` when held, with what is ``weak`` in it. Where
    nothing is, the same steps."""
    if not weak:
        return list(steps)
    kept = [(("weak", p.effect, p.form.name, p.values), lambda x, run: x, p) for p in weak]
    keys: tuple[Hashable, ...] = tuple(key for key, *_ in (*kept, *steps))
    return [*kept, (keys, _bent([act for _, act, _ in steps], weak, gain), None)]


def _bent(
    acts: Sequence[Callable[[Array, Run], Array]], weak: Sequence[Weak], gain: float
) -> Callable[[Array, Run], Array]:
    def nominal(x: Array, run: Run) -> Array:
        for act in acts:
            x = act(x, run)
        return x

    def respond(x: Array, run: Run) -> Array:
        lost = 1.0 - stiffness(x, weak, run)
        y = nominal(x, run)
        for _ in range(_TURNS):
            before, y = y, nominal(x + lost * y / gain, run)
            if np.max(np.abs(y - before)) <= _CLOSE * np.max(np.abs(y)):
                break
        return y

    return respond


def stiffness(x: Array, weak: Sequence[Weak], run: Run) -> Array:
    """Of the spring (n,), in units of the nominal one, under the drive ``x`` (n,): where that is 0, as it was
    last."""
    held = np.ones(len(x))
    place = np.maximum.accumulate(np.where(x != 0.0, np.arange(len(x)), 0))
    for effect in weak:
        driven = effect.act(x, run)
        size = np.divide(driven, x, out=np.ones(len(x)), where=x != 0.0)[place]
        held = held / np.maximum(size, 1e-3)
    return np.clip(held, _LEAST, _MOST)
