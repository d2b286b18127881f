"""The controllers that run in simulated loops are the references' twins: bit for bit, or to rounding.

Red when a loop simulates a controller that the C is not.
"""

import numpy as np
import pytest

from focgen.errors import PlanError
from focgen.loop.online import OnlineConvolution
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.stepper import FloatStepper
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_raw
from tests.controllers import random_controller

LANES = 3
EXPONENTIAL = {"memory": "exponential", "tolerance": 1e-3, "horizon": 10_000}


def signals(rng, controller, lanes, samples):
    """Set points, measurements and schedules all over their ranges, and a little beyond."""

    def walk(span):
        low, high = span
        steps = np.repeat(rng.uniform(low, high, (lanes, samples // 10 + 1)), 10, axis=1)[:, :samples]
        return steps + 0.1 * (high - low) * rng.normal(size=steps.shape)

    ranges = controller.ranges
    return walk(ranges.reference), walk(ranges.measurement), walk(ranges.schedule or (0.0, 1.0))


def stepped(stepper, ref, meas, sched):
    return np.stack([stepper.step(*inputs) for inputs in zip(ref.T, meas.T, sched.T)], axis=1)


def rest_of(controller, rng):
    """An output to start from, and the scenario's resets for it: at error 0, where the ranges have one."""
    ranges = controller.ranges
    low = max(ranges.reference[0], ranges.measurement[0])
    high = min(ranges.reference[1], ranges.measurement[1])
    if low > high:
        return 0.0, ()
    start = float(rng.uniform(*ranges.output))
    return start, tuple(Reset(lane, 0, high, high, start) for lane in range(LANES))


def cases(arithmetic, count, **memory):
    """Random controllers that can be planned with ``memory``."""
    seed = 100
    while count:
        seed += 1
        controller = random_controller(seed)
        try:
            plan = build_plan(controller, arithmetic, **memory)
        except PlanError:
            continue
        count -= 1
        yield np.random.default_rng(seed), controller, plan


@pytest.mark.parametrize(
    "memory, arithmetic, count",
    [
        *(({}, "f64", 10), ({}, "q31", 10), (EXPONENTIAL, "f32", 4), (EXPONENTIAL, "q15", 4)),
        *(
            pytest.param(memory, arithmetic, 30, marks=pytest.mark.long)
            for memory in ({}, EXPONENTIAL)
            for arithmetic in ("f64", "q31", "f32", "q15")
        ),
    ],
)
def test_plan_stepper_is_the_bit_true_reference(memory, arithmetic, count):
    """About one controller of each kind here, and fewer with modes; more in the long suite."""
    for rng, controller, plan in cases(arithmetic, count, **memory):
        ref, meas, sched = signals(rng, controller, LANES, 150)
        start, resets = rest_of(controller, rng)
        scenario = Scenario(ref, meas, sched if controller.scheduled else None, resets)
        expected = physical_trace(plan, execute(plan, to_raw(plan, scenario))).u
        assert np.array_equal(stepped(PlanStepper(plan, LANES, start), ref, meas, sched), expected), (
            controller
        )


@pytest.mark.parametrize("endless", [True, False])
def test_float_stepper_is_the_ideal_reference(endless):
    for rng, controller, _ in cases("f64", 10):
        ref, meas, sched = signals(rng, controller, LANES, 300)
        length = None if endless else controller.length
        start, resets = rest_of(controller, rng)
        scenario = Scenario(ref, meas, sched if controller.scheduled else None, resets)
        expected = ideal(controller, scenario, length).u
        found = stepped(FloatStepper(controller, 300, LANES, start, length), ref, meas, sched)
        assert np.abs(found - expected).max() < 1e-9 * np.ptp(controller.ranges.output), controller


def test_online_convolution_is_the_convolution():
    rng = np.random.default_rng(3)
    for lags, samples in ((1, 40), (7, 600), (200, 500), (257, 700), (900, 900), (1300, 1000)):
        kernel, x = rng.normal(size=(lags, 2, 3)), rng.normal(size=(samples, 3, 4))
        online = OnlineConvolution(kernel, 4, samples)
        found = np.stack([online.step(each) for each in x])
        full = np.stack(
            [
                [sum(np.convolve(kernel[:, o, i], x[:, i, c])[:samples] for i in range(3)) for c in range(4)]
                for o in range(2)
            ]
        )
        assert np.abs(found - full.transpose(2, 0, 1)).max() < 1e-11
