"""Truncated recursions: stability, amplification, frequency response, against roots and simulations.

Red when an unstable recursion passes, or a norm is smaller than what a simulation reaches.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import signal

from focgen.fractional import discrete
from focgen.fractional.discrete import (
    UnprovenStability,
    UnstableRecursion,
    gl_frequency_response,
    inverse_l1_bound,
    poles_outside,
    shortest_stable_length,
)
from focgen.fractional.simulation import GrunwaldLetnikov, gl_operator
from focgen.fractional.transfer import TransferFunction

STEP = 0.01
ACTUATOR = TransferFunction([(1, 0)], [(1.32, 0.6), (1, 0)])
SHARP = TransferFunction([(1, 0)], [(10, 1.2), (1, 0)])
OSCILLATING = TransferFunction([(1, 0.4), (2, 0)], [(0.2, 1.83), (0.3, 0.41), (1, 0)])


def recursion(transfer, length):
    a = gl_operator(transfer.den, STEP, length)
    return a / a[0]


@pytest.mark.parametrize("seed", range(60))
def test_poles_outside_equals_the_roots(seed):
    rng = np.random.default_rng(seed)
    a = np.append(1.0, rng.standard_normal(rng.integers(1, 30)) * rng.choice([0.05, 0.3, 1.0]))
    roots = np.roots(a)
    assert poles_outside(a) == np.sum(np.abs(roots) > 1)
    if poles_outside(a):
        with pytest.raises(UnstableRecursion, match=f"{np.sum(np.abs(roots) > 1)} of its poles"):
            inverse_l1_bound(a)


@pytest.mark.parametrize("margin", [1e-2, 1e-5, 1e-8])
def test_poles_just_inside_and_outside(margin):
    assert poles_outside(np.poly([1 - margin, 0.3])) == 0
    assert poles_outside(np.poly([1 + margin, 0.3])) == 1
    pair = np.exp(1j) * (1 + margin)
    assert poles_outside(np.poly([pair, pair.conjugate(), 0.5]).real) == 2


@pytest.mark.parametrize("a", [[1.0, -1.0], [1.0, 1.0], [1.0, -2 * math.cos(1), 1.0]])
def test_a_pole_on_the_circle_is_not_decided(a):
    with pytest.raises(UnprovenStability):
        poles_outside(a)


LAG = TransferFunction([(1, 0)], [(1, 1), (0.1, 0)])
CASES = [(ACTUATOR, 100), (ACTUATOR, 1000), (SHARP, 400), (OSCILLATING, 300), (LAG, 5)]


@pytest.mark.parametrize("transfer, length", CASES)
def test_bound_holds_and_is_tight(transfer, length):
    a = recursion(transfer, length)
    response = signal.lfilter([1.0], a, np.eye(1, 60_000)[0])
    truth = math.fsum(np.abs(response))
    assert truth <= inverse_l1_bound(a) < truth * 1.002


@pytest.mark.parametrize("seed", range(30))
def test_bound_is_never_below_the_closed_form(seed):
    """1/Π(1 − r x), r > 0, has positive coefficients: its norm is 1/Π(1 − r), here in rational numbers."""
    rng = np.random.default_rng(seed)
    a = np.poly(rng.uniform(0, 1 - 10 ** -rng.uniform(0.5, 3), rng.integers(1, 4)))
    truth = 1 / sum(Fraction(float(c)) for c in a)
    bound = inverse_l1_bound(a)
    assert Fraction(bound) >= truth * (1 - Fraction(1, 10**15) * len(a)) and bound <= float(truth) * 1.002


@pytest.mark.parametrize("seed", range(20))
def test_residual_is_never_below_the_exact_one(seed):
    """‖A H − 1‖₁ in rational numbers, for an H that is a little off, so that rounding goes either way."""
    rng = np.random.default_rng(seed)
    a = np.append(1.0, rng.uniform(-1, 1, 6) / 16)
    inverse = discrete.power_series_inverse(a, 512) + 1e-6 * rng.standard_normal(512)
    product = [Fraction(0)] * (len(a) + 511)
    for i, x in enumerate(a):
        for j, h in enumerate(inverse):
            product[i + j] += Fraction(float(x)) * Fraction(float(h))
    product[0] -= 1
    assert Fraction(discrete.inverse_residual(a, inverse)) >= sum(map(abs, product))


def test_scaled_coefficients_scale_the_bound():
    a = recursion(ACTUATOR, 50)
    assert inverse_l1_bound(4 * a) == pytest.approx(inverse_l1_bound(a) / 4, rel=1e-12)
    assert 0.5 <= inverse_l1_bound([2.0]) < 0.5 * (1 + 1e-9)


@pytest.mark.parametrize("a", [[0.0, 1.0], [], [1.0, math.nan], [[1.0, 2.0]]])
def test_what_is_no_recursion_is_refused(a):
    with pytest.raises(ValueError, match="recursion"):
        inverse_l1_bound(a)


def test_short_memory_can_destabilise():
    """10 s^1.2 + 1 at 10 ms is unstable at L = 64, as its simulation shows, and stable with more memory."""
    assert poles_outside(recursion(SHARP, 64)) == 1
    with pytest.raises(UnstableRecursion):
        inverse_l1_bound(recursion(SHARP, 64))
    response = np.abs(signal.lfilter([1.0], recursion(SHARP, 64), np.eye(1, 20_000)[0]))
    assert response[-1] > 1e3 * response[5000] > 1e6
    length = shortest_stable_length(SHARP, STEP, 64)
    assert length == 158
    assert np.max(np.abs(np.roots(recursion(SHARP, length)))) < 1
    assert np.max(np.abs(np.roots(recursion(SHARP, length - 1)))) > 1


def test_shortest_stable_length_elsewhere():
    assert shortest_stable_length(ACTUATOR, STEP, 10) == 10
    assert shortest_stable_length(SHARP, STEP, 5000) == 5000
    assert shortest_stable_length(TransferFunction([(1, 0)], [(1, 1.2), (-1, 0)]), STEP, limit=4096) is None


@pytest.mark.parametrize("transfer", [ACTUATOR, OSCILLATING, ACTUATOR.inverse() * LAG])
def test_frequency_response_is_that_of_the_recursion(transfer):
    omega = np.geomspace(0.1, 0.99 * math.pi / STEP, 7)
    num, den = GrunwaldLetnikov(transfer, STEP, 80).coefficients(10**6)
    truth = signal.freqz(num, den, omega * STEP)[1]
    assert gl_frequency_response(transfer, STEP, 80, omega) == pytest.approx(truth, rel=1e-12)


def test_infinite_memory_is_the_limit_and_tends_to_the_continuous():
    omega = np.array([3.0, 30.0, 200.0])
    infinite = gl_frequency_response(ACTUATOR, STEP, None, omega)
    assert gl_frequency_response(ACTUATOR, STEP, 100_000, omega) == pytest.approx(infinite, rel=1e-6)
    fine = gl_frequency_response(ACTUATOR, 1e-6, None, omega)
    assert fine == pytest.approx(ACTUATOR.frequency_response(omega), rel=1e-4)


def test_a_slow_oscillation_is_bounded():
    """Poles 1 − 2.5e-5 at an angle of 5e-3: 8e6, which transforms alone cannot tell from growth."""
    radius, angle = 1.0 - 2.5e-5, 5e-3
    a = np.array([1.0, -2.0 * radius * np.cos(angle), radius**2])
    k = np.arange(2_000_000)
    truth = float(np.abs(radius**k * np.sin((k + 1) * angle)).sum() / np.sin(angle))
    assert truth <= inverse_l1_bound(a) < 1.01 * truth
