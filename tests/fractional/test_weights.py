"""Grünwald–Letnikov weights against 40-digit gamma functions and exact binomials.

Red when a weight is off the exact binomial.
"""

import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional.weights import (
    _BERNOULLI,
    gl_weights,
    gl_weights_at,
    short_memory_bias,
    short_memory_bias_asymptote,
)

ORDERS = [0.6, 0.1, 1e-8, 0.5, 1 - 1e-12, 1 + 1e-9, 0.999, 1.2, 1.99, 2.7, 3.5, 17.3]
NEGATIVE = [-0.4, -0.6, -1.0, -2.3, -1e-6, -9.7]
INDICES = np.array([0, 1, 2, 3, 50, 127, 128, 129, 130, 200, 689, 1000, 12345, 10**5, 654321, 10**6])


def relative_errors(values, truths):
    return [abs(float((mp.mpf(float(v)) - t) / t)) for v, t in zip(values, truths)]


@pytest.mark.parametrize("order", ORDERS + NEGATIVE)
def test_a_million_weights_within_1e_12(order):
    weights = gl_weights(order, 10**6)
    assert weights.shape == (10**6 + 1,)
    with mp.workdps(40):
        a = mp.mpf(order)
        truths = [mp.gammaprod([int(j) - a], [-a, int(j) + 1]) for j in INDICES]
        assert max(relative_errors(weights[INDICES], truths)) < 1e-13


@pytest.mark.parametrize("order", [0.6, -0.6, 1.37, 2.7])
def test_every_weight_obeys_the_recursion(order):
    """The series and the recursion meet without a step, and no weight between the samples is off."""
    weights = gl_weights(order, 5000)
    j = np.arange(1, 5001)
    assert np.max(np.abs(weights[1:] / (weights[:-1] * ((j - 1 - order) / j)) - 1)) < 2e-14


@pytest.mark.parametrize("order", range(12))
def test_whole_orders_are_exact_binomials(order):
    weights = gl_weights(float(order), 400)
    assert weights[: order + 1].tolist() == [(-1) ** j * math.comb(order, j) for j in range(order + 1)]
    assert not weights[order + 1 :].any()


def test_single_weights_equal_the_table():
    assert np.array_equal(gl_weights_at(0.6, INDICES), gl_weights(0.6, 10**6)[INDICES])
    assert gl_weights(0.6, 0).tolist() == [1.0]
    assert gl_weights(1.0, 1).tolist() == [1.0, -1.0]


@pytest.mark.parametrize("order", ORDERS + NEGATIVE + [1.0, 2.0, 0.0])
@pytest.mark.parametrize("length", [0, 1, 5, 64, 1000, 10**9])
def test_short_memory_bias_is_the_exact_partial_sum(order, length):
    with mp.workdps(40):
        a = mp.mpf(order)
        truth = mp.gammaprod([length + 1 - a], [1 - a, length + 1])
        bias = short_memory_bias(order, length)
        assert bias == 0.0 if truth == 0 else abs(float((bias - truth) / truth)) < 1e-12


def test_short_memory_bias_sums_the_weights_and_tends_to_its_asymptote():
    assert math.fsum(gl_weights(0.6, 300)) == pytest.approx(short_memory_bias(0.6, 300), rel=1e-12)
    assert short_memory_bias_asymptote(0.6, 10**9) == pytest.approx(short_memory_bias(0.6, 10**9), rel=1e-8)
    # the bias of 1.32 s^0.6 + 1 at h = 10 ms, L = 1000, known from simulation: y = 0.87
    assert 1 / (1 + 1.32 * 0.01**-0.6 * short_memory_bias(0.6, 1000)) == pytest.approx(0.870, abs=5e-4)


@pytest.mark.parametrize("order, count", [(math.nan, 3), (math.inf, 3), (0.6, -1), (1e9, 3)])
def test_what_has_no_weights_is_refused(order, count):
    with pytest.raises(ValueError):
        gl_weights(order, count)


def test_the_polynomials_are_bernoullis():
    """Against mpmath's, at as many places as fix them."""
    for degree, coefficients in _BERNOULLI.items():
        for x in np.linspace(-2.0, 2.0, degree + 2):
            assert np.polyval(coefficients, x) == pytest.approx(float(mp.bernpoly(degree, x)), abs=1e-9)
