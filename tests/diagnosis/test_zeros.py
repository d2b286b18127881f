"""The zero of a reading: the commonest fault of a bench, and no effect of the rig.

Red when a reading that is off by the same at every level is named a drift, or when the rigs that are written
leave the output off by it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.replay import replay
from focgen.rig.rig import Rig, Signals
from tests.diagnosis_rig import RIG, session

DRIFTS = ("sensor_drift", "gain_drift")


def off_by(logs, role, part):
    """The logs with a column off by ``part`` of the largest of it, and by how much that is."""
    zero = part * max(float(np.max(log[role])) for log in logs)
    return [replace(log, signals=dict(log.signals) | {role: log[role] + zero}) for log in logs], zero


def note_of(found, role):
    (line,) = (line for line in found.notes if f"the {role} reads" in line)
    return line


@pytest.mark.parametrize(
    "role, part",
    [
        ("output", -0.1),
        pytest.param("pressure", 0.1, marks=pytest.mark.long),
        pytest.param("curvature", 0.05, marks=pytest.mark.long),
        *(pytest.param(*case, marks=pytest.mark.long) for case in (("output", 0.3), ("pressure", -0.4))),
    ],
)
def test_a_zero_that_is_off_is_no_drift_and_in_the_rig(role, part):
    """Of 2 % nothing was said, and the output stayed off by it; 8 % were a ``sensor_drift`` at 0.95."""
    logs, zero = off_by(session(1), role, part)
    found, usual = (diagnose(RIG, of, pictures=False, only=DRIFTS) for of in (logs, session(1)))
    assert found.verdict == "parameters" and not found.causes
    assert found.gap.refitted < 1.1 * usual.gap.refitted
    told = -zero if role == "curvature" else zero
    line = note_of(found, "output" if role == "curvature" else role)
    assert f"{'more' if told > 0.0 else 'less'} than the" in line
    assert float(line.split(" reads ")[1].split()[0]) == pytest.approx(abs(zero), rel=0.1)


def test_a_small_zero_is_in_the_rig_that_is_written():
    logs, _ = off_by(session(1), "output", 0.02)
    found, usual = (diagnose(RIG, of, pictures=False) for of in (logs, session(1)))
    assert found.verdict == "parameters" and not found.causes
    assert found.gap.refitted < 1.05 * usual.gap.refitted
    replayed, as_usual = replay(found.refitted, logs), replay(usual.refitted, session(1))
    for name, result in replayed.logs.items():
        assert result.gof == pytest.approx(as_usual.logs[name].gof, abs=0.01)


def test_an_effect_beside_a_zero_is_named_and_both_are_in_the_rig():
    logs, zero = off_by(session(2, bend=12.0), "output", 0.1)
    found = diagnose(RIG, logs, pictures=False, only=("sensor_nonlinearity", "sensor_drift"))
    assert [c.candidates[0].effect for c in found.causes] == ["sensor_nonlinearity"]
    assert found.gap.explained < 1.3 * found.gap.floor
    assert found.augmented.zero == pytest.approx(zero, rel=0.1)


def test_a_rig_as_given_has_no_zero_off():
    found = diagnose(RIG, session(3), pictures=False)
    assert found.verdict in ("none", "parameters") and not any(" reads " in line for line in found.notes)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(s, marks=pytest.mark.long) for s in range(2, 4))])
def test_what_a_pump_held_is_no_zero(seed):
    """Both shift its path alike. As free as elsewhere, the zero took it in two of four. And white noise is
    a pump's floor: by its recent part, a seventh of it, the pump was ``unknown`` in all."""
    rig = Rig("pump", 0.05, Signals("t", "y", "u"), regulator=TransferFunction([(0.2, 0.0)], [(1.0, 1.0)]))
    u = np.repeat([0.0, 1.0, 0.0, -0.5, 0.0, 0.7, 0.0], 100)
    y = 1.0 + 0.2 * 0.05 * np.r_[0.0, np.cumsum(u)[:-1]]
    y += 0.01 * np.random.default_rng(seed).normal(size=len(u))
    found = diagnose(rig, [Experiment("log", 0.05, {"command": u, "output": y}, 0.0)], pictures=False)
    assert found.verdict in ("none", "parameters") and abs(found.refitted.zero) < 0.1
    assert found.gap.floor == pytest.approx(0.01, rel=0.1)
