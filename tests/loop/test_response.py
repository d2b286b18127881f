"""The simulated loop against independent truths: exact responses, differential equations, state space.

Red when the simulated loop departs from its exact response.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from focgen.control.controller import Controller, ControllerRanges, GainSchedule
from focgen.control.equilibrium import Equilibrium, derived_ranges, holding, rest
from focgen.control.measures import measure_step
from focgen.fractional.responses import mittag_leffler, step_response
from focgen.fractional.transfer import TransferFunction
from focgen.loop.chain import chain, substeps
from focgen.loop.frequency import held_response, sampled_response
from focgen.loop.frozen import frozen_loop, frozen_step
from focgen.loop.run import run_loop
from focgen.loop.stepper import FloatStepper
from focgen.rig.rig import UNITY, Actuator, LinearActuator
from tests.conftest import paper_controller, paper_rig

PRESSURES = (0.075, 0.1, 0.125, 0.15, 0.175, 0.2)
REST = Equilibrium(0.0, 0.0, 0.0)


class Constant:
    """A stand-in controller: the output does not depend on what it reads."""

    def __init__(self, value):
        self.value = np.asarray(value, dtype=float)

    def step(self, reference, measurement, schedule):
        return self.value


def paper_loop(pressure):
    """The controller with eq. (7) exactly at ``pressure``."""
    gain = (85.66 * pressure + 6.692) / (0.0015 + 0.345 * pressure)
    controller = paper_controller()
    return replace(controller, gain=gain, ranges=replace(controller.ranges, schedule=None))


@pytest.mark.parametrize("pressure, settling", list(zip(PRESSURES, (1.98, 1.65, 1.40, 1.20, 1.04, 0.91))))
def test_the_papers_frozen_loop_settles_as_stated(pressure, settling):
    step = frozen_step(frozen_loop(paper_rig(), paper_loop(pressure), pressure), np.arange(0.0, 6.0, 1e-3))
    found = measure_step(step, 1e-3, 0.0, 1.0)
    assert found.settling_s == pytest.approx(settling, rel=0.005)
    assert found.overshoot_pct < 0.1


def test_a_peak_is_the_pressure_farthest_from_0():
    """A vacuum's is its lowest, which an overshoot passes between and beyond what the run ends at."""
    ringing = TransferFunction([(1.0, 0.0)], [(0.01, 2.0), (0.06, 1.0), (1.0, 0.0)])
    rig = replace(paper_rig(), regulator=ringing)
    run = run_loop(chain(rig, 0.05, 60), Constant([1.0, -1.0]), np.zeros((60, 2)), REST, delay=0)
    up, down = run.peak_pressure
    assert up == -down > run.pressure[:, 0].max() > 1.1


def test_the_papers_frozen_loop_settles_in_1_36_s_on_average():
    times = [
        measure_step(
            frozen_step(frozen_loop(paper_rig(), paper_loop(p), p), np.arange(0.0, 6.0, 1e-3)), 1e-3, 0.0, 1.0
        ).settling_s
        for p in PRESSURES
    ]
    assert np.mean(times) == pytest.approx(1.36, rel=0.01)


def test_the_frozen_loop_is_the_linear_loop_of_state_space():
    """What is left once K and T s^α + 1 cancel is integer: 0.0998 K_o / s with regulator and sensor."""
    for pressure in PRESSURES:
        gain = 85.66 * pressure + 6.692
        num = [gain * 152.48 * 10.0]
        den = np.r_[np.polymul([1.0, 53.39, 1528.0], [1.0, 10.0]), 0.0]
        den[-1] += num[0]
        t, expected = signal.step((num, den), T=np.linspace(0.0, 4.0, 401))
        found = frozen_step(frozen_loop(paper_rig(), paper_loop(pressure), pressure), t)
        assert np.abs(found - expected).max() < 1e-9


