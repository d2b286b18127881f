"""What the form of a first stage lacks, in the input of the next one.

Red when what a valve's form leaves of its spool's motion is taken for something of the actuator behind it.
"""

import numpy as np
import pytest

from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.hypotheses.initial import begun_session
from focgen.logs.experiment import Experiment
from tests.diagnosis_rig import RIG, H, _fractional, _lag, _noise, commands

BAND, KINETIC, SLIDES = 0.27, 0.165, 0.045  # V, V, s
PARTS, QUIET = 20, 0.02  # of a sample; of the excess, below which the spool is held


def spool(commands):
    """A spool that breaks loose beyond a band, slides in its own time, and is held where kinetic friction
    does. Where a command is slow it slips and is held, and where it is quick it follows. No form has both."""
    x, loose, found = 0.0, False, []
    for u in commands:
        for _ in range(PARTS):
            pull = u - x
            loose = loose or abs(pull) > BAND
            if loose:
                excess = max(abs(pull) - KINETIC, 0.0)
                x += np.copysign(excess * -np.expm1(-H / PARTS / SLIDES), pull)
                loose = excess >= QUIET * (BAND - KINETIC)
        found.append(x)
    return np.array(found)


def session(seed):
    rng, logs, start = np.random.default_rng(seed), [], 0.0
    for name, u in commands().items():
        p = _lag(0.1 * spool(u), 0.12)
        y = _lag(_fractional((0.002 + 0.34 * p) * p, 1.3, 0.6), 1 / 6.0)
        signals = {"command": u, "pressure": p + 0.006 * 0.18 * _noise(rng, len(u))}
        signals["output"] = y + 0.003 * 0.011 * _noise(rng, len(u))
        logs.append(Experiment(name, H, signals, start))
        start += len(u) * H + 15
    return begun_session(RIG, logs)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_what_a_valve_s_form_lacks_is_nothing_of_the_actuator(seed):
    valve, actuator = explain_all(RIG, session(seed), 12.0)
    assert [c.effect for c in valve.best.problem.candidates] == ["valve_stiction"]
    assert valve.predictability.share > 0.01  # inputs predict a little of what the form leaves
    assert not actuator.causes
    assert actuator.predictability.share < 0.02
