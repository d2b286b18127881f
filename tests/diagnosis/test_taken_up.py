"""An output that takes up another signal at once, past what is between, is no effect of the library.

Red when a gauge on a wall that bulges is a lag, or a cable beside the drive's a resonance, for sure; when the
note does not say which signal it is; or when an effect is taken for such a thing.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.diagnosis.findings import explain_all
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict.taken_up import taken_up
from tests.diagnosis_rig import RIG, session


def taking(role, part, seed=3, roles=("command", "pressure", "curvature", "output")):
    """The logs of a sound rig whose output has a ``part`` of its reach from another signal."""
    made = []
    for log in session(seed):
        reach = np.max(np.abs(log["output"])) / np.max(np.abs(log[role]))
        output = log["output"] + part * reach * log[role]
        kept = {r: log[r] for r in roles if r != "output"}
        made.append(replace(log, signals={**kept, "output": output}))
    return made


ALL = ("command", "pressure", "curvature", "output")


@pytest.mark.long
@pytest.mark.parametrize(
    "role, part, roles",
    [
        ("command", 0.06, ("command", "output")),
        ("pressure", -0.07, ALL),
        ("command", 0.06, ALL),
    ],
)
def test_what_the_gauge_takes_up_is_unknown_and_said(role, part, roles):
    found = diagnose(RIG, taking(role, part, roles=roles), pictures=False)
    assert not any(c.confidence > 0.9 for cause in found.causes for c in cause.candidates)
    assert any(f"take up the {role}" in note for note in found.notes)


def test_how_much_of_it_is_found():
    logs = taking("pressure", -0.07)
    (*_, last) = explain_all(RIG, logs, NUMBERS.nats, ["sensor_lag"])
    found = taken_up(last)
    assert found.role == "pressure" and found.part == pytest.approx(-0.07, abs=0.01) and found.odds > 0.0


@pytest.mark.parametrize("vent", [0.5, pytest.param(0.8, marks=pytest.mark.long)])
def test_an_effect_is_not_taken_for_it(vent):
    (first, *_) = explain_all(RIG, session(11, vent=vent), NUMBERS.nats)
    assert first.causes and (taken_up(first) is None or taken_up(first).odds < -5.0)
