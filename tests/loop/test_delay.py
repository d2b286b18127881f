"""Loops whose rig has nominal dead times: by hand, by the method of steps, and sample by sample.

Red when a dead time shifts the loop by more or less than it says.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import Controller, ControllerRanges
from focgen.control.equilibrium import Equilibrium
from focgen.fractional.delay import Delayed, split_delay
from focgen.fractional.responses import step_response
from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.loop.chain import chain
from focgen.loop.design import design
from focgen.loop.frequency import held_response, margins_at, shapes
from focgen.loop.frozen import frozen_loop, frozen_margins, frozen_step
from focgen.loop.run import run_loop
from focgen.loop.simulate import simulate
from focgen.loop.stepper import FloatStepper
from focgen.plan.build import build_plan
from focgen.rig.rig import UNITY, Delays, LinearActuator, Ranges, Rig, Signals
from focgen.studies.closed import ideal_loop
from tests.conftest import paper_controller, paper_rig

H, DEAD = 0.01, 0.3
WIDE = (-1e6, 1e6)
INTEGRATOR = TransferFunction([(1.0, 0.0)], [(1.0, 1.0)])
STAGES = [Delays(regulator=DEAD), Delays(actuator=DEAD), Delays(sensor=DEAD), Delays(0.1, 0.1, 0.1)]


def dead(delays=Delays(sensor=DEAD), h=H):
    """A rig that is nothing but its delays."""
    ranges = Ranges(WIDE, WIDE, WIDE)
    return Rig("dead", h, Signals("t", "y", "u"), LinearActuator(UNITY), ranges=ranges, delays=delays)


def integral(gain, h=H):
    """The controller gain/s."""
    return Controller("i", h, UNITY, gain, True, ControllerRanges(WIDE, WIDE, WIDE), length=1)


def step(rig, controller, seconds, delay=0):
    samples = round(seconds / controller.sample_time)
    prepared = chain(rig, controller.sample_time, samples)
    stepper, start = FloatStepper(controller, samples, 1), Equilibrium(0.0, 0.0, 0.0)
    return run_loop(prepared, stepper, np.ones((samples, 1)), start, delay).output[:, 0]


def by_steps(gain, dead_time, t):
    """The step response of gain e^(−Ls)/s in closed loop: Σ (−1)^(m+1) gain^m (t − mL)^m / m!."""
    total = np.zeros(len(t))
    for m in range(1, int(t.max() / dead_time) + 1):
        late = np.maximum(t - m * dead_time, 0.0)
        total -= (-gain * late) ** m / math.factorial(m)
    return total


# --------------------------------------------------------------------------------------------------- by hand


@pytest.mark.parametrize("delays", STAGES)
def test_margins_of_an_integrator_and_a_delay_by_hand(delays):
    gain = 2.0
    found = frozen_margins(frozen_loop(dead(delays), integral(gain), 0.0), H)
    assert found.crossover_rad_s == pytest.approx(gain, rel=1e-4)
    assert found.phase_deg == pytest.approx(90.0 - math.degrees(gain * DEAD), abs=0.01)
    assert found.gain_db == pytest.approx(20 * math.log10(math.pi / 2 / (gain * DEAD)), abs=0.01)
    assert found.delay_s == pytest.approx(math.pi / 2 / gain - DEAD, abs=1e-4)


@pytest.mark.parametrize("share, stable", [(0.99, True), (1.01, False)])
def test_the_continuous_loop_ends_at_gain_times_delay_of_a_quarter_turn(share, stable):
    loop = Delayed(INTEGRATOR * (share * math.pi / 2 / DEAD), DEAD)
    assert frozen_margins(loop, H).stable == stable


@pytest.mark.parametrize("dead_time", [0.3, 0.237])
def test_the_delayed_frozen_step_is_that_of_the_method_of_steps(dead_time):
    t = np.arange(0.0, 3.0, H)
    found = frozen_step(Delayed(INTEGRATOR * 2.0, dead_time), t)
    np.testing.assert_allclose(found, by_steps(2.0, dead_time, t), atol=2e-5)


def test_a_delay_of_nothing_is_the_frozen_step_without():
    rig, controller, t = paper_rig(), paper_controller(), np.arange(0.0, 3.0, H)
    loop = frozen_loop(rig, controller, 0.1)
    almost = frozen_step(replace(loop, delay=1e-7), t)
    np.testing.assert_allclose(almost, frozen_step(loop, t), atol=2e-5)


# --------------------------------------------------------------------------------------------- sampled loops


@pytest.mark.parametrize(
    "delays, delay",
    [
        pytest.param(delays, delay, marks=() if (turn, delay) in ((0, 0), (3, 1)) else pytest.mark.long)
        for turn, delays in enumerate(STAGES)
        for delay in (0, 1)
    ],
)
def test_the_sampled_loop_ends_where_its_difference_equation_does(delays, delay):
    """y_k = u_(k−n−1), u by the trapezoidal rule: the phase is −90° − (n + 1 + delay) ωh at every frequency,
    so the limit is 2 tan(ωh/2)/h at ωh = π/2/(n + 1 + delay)."""
    late = round(DEAD / H) + 1 + delay
    limit = 2.0 / H * math.tan(math.pi / 4 / late)
    for share, grows in ((0.97, False), (1.03, True)):
        away = np.abs(step(dead(delays), integral(share * limit), 60.0, delay) - 1.0)
        assert (away[-500:].max() > 2.0 * away[500:1000].max()) == grows
        assert (away[-500:].max() < 0.5 * away[500:1000].max()) != grows


@pytest.mark.parametrize("dead_time", [0.3, 0.3037, 0.2999])
def test_the_sampled_loop_is_its_difference_equation_sample_by_sample(dead_time):
    """A staircase later by n samples and a part is, at a sample, the step before it."""
    whole, _part = split_delay(dead_time, H)
    late, gain, y, u = whole + 1, 2.0, np.zeros(400), np.zeros(400)
    for k in range(400):
        y[k] = u[k - late] if k >= late else 0.0
        u[k] = u[k - 1] + gain * H / 2 * (2.0 - y[k] - y[k - 1]) if k else gain * H / 2
    found = step(dead(Delays(sensor=dead_time)), integral(gain), 4.0)
    np.testing.assert_allclose(found, y, atol=1e-12)


@pytest.mark.parametrize("dead_time", [0.3, 0.3037])
def test_the_pressure_that_is_measured_is_late_as_the_output_is(dead_time):
    """Nothing but the regulator's delay: what is measured behind it is the output."""
    controller, rig = integral(2.0), dead(Delays(regulator=dead_time))
    stepper, start = FloatStepper(controller, 200, 1), Equilibrium(0.0, 0.0, 0.0)
    run = run_loop(chain(rig, H, 200), stepper, np.ones((200, 1)), start, 0)
    np.testing.assert_allclose(run.pressure, run.output, atol=1e-12)
    assert run.pressure[-1, 0] > 0.5


