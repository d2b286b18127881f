"""A stage with few samples in its time: what is behind it keeps its numbers.

Red when T, alpha, K or a sensor's lag take up what a signal does between its readings, or a lead is found.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.errors import FitError
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.identification.bent import driving
from focgen.identification.identify import identify
from focgen.identification.stages import identify_stage
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

H, T, GAIN, COUNT = 0.2, 1.0, 0.66, 800
SIGNALS = {True: Signals("t", "y", "u", "p"), False: Signals("t", "y", "u")}


def staircase(rng):
    return np.r_[np.zeros(10), np.repeat(rng.uniform(0.0, 3.0, COUNT), rng.integers(5, 30, COUNT))][:COUNT]


def sines(rng):
    phases = np.outer(np.arange(COUNT) * H, 2.0 * np.pi * np.array([0.02, 0.05, 0.13, 0.31]))
    return 1.5 + 0.4 * np.sin(phases + rng.uniform(0.0, 6.0, 4)).sum(1)


def logs_of(command_of, tau, alpha, pressure, noise=0.006):
    """Two logs of a held command: the pressure is the exact one of a lag, and what is behind both is exact,
    too, as one transfer function."""
    rng, logs = np.random.default_rng(5), []
    lag = TransferFunction([(1.1, 0.0)], [(tau, 1.0), (1.0, 0.0)])
    den = [(tau * T**alpha, 1.0 + alpha), (tau, 1.0), (T**alpha, alpha), (1.0, 0.0)]
    if alpha == 1.0:
        den = [(tau * T, 2.0), (tau + T, 1.0), (1.0, 0.0)]
    both = TransferFunction([(1.1 * GAIN, 0.0)], den)
    for number in range(2):
        command = command_of(rng)
        moved = command - command[0]
        signals = {"command": command}
        for role, stage, off in (("output", both, noise), ("pressure", lag, 0.009)):
            made = stage.dc_gain * command[0] + Convolution(stage, H).run(moved)
            signals[role] = made + rng.normal(0.0, off, COUNT)
        kept = {role: values for role, values in signals.items() if pressure or role != "pressure"}
        logs.append(Experiment(f"e{number}", H, kept, start=900.0 * number))
    return logs


@pytest.mark.parametrize("pressure", [True, False])
@pytest.mark.parametrize("alpha", [1.0, 0.7])
@pytest.mark.parametrize("command_of", [staircase, sines])
def test_the_actuator_behind_a_quick_regulator_keeps_its_numbers(command_of, alpha, pressure):
    tau = 0.08
    lag = TransferFunction([(1.1, 0.0)], [(tau, 1.0), (1.0, 0.0)])
    rough = Rig("finger", H, SIGNALS[pressure], Actuator(T, alpha, (GAIN,)), regulator=lag)
    stages = ("regulator", "actuator") if pressure else ("actuator",)
    found = identify(rough, logs_of(command_of, tau, alpha, pressure), stages=stages, integer=False).rig
    time = found.actuator.T ** (1.0 / found.actuator.alpha)
    assert time == pytest.approx(T, rel=0.01)
    assert found.actuator.alpha == pytest.approx(alpha, abs=0.006)
    assert np.polyval(found.actuator.gain[::-1], 1.65) == pytest.approx(GAIN, rel=0.006)  # the middle of it
    assert found.lead == 0.0


def seen_by_a_sensor(alpha, time, lag):
    """Two logs of an actuator whose curvature is logged ahead of a sensor's ``lag``, both exact."""
    rng, logs = np.random.default_rng(3), []
    actuator = TransferFunction([(2.0, 0.0)], [(time**alpha, alpha), (1.0, 0.0)])
    den = [(time**alpha * lag, 1.0 + alpha), (lag, 1.0), (time**alpha, alpha), (1.0, 0.0)]
    both = TransferFunction([(2.0, 0.0)], den)
    for number in range(2):
        command = staircase(rng)
        signals = {"command": command}
        for role, stage in (("curvature", actuator), ("output", both)):
            signals[role] = Convolution(stage, H).run(command) + rng.normal(0.0, 0.018, COUNT)
        logs.append(Experiment(f"e{number}", H, signals, start=900.0 * number))
    return logs


@pytest.mark.parametrize("samples", [0.6, 1.5])
@pytest.mark.parametrize("alpha, time", [(0.5, 3.0), (0.7, 1.0)])
def test_a_sensor_behind_a_springpot_keeps_its_lag(alpha, time, samples):
    lag = samples * H
    slow = TransferFunction([(1.0, 0.0)], [(lag, 1.0), (1.0, 0.0)])
    given = Actuator(time**alpha, alpha, (2.0,))
    rough = Rig("finger", H, Signals("t", "y", "u", None, "k"), given, sensor=slow)
    logs = seen_by_a_sensor(alpha, time, lag)
    found = identify(rough, logs, stages=("actuator", "sensor"), integer=False)
    assert found.rig.sensor.den[0].coefficient == pytest.approx(lag, rel=0.04)
    assert found.stages["sensor"].transfer == found.rig.sensor
    alone = identify(rough, logs, stages=("sensor",), integer=False)  # behind the actuator of the file
    assert alone.rig.sensor.den[0].coefficient == pytest.approx(lag, rel=0.04)


