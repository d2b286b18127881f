"""What a simulated loop says of the effects in its rig: where they were learned, and what they promise.

Red when a set point beyond what was learned is not said to be beyond.
"""

from dataclasses import replace

import pytest

from focgen.diagnosis.verdict.compose import Rigs
from focgen.errors import RigError
from focgen.loop.learned import learned_notes
from focgen.rig.effects import library
from focgen.rig.files import read_rig, write_rig
from focgen.rig.placed import Placed
from tests.diagnosis_rig import RIG, session

LAG = {"name": "sensor_lag", "form": "one_lag", "lag": 0.2}


def notes(setpoints, **told):
    return learned_notes(replace(RIG, effects=(LAG | told,)), setpoints)


def test_set_points_beyond_what_was_learned_are_named():
    assert notes([0.002, 0.01]) == [] == notes([0.002, 0.01], learned=[0.0, 0.011])
    [said] = notes([0.002, 0.012, 0.014], learned=[0.0, 0.011])
    assert "from 0 to 0.011" in said and "at 0.012, 0.014 is an extrapolation" in said


@pytest.mark.parametrize("promise, doubted", [(0.95, False), (0.41, True)])
def test_the_promise_is_said_and_a_low_one_doubted(promise, doubted):
    [said] = notes([0.002], promise=promise)
    assert f"promise {promise:.0%}" in said and ("may differ" in said) == doubted


@pytest.mark.parametrize("told", [{"promise": "much"}, {"learned": [0.0]}, {"learned": 3.0}])
def test_what_says_neither_is_refused(told):
    with pytest.raises(RigError, match="sensor_lag"):
        notes([0.002], **told)


def test_a_diagnosed_rig_says_where_it_was_learned(tmp_path):
    logs = session(2)
    lag = Placed("sensor_lag", library()["sensor_lag"].forms[0], "sensor", (0.2,))
    write_rig(Rigs(RIG, RIG, (lag,)).augmented(logs, 0.87), tmp_path / "augmented.toml")
    [table] = read_rig(tmp_path / "augmented.toml").effects
    outputs = [log["output"] for log in logs]
    assert table["promise"] == 0.87 and table["learned"][0] == min(y.min() for y in outputs)
    assert table["learned"][1] == max(y.max() for y in outputs)