@pytest.mark.parametrize("delays", [*STAGES, Delays(0.1037, 0.05, 0.1463)])
def test_the_chain_is_the_exact_response_to_held_commands_later(delays):
    """Linear stages: kernel by kernel, against the step response of their product at t − L."""
    actuator = LinearActuator(TransferFunction([(1.0, 0.0)], [(1.32, 0.6), (1.0, 0.0)]))
    rig = replace(paper_rig(), actuator=actuator, delays=delays)
    made = chain(rig, H, 300)
    command = np.ones(300)
    pressure = np.array([np.convolve(command, row)[:300] for row in made.pressure[:, :, 0].T])
    t = (np.arange(300) + 1) * H
    before = rig.regulator * rig.actuator.dynamics
    for kernel, transfer, late, close in (
        (made.output, before * rig.sensor, delays.total, 1e-5),
        (made.curvature, before, delays.regulator + delays.actuator, 2e-5),  # less smooth
    ):
        found = sum(np.convolve(p, k)[:300] for p, k in zip(pressure, kernel[:, 0, :].T))
        at = np.maximum(t - late, 1e-9)
        exact = np.where(t > late + 1e-9, step_response(transfer, at), 0.0)
        assert np.abs(found - exact).max() < close * np.abs(exact).max()
    at = np.maximum(t - delays.regulator, 1e-9)
    exact = np.where(t > delays.regulator + 1e-9, step_response(rig.regulator, at), 0.0)
    np.testing.assert_allclose(pressure[-1], exact, atol=1e-9)


@pytest.mark.parametrize("dead_time", [0.0001, 0.0063, 0.02, 0.0237])
@pytest.mark.parametrize(
    "num, den",
    [([(1, 0)], [(0.05, 1), (1, 0)]), ([(1, 1), (30, 0)], [(1, 1), (20, 0)]), ([(5, 0)], [(1, 0)])],
)
def test_the_held_response_is_the_sum_over_the_pulse_response(num, den, dead_time):
    transfer, omega = TransferFunction(num, den), np.array([0.1, 1.0, 10.0, 100.0, 300.0])
    pulse = Convolution(transfer, H, "zero", dead_time).run(np.eye(1, 3000)[0])
    whole, part = split_delay(dead_time, H)
    if not part and transfer.num[0].order == transfer.den[0].order:  # sampled before the hold moves on
        at_once = transfer.num[0].coefficient / transfer.den[0].coefficient
        pulse[whole : whole + 2] += -at_once, at_once
    exact = np.exp(-1j * omega[:, None] * H * np.arange(3000)) @ pulse
    found = held_response(transfer, H, omega, delay=dead_time)
    np.testing.assert_allclose(found, exact, rtol=1e-6)


