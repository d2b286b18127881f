"""The search for modes that follow s^α: its functions in 40 digits, its optimum by linear programmes.

Red when a basis function or its derivative is off, or a fit is far from the best there is.
"""

import math
import re

import mpmath as mp
import numpy as np
import pytest
from scipy import optimize

from focgen.fractional import continuous
from focgen.fractional.continuous import (
    ContinuousMemory,
    check_band,
    fit_band,
    fit_band_states,
    growth_limit,
)
from focgen.fractional.continuous_fit import (
    Band,
    Lines,
    _apart,
    best_rates,
    best_weights,
    power_of,
    rates_of,
    spread,
)

ORDERS = [0.6, 0.05, 1.3, 1.95, -0.4, -0.9]


def complexes(pairs):
    """From real and imaginary parts on the axis before the last."""
    return pairs[..., 0, :] + 1j * pairs[..., 1, :]


def mode(order, theta, rate):
    """(1 − z⁻¹)^m z⁻¹ / (1 − p z⁻¹) / (jθ)^α in 40 digits; without a rate, the lead."""
    z = mp.e ** mp.mpc(0, -theta)
    late = 1 if rate is None else z / (1 - (1 - rate) * z)
    return (1 - z) ** math.ceil(order) * late / mp.mpc(0, theta) ** order


@pytest.mark.parametrize("order", ORDERS)
def test_basis_functions_and_their_slopes_are_right_to_the_last_digits(order):
    theta, rates = np.array([1e-6, 3e-4, 0.1, 1.7, math.pi]), np.array([1.0, 0.6, 1e-3, 1e-7])
    lines = Lines(order, theta)
    basis, slopes = complexes(lines.basis(rates)), complexes(lines.by_rate(rates))
    with mp.workdps(40):
        for j, at in enumerate(map(mp.mpf, theta.tolist())):
            assert abs(basis[0, j] / complex(mode(mp.mpf(order), at, None)) - 1.0) < 1e-13
            for i, rate in enumerate(map(mp.mpf, rates.tolist())):
                assert abs(basis[i + 1, j] / complex(mode(mp.mpf(order), at, rate)) - 1.0) < 1e-13
                slope = mp.diff(lambda r, at=at: mode(mp.mpf(order), at, r), rate, h=mp.mpf("1e-14"))
                assert abs(slopes[i, j] / complex(slope) - 1.0) < 1e-12


@pytest.mark.parametrize("order", [-1.99, -0.6, 0.0, 0.3, 1.0, 1.99])
def test_powers_of_j_omega(order):
    omega = np.array([1e-6, 0.3, 1.0, 40.0])
    with mp.workdps(40):
        exact = [complex(mp.mpc(0, w) ** mp.mpf(order)) for w in omega.tolist()]
    assert complexes(power_of(order, omega)) == pytest.approx(np.array(exact), rel=1e-14)


@pytest.mark.parametrize("low, high, count", [(1e-5, 0.3, 2), (0.1, 0.3, 7), (1e-6, 1.5, 1000)])
def test_places_are_even_on_a_logarithmic_scale(low, high, count):
    found = spread(low, high, count)
    assert found == pytest.approx(np.geomspace(low, high, count), rel=1e-12)
    assert found[-1] == high == found.max() and len(found) == count


def test_a_band_is_looked_at_fourteen_times_a_factor_of_e_and_above_it():
    band = Band(1.3, 1e-3, 0.3)
    inside, beyond = band.points[: band.count], band.points[band.count :]
    assert (inside[0], inside[-1]) == (1e-3, 0.3) and beyond[0] > 0.3 and beyond[-1] == math.pi
    assert np.diff(np.log(inside)).max() <= 1.0 / 14.0 < np.diff(np.log(inside)).max() * 1.02
    assert len(beyond) == 32 and np.diff(np.log(beyond)).max() <= 1.01 * math.log(math.pi / 0.3) / 32
    assert band.differences == 2 and Band(-0.5, 1e-3, 0.3).differences == 0


