"""A rig whose zero is in none of its logs: of another unit, as kelvin, or of a gauge zeroed since.

What the rig's file says of its zero is a claim, and the logs show where it lies. One that is farther off than
everything that the rig moves by tells nothing, and effects would be looked for around it: a ceiling was an
obstacle at 0.95, and behind a zero of 293 K a bent curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.logs.experiment import Experiment
from focgen.rig.replay import simulate_session
from focgen.rig.rig import UNITY, Rig

_SAID = (
    "the rig's zero of the {} is {}, and the logs lie by {} from what it makes of that, farther than it "
    "moves: it is taken as {}. Correct its offset, or the column's unit"
)


def with_zero_of(rig: Rig, logs: Sequence[Experiment]) -> tuple[Rig, tuple[str, ...]]:
    """The rig with zeros that the logs bear out, and a warning for each that they did not. What a rig that
    integrates, or has effects, says stays."""
    if rig.effects or rig.integrator or not np.isfinite(rig.sensor.dc_gain):
        return rig, ()
    said: list[str] = []
    for role in ("curvature", "output"):
        if all(role in log for log in logs):
            now, off = _borne_out(rig, logs, role), 0.0
            if now is not rig:
                off = _rests(now, role) - _rests(rig, role)
                unit = rig.signals.unit_of(role) or ""
                numbers = (
                    f"{x:.4g} {unit}".rstrip() for x in (_rests(rig, role), abs(off), _rests(now, role))
                )
                said.append(_SAID.format(role, *numbers))
            rig = now
    return rig, tuple(said)


def _borne_out(rig: Rig, logs: Sequence[Experiment], role: str) -> Rig:
    """The rig, with the zero of ``role`` where the logs show it if that is elsewhere altogether."""
    made = np.concatenate([signals[role] for signals in simulate_session(rig, logs, continues=False)])
    read = np.concatenate([np.asarray(log[role], float) for log in logs])
    off = float(np.median(read - made))
    moves = max(float(np.ptp(read)), float(np.max(np.abs(made - _rests(rig, role)))))
    return _moved(rig, role, off) if np.isfinite(off) and abs(off) > moves else rig


def _rests(rig: Rig, role: str) -> float:
    """Where a signal of a rig at rest lies."""
    offset = 0.0 if rig.actuator is None else rig.actuator.offset
    return offset if role == "curvature" else rig.zero + rig.sensor.dc_gain * offset


def _moved(rig: Rig, role: str, off: float) -> Rig:
    """The rig with another zero, in the offset that it has."""
    actuator = rig.actuator
    of_actuator = role == "curvature" or (rig.zero == 0.0 and rig.sensor == UNITY)
    if actuator is not None and of_actuator and (role == "curvature" or actuator.offset):
        return replace(rig, actuator=replace(actuator, offset=actuator.offset + off))
    return rig if role == "curvature" else replace(rig, zero=rig.zero + off)
