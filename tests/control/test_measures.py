"""Settling time, overshoot and steady error against responses whose values are known in closed form.

Red when a settling time, an overshoot or a steady error is off its closed form.
"""

import math

import numpy as np
import pytest

from focgen.control.measures import measure_step


@pytest.mark.parametrize("start, target", [(0.0, 1.0), (3.0, -2.0), (1e-6, 3e-6)])
def test_first_order_settles_after_log_twenty(start, target):
    t = np.arange(0.0, 12.0, 0.01)
    output = start + (target - start) * (1.0 - np.exp(-t))
    found = measure_step(output, 0.01, start, target)
    assert found.settling_s == pytest.approx(math.log(20.0), rel=1e-4)
    assert found.overshoot_pct == 0.0
    assert found.steady_error == pytest.approx(0.0, abs=1e-4 * abs(target - start))


@pytest.mark.parametrize("damping", [0.2, 0.5, 0.8])
def test_second_order_overshoot_in_closed_form(damping):
    t, root = np.arange(0.0, 40.0, 0.005), math.sqrt(1.0 - damping**2)
    output = 1.0 - np.exp(-damping * t) * (np.cos(root * t) + damping / root * np.sin(root * t))
    found = measure_step(output, 0.005, 0.0, 1.0)
    assert found.overshoot_pct == pytest.approx(100.0 * math.exp(-math.pi * damping / root), rel=1e-4)
    assert np.all(np.abs(output[t > found.settling_s] - 1.0) <= 0.05)
    assert abs(np.interp(found.settling_s, t, output) - 1.0) == pytest.approx(0.05, abs=1e-6)


def test_what_leaves_the_band_late_has_not_settled_before():
    output = np.ones(1000)
    output[850] = 1.06
    assert measure_step(output, 0.1, 0.0, 1.0).settling_s == pytest.approx(85.0, abs=0.1)


def test_an_oscillation_never_settles():
    found = measure_step(1.0 + 0.1 * np.sin(np.arange(1000)), 0.01, 0.0, 1.0)
    assert math.isnan(found.settling_s) and not found.settled


def test_steady_error_keeps_its_unit():
    assert measure_step(np.full(100, 0.019), 0.01, 0.0, 0.02).steady_error == pytest.approx(0.001)


def test_a_set_point_that_does_not_move_is_refused():
    with pytest.raises(ValueError, match="does not move"):
        measure_step(np.ones(10), 0.01, 1.0, 1.0)