def test_the_frozen_loop_is_the_product_of_its_parts():
    """Whatever cancels, and with whatever factor."""
    omega, rig = np.geomspace(0.01, 100.0, 20), paper_rig()
    doubled = LinearActuator(TransferFunction([(0.14, 0.0)], [(2.64, 0.6), (2.0, 0.0)]))
    for actuator in (
        rig.actuator,
        doubled,
        LinearActuator(TransferFunction([(1.0, 0.3), (1.0, 0.0)], [(1.0, 1.0)])),
    ):
        loop = frozen_loop(replace(rig, actuator=actuator), paper_controller(), 0.1)
        still = 0.0015 + 0.345 * 0.1 if actuator is rig.actuator else 1.0
        parts = paper_controller().transfer * rig.regulator * actuator.dynamics * rig.sensor
        expected = parts.frequency_response(omega) * still * paper_controller().gain_at(0.1) / (1j * omega)
        assert np.abs(loop.frequency_response(omega) / expected - 1.0).max() < 1e-12


def test_the_sampled_loop_tends_to_the_frozen_one():
    """K held constant in rig and controller; sampling ever faster. Plain GL at 10 ms settles 1–3 % sooner."""
    rig = replace(paper_rig(), actuator=Actuator(1.32, 0.6, (0.0015 + 0.345 * 0.15,)))
    target = 0.0015 * 0.15 + 0.345 * 0.15**2
    expected = frozen_step(frozen_loop(rig, paper_loop(0.15), 0.15), np.arange(0.0, 3.0, 0.01))
    errors = []
    for h in (0.01, 0.005, 0.0025):
        controller, samples = replace(paper_loop(0.15), sample_time=h), round(3.0 / h)
        run = run_loop(
            chain(rig, h, samples),
            FloatStepper(controller, samples, 1),
            np.full((samples, 1), target),
            REST,
            delay=0,
        )
        errors.append(np.abs(run.output[:: round(0.01 / h), 0] / target - expected).max())
    assert errors[0] < 0.02 and errors[1] < 0.55 * errors[0] and errors[2] < 0.55 * errors[1]


# --------------------------------------------------------------------------------------------- chain


def test_a_held_command_meets_the_exact_response_of_the_whole_chain():
    """Open loop, linear actuator: regulator · actuator · sensor in one transfer function, no substeps at
    all.
    """
    linear = LinearActuator(TransferFunction([(0.07, 0.0)], [(1.32, 0.6), (1.0, 0.0)]))
    for h in (0.002, 0.01, 0.03):
        rig = replace(paper_rig(), actuator=linear)
        run = run_loop(chain(rig, h, 400), Constant([2.0]), np.zeros((400, 1)), REST, delay=0)
        exact = step_response(rig.regulator * linear.dynamics * rig.sensor, run.time)
        assert np.abs(run.output[:, 0] - 2.0 * exact).max() < 1e-5 * 2.0 * np.abs(exact).max()
        bent = step_response(rig.regulator * linear.dynamics, run.time)
        assert np.abs(run.curvature[:, 0] - 2.0 * bent).max() < 2e-5 * 2.0 * np.abs(bent).max()
        pressure = step_response(rig.regulator, run.time)
        assert np.abs(run.pressure[:, 0] - 2.0 * pressure).max() < 1e-11


def test_a_pressure_step_is_the_mittag_leffler_function_times_the_drive():
    rig = replace(paper_rig(), regulator=UNITY, sensor=UNITY)
    run = run_loop(chain(rig, 0.01, 500), Constant([0.1, 0.2]), np.zeros((500, 2)), REST, delay=0)
    rise = 1.0 - mittag_leffler(0.6, 1.0, -(run.time**0.6) / 1.32)
    drive = 0.0015 * np.array([0.1, 0.2]) + 0.345 * np.array([0.1, 0.2]) ** 2
    assert np.abs(run.output - rise[:, None] * drive).max() < 1e-13


