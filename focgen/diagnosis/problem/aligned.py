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
from focgen.rig.rig import UNITY, Rig


def first_that_takes_time(rig: Rig, stages: Sequence[str]) -> str | None:
    """Of the ``stages``; None where all of them answer at once."""
    return next((stage for stage in stages if _takes_time(rig, stage)), None)


def _takes_time(rig: Rig, stage: str) -> bool:
    if stage == "actuator":
        return getattr(rig.actuator, "dynamics", UNITY) != UNITY
    made: bool = getattr(rig, stage) != UNITY
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


def sooner(made: Array, rest: Bytes) -> Array:
    """What was ``made`` (n,) a sample sooner, experiments apart, each at its end as it was a sample before."""
    return np.where(np.r_[rest[1:], 1] > 0, made, np.roll(made, -1))
