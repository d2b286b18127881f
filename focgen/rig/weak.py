"""An actuator whose spring gives way while it is used: it bends further for it, and more slowly.

With a stiffness s(t) in units of the nominal one, T D^α y + s y = x is T D^α y + y = x + (1 − s) y. So y is
the nominal response to x and to what the spring no longer bears, found by putting in the y found last: what
is missing falls by the part 1 − s each time. Where the nominal actuator is linear and the form says what its
spring gives way with, y is solved for at every sample instead.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.fractional.transfer import TransferFunction
from focgen.logs.between import Between
from focgen.rig import solved
from focgen.rig.dynamics import SAME, Lever
from focgen.rig.effects import Form, Run
from focgen.rig.kernels import Wear
from focgen.rig.turns import Act, by_turns, in_a_row

_TURNS = 12
_FEW = 3  # where hypotheses are only ranked: a spring that bears four fifths is then within 2e-3
_CLOSE = 1e-4  # of the largest response: what a turn may still change
_LEAST = 0.2  # of the stiffness: with less, the turns would not come to an end
_MOST = 1.8  # of it
_BY = {"time": 0, "largest": 1, "work": 2, "retreat": 3}  # as in ``weak.c``, which has the same bounds
_FROM = {"largest": "largest", "work": "work", "retreat": "largest"}  # what an earlier session leaves of it


class Weak(Protocol):
    """An effect that gives how much further a weaker spring is bent at rest."""

    @property
    def form(self) -> Form:
        """What it is a form of."""

    @property
    def carried(self) -> Mapping[str, float]:
        """What outlived an earlier session."""

    @property
    def values(self) -> tuple[float, ...]:
        """Its parameters."""

    def act(self, x: Array, run: Run) -> Array:
        """Where the spring would be with what bends a nominal one by ``x`` (n,)."""


def weakened(steps: Sequence[Any], weak: Sequence[Any], gain: float, lever: Lever = SAME) -> list[Any]:
    """The ``steps`` of an actuator that answers 1 with ``gain`` when held, with what is ``weak`` in it, and
    driven by a ``lever``: one turn is of both."""
    kept = after(weak)
    keys: tuple[Hashable, ...] = tuple(key for key, *_ in (*steps, *kept))
    return [((lever, *keys), _bent([act for _, act, _ in steps], weak, gain, lever), None), *kept]


def after(weak: Sequence[Any]) -> list[Any]:
    """Steps that change nothing: what is weak is told there what it leaves."""
    return [(("weak", p.effect, p.form.name, p.values), lambda y, run: y, p) for p in weak]


def solved_weak(of: TransferFunction, weak: Sequence[Any], between: Between | bool) -> list[Any]:
    """The steps of a linear actuator with what is ``weak`` in it and :func:`can_be_solved`."""
    kept = after(weak)

    def act(x: Array, run: Run) -> Array:
        worn = wear(weak, of.dc_gain, run)
        return solved.run_weak(of, x, run.rest, run.h, run.duration, between, worn)

    return [((of, between, *(key for key, *_ in kept)), act, None), *kept]


def _bent(acts: Sequence[Act], weak: Sequence[Weak], gain: float, lever: Lever) -> Act:
    nominal = in_a_row(acts)

    def respond(x: Array, run: Run) -> Array:
        def further(y: Array) -> Array:
            driven = x if lever == SAME else x * lever.strength(y)
            return nominal(driven + (1.0 - stiffness(y, weak, run)) * y / gain, run)

        return by_turns(nominal(x, run), further, _FEW if run.rough else _TURNS, _CLOSE)

    return respond


def can_be_solved(weak: Sequence[Weak]) -> bool:
    """Whether all that gives way says by what, and no more than one by anything but time."""
    return all(p.form.wears for p in weak) and sum(p.form.wears != "time" for p in weak) <= 1


def wear(weak: Sequence[Weak], gain: float, run: Run) -> Wear:
    """What the compiled loops know of what :func:`can_be_solved`, of an actuator that answers 1 with
    ``gain`` when held."""
    given = ones = np.ones(len(run.rest))
    by, growth, scale, before = 0, 0.0, 1.0, 0.0
    for p in weak:
        if p.form.wears == "time":
            given = given / np.maximum(p.act(ones, run), 1e-3)
        else:
            by, (growth, scale) = _BY[p.form.wears], p.values
            before = p.carried.get(_FROM[p.form.wears], 0.0)
    return by, (growth, scale, before, gain), given


def stiffness(y: Array, weak: Sequence[Weak], run: Run) -> Array:
    """Of the spring (n,), in units of the nominal one, as it is bent by ``y`` (n,): at 0 as it was last."""
    held = np.ones(len(y))
    place = np.maximum.accumulate(np.where(y != 0.0, np.arange(len(y)), 0))
    for effect in weak:
        further = effect.act(y, run)
        held = held / np.maximum(np.divide(further, y, out=np.ones(len(y)), where=y != 0.0)[place], 1e-3)
    return np.clip(held, _LEAST, _MOST)