def test_what_passes_at_once_arrives_with_the_next_sample():
    """An actuator with as many zeros as poles, and one behind a regulator that is like that, too."""
    lead = TransferFunction([(0.5, 1.0), (1.0, 0.0)], [(1.0, 1.0), (1.0, 0.0)])
    for regulator in (UNITY, lead):
        rig = replace(paper_rig(), regulator=regulator, actuator=LinearActuator(lead), sensor=UNITY)
        run = run_loop(chain(rig, 0.01, 100), Constant([1.0]), np.zeros((100, 1)), REST, delay=0)
        exact = step_response(regulator * lead, run.time)
        assert run.output[0, 0] == 0.0  # read before the command moves
        assert np.abs(run.output[1:, 0] - exact[1:]).max() < 1e-5


def test_from_a_rest_away_from_zero_nothing_moves():
    rig = replace(paper_rig(), actuator=replace(paper_rig().actuator, offset=0.004))
    start = rest(rig, (2.0, 10.0))
    assert start.command == 2.0 and start.output > 0.004
    run = run_loop(chain(rig, 0.01, 50), Constant([2.0]), np.zeros((50, 1)), start)
    assert np.abs(run.output - start.output).max() < 1e-15
    assert np.abs(run.curvature - start.output).max() < 1e-15


def test_delay_shifts_the_command_by_one_sample():
    rig = replace(paper_rig(), regulator=UNITY, sensor=UNITY)
    late, early = (
        run_loop(chain(rig, 0.01, 50), Constant([0.1]), np.zeros((50, 1)), REST, d) for d in (1, 0)
    )
    assert np.abs(late.output[1:] - early.output[:-1]).max() < 1e-15
    assert late.command[0, 0] == 0.0 and late.command[1, 0] == 0.1


def test_substeps_follow_the_regulators_speed():
    assert substeps(paper_rig(), 0.001) < substeps(paper_rig(), 0.01) <= 32
    assert substeps(replace(paper_rig(), regulator=UNITY), 0.01) == 1


# ------------------------------------------------------------------------------------ the closed loop


def test_the_nonlinear_loop_is_that_of_its_differential_equations():
    """α = 1: every stage an ODE, solved by Runge–Kutta between the samples; a controller of a few lines."""
    rig = replace(paper_rig(), actuator=Actuator(0.8, 1.0, (0.0015, 0.345)))
    table = GainSchedule((0.05, 0.1, 0.2), (300.0, 200.0, 120.0))
    controller = Controller(
        "pi",
        0.02,
        TransferFunction([(0.8, 1.0), (1.0, 0.0)]),
        table,
        True,
        ControllerRanges((0.0, 0.02), (0.0, 0.02), (0.0, 2.6), (0.0, 0.25)),
    )
    samples, target = 150, 0.012
    run = run_loop(
        chain(rig, 0.02, samples),
        FloatStepper(controller, samples, 1),
        np.full((samples, 1), target),
        REST,
        delay=1,
    )
    expected, applied = _by_ode(table, samples, target)
    assert np.abs(run.output[:, 0] - expected).max() < 2e-6 * target / 0.012 * 5
    assert np.abs(run.command[:, 0] - applied).max() < 2e-3
    assert applied.max() == 2.6  # the limit takes part


def _by_ode(table, samples, target):
    """x = pressure, its rate, curvature, sensor."""

    def rate(t, x, u):
        p, dp, kappa, y = x
        drive = (0.0015 + 0.345 * p) * p
        return [dp, 152.48 * u - 53.39 * dp - 1528.0 * p, (drive - kappa) / 0.8, 10.0 * (kappa - y)]

    x, waiting, integral, before, last = np.zeros(4), 0.0, 0.0, 0.0, 0.0
    outputs, commands = [], []
    for _ in range(samples):
        outputs.append(x[3])
        error = target - x[3]
        increment = (
            0.01 * np.interp(x[0], table.breakpoints, table.gains) * (0.8 * (error - last) / 0.02 + error)
        )
        integral = min(max(integral + increment + before, 0.0), 2.6)
        before, last = increment, error
        commands.append(waiting)
        x = solve_ivp(rate, (0.0, 0.02), x, args=(waiting,), rtol=1e-10, atol=1e-14).y[:, -1]
        waiting = integral
    return np.array(outputs), np.array(commands)


