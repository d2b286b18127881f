"""The campaign under faults in short, and that it sees what it is there to see.

Red when a loop does not survive a fault, or the campaign does not see one that fails.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.trust import campaign as module
from tests.trust.campaign import LIMITS, campaign, table, wound_up
from tests.trust.faults import FAULTS
from tests.trust.seat import Seat

STARTS = ("AnyState", "Zeroed", "Restarted")


@pytest.fixture
def brief(monkeypatch):
    """Less time between the faults."""
    for name, seconds in (("BEGIN", 3.0), ("REST", 3.0), ("LAST", 1.0)):
        monkeypatch.setattr(module, name, seconds)


@pytest.mark.parametrize("arithmetic", ("f32", "q15"))
def test_every_fault_is_outlived(brief, arithmetic):
    rows = campaign(arithmetic, 1.0, 0)
    assert len(rows) == len(FAULTS) and all(row.compared > 200 for row in rows)
    assert [row for row in rows if not row.holds] == []
    assert table(rows).count("\n") == len(FAULTS) + 1 and "NOT" not in table(rows)


def test_what_is_wrong_is_seen(brief, monkeypatch):
    """A count that is off in one sample, and an output that no limit holds."""
    real = Seat.step

    def off(self, ref, meas, sched):
        u = real(self, ref, meas, sched)
        if len(self.lane.inputs) == 50:
            self.lane.answers[-1] = (self.lane.answers[-1][0] + 1, self.lane.answers[-1][1])
        if len(self.lane.inputs) == 60:
            self.lane.answers[-1] = (1 << 15, 0)
        return u

    monkeypatch.setattr(module, "FAULTS", FAULTS[:2])
    monkeypatch.setattr(Seat, "step", off)
    for row in campaign("q15", 0.5, 0):
        assert row.wrong >= 2 and not row.within and not row.holds


def test_a_fault_that_is_never_outlived_is_seen(brief, monkeypatch):
    monkeypatch.setattr(module, "REST", 0.3)
    monkeypatch.setattr(module, "FAULTS", FAULTS[-1:])
    (row,) = campaign("q15", 1.0, 0)
    assert row.recovery == np.inf and not row.holds and "never" in table([row])


def test_what_is_owed_with_an_exponential_memory(brief, monkeypatch):
    """After a start in any state: everything once ``init`` was called, or the state is zero; without it a
    finite output within its limits, however long the means take.
    """
    monkeypatch.setattr(module, "FAULTS", tuple(f for f in FAULTS if f.__name__ in STARTS))
    rows = dict(zip(STARTS, campaign("q31", 1.0, 0, "exponential")))
    assert [name for name in ("Zeroed", "Restarted") if not rows[name].recovery < 1.0] == []
    wild = rows["AnyState"]
    assert not wild.owed and wild.finite and wild.within and wild.holds
    assert not replace(wild, within=False).holds and not replace(wild, wrong=1).holds
    assert not replace(rows["Zeroed"], recovery=np.inf).holds


def test_windup_is_seen():
    reference = np.full(10, 0.01)
    above = np.array([0.0] * 4 + [0.02] * 6)
    assert wound_up(np.full(10, LIMITS[1]), above, reference) == 6
    assert wound_up(np.full(10, LIMITS[1]), np.zeros(10), reference) == 0
    assert wound_up(np.full(10, LIMITS[0]), np.zeros(10), reference) == 10
    assert wound_up(np.full(10, 1.0), above, reference) == 0
