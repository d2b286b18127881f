"""A tank that cools between its logs: what its temperature was there, its heater tells.

Red when a signal between two logs counts as 0 or as a level where the one that drives it is known, or when a
dead time of several response times is lost.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.diagnosis.diagnose import diagnose
from focgen.fractional.transfer import TransferFunction
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.placed import Placed
from focgen.rig.recalled import recalled
from focgen.rig.replay import simulate_session
from focgen.rig.rig import Delays, LinearActuator, Rig, Signals

H, ROOM, LAG = 5.0, 21.0, 40.0
LOG, GAP = 900, 240  # samples
RIG = Rig(
    "tank",
    H,
    Signals("t", "probe", pressure="heat", curvature="tank"),
    LinearActuator(TransferFunction([(0.02, 0.0)], [(1100.0, 1.0), (1.0, 0.0)]), ROOM),
    sensor=TransferFunction([(1.0, 0.0)], [(LAG, 1.0), (1.0, 0.0)]),
    delays=Delays(sensor=20.0),
)


def session_of(late=0.0, noise=0.0, seed=0, idle=0.0):
    """Three logs and what was between them: the whole recording, and where each log begins. ``late``: a dead
    time, s, that the rig does not know; ``idle``: what the heater gives before and between the logs, W."""
    rng = np.random.default_rng(seed)
    heat = [np.r_[np.full(20, idle), np.repeat(rng.uniform(100.0, 900.0, 8), 110)] for _ in range(3)]
    whole = np.concatenate([np.r_[x, np.full(GAP, idle)] for x in heat])
    delay = library()["transport_delay"]
    placed = [Placed("transport_delay", delay.forms[0], "sensor", (late,))] if late else []
    one = Experiment("whole", H, {"pressure": whole}, begins={"pressure": Begin((idle,))})
    (made,) = simulate_session(RIG, [one], placed)
    signals = {"pressure": whole, "curvature": made["curvature"], "output": made["output"]}
    signals = {role: x + rng.normal(0.0, noise, len(x)) for role, x in signals.items()}
    starts = [k * (LOG + GAP) for k in range(3)]
    logs = [
        Experiment(f"run {k}", H, {role: x[a : a + LOG] for role, x in signals.items()}, start=a * H)
        for k, a in enumerate(starts)
    ]
    return signals, starts, logs


def between(signals, starts, told, k):
    """How far (the temperature as told less what it was) before log ``k``, of its span, in the gap."""
    begin = told[k].before("curvature")
    made, was = begin.samples(H), signals["curvature"][: starts[k]]
    return (made[-GAP:] - was[-GAP:]) / np.ptp(signals["curvature"])


@pytest.mark.parametrize("seed", range(4))
def test_between_two_logs_a_signal_is_what_the_one_ahead_drives_it_to(seed):
    signals, starts, logs = session_of(late=400.0, seed=seed)
    told = recalled(RIG, logs)
    for k in (1, 2):
        assert told[k].before("pressure").known
        assert not told[k].before("curvature").known  # nobody has seen the gap
        off = between(signals, starts, told, k)
        assert np.sqrt(np.mean(off**2)) < 0.02  # means over windows, a tenth as wide as they are ago
        assert abs(off[-1]) < 0.005


def test_it_ends_where_the_log_begins_though_the_rig_is_not_quite_as_given():
    """A fifth slower than given: both ends are measured, and between them the shape is a little off."""
    signals, starts, logs = session_of(seed=1)
    slower = TransferFunction([(0.02, 0.0)], [(1320.0, 1.0), (1.0, 0.0)])
    other = replace(RIG, actuator=LinearActuator(slower, ROOM))
    told = recalled(other, logs)
    off = between(signals, starts, told, 2)
    assert abs(off[-1]) < 0.005
    assert np.sqrt(np.mean(off**2)) < 0.02


@pytest.mark.parametrize("seed", range(4))
def test_a_level_that_is_held_drives_it_too(seed):
    """Where the heater idled at 200 W between the logs, as they begin."""
    signals, starts, logs = session_of(idle=200.0, seed=seed)
    warm = ROOM + 0.02 * 200.0
    logs = [replace(log, begins={"pressure": Begin((200.0,)), "curvature": Begin((warm,))}) for log in logs]
    told = recalled(RIG, logs, held=())
    for k in (1, 2):
        assert np.sqrt(np.mean(between(signals, starts, told, k) ** 2)) < 0.02


@pytest.mark.long
def test_a_dead_time_of_ten_response_times_is_found():
    """Of the gauge, which takes a minute: the past that the logs begin with is in it for far longer."""
    _, _, logs = session_of(late=600.0, noise=0.03, seed=3)
    found = diagnose(RIG, logs, pictures=False)
    (cause,) = found.causes
    first = cause.candidates[0]
    assert (first.effect, first.stage) == ("transport_delay", "sensor")
    assert first.confidence > 0.9
    assert first.parameters["delay"].value == pytest.approx(600.0, abs=3.0)
