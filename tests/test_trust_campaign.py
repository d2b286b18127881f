"""The campaign under faults in short, and that it sees what it is there to see."""

import numpy as np
import pytest

from tests.trust import campaign as module
from tests.trust.campaign import LIMITS, campaign, table, wound_up
from tests.trust.faults import FAULTS
from tests.trust.seat import Seat


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


def test_windup_is_seen():
    reference = np.full(10, 0.01)
    above = np.array([0.0] * 4 + [0.02] * 6)
    assert wound_up(np.full(10, LIMITS[1]), above, reference) == 6
    assert wound_up(np.full(10, LIMITS[1]), np.zeros(10), reference) == 0
    assert wound_up(np.full(10, LIMITS[0]), np.zeros(10), reference) == 10
    assert wound_up(np.full(10, 1.0), above, reference) == 0
