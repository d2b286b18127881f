"""An axis that moves as its log begins: no first sample tells how fast, so no effect is sure.

Red when what is left of that motion is a drift at .95, or an axis that begins at rest is doubted.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, TAU, GAIN, NOISE = 0.05, 1.0, 2.0, 0.01
AXIS = LinearActuator(TransferFunction([(GAIN, 0.0)], [(1.05 * TAU, 2.0), (1.0, 1.0)]))
RIG = Rig("axis", H, Signals("t", "y", "u"), AXIS)


def ramps(seed: int, skip: int, drift: float = 0.0) -> list[Experiment]:
    """A position from ramps of a voltage of either sign, logged from sample ``skip`` on."""
    rng, n = np.random.default_rng(seed), 1500
    volts = np.interp(np.arange(n) / 150.0, np.arange(12), np.r_[0.0, rng.uniform(-1.0, 1.0, 11)])
    volts[:20] = 0.0
    kept = np.exp(-H / TAU)
    speed = lfilter([0.0, 1.0 - kept], [1.0, -kept], GAIN * volts)
    place = H * np.cumsum(speed) - 0.5 * H * speed + drift * np.arange(n) * H
    signals = {"command": volts, "output": place + rng.normal(0.0, NOISE, n)}
    return [Experiment("e", H, {role: x[skip:] for role, x in signals.items()})]


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in (2, 4, 5, 6, 7))])
def test_nothing_is_sure_where_a_log_begins_underway(seed):
    found = diagnose(RIG, ramps(seed, 400), pictures=False)
    sure = [cause.candidates[0].confidence for cause in found.causes]
    assert all(each < 0.7 for each in sure)
    assert any("while the rig moves" in note for note in found.notes)


@pytest.mark.parametrize("seed", [0, *(pytest.param(s, marks=pytest.mark.long) for s in range(1, 4))])
def test_a_log_that_begins_at_rest_is_not_doubted(seed):
    found = diagnose(RIG, ramps(seed, 0), pictures=False)
    assert found.causes == () and not any("while the rig moves" in note for note in found.notes)
