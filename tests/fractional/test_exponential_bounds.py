"""The bounds of exponential memories against sums that telescope: closed forms in 40 digits, nothing between.

Red when a bound is below what the weights give, or looser than the grid of lags accounts for.
"""

import itertools
import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional.exponential import fit_exponential
from focgen.fractional.exponential_certificate import Certificate, _Error, _lags, certify
from focgen.fractional.weights import gl_weights
from tests.fractional.test_exponential import bounds, truths

SLACK = 3e-13
"""Of the weights, which the certificate adds for rounding."""


def weight(order, j):
    """w_j of (1 − x)^order."""
    return mp.gammaprod([j - order], [-order, j + 1])


def without_modes(beta, differences, horizon):
    """What is wrong where nothing follows the weights: the weights themselves from lag 1 on."""
    g1, g2 = weight(-beta, 1), weight(-beta, 2)
    if differences == 0:
        return weight(-beta - 1, horizon) - 1, mp.inf
    if differences == 1:  # g rises once to g₁, then falls for ever
        return 2 * g1 - weight(-beta, horizon), weight(-beta, horizon)
    slope = weight(1 - beta, horizon)  # of g at the horizon: below 0, and rising to it
    return g1 + abs(g2 - 2 * g1) + slope - weight(1 - beta, 2), -slope


@pytest.mark.parametrize("differences", [0, 1, 2])
@pytest.mark.parametrize("beta", [0.4, 0.93])
@pytest.mark.parametrize("horizon, share", [(100, 1e-12), (20_000, 1e-6), (10**8, 3e-4)])
def test_where_nothing_follows_the_weights_they_are_the_error(beta, differences, horizon, share):
    found = certify(beta, differences, horizon, [0.5], [0.0])
    with mp.workdps(40):
        exact = mp.mpf(beta)
        per_unit, beyond = without_modes(exact, differences, horizon)
        whole = weight(-exact - 1, min(horizon, 4096))  # Σ g over the lags that are all looked at
        rounding = SLACK * 2**differences * float(whole)
        excess = float(found.per_unit - per_unit)
        assert 0.98 * rounding < excess
        assert excess < 1.02 * rounding + (share * float(per_unit) if horizon > 4096 else 0.0)
        assert SLACK * 0.99 < float(found.largest - exact) < SLACK * 1.01
        assert SLACK * 0.99 < found.kernel - 1.0 < (2e-3 if horizon > 4096 else SLACK * 1.01)
        assert float(beyond) <= found.beyond <= float(beyond) * (1.0 + 2e-5)


@pytest.mark.parametrize("horizon, left", [(700, 0.1), (10**6, 0.1), (700, 1e-7)])
@pytest.mark.parametrize("differences", [0, 1, 2])
def test_a_mode_beside_vanishing_weights_is_the_error(horizon, left, differences):
    """β = 1e-12 leaves g_j ≈ β/j: e_j is w p^(j−1), and its differences add up by themselves."""
    beta, w = 1e-12, 0.7
    p = 1.0 - left / horizon
    found = certify(beta, differences, horizon, [p], [w])
    with mp.workdps(40):
        q = mp.mpf(p)
        last = q ** (horizon - differences)
        per_unit = {
            0: w * (1 - q**horizon) / (1 - q),
            1: w + w * (1 - q ** (horizon - 1)),
            2: w + w * (2 - q) + w * (1 - q) * (1 - q ** (horizon - 2)),
        }[differences]
        beyond = {0: mp.inf, 1: w * last, 2: w * (1 - q) * last}[differences]
    assert float(per_unit) * (1.0 - 1e-9) <= found.per_unit <= float(per_unit) * (1.0 + 1e-5) + 1e-9
    assert w - 1e-12 <= found.largest <= w * (1.0 + 1e-5)
    assert float(beyond) * (1.0 - 1e-7) <= found.beyond
    assert math.isinf(beyond) or found.beyond <= float(beyond) * (1.0 + 1e-3) + 1e-10
    g = gl_weights(-beta, horizon)[1:]
    relative = (w * p ** np.arange(horizon) / g - 1.0).max()
    assert relative * (1.0 - 1e-9) <= found.kernel <= relative * (1.0 + 4e-3)


def test_third_differences_weigh_one_per_cent_of_a_small_error():
    """The closest fit, where the lags that are looked at are nearest to one another."""
    memory = fit_exponential(0.6, 300_000, 1e-8)
    found = truths(memory.beta, memory.differences, 300_000, memory.poles, memory.weights)
    for bound, truth, share in zip(bounds(memory.certificate), found, (3.4e-3, 2e-4, 1.2e-3)):
        assert truth <= bound <= truth * (1.0 + share) + SLACK


