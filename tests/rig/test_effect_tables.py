"""[[effects]] of a rig's file: numbers that no fit could have found are refused, each by its name.

Red when a run of the rig ends in NaN or in a fault of its own, or an effect does something else than it says.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import RigError
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from tests.diagnosis_rig import RIG, H

STEP = np.where(np.arange(400) > 20, 1.0, 0.0)
LOG = Experiment("step", H, {"command": STEP, "output": np.cumsum(STEP) * 1e-5})
CREEP = {"name": "creep", "stage": "actuator", "share": 0.3, "time": 5.0}


def run(**change):
    """The rig with creep, altered so."""
    effect = {key: value for key, value in (CREEP | change).items() if value is not None}
    return replay(replace(RIG, effects=(effect,)), [LOG])


@pytest.mark.parametrize(
    "change",
    [
        *({"share": value} for value in (math.nan, math.inf, -0.3, "0.3", True, [1], 1e50)),
        *({"time": value} for value in (0.0, -5.0, math.nan)),
        *({"clock": value} for value in (math.nan, "now")),
        {"carried": 3},
        {"carried": {"strain": "x"}},
        {"carried": {"strain": math.nan}},
        {"name": ["creep"]},
    ],
)
def test_numbers_that_are_none_are_refused(change):
    with pytest.raises(RigError, match="give a |write it as a table|known: "):
        run(**change)


def test_numbers_that_may_be_are_run():
    usual = run().simulated["step"]["output"]
    assert np.isfinite(usual).all()
    none = run(share=0.0).simulated["step"]["output"]
    assert not np.allclose(usual, none, rtol=1e-3)
    late = {"name": "transport_delay", "stage": "regulator", "delay": 0.0, "share": None, "time": None}
    assert np.allclose(run(**late).simulated["step"]["output"], none, rtol=1e-9)
