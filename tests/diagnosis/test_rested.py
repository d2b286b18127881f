"""Logs with clocks of their own, ahead of which a rest was told that was too short.

Red when what the earlier logs would have left is kept ahead of a log though what was found suits a long rest.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis import findings as module
from focgen.diagnosis.hypotheses.initial import rested_long
from focgen.logs.experiment import Experiment
from focgen.rig.recalled import all_ahead
from focgen.rig.rig import Actuator, Rig, Signals

H = 0.05
RIG = Rig("finger", H, Signals("t", "y", pressure="p"), Actuator(1.5, 0.55, (1.0,)))


def too_soon():
    """Four logs of steps, each but the first with what the ones before left, after a rest of a response time
    that nobody has timed."""
    p = np.r_[np.zeros(10), np.repeat([0.9, 0.3, 0.7, 0.5], 100), np.zeros(90)]
    logs = [
        Experiment(f"run {n}", H, {"pressure": p, "output": p}, start=n * H * len(p), paused=n > 0)
        for n in range(4)
    ]
    return all_ahead(RIG, logs)[3]


@pytest.mark.parametrize(("nats", "asked"), [(5.0, False), (20.0, True)])
def test_a_long_rest_is_searched_where_it_suits_what_was_found(nats, asked, monkeypatch):
    """By their nats, for a fit that is bent to a wrong past leaves no more than one without it."""
    told, again = too_soon(), []
    search = SimpleNamespace(only=None, better=lambda found, logs: again.append(logs))
    found = (SimpleNamespace(causes=("a drift",)),)
    monkeypatch.setattr(module, "gained", lambda e, logs: nats)
    assert module._rested(search, found, told) == (found, told)
    assert [[log.begins for log in logs] for logs in again] == [[{}] * 4] * asked


def test_without_an_effect_no_rest_is_taken_back(monkeypatch):
    told = too_soon()
    monkeypatch.setattr(module, "gained", lambda e, logs: 100.0)
    search = SimpleNamespace(only=None, better=lambda found, logs: pytest.fail("searched"))
    found = (SimpleNamespace(causes=()),)
    assert module._rested(search, found, told) == (found, told)


def test_only_what_no_clock_tells_is_taken_back():
    told = too_soon()
    assert any(log.begins for log in told)
    assert [log.begins for log in rested_long(told)] == [{}] * 4
    timed = tuple(replace(log, paused=False) for log in told)
    assert rested_long(timed) == timed