def test_beyond_the_horizon_what_is_forgotten_is_counted_once():
    """All lags to 300 000 with differences that change their sign, and what g leaves after them."""
    memory = fit_exponential(0.6, 100, 1e-4)
    count = 300_000
    lags = np.arange(count + 1)
    e = np.where(lags == 0, 0.0, memory.kernel(lags) - gl_weights(-0.4, count))
    reached = np.abs(np.diff(e))[100:].sum() + gl_weights(-0.4, count)[-1]
    assert reached <= memory.certificate.beyond <= 1.0001 * reached


@pytest.mark.parametrize("m", [0, 1])
def test_between_lags_the_error_is_bounded_as_it_is_argued(m):
    """(b − a)²/8 (|∇^(m+2) e_(a+2)| + (b − a) max(|∇^(m+3) g_(a+3)|, |∇^(m+3) h_(a+3)|)), in 40 digits."""
    beta, poles, weights = 0.4, (0.3, 0.99), (0.25, 0.03)
    grid = np.array([10, 11, 13, 20, 40])
    error = _Error(beta, np.array(poles), np.array(weights))
    with mp.workdps(40):

        def modelled(k, j):
            return mp.fsum(
                w * (mp.mpf(p) - 1) ** k * mp.mpf(p) ** (j - 1 - k) for p, w in zip(poles, weights)
            )

        def exact(k, j):
            return weight(k - mp.mpf(beta), j)

        apart, sizes, total = [], [], mp.mpf(0)
        for a, b in itertools.pairwise(grid.tolist()):
            second = abs(modelled(m + 2, a + 2) - exact(m + 2, a + 2))
            third = max(abs(exact(m + 3, a + 3)), abs(modelled(m + 3, a + 3)))
            apart.append((b - a) ** 2 / mp.mpf(8) * (second + (b - a) * third) if b > a + 1 else 0)
            ends = [abs(modelled(m, j) - exact(m, j)) for j in (a, b)]
            sizes.append(max(ends) + apart[-1])
            # the trapezoid from a to b without the end a: half of the ends, and half of what b has more
            total += mp.mpf(b - a) / 2 * sum(ends) + (ends[1] - ends[0]) / 2 + (b - a) * apart[-1]
    assert error.off_chord(m, grid) == pytest.approx([float(x) for x in apart], rel=1e-10)
    assert error.sizes(m, grid) == pytest.approx([float(x) for x in sizes], rel=1e-10)
    assert error.total(m, grid) == pytest.approx(float(total), rel=1e-10)


@pytest.mark.parametrize("first, last, gap", [(4096, 4097, 2e-3), (4096, 10**6, 3e-4), (100, 10**6, 2e-3)])
def test_lags_of_the_grid_are_no_farther_apart_than_asked(first, last, gap):
    lags = _lags(first, last, gap)
    assert (lags[0], lags[-1]) == (first, last) and np.all(np.diff(lags) > 0)
    assert np.all(np.diff(lags) <= gap * 1.001 * lags[1:] + 1.0)
    assert len(lags) <= math.log(last / first) / gap + 3
    assert len(_lags(first, last, 5.0)) == len(_lags(first, last, 2e-3))  # the widest there is


@pytest.mark.parametrize("pole, weight, kept", [
    (0.0, 0.3, True), (math.nextafter(1.0, 0.0), 0.0, True), (1.0, 0.3, False), (1.5, 0.3, False),
    (-1e-300, 0.3, False), (0.5, -1e-300, False), (0.5, math.inf, False), (0.5, math.nan, False),
    (math.nan, 0.3, False),
])  # fmt: skip
def test_poles_and_weights_are_taken_to_their_limits(pole, weight, kept):
    for poles, weights in (([pole], [weight]), ([0.5, pole], [0.2, weight])):
        if kept:
            assert certify(0.4, 1, 100, poles, weights).kernel > 0.0
        else:
            with pytest.raises(
                ValueError, match=r"must lie in \[0, 1\) and the weights must not be negative"
            ):
                certify(0.4, 1, 100, poles, weights)


def test_an_output_errs_by_its_input_times_what_is_told():
    certificate = Certificate(0.1, 0.2, 0.25, 0.5)
    assert certificate.output_error(4.0) == certificate.output_error(4.0, True) == 3.0
    assert certificate.output_error(4.0, past_horizon=False) == 1.0