@pytest.mark.parametrize("seed", range(8))
def test_log_rates_are_pushed_apart_from_their_middle(seed):
    """Rising by a half or more, none beyond log 3; what keeps that already stays as it is."""
    random = np.random.default_rng(seed)
    given = np.sort(random.uniform(-8.0, 2.0, 1 + seed))
    found = _apart(given)
    assert np.all(np.diff(found) >= 0.5 - 1e-12) and found[-1] <= math.log(3.0)
    assert _apart(found) == pytest.approx(found, abs=1e-12)
    kept = -8.0 + 0.7 * np.arange(1 + seed)
    assert np.array_equal(_apart(kept), kept)


def test_the_middle_rate_stays_and_its_neighbours_give_way():
    assert _apart(np.array([-3.1, -3.05, -3.0, -2.9, -2.8])) == pytest.approx([-4.0, -3.5, -3.0, -2.5, -2.0])
    assert _apart(np.array([0.9, 1.0, 1.05])) == pytest.approx(
        [math.log(3.0) - 1, math.log(3.0) - 0.5, math.log(3.0)]
    )
    assert rates_of(np.array([-40.0, 0.0])) == pytest.approx(
        [math.exp(-40.0), 1.0 - math.exp(-1.0)], rel=1e-14
    )


def chebyshev(band, rates):
    """The least largest error in the band: a linear programme, errors within 64 sides of a circle."""
    theta = band.points[: band.count]
    z = np.exp(-1j * theta)
    rest = (1.0 - z) ** math.ceil(band.order) / (1j * theta) ** band.order
    basis = np.array([rest, *(rest * z / (1.0 - (1.0 - r) * z) for r in rates)])
    scale = np.abs(basis).max(axis=1)[:, None]
    turned = np.exp(2j * math.pi * np.arange(64) / 64)[:, None, None]
    rows = (turned * (basis / scale)).real.transpose(0, 2, 1).reshape(-1, len(basis))
    right = (turned[..., 0] * np.ones(len(theta))).real.ravel()
    found = optimize.linprog(
        [*np.zeros(len(basis)), 1.0],
        A_ub=np.column_stack([rows, -np.ones(len(rows))]),
        b_ub=right,
        bounds=[(None, None)] * (len(basis) + 1),
    )
    return found.fun  # at most 1/cos(π/64) too small


def error_of(band, rates, weights):
    theta = band.points[: band.count]
    z = np.exp(-1j * theta)
    modes = sum(w * z / (1.0 - (1.0 - r) * z) for w, r in zip(weights[1:], rates))
    made = (1.0 - z) ** math.ceil(band.order) * (weights[0] + modes) / (1j * theta) ** band.order
    return np.abs(made - 1.0).max()


@pytest.mark.parametrize("order, states", [(0.6, 2), (0.6, 5), (1.4, 4), (-0.5, 3), (0.1, 4)])
def test_weights_for_given_rates_come_near_the_best_there_are(order, states):
    band = Band(order, 3e-3, 0.3)
    rates = np.geomspace(0.9, 2e-3, states)
    least = chebyshev(band, rates)
    found = error_of(band, rates, best_weights(band, rates, 1e-5))
    assert least * (1.0 - 1e-6) <= found <= 1.03 * least


def test_no_weights_suit_rates_that_are_one():
    assert best_weights(Band(0.6, 3e-3, 0.3), np.array([0.0, 0.0]), 1e-4) is None


@pytest.mark.parametrize("order", [0.6, 1.4])
def test_two_rates_come_near_the_best_there_are(order):
    """Against every pair of a grid, each with its best weights."""
    band = Band(order, 0.02, 0.3)
    rates, error = best_rates(band, 2, 1e-5)
    grid = np.geomspace(0.01, 0.94, 9)
    least = min(chebyshev(band, (a, b)) for i, b in enumerate(grid) for a in grid[i + 1 :])
    assert rates[0] > rates[1] > 0.0
    assert error_of(band, rates, best_weights(band, rates, 1e-5)) <= 1.05 * least
    assert chebyshev(band, rates) <= error * 1.001 <= 1.1 * least


