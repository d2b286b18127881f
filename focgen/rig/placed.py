"""An effect at its place in a chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from focgen.arrays import Array
from focgen.rig.effects import EQUATIONS, SLOTS, Form, Run, library

EARLY, LATE, LAST = ("command", "load", "strain"), ("supply", "response", "reading"), ("place",)
"""The slots ahead of a stage's own dynamics, behind them, and behind its offset."""


@dataclass(frozen=True)
class Placed:
    """An effect in a chain: family ``effect``, its form, where, and its parameters in the log's units;
    ``carried``: what outlived an earlier session."""

    effect: str
    form: Form
    stage: str
    values: tuple[float, ...]
    carried: Mapping[str, float] = field(default_factory=dict)

    @property
    def named(self) -> dict[str, float]:
        """Its parameters by name."""
        return {p.name: float(v) for p, v in zip(self.form.parameters, self.values)}

    def act(self, x: Array, run: Run) -> Array:
        """What leaves it when ``x`` (n,) enters."""
        made: Array = self.form.act(x, self.values, self._own(run))
        return made

    def leaves(self, x: Array, run: Run) -> dict[str, float]:
        """What of it outlives the session."""
        return self.form.leaves(x, self.values, self._own(run)) if self.form.leaves else {}

    def _own(self, run: Run) -> Run:
        if run.lasts and self.remembers and not self.form.adds_up:  # a pump's is told from where each stood
            run = run.unbroken
        return replace(run, carried=self.carried) if self.carried else run

    @property
    def remembers(self) -> bool:
        """Whether it stays where its last turn left it."""
        family = library().get(self.effect)
        return family is not None and family.remembers

    @property
    def slot(self) -> str:
        """Where it acts: the form's slot, or the like one of the stage it was moved to."""
        return slot_in(self.form, self.stage)


def on_one_side(one: tuple[Form, str], other: tuple[Form, str]) -> bool:
    """Whether two forms in their stages are passed one right after the other, so that either may come
    first."""
    slots = [slot_in(*placed) for placed in (one, other)]
    return one[1] == other[1] and any(all(slot in side for slot in slots) for side in (EARLY, LATE, LAST))


def slot_in(form: Form, stage: str) -> str:
    """The slot of ``form`` in ``stage``: its own. Where it is not at home, the stage's own equation for what
    acts in one, the first for what is at home ahead of the actuator, the last for what is behind it, and for
    the actuator's own the one on the same side of the dynamics. What is linear may stand on either side:
    behind, where a delay interpolates what is smooth, unless it leads, and ahead of an actuator's offset.

    Of a regulator alone the output is what its own gauge reads: behind it, the memory of a sensor of its own
    would stand for whatever fills and vents at another pace.
    """
    if form.slot in SLOTS[stage]:
        return form.slot
    if form.slot in EQUATIONS.values() and stage in EQUATIONS:
        return EQUATIONS[stage]
    first, *_, last = SLOTS[stage]
    last = "response" if last == "place" and form.response else last
    ahead = form.slot in (*SLOTS["regulator"], "load", "drive")
    ahead = ahead or (form.slot == "strain" and stage == "regulator")
    return first if ahead and (form.leads or not form.response) else last
