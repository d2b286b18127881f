"""A pace that depends on the level: a rubber that is damped more where it is stretched, a valve that fills
faster from a higher supply. A nominal time is one number for all levels, and never quite true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.diagnosis.problem.segments import Segment
from focgen.rig.effects import Form, Run
from focgen.rig.engine import Chain
from focgen.rig.placed import Placed
from focgen.rig.rig import Actuator, Relative, Rig

_AHEAD = {"actuator": "drive", "regulator": "command", "sensor": "strain"}  # slots ahead of dynamics
_PART = 1.0 / 3.0  # of the uncertainty of a time: a standard deviation, of which there may be three


def level_pace(rig: Rig, segment: Segment) -> np.ndarray | None:
    """What the output (n,) is another by, in its unit, where a stage is slower at its largest level than at
    0, by a third of the uncertainty of its time. None where no stage of the segment has dynamics, or the
    stage holds no level: its gain is 0 or infinite.

    To first order: with Q y = g u − y, g the gain, a factor 1 + c y/max|y| of Q is c y/max|y| (y/g − u) more
    of u.
    """
    stage = paced_stage(rig, segment)
    if stage is None:
        return None
    core, gain = _core(rig, stage)
    if gain == 0.0 or not np.isfinite(gain):
        return None
    part = slower_by(rig, stage, 1.0)

    def act(u: Array, values: tuple[float, ...], run: Run) -> Array:
        y = Chain(core).run(u, stage, stage, run, segment.between) / gain
        made: Array = u + part * y / (float(np.max(np.abs(y))) or 1.0) * (y - u)
        return made

    slower = Placed("level_pace", Form("level_pace", _AHEAD[stage], (), act), stage, ())
    usual, other = (
        Chain(rig, placed).run(
            segment.bent, segment.stages[0], segment.stages[-1], segment.run, segment.between
        )
        for placed in ((), (slower,))
    )
    return other - usual if np.any(other != usual) else None


def paced_stage(rig: Rig, segment: Segment) -> str | None:
    """The stage whose pace it is."""
    return next((s for s in _AHEAD if s in segment.stages and getattr(rig, s) is not None), None)


def slower_by(rig: Rig, stage: str, size: float) -> float:
    """By what part of its time a stage is slower at its highest level where what :func:`level_pace` gives is
    there ``size`` times."""
    known: Relative = getattr(rig.uncertainty, stage)
    return size * _PART * known.time


def _core(rig: Rig, stage: str) -> tuple[Rig, float]:
    """A stage from behind that slot on, without effects, and its gain."""
    rig = replace(rig, known=(), zero=0.0, lead=0.0)
    if stage != "actuator":
        return rig, getattr(rig, stage).dc_gain
    actuator = rig.actuator
    if isinstance(actuator, Actuator):
        return replace(rig, actuator=replace(actuator, gain=(1.0,), offset=0.0)), 1.0
    assert actuator is not None
    return replace(rig, actuator=replace(actuator, offset=0.0, bias=0.0)), actuator.dynamics.dc_gain
