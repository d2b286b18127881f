"""Logs that follow one another before a creep has died away, made here step by step.

Red when what an earlier log left is taken for a drift, or hides the creep that left it.
"""

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.logs.read import in_session_order
from focgen.rig.rig import LinearActuator, Rig, Signals

H, LAG, SHARE, SLOW = 0.1, 0.5, 0.12, 30.0
REST = 15.0  # s, between the logs
NOISE, PARTS = 0.004, 20


def session(seed, at=0.0):
    """Three logs of holds of a pressure, of one lag with one Kelvin-Voigt element behind it, and with rests
    ``at`` a pressure between them that no log shows: start, pressure, output."""
    rng, y, slow, start, found = np.random.default_rng(seed), 2.0 * at, 2.0 * at * SHARE, 0.0, []
    for _ in range(3):
        held = np.repeat(rng.uniform(0.3, 1.0, 4), 300)
        p = np.r_[np.full(5, at), held, np.full(300 + int(REST / H), at)]
        made = []
        for x, then in zip(p, np.r_[p[1:], at]):  # the pressure runs in lines
            made.append(y + slow)
            for j in range(PARTS):
                y += H / PARTS * (2.0 * (x + (then - x) * (j + 0.5) / PARTS) - y) / LAG
                slow += H / PARTS * (SHARE * y - slow) / SLOW
        count = len(p) - int(REST / H)
        output = np.array(made[:count]) + NOISE * rng.standard_normal(count)
        found.append((start, p[:count], output))
        start += H * len(p)
    return found


@pytest.mark.long
@pytest.mark.parametrize("at", [0.0, 0.25])
@pytest.mark.parametrize("clock", ["one", "of its own"])
def test_a_creep_that_goes_on_is_no_drift(clock, at):
    """Where rigs rest elsewhere than at 0, a log was taken to begin at a level held for ever."""
    actuator = LinearActuator(TransferFunction([(2.05, 0.0)], [(0.52, 1.0), (1.0, 0.0)]))
    rig = Rig("finger", H, Signals("t", "y", pressure="p"), actuator)
    logs = [
        Experiment(f"run {k}", H, {"pressure": p, "output": y}, start=start)
        for k, (start, p, y) in enumerate(session(2, at))
    ]
    if clock != "one":
        logs = in_session_order([Experiment(log.name, H, log.signals) for log in logs])
    found = diagnose(rig, logs, pictures=False)
    (cause,) = found.causes
    assert cause.candidates[0].effect == "creep"
    assert found.gap.explained < 1.3 * NOISE
    if clock == "one":
        assert cause.candidates[0].parameters["share"].value == pytest.approx(SHARE, rel=0.05)
        assert cause.candidates[0].parameters["time"].value == pytest.approx(SLOW, rel=0.05)
