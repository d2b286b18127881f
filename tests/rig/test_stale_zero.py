"""A rig's zero that is in none of its logs.

Red when a zero of another unit stays, when one that the logs bear out is moved, as of a rig held around a
working point or with a gain that is off, or when it is moved where nothing tells it.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.rig.replay import simulate_session
from focgen.rig.rig import UNITY, LinearActuator, Rig, Signals
from focgen.rig.stale_zero import with_zero_of

H = 0.05


def lag(gain, time, *more):
    return TransferFunction([(gain, 0.0)], [*more, (time, 1.0), (1.0, 0.0)])


def rig_of(offset=0.0, zero=0.0, sensor=lag(1.0, 0.1), gain=2.0):
    signals = Signals("t", "y", "u", "p", "k")
    return Rig("r", H, signals, LinearActuator(lag(gain, 0.5), offset), lag(1.0, 0.1), sensor, zero=zero)


def logs_of(rig, u=(0.0, 1.0, 0.3, 2.0, 0.0), keep=("output",), noise=0.01):
    command = np.repeat(u, 80)
    made = simulate_session(rig, [Experiment("e", H, {"command": command})])[0]
    rng = np.random.default_rng(1)
    read = {role: made[role] + noise * rng.normal(size=len(command)) for role in keep}
    return [Experiment("e", H, {"command": command} | read)]


@pytest.mark.parametrize("given, zero", [(293.15, 0.0), (0.0, 293.15), (0.0, -6.0), (20.0, -20.0)])
def test_a_zero_of_another_unit_is_where_the_logs_are(given, zero):
    now, said = with_zero_of(rig_of(zero=given), logs_of(rig_of(zero=zero)))
    assert now.zero == pytest.approx(zero, abs=0.02)
    assert len(said) == 1 and f"is {given:.4g}, and the logs lie by" in said[0]


@pytest.mark.parametrize(
    "given, true",
    [
        ({}, {"zero": 0.5}),  # a tenth of what it moves by
        ({}, {"zero": 3.0}),
        ({"gain": 3.0}, {"gain": 2.0}),
        ({"zero": 293.0}, {"zero": 293.4}),
    ],
)
def test_a_zero_that_is_off_by_less_than_the_rig_moves_stays(given, true):
    rig = rig_of(**given)
    assert with_zero_of(rig, logs_of(rig_of(**true))) == (rig, ())


@pytest.mark.parametrize("zero", [0.0, 293.0])
def test_a_rig_held_around_a_working_point_keeps_its_zero(zero):
    """It moves by 0.4 of 20, and its gain is 5 % off: by more than it moves."""
    rig = rig_of(zero=zero, gain=2.1)
    logs = logs_of(rig_of(zero=zero), u=(10.0, 10.1, 9.9, 10.05, 10.0))
    cut = [log.between(4.0, None) for log in logs]
    assert with_zero_of(rig, cut)[0] is rig


@pytest.mark.parametrize("gain", [-2.0, 4.1, 6.0])
@pytest.mark.parametrize("u", [(10.0, 10.1, 9.9, 10.05, 10.0), (0.0, 10.0, 10.0, 10.0, 8.0, 10.0, 10.0)])
def test_a_gain_or_a_sign_that_is_wrong_is_no_zero(gain, u):
    """Held high all the time it is as far off."""
    rig = rig_of(gain=2.0)
    logs = [log.between(4.0, None) for log in logs_of(rig_of(gain=gain), u)]
    assert with_zero_of(rig, logs)[0] is rig


@pytest.mark.parametrize("after", [(0.0, 0.2, 0.0, 0.2), (0.0, 0.0, 0.0, 0.0)])
@pytest.mark.parametrize("order", [1.0, 0.5])
def test_a_rig_that_comes_to_rest_keeps_its_zero(order, after):
    """It was held for 40 s before the log, and moves by less than it has to go yet."""
    slow = LinearActuator(TransferFunction([(2.0, 0.0)], [(20.0**order, order), (1.0, 0.0)]))
    rig = replace(rig_of(), actuator=slow)
    logs = [log.between(41.0, None) for log in logs_of(rig, (10.0,) * 10 + after)]
    assert with_zero_of(rig, logs)[0] is rig


def test_a_curvature_has_a_zero_of_its_own():
    both = ("curvature", "output")
    moved = {"curvature": 293.0, "output": 20.0}  # in kelvin, and in degrees beside
    logs = [
        replace(log, signals=log.signals | {role: log[role] - 20.0 + moved[role] for role in both})
        for log in logs_of(rig_of(offset=20.0), keep=both)
    ]
    now, said = with_zero_of(rig_of(offset=20.0), logs)
    assert (now.actuator.offset, now.zero) == pytest.approx((293.0, -273.0), abs=0.02)
    assert len(said) == 1 and "zero of the curvature is 20" in said[0]
    now, said = with_zero_of(rig_of(offset=20.0), logs_of(rig_of(offset=293.0), keep=both))
    assert (now.actuator.offset, now.zero) == pytest.approx((293.0, 0.0), abs=0.03) and len(said) == 2
    now, said = with_zero_of(rig_of(20.0, sensor=UNITY), logs_of(rig_of(20.0, 273.0, UNITY), keep=both))
    assert now.actuator.offset == 20.0 and now.zero == pytest.approx(273.0, abs=0.02) and len(said) == 1
    now, _ = with_zero_of(rig_of(20.0, sensor=UNITY), logs_of(rig_of(293.0, sensor=UNITY)))
    assert now.actuator.offset == pytest.approx(293.0, abs=0.02) and now.zero == 0.0
    now, _ = with_zero_of(rig_of(offset=20.0), logs_of(rig_of(offset=293.0)))
    assert now.actuator.offset == 20.0 and now.zero == pytest.approx(273.0, abs=0.02)


def test_what_adds_up_or_has_effects_says_its_zero_itself():
    moves = TransferFunction([(2.0, 0.0)], [(0.1, 2.0), (1.0, 1.0)])
    axis = Rig("axis", H, Signals("t", "y", "u"), LinearActuator(moves), zero=40.0)
    logs = logs_of(rig_of())
    assert with_zero_of(axis, logs) == (axis, ())
    counter = replace(rig_of(zero=40.0), sensor=TransferFunction([(1.0, 0.0)], [(1.0, 1.0)]))
    assert with_zero_of(counter, logs) == (counter, ())
    told = replace(rig_of(zero=40.0), effects=({"name": "contact", "form": "stop", "place": 0.5},))
    assert with_zero_of(told, logs) == (told, ())
