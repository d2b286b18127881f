"""A rig whose zero is in none of its logs: of another unit, as kelvin, or of a gauge zeroed since.

What the rig's file says of its zero is a claim, and the logs show where it lies. One that is farther off than
everything that the rig moves by, all the time, tells nothing. Effects would be looked for around it: a
ceiling was an obstacle at 0.95, and behind a zero of 293 K a bent curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.logs.experiment import Experiment
from focgen.rig.replay import simulate_session
from focgen.rig.rig import UNITY, Rig

_ALIKE = 0.5  # of what the model moves, both root mean square: by so much a gap that is one zero's may differ
_SAID = (
    "the rig's zero of the {} is {}, and the logs lie by {} from what it makes of that, farther than it "
    "moves: it is taken as {}. Correct its offset, or the column's unit"
)


def with_zero_of(rig: Rig, logs: Sequence[Experiment]) -> tuple[Rig, tuple[str, ...]]:
    """The rig with zeros that the logs bear out, and a warning for each that they did not. What a rig that
    integrates, or has effects, says stays."""
    if not logs or rig.effects or rig.integrator or not np.isfinite(rig.sensor.dc_gain):
        return rig, ()
    said: list[str] = []
    for role in ("curvature", "output"):
        off = _off(rig, logs, role) if all(role in log for log in logs) else 0.0
        if off:
            unit, was = rig.signals.unit_of(role) or "", rig.own_zero(role)
            numbers = (f"{x:.4g} {unit}".rstrip() for x in (was, abs(off), was + off))
            said.append(_SAID.format(role, *numbers))
            rig = _moved(rig, role, off, "curvature" in logs[0])
    return rig, tuple(said)


def _off(rig: Rig, logs: Sequence[Experiment], role: str) -> float:
    """By what the zero of ``role`` is off, where it is elsewhere altogether: farther than everything moves,
    and the same all the time. What a wrong gain or sign, or a rig that comes to rest, makes is not."""
    made = np.concatenate([signals[role] for signals in simulate_session(rig, logs, continues=False)])
    read = np.concatenate([np.asarray(log[role], float) for log in logs])
    off = float(np.median(read - made))
    moves = max(float(np.ptp(read)), float(np.max(np.abs(made - rig.own_zero(role)))))
    steady = float(np.std(read - made)) < _ALIKE * float(np.std(made))
    return off if np.isfinite(off) and abs(off) > moves and steady else 0.0


def _moved(rig: Rig, role: str, off: float, curvature_logged: bool) -> Rig:
    """The rig with another zero of ``role``, and no other. It is the actuator's own offset where that is the
    only one and nothing logged says otherwise."""
    actuator = rig.actuator
    if role == "curvature":
        if actuator is None:
            return rig
        moved = replace(actuator, offset=actuator.offset + off)
        return replace(rig, actuator=moved, zero=rig.zero - rig.sensor.dc_gain * off)
    alone = rig.zero == 0.0 and rig.sensor == UNITY and not curvature_logged
    if actuator is not None and actuator.offset and alone:
        return replace(rig, actuator=replace(actuator, offset=actuator.offset + off))
    return replace(rig, zero=rig.zero + off)