def test_what_is_held_back_grows_less_and_follows_less():
    band = Band(0.6, 1e-3, 0.3)
    free, held = (best_rates(band, 5, above) for above in (1e-5, 0.1))
    assert free[1] < 0.9 * held[1]
    z = np.exp(-1j * np.linspace(0.5, math.pi, 50))
    most = []
    for (rates, _), above in ((free, 1e-5), (held, 0.1)):
        lead, *weights = best_weights(band, rates, above)
        modes = sum(w * z / (1.0 - (1.0 - r) * z) for w, r in zip(weights, rates))
        most.append(np.abs((1.0 - z) * (lead + modes)).max())
    assert most[1] < 0.9 * most[0]


def test_the_default_band_is_four_decades_up_to_a_tenth_of_the_nyquist_frequency():
    assert continuous.DEFAULT_BAND == pytest.approx((1e-5 * math.pi, 0.1 * math.pi), rel=1e-15)
    assert math.log10(continuous.DEFAULT_BAND[1] / continuous.DEFAULT_BAND[0]) == pytest.approx(4.0)
    assert continuous.DEFAULT_TOLERANCE == 1e-3 and math.pi / 2 == continuous.HIGHEST


def test_growth_above_the_band_is_limited_by_the_order():
    assert [growth_limit(order) for order in (-0.5, 0.9, 1.0, 1.1, 1.9)] == [2.0, 2.0, 2.0, 4.0, 4.0]


@pytest.mark.parametrize("order, low, high, tolerance", [
    (0.6, 0.03, 0.3, 0.1), (0.1, 0.03, 0.3, 0.1),
    (-0.5, 0.03, 0.3, 1e-3),
])  # fmt: skip
def test_one_mode_fewer_misses_the_tolerance(order, low, high, tolerance):
    memory = fit_band(order, low, high, tolerance)
    assert memory.certificate.error == memory.tolerance <= tolerance
    assert memory.certificate.above <= growth_limit(order)
    assert (memory.order, memory.band) == (order, (low, high)) and memory.differences == math.ceil(order)
    assert list(memory.poles) == sorted(memory.poles) and 0.0 < memory.poles[0] and memory.poles[-1] < 1.0
    if memory.states > 2:
        assert fit_band_states(order, low, high, memory.states - 1).tolerance > 0.9 * tolerance
    else:
        assert memory.states == 2


def test_two_modes_are_tried_first():
    """Where two keep a tolerance of 10 %, no third is spent."""
    two = fit_band_states(0.1, 0.03, 0.3, 2)
    assert two.tolerance < 0.09 and fit_band(0.1, 0.03, 0.3, 0.1).states == 2


@pytest.mark.parametrize("tolerance", [1.01e-1, 9.9e-7, math.nan])
def test_tolerances_are_refused_beyond_their_limits(tolerance):
    with pytest.raises(ValueError, match=f"the tolerance {tolerance} is not between 1e-06 and 0.1"):
        fit_band(0.6, 0.03, 0.3, tolerance)


def coarse(rates):
    """Powers of four."""
    return 4.0 ** np.round(np.log(rates) / np.log(4.0))


def test_the_largest_tolerance_is_taken_and_the_smallest(monkeypatch):
    assert fit_band(0.1, 0.03, 0.3, 0.1).tolerance <= 0.1
    monkeypatch.setattr(continuous, "MOST_STATES", 2)
    with pytest.raises(ValueError, match="2 modes miss the tolerance 1e-06 in this band; allow more"):
        fit_band(0.6, 0.03, 0.3, 1e-6)


def test_what_is_said_to_be_within_reach_is_kept(monkeypatch):
    """Rates as powers of four, whose best weights are far from what the rates themselves allow."""
    monkeypatch.setattr(continuous, "MOST_STATES", 3)
    tolerance = 0.5 * fit_band_states(0.6, 0.03, 0.3, 3, coarse).tolerance
    with pytest.raises(ValueError, match="3 modes miss the tolerance .* is within reach") as refused:
        fit_band(0.6, 0.03, 0.3, tolerance, coarse)
    reach = float(re.search(r"(\S+) is within reach", str(refused.value))[1])
    assert tolerance < fit_band(0.6, 0.03, 0.3, reach, coarse).tolerance <= reach < 2.2 * tolerance


