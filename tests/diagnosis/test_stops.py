"""Stops at both ends of a stroke are an obstacle, not a reading that stops or a spring that stiffens.

Red when an obstacle is looked for on one side only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, MASS, DAMPER, SPRING = 0.02, 0.02, 0.3, 2.0
COIL = Rig(
    "voice coil",
    H,
    Signals("t", "y", "u"),
    LinearActuator(TransferFunction([(0.96, 0.0)], [(MASS, 2.0), (1.05 * DAMPER, 1.0), (SPRING, 0.0)])),
)
STOP, STIFFNESS = 0.85, 8.0
LEVELS = (1.0, 0.0, -1.0, 2.0, -2.0, 0.5, 3.0, -0.5, -3.0, 1.5, 0.0)


def moved(command: np.ndarray) -> np.ndarray:
    """The coil's place (n,), the command held from sample to sample."""

    def slope(t, state):
        pushed = STIFFNESS * (state[0] - np.clip(state[0], -STOP, STOP))
        drive = command[min(int(t / H), len(command) - 1)]
        return [state[1], (drive - SPRING * state[0] - DAMPER * state[1] - pushed) / MASS]

    t = np.arange(len(command)) * H
    return solve_ivp(slope, (0, t[-1]), [0.0, 0.0], t_eval=t, max_step=H / 2, rtol=1e-6).y[0]


def session() -> list[Experiment]:
    """Steps and a slow sine both ways of zero."""
    rng, t = np.random.default_rng(11), np.arange(1230) * H
    steps = np.r_[np.zeros(20), np.repeat(LEVELS, 110)]
    logs = []
    for i, (name, command) in enumerate((("steps", steps), ("sine", 3.0 * np.sin(0.9 * t)))):
        seen = moved(command) + 0.01 * rng.normal(size=len(t))
        log = Experiment(name, H, {"command": command, "output": seen})
        logs.append(replace(log, start=60.0 * i))
    return logs


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.long)])
def test_stops_at_both_ends_are_an_obstacle(count):
    found = diagnose(COIL, session()[:count])
    (cause,) = found.causes
    assert cause.candidates[0].effect == "contact" and cause.candidates[0].form == "both_ways"
    assert found.shrink is not None and found.shrink > 0.8
