"""Factors by which a refit may move a stage that was given: its gain, all of its times, its damping, its dead
time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import UNITY, Rig

WITHIN = 3.0  # times its uncertainty a number may be off without being a fault
LEAST = 0.05  # of a number as given: no refit moves it below, nor above the inverse


@dataclass(frozen=True)
class Factor:
    """One of them, as a logarithm: the ``kind`` "gain", "time", "damping" or "delay" of ``stage``, known to
    ``uncertainty``, a part of itself. ``faults``: the direction, +1 or −1, in which an effect stands for
    what goes beyond three times that, 0 where none does."""

    stage: str
    kind: str
    uncertainty: float
    faults: int

    def bounds(self, wide: bool) -> tuple[float, float]:
        """What the logarithm may be; ``wide``: anything where no effect stands for it."""
        usual = WITHIN * self.uncertainty
        low, high = np.log(max(1.0 - usual, LEAST)), np.log1p(usual)
        if wide and self.faults >= 0:
            low = np.log(LEAST)
        if wide and self.faults <= 0:
            high = -np.log(LEAST)
        return float(low), float(high)

    def put(self, rig: Rig, logarithm: float) -> Rig:
        """``rig`` with the stage's number times the factor."""
        if logarithm == 0.0:
            return rig
        factor = float(np.exp(logarithm))
        if self.kind == "delay":
            later = factor * getattr(rig.delays, self.stage)
            return replace(rig, delays=replace(rig.delays, **{self.stage: later}))
        transfer = getattr(rig, self.stage)
        changes: dict[str, Any] = {self.stage: _MOVED[self.kind](transfer, factor)}
        return replace(rig, **changes)


def slower(transfer: TransferFunction, factor: float) -> TransferFunction:
    """With s → ``factor`` s: every time constant times the factor, the gain at rest as it was."""
    num, den = ([(t.coefficient * factor**t.order, t.order) for t in p] for p in (transfer.num, transfer.den))
    return TransferFunction(num, den)


def damped(transfer: TransferFunction, factor: float) -> TransferFunction:
    """With the coefficients between the first and the last of the denominator times ``factor``: of a second
    order the damping, as every time and the gain at rest stay."""
    first, *middle, last = transfer.den
    return TransferFunction(transfer.num, [first, *((t.coefficient * factor, t.order) for t in middle), last])


_MOVED = {"gain": TransferFunction.__mul__, "time": slower, "damping": damped}


def factors(rig: Rig, stages: Sequence[str], freely: str | None) -> Iterator[Factor]:
    """Those of ``stages`` that the rig gives; the one that is refitted ``freely`` has a delay only, and the
    others beside it no gain, for it has one."""
    for stage in stages:
        known, transfer = getattr(rig.uncertainty, stage), getattr(rig, stage)
        if stage not in (freely, "actuator") and transfer != UNITY:
            if known.gain > 0.0 and freely is None:
                yield Factor(stage, "gain", known.gain, -1 if stage == "regulator" else 0)
            if known.time > 0.0 and any(t.order for t in (*transfer.num, *transfer.den)):
                yield Factor(stage, "time", known.time, +1)
            if known.time > 0.0 and len(transfer.den) > 2:  # what gives a bandwidth gives a damping no better
                yield Factor(stage, "damping", known.time, +1)
        if known.time > 0.0 and getattr(rig.delays, stage) > 0.0:
            yield Factor(stage, "delay", known.time, +1)
