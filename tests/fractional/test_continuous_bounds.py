"""The bounds on modes that follow s^α: each number of the argument in 40 digits, and what it bounds.

Red when a second derivative is larger than its bound, or a bound is not the one that is argued for.
"""

import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional.continuous import fit_band_states
from focgen.fractional.continuous_certificate import _largest, _second, certify_band
from tests.fractional.test_continuous_search import mode

ORDERS = [0.6, 1.7, -0.4, 0.03]


def argued(order, theta, step):
    """(K² + K') e^{Kδ} at the end of the step, as the module argues it."""
    end = min(theta * mp.exp(step), mp.pi)
    m = math.ceil(order)
    kappa = end / 2 / mp.sin(end / 2)
    gamma = end / mp.sin(end) if end <= mp.pi / 2 else max(end, mp.pi / 2)
    first = m * kappa + gamma + end + abs(order)
    change = m * (kappa + kappa**2) + gamma + gamma**2 + end
    return (first**2 + change) * mp.exp(first * step)


PLACES = [1e-6, 1e-3, 0.3, 1.0, 1.5, 1.56, 1.58, 2.0, 2.9, 3.1]


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("step", [2e-4, 1e-2, 0.3])
def test_the_bound_of_second_derivatives_is_the_one_that_is_argued_for(order, step):
    found = _second(order, np.array(PLACES), step)
    with mp.workdps(30):
        exact = [float(argued(mp.mpf(order), mp.mpf(at), mp.mpf(step))) for at in PLACES]
    assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("rate", [None, 1.0, 0.5, 1e-2, 1e-5])
def test_no_basis_function_bends_more_than_its_bound(order, rate):
    """d²B/dt² over |B|, t = ln θ, between each place and a hundredth of a factor of e beyond it."""
    bounds = _second(order, np.array(PLACES), 1e-2)
    with mp.workdps(30):
        exact = None if rate is None else mp.mpf(rate)
        for at, bound in zip(PLACES, bounds):
            t, size = mp.log(at), abs(mode(mp.mpf(order), mp.mpf(at), exact))
            for along in (0.0, 0.005, 0.01):
                if t + along < mp.log(mp.pi):
                    bent = mp.diff(lambda x: mode(mp.mpf(order), mp.exp(x), exact), t + along, 2)
                    assert abs(bent) <= bound * size


@pytest.mark.parametrize("order", ORDERS)
def test_the_largest_error_at_lines_is_that_at_every_line(order):
    """In several parts of 4096 lines; and an eighth of the largest bend."""
    rates, weights = np.array([0.5, 0.01]), np.array([0.7, -0.2, 0.4])
    low, high, step = 1e-3, 1.5, 7e-4
    seen, bend = _largest(order, low, high, rates, weights, step, 1.0)
    theta = np.geomspace(low, high, 5 * math.ceil(math.log(high / low) / step))
    z = np.exp(-1j * theta)
    rest = (1.0 - z) ** math.ceil(order) / (1j * theta) ** order
    parts = np.array(
        [w * rest * f for w, f in zip(weights, [1.0, z / (1.0 - 0.5 * z), z / (1.0 - 0.99 * z)])]
    )
    most = np.abs(parts.sum(axis=0) - 1.0).max()
    assert most * (1.0 - 1e-6) <= seen <= most * (1.0 + 1e-9)
    bends = np.abs(parts).sum(axis=0) * _second(order, theta, step)
    assert bend == pytest.approx(bends.max() / 8.0, rel=2e-3)
    assert _largest(order, low, high, rates, weights, step, 0.0)[0] == pytest.approx(
        np.abs(parts.sum(axis=0)).max(), rel=1e-6
    )


@pytest.mark.parametrize("order", [0.6, 1.4, -0.5])
def test_a_lead_alone_is_bounded_by_its_closed_form(order):
    """|(1 − z⁻¹)^m / (jθ)^α| = (2 sin θ/2)^m θ^−α; the error against 1 at the end where it is largest."""
    low, high = 0.01, 0.3
    found = certify_band(order, (low, high), [0.5], [1.0, 0.0])
    theta = np.geomspace(low, high, 20_001)
    z = np.exp(-1j * theta)
    error = np.abs((1.0 - z) ** math.ceil(order) / (1j * theta) ** order - 1.0).max()
    assert error <= found.error <= 1.011 * error
    beyond = np.linspace(high, math.pi, 20_001)
    above = ((2.0 * np.sin(beyond / 2.0)) ** math.ceil(order) * beyond**-order).max()
    assert above * (1.0 - 1e-9) <= found.above <= above * (1.0 + 1e-4)


@pytest.mark.parametrize("order, states", [(0.6, 6), (1.4, 3)])
def test_chords_add_one_per_cent(order, states):
    memory = fit_band_states(order, 0.003, 0.3, states)
    theta = np.geomspace(*memory.band, 100_001)
    seen = np.abs(memory.frequency_response(theta) / (1j * theta) ** order - 1.0).max()
    assert seen <= memory.certificate.error <= 1.0103 * seen
    beyond = np.geomspace(memory.band[1], math.pi, 50_001)
    above = np.abs(memory.frequency_response(beyond) / beyond**order).max()
    assert above * (1.0 - 1e-9) <= memory.certificate.above <= above * 1.001


@pytest.mark.parametrize("rate, weight, kept", [
    (1.0, 1.0, True), (1e-300, 1.0, True), (0.0, 1.0, False), (1.0 + 1e-15, 1.0, False),
    (-0.5, 1.0, False), (math.nan, 1.0, False), (0.5, math.inf, False), (0.5, math.nan, False),
    (0.5, -1.0, True), (0.5, 0.0, True),
])  # fmt: skip
def test_rates_and_weights_are_taken_to_their_limits(rate, weight, kept):
    for rates, weights in (([rate], [1.0, weight]), ([0.3, rate], [weight, 1.0, 0.1])):
        if kept:
            assert certify_band(0.6, (0.01, 0.1), rates, weights).error >= 0.0
        else:
            with pytest.raises(ValueError, match=r"must lie in \(0, 1\] and the weights must be finite"):
                certify_band(0.6, (0.01, 0.1), rates, weights)


def test_nothing_at_all_is_wrong_by_one():
    found = certify_band(0.6, (0.01, 0.1), [0.5], [0.0, 0.0])
    assert (found.error, found.above) == (1.0, 0.0)
