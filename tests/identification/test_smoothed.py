"""A measured input without its noise: no worse than the truth where it turns, and no bias of what it drives.

The truth is simulated here: a real order driven by sines, on a grid ten times finer.

Red when noise on a measured pressure passes for dynamics: an order of 0.36 was 0.45, and known to 0.02.
"""

import numpy as np
import pytest

from focgen.fractional.simulation import Convolution
from focgen.fractional.transfer import TransferFunction
from focgen.identification.identify import identify
from focgen.identification.smoothed import without_noise
from focgen.logs.between import jumps_of
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Actuator, Rig, Signals

FINER, ORDER, TIME = 10, 0.36, 1.1
STEP = 0.05 * TIME ** (1.0 / ORDER)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


@pytest.mark.parametrize("seed", range(3))
def test_noise_goes_and_turns_stay(seed):
    time = np.arange(3000.0)
    smooth = np.sin(time / 25.0) + 0.3 * np.sin(time / 9.0 + seed)
    noise = 0.02 * np.random.default_rng(seed).standard_normal(3000)
    left = without_noise(smooth + noise, jumps_of(smooth + noise)) - smooth
    assert rms(left) < 0.6 * 0.02
    assert abs(np.polyfit(smooth, left, 1)[0]) < 2e-3  # nothing of the signal is taken for noise


def test_a_jump_stays_a_jump():
    step = np.where(np.arange(600) < 300, 0.0, 1.0)
    noisy = step + 0.01 * np.random.default_rng(1).standard_normal(600)
    found = without_noise(noisy, jumps_of(noisy))
    assert rms((found - step)[290:310]) < 0.01 and rms(found - step) < 0.005


@pytest.mark.parametrize("noise", [0.0, 1e-9])
def test_readings_without_noise_stay_as_they_are(noise):
    exact = np.tanh(np.arange(400) / 40.0) + noise * np.random.default_rng(0).standard_normal(400)
    assert without_noise(exact, jumps_of(exact)) is exact


def test_what_is_as_quick_as_noise_stays_as_it_is():
    quick = np.random.default_rng(2).standard_normal(800)
    for values in (quick, np.repeat(quick[:200], 4)):
        assert without_noise(values, jumps_of(values)) is values


def test_what_moves_a_reading_is_known_but_for_its_gain_and_zero():
    """A curve alone rounds the corner of a lag; beside what a regulator makes of its command it does not."""
    lag = 1.0 - np.exp(-np.maximum(np.arange(900.0) - 300.0, 0.0) / 6.0)
    noisy = 0.3 + 2.0 * lag + 0.05 * np.random.default_rng(4).standard_normal(900)
    alone, beside = (without_noise(noisy, jumps_of(noisy), known) - 0.3 - 2.0 * lag for known in (None, lag))
    assert rms(beside[295:320]) < 0.5 * rms(alone[295:320])


def session(seed: int) -> list[Experiment]:
    """Four logs of sines, the pressure measured with noise of 2 % of its span."""
    rng, logs = np.random.default_rng([seed, 3]), []
    plant = TransferFunction([(1.0, 0.0)], [(TIME, ORDER), (1.0, 0.0)])
    for i in range(4):
        fine = np.arange(600 * FINER) / FINER
        periods = rng.uniform(60.0, 500.0, 3)
        pressure = sum(np.sin(2.0 * np.pi * fine / p) for p in periods) * np.minimum(1.0, fine / 20.0)
        curvature = Convolution(plant, STEP / FINER, "linear").run(pressure)[::FINER]
        pressure = pressure[::FINER]
        noisy = pressure + 0.02 * np.ptp(pressure) * rng.standard_normal(600)
        curvature = curvature + 0.005 * np.ptp(curvature) * rng.standard_normal(600)
        logs.append(Experiment(f"log {i}", STEP, {"pressure": noisy, "output": curvature}))
    return logs


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_a_pressure_does_not_pass_for_dynamics(seed):
    rig = Rig("r", STEP, Signals("t", "y", pressure="p"), Actuator(1.0, 0.5, (1.0,)))
    found = identify(rig, session(seed), gain_degree=0, integer=False).joint
    assert found.alpha == pytest.approx(ORDER, rel=0.06) and found.T == pytest.approx(TIME, rel=0.1)
