"""A gauge that warms up over logs with clocks of their own: its zero is no rest that was too short.

Red when what the earlier logs would have left is kept ahead of a log though what was found suits a long rest.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from focgen.diagnosis import diagnose as module
from focgen.diagnosis.hypotheses.initial import rested_long
from focgen.logs.experiment import Experiment
from focgen.rig.recalled import all_ahead
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Actuator, Rig, Signals

H, NOISE, PAUSE = 0.05, 0.004, 120.0
RIG = Rig("finger", H, Signals("t", "y", pressure="p"), Actuator(1.5, 0.55, (1.0,)))


def session(seed, size, warm):
    """Four logs of 40 s from rest, two minutes apart, each with a clock of its own: the reading is off by a
    zero that settles in ``warm`` s."""
    rng, found, start = np.random.default_rng(seed), [], 0.0
    for log in range(4):
        p = np.r_[np.zeros(10), np.repeat(rng.uniform(0.2, 1.0, 7), 100), np.zeros(90)]
        one = Experiment(f"run {log}", H, {"pressure": p, "output": p})
        (made,) = simulate_session(RIG, [one])
        zero = -size * (1.0 - np.exp(-(log * (PAUSE + H * len(p)) + H * np.arange(len(p))) / warm))
        output = made["output"] + zero + NOISE * rng.standard_normal(len(p))
        found.append(replace(one, signals={"pressure": p, "output": output}, start=start, paused=log > 0))
        start += H * len(p)
    return found


@pytest.mark.parametrize(("nats", "asked"), [(5.0, False), (20.0, True)])
def test_a_long_rest_is_searched_where_it_suits_what_was_found(nats, asked, monkeypatch):
    """By their nats, for a fit that is bent to a wrong past leaves no more than one without it."""
    told, again = all_ahead(RIG, session(1, 0.0, 300.0))[3], []
    search = SimpleNamespace(only=None, better=lambda found, logs: again.append(logs))
    found = (SimpleNamespace(causes=("a drift",)),)
    monkeypatch.setattr(module, "gained", lambda e, logs: nats)
    assert module._rested(search, found, told) == (found, told)
    assert [[log.begins for log in logs] for logs in again] == [[{}] * 4] * asked


def test_without_an_effect_no_rest_is_taken_back(monkeypatch):
    told = all_ahead(RIG, session(1, 0.0, 300.0))[3]
    monkeypatch.setattr(module, "gained", lambda e, logs: 100.0)
    search = SimpleNamespace(only=None, better=lambda found, logs: pytest.fail("searched"))
    found = (SimpleNamespace(causes=()),)
    assert module._rested(search, found, told) == (found, told)


def test_only_what_no_clock_tells_is_taken_back():
    logs = session(1, 0.0, 300.0)
    told = all_ahead(RIG, logs)[3]
    assert [log.begins for log in rested_long(told)] == [{}] * 4
    timed = tuple(replace(log, paused=False) for log in told)
    assert rested_long(timed) == timed
