"""Where an actuator that integrates stood as each experiment began.

It has no equilibrium that an input's past could tell: it stays where it was left. Its first samples show
where.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import Begin
from focgen.logs.between import white_level
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run
from focgen.rig.engine import Chain, Placed, between_of
from focgen.rig.rig import Rig
from focgen.rig.stages import ENTERS

_FIRST = 5  # samples that show it, at least
_APART = 5.0  # standard errors by which the first samples are off from 0


def standing(rig: Rig, log: Experiment, placed: Sequence[Placed], note: str) -> Experiment:
    """The experiment with where its actuator stood, and a ``note`` where that was not at 0: by the first
    signal behind it, while neither that nor what the rig with what is ``placed`` makes from 0 on has moved
    beyond the noise."""
    entry = "command" if "command" in log else "pressure"
    role, last = ("curvature", "actuator") if "curvature" in log else ("output", "sensor")
    gain = 1.0 if role == "curvature" else rig.sensor.dc_gain
    if entry not in log or role not in log or len(log) < 2 * _FIRST or not _alone(rig):
        return log
    run, chain = Run.of([len(log)], [log.start], log.sample_time), Chain(rig, tuple(placed))
    made = chain.run(np.asarray(log[entry], float), ENTERS[entry], last, run, between_of(rig, entry))
    off = np.asarray(log[role], float) - made
    white = white_level(off)
    still = max(min(_moves(made, white), _moves(off, white)), _FIRST)
    place = float(np.median(off[:still]))
    if not abs(place) > _APART * white / np.sqrt(still):
        return replace(log, stands=0.0)
    begins = {"curvature": Begin((place / gain,))} if "curvature" in log else {}
    notes = (*(n for n in log.notes if n != note), note)
    return replace(log, stands=place / gain, begins={**log.begins, **begins}, notes=notes)


def _alone(rig: Rig) -> bool:
    """Whether regulator and sensor come to rest at a level."""
    return bool(np.isfinite(rig.regulator.dc_gain) and np.isfinite(rig.sensor.dc_gain))


def _moves(signal: Array, noise: float) -> int:
    """The first sample at which a signal (n,), in means of a few, is off from its first ones."""
    means = np.convolve(signal, np.full(_FIRST, 1.0 / _FIRST), "valid")
    moved = np.abs(means - means[0]) > 2.0 * noise
    return int(np.argmax(moved)) if moved.any() else len(signal)
