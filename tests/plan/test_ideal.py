"""The ideal controller against independent mathematics: exact responses, and eq. (10) as a double loop.

Red when the ideal departs from eq. (10).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.fractional.responses import step_response
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.response import designed_response, running_response
from focgen.plan.scenario import Reset, Scenario, Track, physical_trace, to_raw
from tests.controllers import random_controller, seed_controller, simple


def step(samples: int, level: float = 1.0) -> Scenario:
    return Scenario(np.full((1, samples), level), np.zeros((1, samples)))


WIDE = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-1e6, 1e6))


@pytest.mark.parametrize(
    "num, den",
    [
        ([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)]),
        ([(1.0, 0.5)], [(0.1, 0.7), (1.0, 0.0)]),
        ([(1.0, 0.0)], [(0.5, 1.5), (0.3, 0.5), (1.0, 0.0)]),
        ([(2.0, -0.9), (0.5, 0.0)], [(1.0, 0.0)]),
        ([(1.0, 0.0)], [(1.0, 1.3), (1.0, 0.3)]),
    ],
)
def test_infinite_memory_converges_to_the_exact_step_response(num, den):
    """Of first order in h, as eq. (10) is: halving the step halves the error."""
    transfer, end = TransferFunction(num, den), 4.0
    errors = []
    for h in (0.004, 0.002):
        controller = simple(transfer, sample_time=h, ranges=WIDE)
        count = round(end / h) + 1
        u = ideal(controller, step(count)).u[0]
        exact = step_response(transfer, np.arange(count) * h)
        late = count // 4
        errors.append(float(np.abs(u - exact)[late:].max()))
    assert errors[1] < 0.7 * errors[0] and errors[1] < 4e-3


def test_a_fractional_integral_has_no_short_memory():
    """s^−0.9 of 1 is t^0.9/Γ(1.9): with L = 50 the trapezoid still carries it on, where a bare sum would stop
    at L.
    """
    controller = simple(TransferFunction([(1.0, -0.9)]), ranges=WIDE, length=50)
    count = 4000
    u = ideal(controller, step(count), 50).u[0]
    exact = (np.arange(count) * 0.01) ** 0.9 / math.gamma(1.9)
    assert u[-1] > 0.9 * exact[-1]
    assert np.all(np.diff(u) > 0.0)


def double_loop(controller, e, length):
    """Eq. (10), no term of negative order: from rest."""
    h, (num, den) = controller.sample_time, (controller.transfer.num, controller.transfer.den)

    def weights(order):
        w = [1.0]
        for j in range(1, length + 1):
            w.append(w[-1] * (1.0 - (order + 1.0) / j))
        return w

    scale, y = sum(a * h**-o for a, o in den), []
    tables = {o: weights(o) for _, o in num + den}
    for k in range(len(e)):
        total = sum(b * h**-o * tables[o][j] * e[k - j] for b, o in num for j in range(min(length, k) + 1))
        total -= sum(
            a * h**-o * tables[o][j] * y[k - j] for a, o in den for j in range(1, min(length, k) + 1)
        )
        y.append(total / scale)
    return np.array(y)


@pytest.mark.parametrize("length", [1, 5, 40])
def test_finite_memory_is_equation_10(length):
    transfer = TransferFunction([(0.2, 0.6), (1.0, 0.0)], [(0.05, 0.8), (0.3, 0.0)])
    controller = simple(transfer, ranges=WIDE)
    e = np.random.default_rng(5).uniform(-1.0, 1.0, 120)
    made = ideal(controller, Scenario(e[None], np.zeros((1, 120))), length)
    assert np.allclose(made.d[0], double_loop(controller, e, length), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("length", [30, None])
def test_a_reset_is_a_constant_past(length):
    """The same as having run the constant for long; infinite memory still sees its beginning, 3000 samples
    ago.
    """
    transfer = TransferFunction([(0.2, 0.6), (1.0, 0.0)], [(0.05, 0.8), (0.3, 0.0)])
    controller = simple(transfer, sample_time=10.0, ranges=WIDE)
    e = np.random.default_rng(6).uniform(-1.0, 1.0, 50)
    after = ideal(
        controller, Scenario(e[None], np.zeros((1, 50)), None, (Reset(0, 0, 0.7, 0.1, 0.0),)), length
    )
    long = np.concatenate([np.full(3000, 0.6), e])[None]
    ran = ideal(controller, Scenario(long, np.zeros_like(long)), length)
    beginning = 2.0 * 0.6 / 0.3 * 0.2 * 30_000.0**-0.6 / math.gamma(0.4)
    assert np.allclose(after.d[0], ran.d[0, 3000:], rtol=0, atol=beginning if length is None else 1e-9)


def test_clamps_hold_the_output_and_let_go_at_once():
    """Anti-windup: the integrator stands at its limit and leaves it as the error changes sign."""
    controller = simple(
        TransferFunction([(1.0, 0.0)]), integrator=True, ranges=ControllerRanges((-1, 1), (-1, 1), (0, 2))
    )
    e = np.concatenate([np.ones(500), -np.ones(20)])
    u = ideal(controller, Scenario(e[None], np.zeros((1, 520)))).u[0]
    assert u[499] == 2.0 and u[500] == pytest.approx(2.0) and u[501] == pytest.approx(1.99)
    tracked = ideal(controller, Scenario(e[None], np.zeros((1, 520)), None, (), (Track(0, 10, 0.5),))).u[0]
    assert tracked[10] == pytest.approx(0.51)


# ---------------------------------------------------------------------------------- frequency response


@pytest.mark.parametrize(
    "seed",
    [
        0,
        pytest.param(2, marks=pytest.mark.long),
        4,
        pytest.param(5, marks=pytest.mark.long),
        7,
        pytest.param(10, marks=pytest.mark.long),
        12,
        pytest.param(14, marks=pytest.mark.long),
        15,
        pytest.param(20, marks=pytest.mark.long),
    ],
)
@pytest.mark.parametrize("arithmetic", ["f64", "q31"])
def test_running_response_is_what_a_sine_shows(seed, arithmetic):
    """A sine through the bit-true reference, its amplitude and phase read off the last periods."""
    controller = random_controller(seed, longest=60)
    plan = build_plan(controller, arithmetic)
    if controller.integrator or plan.inner:
        pytest.skip("an integral of a sine depends on where it began")
    period, periods = 40, 60
    count, (low, high) = period * periods, controller.ranges.reference
    omega = 2.0 * np.pi / (period * controller.sample_time)
    phase = np.arange(count) * omega * controller.sample_time
    size = (plan.error.high - plan.error.low) * plan.error.lsb
    ref = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase)
    value = None if controller.ranges.schedule is None else float(np.mean(controller.ranges.schedule))
    meas = np.full((1, count), np.mean(controller.ranges.measurement))
    sched = None if value is None else np.full((1, count), value)
    trace = execute_physical(plan, Scenario(ref[None], meas, sched))
    tail = slice(count - 10 * period, count)
    seen = 2.0 * np.mean(trace.d[0, tail] * np.exp(-1j * phase[tail])) * 1j / (0.5 * (high - low))
    said = complex(running_response(plan, omega, value))
    assert abs(seen - said) <= 1e-9 * abs(said) + 2.0 * plan.error_bound.operator / size


def execute_physical(plan, physical):
    return physical_trace(plan, execute(plan, to_raw(plan, physical)))


def test_running_response_approaches_the_designed_one():
    """Long memory, short samples, fine arithmetic."""
    controller = seed_controller(sample_time=1e-3)
    plan = build_plan(controller, "q31", length=20_000)
    omega = np.array([1.0, 3.0, 10.0])
    ratio = running_response(plan, omega, 0.15) / designed_response(controller, omega, 0.15)
    assert np.all(np.abs(ratio - 1.0) < 6e-3)
    assert np.allclose(
        designed_response(controller, omega, 0.15),
        controller.gain(0.15) * (1.32 * (1j * omega) ** 0.6 + 1) / (1j * omega),
    )


def test_running_response_shows_truncation_and_quantisation():
    controller, omega = seed_controller(), np.array([0.05, 0.5])
    full, short = (build_plan(controller, "f64", length=n) for n in (5000, 100))
    coarse = build_plan(controller, "q15", length=5000)
    exact = running_response(full, omega, 0.1)
    assert np.all(np.abs(running_response(short, omega, 0.1) / exact - 1.0) > 0.02)
    assert np.all(np.abs(running_response(coarse, omega, 0.1) / exact - 1.0) < 0.002)
    assert np.any(running_response(coarse, omega, 0.1) != exact)
