"""A command that is logged late is told of where the rig answers it before it comes.

Red when that has no warning, since dead time, resonances and switches are then said of the rig; or when an
honest rig, with whatever effect, gets one.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.logs.ahead import is_answered_ahead
from focgen.rig.plausibility import doubts
from tests.diagnosis_rig import RIG, session

EFFECTS = [
    {},
    {"noise": 0.0},
    {"delay": 3},
    {"vent": 0.4},
    {"zone": 0.03},
    {"slip": 0.3},
    {"drift": 2e-3},
    {"alpha": 0.9},
    {"T": 0.5, "alpha": 1.0},
    {"T": 4.0},
]


def shifted(logs, late):
    """The command so many samples late, or early where it is negative."""
    made = []
    for log in logs:
        u = log["command"]
        ends = np.full(abs(late), u[0] if late > 0 else u[-1])
        moved = np.r_[ends, u[:-late]] if late > 0 else np.r_[u[-late:], ends]
        made.append(replace(log, signals=dict(log.signals) | {"command": moved}))
    return made


@pytest.mark.parametrize("roles, late", [(("pressure",), 2), (("pressure",), 3), (("pressure",), 8), ((), 8)])
def test_a_command_that_is_logged_late_is_told_of(roles, late):
    (warning,) = doubts(RIG, shifted(session(1, roles=roles), late))
    assert "answers the command before it comes; the command logged late" in warning


@pytest.mark.parametrize(
    "effect",
    [pytest.param(e, marks=pytest.mark.long if turn % 2 else ()) for turn, e in enumerate(EFFECTS)],
    ids=str,
)
def test_what_a_rig_does_late_or_slowly_is_no_such_thing(effect):
    logs = session(2, **effect)
    for part in (logs, logs[:1], logs[2:3], logs[3:4], shifted(logs, -3)):
        assert not any(is_answered_ahead(part, role) for role in ("pressure", "curvature", "output"))
