"""The controller's stage: departures of a running controller found from logs."""

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import Controller, ControllerRanges
from focgen.diagnosis.running import running
from focgen.fractional.transfer import TransferFunction
from focgen.logs.experiment import Experiment
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Scenario, physical_trace, to_raw

CONTROLLER = Controller(
    "foc",
    0.02,
    TransferFunction([(1.3, 0.6), (1.0, 0.0)]),
    40.0,
    True,
    ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 10.0)),
    length=1000,
)
N = 1500


def inputs(seed=0):
    rng = np.random.default_rng(seed)
    ref = np.repeat([0, 0.01, 0.004, 0.012, 0.0], N // 5)
    meas = np.convolve(ref, np.exp(-np.arange(200) / 40) / 40)[:N] * 0.95 + rng.normal(0, 2e-5, N)
    return ref, np.clip(meas, 0, 0.02)


def log_of(u, ref, meas, raw=None):
    return Experiment("loop", 0.02, {"reference": ref, "output": meas, "command": u}, raw_time=raw)


def command(controller=CONTROLLER, length=None):
    ref, meas = inputs()
    return ideal(controller, Scenario(ref[None], meas[None]), length).u[0], ref, meas


def test_the_ideal_controller_departs_in_nothing():
    found = running(CONTROLLER, [log_of(*command())])
    assert not found.causes and not found.resolved


@pytest.mark.parametrize("length", [20, 50, 100])
def test_short_memory(length):
    found = running(CONTROLLER, [log_of(*command(length=length))])
    assert [c.effect for c in found.causes] == ["short_memory"]
    assert found.causes[0].value == length and found.causes[0].share > 0.99


def test_fixed_point():
    ref, meas = inputs()
    plan = build_plan(replace(CONTROLLER, length=1000), "q15")
    u = physical_trace(plan, execute(plan, to_raw(plan, Scenario(ref[None], meas[None])))).u[0]
    found = running(CONTROLLER, [log_of(u, ref, meas)])
    assert [c.effect for c in found.causes] == ["fixed_point"] and found.causes[0].value == 16


def test_output_saturation():
    tight = replace(CONTROLLER, ranges=replace(CONTROLLER.ranges, output=(0.0, 0.6 * command()[0].max())))
    found = running(CONTROLLER, [log_of(*command(tight))])
    assert [c.effect for c in found.causes] == ["output_saturation"]
    assert found.causes[0].value == pytest.approx(tight.ranges.output[1], rel=1e-3)


def test_lost_and_late_samples_from_raw_time():
    u, ref, meas = command()
    even = np.arange(N) * 0.02
    keep = np.random.default_rng(1).random(N) > 0.05
    assert [c.effect for c in running(CONTROLLER, [log_of(u, ref, meas, even[keep])]).causes] == [
        "missed_samples"
    ]
    late = even + np.random.default_rng(2).normal(0, 0.002, N)
    assert [c.effect for c in running(CONTROLLER, [log_of(u, ref, meas, late)]).causes] == ["sample_jitter"]
    assert not running(CONTROLLER, [log_of(u, ref, meas, even)]).causes
