"""Where an actuator that integrates stood as each experiment began.

It has no equilibrium that an input's past could tell: it stays where it was left. Its first samples show
where.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import Begin
from focgen.logs.between import white_level
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run

_FIRST = 5  # samples that show it, at least
_APART = 5.0  # standard errors by which the first samples are off from 0


def from_there(x: Array, run: Run) -> Array:
    """What leaves the actuator (n,), ``x`` where it stood at 0 as each experiment began."""
    made: Array = x + np.repeat(run.stands, [b - a for a, b in run.spans])
    return made


def standing(log: Experiment, role: str, made: Array, gain: float, note: str) -> Experiment:
    """The experiment with where its actuator stood: by the signal ``role``, which answers a constant with
    ``gain`` and is ``made`` (n,) from 0 on, while neither has moved beyond the noise."""
    off = np.asarray(log[role], float) - made
    white = white_level(off)
    still = max(min(_moves(made, white), _moves(off, white)), _FIRST)
    place = float(np.median(off[:still]))
    if abs(place) <= _APART * white / np.sqrt(still):
        return replace(log, stands=0.0)
    begins = {"curvature": Begin((place / gain,))} if "curvature" in log else {}
    notes = (*(n for n in log.notes if n != note), note)
    return replace(log, stands=place / gain, begins={**log.begins, **begins}, notes=notes)


def _moves(signal: Array, noise: float) -> int:
    """The first sample at which a signal (n,), in means of a few, is off from its first ones."""
    means = np.convolve(signal, np.full(_FIRST, 1.0 / _FIRST), "valid")
    moved = np.abs(means - means[0]) > 2.0 * noise
    return int(np.argmax(moved)) if moved.any() else len(signal)
