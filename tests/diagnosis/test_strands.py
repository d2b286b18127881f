"""Dry friction between parts that the load presses together, as strands or a tendon in its sheath, is a loop.

Red when it stands as a valve that sticks, or its promise is not kept.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

H, LAG = 0.05, 0.4
STRING = Rig("string", H, Signals("t", "y", "u"), Actuator(LAG, 1.0, (0.5, 0.5)))
CORNERS = (0.0, 1.9, 0.6, 1.4, 0.2, 1.0, 0.0)


def pulled(turn: np.ndarray, even: float, growing: float) -> np.ndarray:
    """The pull (n,) of a string, whose strands hold it by so much, and so much of what is asked more."""
    now, seen = 0.0, []
    for asked in 0.5 * turn + 0.5 * turn**2:
        seen.append(now)
        for _ in range(10):
            force, most = asked - now, even + growing * asked
            now += H / 10 / LAG * (force - np.clip(force, -most, most))
    return np.array(seen)


def session(even: float, growing: float) -> list[Experiment]:
    """A triangle with smaller ones in it, and steps."""
    ramps = [np.linspace(a, b, int(200 * abs(a - b))) for a, b in pairwise(CORNERS)]
    steps = np.repeat([1.0, 0.0, 2.0, 0.0, 0.5, 1.5, 0.8, 0.0], 80)
    logs = []
    for i, turn in enumerate((np.concatenate(ramps), np.r_[np.zeros(20), steps])):
        noise = 0.015 * np.random.default_rng(i).normal(size=len(turn))
        roles = {"command": turn, "output": pulled(turn, even, growing) + noise}
        logs.append(replace(Experiment(str(i), H, roles), start=100.0 * i))
    return logs


@pytest.mark.long
@pytest.mark.parametrize("even, growing", [(0.02, 0.2), (0.0, 0.15)])
def test_strands_that_rub_are_a_loop_that_the_load_presses(even, growing):
    found = diagnose(STRING, session(even, growing))
    assert [c.candidates[0].effect for c in found.causes] == ["hysteresis"]
    assert found.causes[0].candidates[0].form == "pressed"
    assert found.shrink is not None and found.shrink > 0.93