def test_a_command_that_is_not_held_is_asked_of_the_pressure():
    """A file that says nothing of it is taken for held elsewhere: T was 7 % too long then."""
    lag = TransferFunction([(1.1, 0.0)], [(0.04, 1.0), (1.0, 0.0)])
    plant = TransferFunction([(GAIN, 0.0)], [(T, 1.0), (1.0, 0.0)])
    fine, rng, logs = 10, np.random.default_rng(6), []
    for number in range(2):
        phases = 2.0 * np.pi * np.outer(np.arange(COUNT * fine) * H / fine, [0.02, 0.05])
        command = 1.5 + 0.4 * np.sin(phases + rng.uniform(0.0, 6.0, 2)).sum(1)
        pressure = 1.1 * command[0] + Convolution(lag, H / fine, "linear").run(command - command[0])
        output = GAIN * pressure[0] + Convolution(plant, H / fine, "linear").run(pressure - pressure[0])
        signals = {"command": command[::fine], "pressure": pressure[::fine] + rng.normal(0.0, 0.009, COUNT)}
        signals["output"] = output[::fine] + rng.normal(0.0, 0.006, COUNT)
        logs.append(Experiment(f"e{number}", H, signals, start=900.0 * number))
    rough = Rig("finger", H, SIGNALS[True], Actuator(T, 1.0, (GAIN,)), regulator=lag)
    found = identify(rough, logs, integer=False).joint
    assert found.ci95["T"][0] < T < found.ci95["T"][1] and found.T == pytest.approx(T, rel=0.02)


@pytest.mark.parametrize("wrong", [0.5, 3.0])
def test_a_regulator_of_the_file_that_the_pressure_contradicts_tells_nothing(wrong):
    said = TransferFunction([(1.1, 0.0)], [(wrong * 0.08, 1.0), (1.0, 0.0)])
    rough = Rig("finger", H, SIGNALS[True], Actuator(T, 0.7, (GAIN,)), regulator=said)
    found = identify(rough, logs_of(staircase, 0.08, 0.7, True), integer=False)
    assert found.rig.actuator.T ** (1.0 / found.rig.actuator.alpha) == pytest.approx(T, rel=0.01)
    assert found.rig.regulator == said and found.rig.lead == 0.0  # --stages does not name it


def behind_what_was_at_once(noise):
    """The pressure is there at the next reading: it came at once, or within the sample, or at its end."""
    at_once = TransferFunction([(1.1, 0.0)], [(0.002, 1.0), (1.0, 0.0)])
    rough = Rig("finger", H, SIGNALS[True], Actuator(T, 1.0, (GAIN,)), regulator=at_once)
    return identify(rough, logs_of(staircase, 0.002, 1.0, True, noise), integer=False)


def test_the_output_tells_a_lag_within_a_sample_from_a_dead_time():
    found = behind_what_was_at_once(0.006)
    low, high = found.joint.ci95["T"]
    assert found.rig.actuator.T == pytest.approx(T, rel=0.01) and low < T < high


def test_where_it_does_not_T_is_known_no_better_than_they_are_apart():
    found = behind_what_was_at_once(0.3)
    low, high = found.joint.ci95["T"]
    assert low < T < high and high - low > 0.25
    assert found.rig.uncertainty.actuator.time > 0.1


def test_the_output_corrects_a_regulator_that_the_readings_leave_open():
    """Nothing of a lag of a hundredth of a sample is in them: it may be a dead time of a whole one."""
    rough = Rig("finger", H, SIGNALS[True], Actuator(T, 1.0, (GAIN,)))
    lag = TransferFunction([(1.1, 0.0)], [(0.2, 1.0), (1.0, 0.0)])
    logs = logs_of(staircase, 0.002, 1.0, True)
    found = identify(replace(rough, regulator=lag), logs, stages=("regulator", "actuator"), integer=False)
    low, high = found.joint.ci95["T"]
    assert found.rig.actuator.T == pytest.approx(T, rel=0.05), (low, high)


def test_a_second_fit_of_a_sensor_has_to_leave_less(monkeypatch):
    logs = seen_by_a_sensor(0.7, 1.0, 0.3)
    slow = TransferFunction([(1.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)])
    rough = Rig("finger", H, Signals("t", "y", "u", None, "k"), Actuator(T, 0.7, (2.0,)), sensor=slow)
    first, second = (identify_stage(logs, "sensor", None, rig) for rig in (None, rough))
    assert second.leaves_less_than(first) and not first.leaves_less_than(second)

    def the_other_way_round(experiments, stage, between=None, ahead=None):
        return second if ahead is None else first

    monkeypatch.setattr("focgen.identification.identify.identify_stage", the_other_way_round)
    assert identify(rough, logs, stages=("sensor",)).stages["sensor"] is second

    def undetermined(experiments, stage, between=None, ahead=None):
        if ahead is not None:
            raise FitError("sensor", "has an unknown gain", "log more")
        return first

    monkeypatch.setattr("focgen.identification.identify.identify_stage", undetermined)
    assert identify(rough, logs, stages=("sensor",)).stages["sensor"] is first


@pytest.mark.parametrize("reference", [None, "varying"])
def test_a_sensor_is_driven_as_it_was_read_in_a_loop_or_by_a_command_that_is_not_held(reference):
    (log, _), fine = seen_by_a_sensor(0.7, 1.0, 0.3), 20
    rig = Rig("finger", H, Signals("t", "y", "u", None, "k"), Actuator(T, 0.7, (2.0,)))
    assert not np.array_equal(driving(log, rig), driving(log, None))
    if reference:
        log = replace(log, signals=dict(log.signals) | {"reference": staircase(np.random.default_rng(1))})
    else:
        at = np.arange(COUNT * fine) * H / fine
        command = 1.5 - 1.5 * np.cos(0.15 * at)
        plant = TransferFunction([(2.0, 0.0)], [(1.0, 0.7), (1.0, 0.0)])
        curvature = Convolution(plant, H / fine, "linear").run(command)
        kept = {"command": command[::fine], "curvature": curvature[::fine], "output": log["output"]}
        log = replace(log, signals=kept)
    np.testing.assert_array_equal(driving(log, rig), driving(log, None))