def test_equilibria_hold():
    rig = paper_rig()
    ranges, notes = derived_ranges(rig)
    assert not notes
    for output in (0.002, 0.014):
        at = holding(rig, output, ranges)
        run = run_loop(chain(rig, 0.01, 100), Constant([at.command]), np.zeros((100, 1)), at)
        assert np.abs(run.output - output).max() < 1e-12
        assert (0.0015 + 0.345 * at.pressure) * at.pressure == pytest.approx(output, rel=1e-12)


# -------------------------------------------------------------------------------------- responses


def test_held_response_is_the_pulse_transfer_function():
    """Against the exact discretisation of integer transfer functions by the matrix exponential."""
    omega = np.geomspace(0.01, np.pi / 0.01, 50)
    for num, den, accuracy in (
        ([152.48], [1.0, 53.39, 1528.0], 1e-6),
        ([2.0, 3.0], [1.0, 5.0, 7.0, 1.0], 1e-6),
        ([1.0], [0.3, 1.0], 1e-6),
        ([0.5, 1.0], [1.0, 1.0], 1e-6),
    ):
        terms = [[(c, float(len(p) - 1 - i)) for i, c in enumerate(p)] for p in (num, den)]
        dnum, dden, _ = signal.cont2discrete((num, den), 0.01)
        z = np.exp(1j * omega * 0.01)
        expected = np.polyval(dnum[0], z) / np.polyval(dden, z)
        if len(num) == len(den):  # cont2discrete reads after the hold has moved on, the loop before
            expected = expected - num[0] / den[0] * (1.0 - 1.0 / z)
        error = np.abs(held_response(TransferFunction(*terms), 0.01, omega) - expected)
        assert error.max() < accuracy * np.abs(expected).max()
        assert (error / np.abs(expected))[omega < 1.0 / 0.01].max() < accuracy


def any_controller(transfer):
    wide = (-1e12, 1e12)
    return Controller("any", 0.01, transfer, 1.0, False, ControllerRanges(wide, wide, wide), length=40)


@pytest.mark.parametrize("length", [40, None])
def test_sampled_response_is_that_of_the_stepper(length):
    """The transform of the impulse response; an inner integral leaves a constant behind."""
    inner = [(0.7, -0.5)] if length else []  # with infinite memory its tail would take for ever
    controller = any_controller(TransferFunction([(1.0, 0.4), (2.0, 0.0), *inner], [(0.05, 0.8), (1.0, 0.0)]))
    count, zero, omega = 6000, np.zeros(1), np.array([3.0, 30.0, 250.0])
    stepper = FloatStepper(controller, count, 1, length=length)
    response = np.array([stepper.step(np.array([e]), zero, zero)[0] for e in np.eye(1, count)[0]])
    left = response[-1] if length else 0.0
    turning = np.exp(-1j * np.outer(omega, np.arange(count)) * 0.01)
    found = turning @ (response - left) + left / (1.0 - np.exp(-1j * omega * 0.01))
    expected = sampled_response(controller, omega, length)
    assert np.abs(found / expected - 1.0).max() < (1e-9 if length else 2e-4)


def test_long_memory_tends_to_the_infinite_one():
    controller = any_controller(
        TransferFunction([(1.0, 0.4), (2.0, 0.0), (0.7, -0.5)], [(0.05, 0.8), (1.0, 0.0)])
    )
    omega = np.geomspace(0.1, 300.0, 20)
    endless = sampled_response(controller, omega)
    errors = [
        np.abs(sampled_response(controller, omega, n) / endless - 1.0).max() for n in (500, 5000, 50_000)
    ]
    assert errors[0] > 10.0 * errors[1] and errors[1] > 10.0 * errors[2] and errors[2] < 1e-3
