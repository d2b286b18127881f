"""Columns out of step where the input is a staircase.

Between its samples a staircase is what it was at the last one. By a part of a sample sooner or later its
jumps lie within samples, where a mean of two staircases has none. So it is made by a dead time of the first
stage that takes time, which a simulation has at any part of a sample, and behind which the output may come a
sample sooner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array, Bytes
from focgen.fractional.transfer import TransferFunction
from focgen.rig.rig import UNITY, Rig


def first_of_whole_orders(rig: Rig, stages: Sequence[str]) -> str | None:
    """Of the ``stages`` the first that takes time, if its orders are whole; None where they are not, or all
    answer at once. What rises by t^α has no slope at a jump, and a simulation by modes no share of it that is
    much less than a sample's: there a mean of two staircases is as good."""
    for stage in stages:
        if (transfer := _transfer_of(rig, stage)) != UNITY:
            return stage if transfer.is_integer else None
    return None


def _transfer_of(rig: Rig, stage: str) -> TransferFunction:
    made: TransferFunction = (
        getattr(rig.actuator, "dynamics", UNITY) if stage == "actuator" else getattr(rig, stage)
    )
    return made


def is_ahead(rig: Rig, stage: str, late: float) -> bool:
    """Whether an input that is ``late`` by so many s, less than 0 where it is early, is so by more than the
    dead time of the ``stage`` makes up for."""
    made: bool = getattr(rig.delays, stage) + late < 0.0
    return made


def later(rig: Rig, stage: str, late: float, h: float) -> Rig:
    """The rig with the ``stage`` later by ``late`` s, or by what is left of that to an output that comes a
    sample of ``h`` s sooner, where it :func:`is_ahead`."""
    delay = getattr(rig.delays, stage) + late
    return replace(rig, delays=replace(rig.delays, **{stage: delay + h * (delay < 0.0)}))


def sooner(y: Array, rest: Bytes) -> Array:
    """``y`` (n,) a sample sooner, experiments apart, each of which goes on at its end as it did."""
    last = np.r_[rest[1:], 1] > 0
    return np.where(last, 2.0 * y - np.roll(y, 1), np.roll(y, -1))
