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
_ROUNDING = 1e-6  # of a signal's reach: less is no gauge's noise,
_UNKNOWN = 0.003  # and so much is then taken for it


def standing(rig: Rig, log: Experiment, placed: Sequence[Placed], note: str) -> Experiment:
    """The experiment with where its actuator stood, and a ``note`` where that was not at 0: by the first
    signal behind it, while neither that nor what the rig with what is ``placed`` makes from 0 on has moved
    beyond the noise. What moves from the first sample on is to be further off than it goes meanwhile, for a
    dead time leaves as much."""
    role = "curvature" if "curvature" in log else "output"
    notes = tuple(n for n in log.notes if n != note)
    begins = {name: begin for name, begin in log.begins.items() if name != "curvature"}
    place = _place(rig, log, placed, role)
    if not place:
        return replace(log, stands=0.0, begins=begins, notes=notes)
    if role == "curvature":
        begins[role] = Begin((place,))
    return replace(log, stands=place, begins=begins, notes=(*notes, note))


def _place(rig: Rig, log: Experiment, placed: Sequence[Placed], role: str) -> float:
    """Where the actuator stood, in its output's unit; 0 where that does not show."""
    entry = "command" if "command" in log else "pressure"
    gain, last = (1.0, "actuator") if role == "curvature" else (rig.sensor.dc_gain, "sensor")
    level = np.isfinite(rig.regulator.dc_gain) and np.isfinite(gain) and gain != 0.0
    if entry not in log or role not in log or len(log) < 2 * _FIRST or not level:
        return 0.0
    run, chain = Run.of([len(log)], [log.start], log.sample_time), Chain(rig, tuple(placed))
    made = chain.run(np.asarray(log[entry], float), ENTERS[entry], last, run, between_of(rig, entry))
    made, y = made[log.read(role)], np.asarray(log[role], float)[log.read(role)]
    if len(y) < 2 * _FIRST:
        return 0.0
    off = y - made
    noise = white_level(off)
    if white_level(y) < _ROUNDING * float(np.ptp(y)):  # as of rows that a logger filled in
        noise = _UNKNOWN * float(np.ptp(y))
    still = max(min(_moves(made, noise), _moves(off, noise)), _FIRST)
    place, drifted = float(np.median(off[:still])), abs(np.mean(off[still - 2 : still]) - np.mean(off[:2]))
    unsure = _APART * noise / np.sqrt(still) + 2.0 * (np.ptp(made[: still + 2]) + drifted)
    return place / gain if abs(place) > unsure else 0.0


def _moves(signal: Array, noise: float) -> int:
    """The first sample at which a signal (n,), in means of a few, is off from its first ones."""
    means = np.convolve(signal, np.full(_FIRST, 1.0 / _FIRST), "valid")
    moved = np.abs(means - means[0]) > 2.0 * noise
    return int(np.argmax(moved)) if moved.any() else len(signal)
