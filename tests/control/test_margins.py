"""Margins against python-control, against closed forms of fractional loops, and against what loops really
do.

Red when a margin is off the closed form, or a loop is unstable that was said to be stable.
"""

import math

import control
import numpy as np
import pytest

from focgen.control.margins import curve, margins
from focgen.fractional.transfer import TransferFunction


def random_loop(rng):
    """Stable open loop but for an integrator, with resonances at times."""
    poles = -(10.0 ** rng.uniform(-1, 2, rng.integers(1, 5))).astype(complex)
    if rng.random() < 0.5:
        size, damping = 10 ** rng.uniform(-1, 2), 10 ** rng.uniform(-2, -0.3)
        pair = size * (-damping + 1j * math.sqrt(1 - damping**2))
        poles = np.r_[poles, pair, pair.conjugate()]
    if rng.random() < 0.5:
        poles = np.r_[poles, 0.0]
    scale = np.prod(np.abs(poles[poles != 0]))
    return control.tf([10 ** rng.uniform(-1, 1.5) * scale], np.real(np.poly(poles)))


def test_agrees_with_python_control_on_random_loops():
    rng = np.random.default_rng(2)
    stable = 0
    for _ in range(80):
        loop = random_loop(rng)
        found = margins(curve(lambda omega, loop=loop: loop(1j * omega), 1e-4, 1e5))
        gain, phase, *_ = control.stability_margins(loop)
        really = bool((control.feedback(loop).poles().real < 0).all())
        assert found.stable == really
        if not really:
            continue
        stable += 1
        assert found.phase_deg == pytest.approx(phase, abs=1e-2) or (
            math.isinf(phase) and math.isinf(found.phase_deg)
        )
        assert found.gain_db == pytest.approx(20 * math.log10(gain), abs=1e-2) or math.isinf(gain)
    assert 20 < stable < 75


@pytest.mark.parametrize("order", [0.5, 1.0, 1.3, 1.7])
@pytest.mark.parametrize("gain", [0.1, 30.0])
def test_fractional_integrator_in_closed_form(order, gain):
    """k/s^ν crosses 1 at k^(1/ν) with a phase margin of 180° − 90° ν."""
    loop = TransferFunction([(gain, 0.0)], [(1.0, order)])
    found = margins(curve(loop.frequency_response, 1e-6, 1e6))
    crossover = gain ** (1.0 / order)
    assert found.crossover_rad_s == pytest.approx(crossover, rel=1e-4)
    assert found.phase_deg == pytest.approx(180.0 - 90.0 * order, abs=1e-6)
    assert found.delay_s == pytest.approx(math.radians(180.0 - 90.0 * order) / crossover, rel=1e-4)
    assert math.isinf(found.gain_db) and found.stable


def test_delay_is_found_by_its_closed_form():
    """k e^(−sD)/s: gain margin π/(2 k D), delay margin π/(2 k) − D; unstable beyond."""
    for gain, delay in ((1.0, 0.3), (2.0, 0.7), (5.0, 0.4)):
        found = margins(
            curve(lambda w, gain=gain, delay=delay: gain * np.exp(-1j * w * delay) / (1j * w), 1e-4, 1e3)
        )
        ratio = math.pi / (2 * gain * delay)
        assert found.stable == (ratio > 1.0)
        if ratio > 1.0:
            assert found.gain_db == pytest.approx(20 * math.log10(ratio), abs=1e-2)
            assert found.delay_s == pytest.approx(math.pi / (2 * gain) - delay, rel=1e-3)


def test_positive_feedback_is_unstable():
    assert not margins(curve(lambda w: -2.0 / (1j * w), 1e-4, 1e4)).stable


def test_a_conditionally_stable_loop_may_also_lose_gain():
    loop = control.tf(5e4 * np.poly([-1.0, -1.0]), np.poly([0, 0, 0, -100.0, -100.0]))
    if not (control.feedback(loop).poles().real < 0).all():
        pytest.fail("the example is meant to be stable")
    found = margins(curve(lambda w: loop(1j * w), 1e-4, 1e5))
    assert found.stable
    below = control.feedback(loop * 10 ** (-(found.gain_reduction_db + 0.2) / 20)).poles()
    assert math.isfinite(found.gain_reduction_db) and (below.real > 0).any()
    inside = control.feedback(loop * 10 ** (-(found.gain_reduction_db - 0.2) / 20)).poles()
    assert (inside.real < 0).all()
