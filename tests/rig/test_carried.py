"""What a signal was before a log, told by the past of the one that it comes from.

Red when it is told by the gauge's first samples alone, or ends elsewhere than where the log begins.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.begin import Begin
from focgen.logs.experiment import Experiment
from focgen.rig.carried import carried
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.initial import begun
from tests.diagnosis_rig import RIG, H

SLOW = replace(RIG, sensor=TransferFunction([(1.0, 0.0)], [(1.5, 1.0), (1.0, 0.0)]))
COMMAND = np.repeat([0.0, 1.5, 0.0, 1.2, 0.3], [100, 160, 60, 40, 200])


def signals(rig, noise=0.0, seed=0):
    """All four signals of the whole run, each with noise of that part of its largest."""
    tap: dict[str, np.ndarray] = {}
    run = Run.of([len(COMMAND)], [0.0], H)
    y = Chain(rig).run(COMMAND, "regulator", "sensor", run, True, tap)
    rng = np.random.default_rng(seed)
    clean = {"pressure": tap["regulator"], "curvature": tap["actuator"], "output": y}
    noisy = {k: v + noise * np.abs(v).max() * rng.normal(size=len(v)) for k, v in clean.items()}
    return {"command": COMMAND, **noisy}, clean


def cut(whole, first):
    return Experiment("cut", H, {name: values[first:] for name, values in whole.items()})


@pytest.mark.parametrize("first", [130, 275, 300, 335])
def test_a_loads_past_tells_what_the_curvature_was(first):
    """Cut behind each step, the command's past known: the sensor goes on as it did."""
    whole, _ = signals(SLOW)
    steps = np.flatnonzero(np.diff(COMMAND[:first])) + 1
    known = Begin((0.0, *COMMAND[steps]), tuple((first - steps + 0.5) * H))
    told = carried(Chain(SLOW), cut(whole, first), "command", known, "actuator")
    assert not told.known
    assert read_off(told, whole, first) < 0.015


def read_off(told, whole, first):
    """The largest error of a reading whose past is ``told``, of the largest reading."""
    x, y = whole["curvature"][first:], whole["output"]
    made = Chain(SLOW).run(x, "sensor", "sensor", Run.of([len(x)], [0.0], H, [told]))
    return np.abs(made - y[first:]).max() / np.abs(y).max()


@pytest.mark.parametrize("first", [275, 300])
def test_a_sensors_past_is_told_by_the_load_in_a_session(first):
    noisy, clean = signals(SLOW, 0.005, seed=first)
    (log,) = begun(SLOW, [cut(noisy, first)])
    assert len(log.before("curvature").levels) > 4  # of steps there are three at most
    assert read_off(log.before("curvature"), clean, first) < 0.03


def test_it_ends_where_the_log_begins():
    """The rig is given a gain of 0.8 of what it has: the shape is the rig's, the level is the gauge's."""
    log = cut(signals(SLOW)[0], 300)
    weak = replace(SLOW, actuator=replace(SLOW.actuator, gain=tuple(0.8 * g for g in SLOW.actuator.gain)))
    past = Begin((0.0, 1.5, 0.0), (10.0, 2.0))
    ends = [carried(Chain(rig), log, "command", past, "actuator").levels[-1] for rig in (SLOW, weak)]
    assert ends == pytest.approx([log["curvature"][0]] * 2, rel=0.1)


@pytest.mark.parametrize("ago", [0.5, 0.6, 1.5, 2.5])
def test_a_step_as_the_log_begins_is_carried_too(ago):
    told = carried(
        Chain(SLOW), cut(signals(SLOW)[0], 300), "command", Begin((1.5, 0.0), (ago * H,)), "actuator"
    )
    forever = Chain(SLOW).run(
        np.full(5, 1.5), "regulator", "actuator", Run.of([5], [0.0], H, [Begin((1.5,))])
    )
    assert told.levels[0] == pytest.approx(forever[0]) and len(told.ago) == len(told.levels) - 1 >= 1
    assert np.all(np.diff(told.ago) < 0.0) and told.samples(H)[0] == pytest.approx(forever[0])