@pytest.mark.parametrize("states, kept", [(2, True), (1, False), (21, False)])
def test_states_are_taken_to_their_limits(states, kept):
    if kept:
        assert fit_band_states(0.6, 0.03, 0.3, states).states == states
    else:
        with pytest.raises(ValueError, match=f"{states} modes are not 2 to 20"):
            fit_band_states(0.6, 0.03, 0.3, states)


def test_the_largest_number_of_states_is_taken(monkeypatch):
    monkeypatch.setattr(continuous, "MOST_STATES", 3)
    assert fit_band_states(0.6, 0.02, 0.3, 3).states == 3
    with pytest.raises(ValueError, match="4 modes are not 2 to 3"):
        fit_band_states(0.6, 0.02, 0.3, 4)


@pytest.mark.parametrize("low, high, said", [
    (0.03, 0.3, ""), (0.03000001, 0.3, "factor of 10 to 1e[+]06 apart"), (3e-7, 0.3, ""),
    (2.9999986e-7, 0.3, "factor"), (0.1, math.pi / 2, ""), (0.1, 1.001 * math.pi / 2, "half of the Nyquist"),
    (0.0, 0.3, "rise from above 0"), (-0.1, 0.3, "rise"), (0.3, 0.3, "rise"), (math.nan, 0.3, "rise"),
    (0.03, math.nan, "rise"),
])  # fmt: skip
def test_bands_are_taken_to_their_limits(low, high, said):
    if said:
        with pytest.raises(ValueError, match=said):
            check_band(low, high)
        with pytest.raises(ValueError, match=said):
            fit_band_states(0.6, low, high, 2)
    else:
        check_band(low, high)


@pytest.mark.parametrize("whole", [-1, 0, 1, 2])
def test_orders_are_taken_to_a_ten_millionth_of_a_whole_one(whole):
    for side in (-1.0, 1.0):
        near, nearer = whole + side * 1.001e-7, whole + side * 0.999e-7
        if -1.0 < near < 2.0:
            continuous._check(near, 0.03, 0.3)
        for order in {nearer} | ({near} if not -1.0 < near < 2.0 else set()):
            with pytest.raises(ValueError, match="not between -1 and 2, or within 1e-7 of a whole one"):
                fit_band(order, 0.03, 0.3, 1e-2)


def test_poles_that_become_one_or_leave_the_circle_are_given_up():
    band = Band(0.6, 0.03, 0.3)
    for poles in ([0.2, 0.2], [0.5, 0.2], [0.0, 0.5], [0.5, 1.0], [-0.1, 0.5]):
        assert continuous._held(band, np.array(poles), 1e-4) is None
    held = continuous._held(band, np.array([1e-12, 0.9]), 1e-4)
    assert held.poles == (1e-12, 0.9) and held.tolerance == held.certificate.error
    with pytest.raises(ValueError, match=r"no 2 modes keep within 2 \|jω\|\^α above the band"):
        fit_band_states(0.6, 0.03, 0.3, 2, np.zeros_like)


def test_a_response_is_that_of_its_step():
    """By running the step of the description on a sine until what began it has died away."""
    memory = ContinuousMemory(1.4, (0.01, 0.3), 0.1, 2, 0.7, (0.3, 0.8), (-0.2, 0.4))
    assert memory.states == 2
    omega = 0.35
    v = np.exp(1j * omega * np.arange(400)) * (1.0 - np.exp(-1j * omega)) ** 2
    states = np.zeros(2, complex)
    for sample in v:
        y = memory.lead * sample + states @ np.array(memory.weights)
        states = states * np.array(memory.poles) + sample
    assert y / np.exp(399j * omega) == pytest.approx(memory.frequency_response(omega), rel=1e-12)
    assert memory.frequency_response(np.full((2, 3), omega)).shape == (2, 3)
