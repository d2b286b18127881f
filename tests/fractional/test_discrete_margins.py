"""Margins of recursions: poles a rounding from the circle, bounds of residuals, lengths at their limits.

Red when what rounding hides is decided, or a bound leaves more room than is argued for.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
from scipy import signal

from focgen.fractional import discrete
from focgen.fractional.discrete import (
    UnprovenStability,
    inverse_l1_bound,
    inverse_residual,
    poles_outside,
    power_series_inverse,
    shortest_stable_length,
)
from tests.fractional.test_discrete import ACTUATOR, SHARP, STEP

UNIT = 2.0**-53


@pytest.mark.parametrize("bits", range(4, 53, 2))
@pytest.mark.parametrize("others", [[], [-0.5], [0.25, -0.75], [0.5] * 6])
def test_poles_that_numbers_hold_exactly_are_decided_rightly_or_not_at_all(bits, others):
    """(1 − c x) Π (1 − p x) with c = 1 ± 2^−bits; coefficients that are exact."""
    for side, outside in ((-1, 0), (1, 1)):
        a = [Fraction(1)]
        for p in [1 + side * Fraction(1, 2**bits), *map(Fraction, others)]:
            a = [x - p * y for x, y in zip([*a, Fraction(0)], [Fraction(0), *a])]
        rounded = [float(x) for x in a]
        exact = all(Fraction(x) == y for x, y in zip(rounded, a))
        try:
            found = poles_outside(rounded)
        except UnprovenStability:
            assert bits > 34
        else:
            assert found == outside or not exact
            assert bits < 50


@pytest.mark.parametrize("seed", range(6))
def test_a_residual_is_bounded_by_what_is_argued_and_no_more(seed):
    """‖A H − 1‖₁ in rational numbers, and 64 u log₂ n |A| |H| for every entry of the transforms."""
    rng = np.random.default_rng(seed)
    a = np.append(1.0, rng.uniform(-1, 1, 5) / 12)
    inverse = power_series_inverse(a, 100) + 10.0 ** -(3 + 2 * seed) * rng.standard_normal(100)
    product = [Fraction(0)] * 105
    for i, x in enumerate(a):
        for j, h in enumerate(inverse):
            product[i + j] += Fraction(float(x)) * Fraction(float(h))
    product[0] -= 1
    exact = float(sum(map(abs, product)))
    argued = 64.0 * UNIT * math.log2(210.0) * np.linalg.norm(a) * np.linalg.norm(inverse) * 105
    assert 0.98 * argued < inverse_residual(a, inverse) - exact < 1.02 * argued + 1e-14 * exact


@pytest.mark.parametrize("count", [1, 2, 63, 64, 65, 300])
def test_either_way_to_an_inverse_gives_it(count, monkeypatch):
    a = np.array([2.0, -1.1, 0.3, 0.05])
    run = power_series_inverse(a, count)
    monkeypatch.setattr(discrete, "_RUN", 4 * count - 1)
    iterated = power_series_inverse(a, count)
    truth = signal.lfilter([1.0], a, np.eye(1, count)[0])
    assert len(run) == len(iterated) == count
    assert np.array_equal(run, truth) and iterated == pytest.approx(truth, abs=1e-13)
    monkeypatch.setattr(discrete, "_RUN", 4 * count)
    assert np.array_equal(power_series_inverse(a, count), truth)


def test_an_inverse_that_would_be_too_long_is_given_up(monkeypatch):
    """0.99^256 is 8 %, 0.99^512 is 0.6 %: 256 samples prove a bound, more of them a closer one."""
    bounds = []
    for longest in (256, 512, 1024, 4096):
        monkeypatch.setattr(discrete, "_LONGEST", longest)
        bounds.append(inverse_l1_bound([1.0, -0.99]))
    residual = 0.99**256
    assert bounds[0] == pytest.approx(100.0 * (1.0 - residual) / (1.0 - residual), rel=1e-9)
    assert all(100.0 * (1.0 - 1e-12) <= bound <= 100.0 * 1.0001 for bound in bounds)
    monkeypatch.setattr(discrete, "_LONGEST", 256)
    with pytest.raises(UnprovenStability, match="256 samples do not suffice to bound"):
        inverse_l1_bound([1.0, -0.998])  # 0.998^256 = 0.6, more than a half
    monkeypatch.setattr(discrete, "_LONGEST", 512)
    assert inverse_l1_bound([1.0, -0.998]) >= 500.0 * (1.0 - 1e-12)


def test_the_shortest_stable_length_is_found_within_its_limit():
    assert shortest_stable_length(SHARP, STEP, 64, 158) == 158
    assert shortest_stable_length(SHARP, STEP, 64, 157) is None
    assert (
        shortest_stable_length(SHARP, STEP, 157, 10_000)
        == shortest_stable_length(SHARP, STEP, 100, 300)
        == 158
    )
    assert shortest_stable_length(ACTUATOR, STEP) == 1


def test_coefficients_of_any_length_are_looked_at_closely_enough():
    """x^n − ½: as many poles as coefficients, all of one size."""
    for degree in (1, 7, 300):
        a = np.zeros(degree + 1)
        a[0], a[-1] = 1.0, -0.5
        assert poles_outside(a) == 0
        a[-1] = -2.0
        assert poles_outside(a) == degree
    assert poles_outside([3.0]) == 0 and poles_outside([-3.0, 1.0]) == 0


@pytest.mark.parametrize("length", [3, 257, 270, 281, 300])
@pytest.mark.parametrize("side", [-1e-3, 1e-3])
def test_poles_next_to_minus_one_are_not_missed_however_long_the_recursion(length, side):
    """Two there, zeros behind them: the circle is closed at z = −1 for transforms of any size."""
    a = np.zeros(length)
    a[:3] = np.poly([-1.0 - side, -1.0 - side])
    assert poles_outside(a) == (2 if side > 0 else 0)
