"""A rig whose file has effects: they are part of what it is, and only what is new is named.

Red when the effects of the file are left out of what is compared with the logs.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.identification.identify import identify
from focgen.rig.replay import replay
from tests.diagnosis.test_slow import NOISE, RIG, session

CREEP = {"name": "creep", "form": "pole", "stage": "actuator", "share": 0.4, "time": 60.0}
GIVEN = replace(RIG, effects=({**CREEP, "clock": 118.0, "learned": [0.0, 2.2]},))


def rmse(rig, logs):
    return np.sqrt(np.mean([one.rmse**2 for one in replay(rig, logs).logs.values()]))


def test_what_the_file_has_is_no_gap():
    logs = session(7, 0.4, 60.0)
    found = diagnose(GIVEN, logs, pictures=False)
    assert found.verdict in ("none", "parameters") and not found.causes
    assert found.gap.as_given == pytest.approx(rmse(GIVEN, logs), rel=0.02)
    assert any("as the rig's file has it" in note and "creep of the actuator" in note for note in found.notes)
    assert rmse(found.refitted, logs) < 1.05 * NOISE


def test_what_is_new_is_named_beside_it():
    logs = [
        replace(log, signals=log.signals | {"output": np.minimum(log["output"], 2.0)})
        for log in session(7, 0.4, 60.0)
    ]
    found = diagnose(GIVEN, logs, pictures=False)
    (cause,) = found.causes
    assert "sensor_saturation" in [c.effect for c in cause.candidates]
    assert all(c.stage == cause.stage for c in cause.candidates)
    kept, new = found.augmented.effects
    assert [kept[k] for k in ("name", "share", "time", "learned")] == ["creep", 0.4, 60.0, [0.0, 2.2]]
    assert kept["clock"] == new["clock"] == pytest.approx(118.0 + logs[-1].start + 0.05 * len(logs[-1]))
    assert new["name"] == cause.candidates[0].effect


def test_identify_says_what_it_leaves_out():
    found = identify(GIVEN, session(3, 0.4, 60.0), integer=False)
    assert any("not in the new rig: creep of the actuator" in warning for warning in found.warnings)
    assert not found.rig.effects
