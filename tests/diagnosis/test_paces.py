"""Regulators that fill and vent through one lag, each way at its own pace, made here step by step.

Red when a valve whose own lag is longer while it vents is taken for anything else.
"""

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.rig import LinearActuator, Rig, Signals

H, SAMPLES, PARTS = 0.02, 3000, 20


def lag(gain, time):
    return TransferFunction([(gain, 0.0)], [(time, 1.0), (1.0, 0.0)])


def pumped(seed, pace):
    """Random holds of a command, the pressure p' = (u - p)/T, which vents ``pace`` times as fast, and what a
    lag makes of it: as measured."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(0.0, 1.0, SAMPLES // 150), 150)
    u[:50] = 0.0
    p, y, found = 0.0, 0.0, []
    for command in u:
        found.append((p, y))
        for _ in range(PARTS):
            p += H / PARTS * (command - p) * (1.0 if command > p else pace)
            y += H / PARTS * (2.0 * p - y) / 0.4
    pressure, output = np.array(found).T + np.array([[0.005], [0.01]]) * rng.standard_normal((2, SAMPLES))
    return {"command": u, "pressure": pressure, "output": output}


@pytest.mark.parametrize("pressure", ["p", None])
@pytest.mark.parametrize("pace", [0.5, 0.8, 1.4])
def test_a_pump_vents_at_another_pace(pace, pressure):
    rig = Rig(
        "pump", H, Signals("t", "y", "u", pressure=pressure), LinearActuator(lag(1.95, 0.42)), lag(1.01, 1.05)
    )
    log = pumped(round(10 * pace), pace)
    if not pressure:
        del log["pressure"]
    found = diagnose(rig, [Experiment("holds", H, log)], pictures=False)
    assert found.verdict == "named"
    (cause,) = found.causes
    (first,) = cause.candidates
    assert (cause.stage, first.effect) == ("regulator", "valve_asymmetry")
    assert first.parameters["venting_speed"].value == pytest.approx(pace, rel=0.02)