def test_side_bands_of_a_slow_roll_off_are_all_there():
    """An order of 0.6 only: what lies beyond the bands summed one by one is felt at the Nyquist frequency."""
    transfer, count = TransferFunction([(1.0, 0.0)], [(0.5, 0.6), (1.0, 0.0)]), 400_000
    for dead_time in (0.0004, 0.004, 0.0096):
        pulse = Convolution(transfer, H, "zero", dead_time).run(np.eye(1, count)[0])
        for omega in (30.0, 300.0):
            exact = np.exp(-1j * omega * H * np.arange(count)) @ pulse
            found = held_response(transfer, H, np.array([omega]), delay=dead_time)[0]
            assert abs(found / exact - 1.0) < 2e-4


@pytest.mark.parametrize(
    "delays", [*(pytest.param(one, marks=pytest.mark.long) for one in STAGES[:3]), STAGES[3]]
)
def test_a_delayed_rig_moves_as_one_with_the_delay_as_an_effect(delays):
    """The effect is replayed between the samples and solved for in the loop: another way to the same."""
    rig, controller = paper_rig(), paper_controller(100)
    effects = tuple(
        {"name": "transport_delay", "form": "delay", "stage": stage, "delay": delay}
        for stage, delay in vars(delays).items()
        if delay
    )
    late = simulate(replace(rig, delays=delays), controller, [0.003], duration=2.0)
    other = simulate(replace(rig, effects=effects), controller, [0.003], duration=2.0)
    for signal, scale in (("output", 0.003), ("curvature", 0.003), ("pressure", 0.1)):
        away = np.abs(getattr(late.running, signal) - getattr(other.running, signal)).max()
        assert away < 2e-4 * scale, signal
    # Nothing moves before the delay is over but by less than rounding leaves of the set point.
    assert np.abs(late.running.output[:30]).max() < 1e-15 * 0.003 < late.running.output[33].max()


# ---------------------------------------------------------------------------------------------------- design


@pytest.mark.parametrize(
    "delays",
    [
        Delays(regulator=0.08),
        pytest.param(Delays(actuator=0.08), marks=pytest.mark.long),
        Delays(0.02, 0.02, 0.04),
    ],
)
def test_every_loop_of_a_delayed_rig_turns_by_omega_times_delay(delays):
    rig, controller = paper_rig(), paper_controller(500)
    plan = build_plan(controller)
    soon = margins_at(rig, controller, plan, shapes(rig, controller, plan, 1), 0.1)
    late_rig = replace(rig, delays=delays)
    late = margins_at(late_rig, controller, plan, shapes(late_rig, controller, plan, 1), 0.1)
    for loop in ("frozen", "ideal", "sampled", "truncated", "running"):
        a, b = getattr(late, loop), getattr(soon, loop)
        turned = math.degrees(b.crossover_rad_s * delays.total)
        assert b.phase_deg - a.phase_deg == pytest.approx(turned, abs=0.05), loop
        assert b.delay_s - a.delay_s == pytest.approx(delays.total, abs=2e-4), loop
        assert a.gain_db < b.gain_db, loop


def test_a_study_sees_the_delay():
    rig, controller = paper_rig(), paper_controller(100)
    soon = ideal_loop(controller, rig, (0.006,)).loop
    late = ideal_loop(controller, replace(rig, delays=Delays(sensor=0.08)), (0.006,)).loop
    assert soon.delay_margin_s - late.delay_margin_s == pytest.approx(0.08, abs=2e-4)
    assert late.overshoot_pct > soon.overshoot_pct and late.margin_deg < soon.margin_deg


@pytest.mark.parametrize("lates", [(0.1, 0.2), pytest.param((0.0, 0.1), marks=pytest.mark.long)])
def test_a_design_for_a_delayed_rig_settles_and_its_margins_fall_with_the_delay(lates):
    gains, phases = [], []
    for late in lates:
        made = design(replace(paper_rig(), delays=Delays(sensor=late)), settling=2.0, setpoints=[0.004, 0.01])
        assert made.holds and made.settling_s <= 2.04 and made.overshoot_pct <= 5.5
        gains.append(min(m.running.gain_db for m in made.margins))
        phases.append(min(m.running.phase_deg for m in made.margins))
    assert gains[0] > gains[1] + 2.0
    assert not lates[0] or phases[0] > phases[1] + 3.0  # without a delay other gains are the best


@pytest.mark.long
def test_the_fastest_design_slows_with_the_delay():
    rigs = [replace(paper_rig(), delays=Delays(actuator=late)) for late in (0.0, 0.1, 0.3)]
    times = [design(rig, overshoot=5.0, setpoints=[0.004]).settling_s for rig in rigs]
    assert times[0] + 0.1 < times[1] and times[1] + 0.2 < times[2]
