"""The search for exponential memories: its optimum by every lag, its parts by linear programmes.

Red when a fit is not the best there is, or what is left of a tolerance goes elsewhere than it should.
"""

import itertools
import math
import re

import mpmath as mp
import numpy as np
import pytest
from scipy import optimize

from focgen.fractional import exponential_fit, exponential_rounded
from focgen.fractional.exponential import HORIZONS, fit_exponential, fit_states
from focgen.fractional.exponential_fit import Alternation, Problem, best_weights, eased, ladder
from focgen.fractional.exponential_rounded import fit_rounded
from focgen.fractional.weights import gl_weights


def relative_error(beta, horizon, fit):
    """h_j/g_j − 1 at every lag 1 … horizon."""
    lags = np.arange(horizon, dtype=float)
    modes = np.exp(fit.log_weights[:, None] - np.exp(fit.log_rates)[:, None] * lags)
    return modes.sum(axis=0) / gl_weights(-beta, horizon)[1:] - 1.0


def extrema(error):
    """The largest of each run of one sign, with its lag."""
    edges = [0, *(np.flatnonzero(np.diff(np.sign(error))) + 1), len(error)]
    places = np.array([a + np.argmax(np.abs(error[a:b])) for a, b in itertools.pairwise(edges)])
    return places + 1, error[places]


@pytest.mark.parametrize("beta, horizon", [(0.4, 100), (0.02, 100), (0.97, 250), (0.1, 1000), (0.7, 4000)])
def test_each_rung_of_the_ladder_is_the_best_by_its_alternation(beta, horizon):
    """2n + 1 extrema of one size and alternating signs, at every lag: no n exponentials come closer."""
    rungs = list(itertools.takewhile(lambda fit: fit.error > 1e-7, ladder(beta, horizon)))
    assert [fit.modes for fit in rungs] == list(range(1, len(rungs) + 1))
    for fit in rungs:
        error = relative_error(beta, horizon, fit)
        places, sizes = extrema(error)
        assert len(places) == 2 * fit.modes + 1 == len(fit.places) and places[0] == 1
        assert fit.places[-1] == horizon and np.all(np.diff(fit.places) > 0)
        assert np.all(sizes[1:] * sizes[:-1] < 0.0) and np.all(np.diff(fit.log_rates) > 0.0)
        assert np.abs(sizes).max() < 1.006 * np.abs(sizes).min()
        assert np.abs(error[fit.places - 1]).max() == pytest.approx(fit.error, rel=1e-4, abs=1e-13)
        assert np.abs(sizes).max() < 1.002 * fit.error


@pytest.mark.parametrize("beta", [1e-7, 0.1, 0.55, 0.999, 1.0 - 1e-7])
@pytest.mark.parametrize("horizon", HORIZONS)
def test_the_ladder_goes_on_to_the_smallest_tolerance(beta, horizon):
    """One mode more a rung, none left out, within 16 exp(−π² n / ln 8R) (Braess and Hackbusch 2005)."""
    last = 1.005
    for modes, fit in enumerate(ladder(beta, horizon), 1):
        assert fit.modes == modes
        assert 0.0 < fit.error < min(last, 16.0 * math.exp(-modes * math.pi**2 / math.log(8.0 * horizon)))
        last = fit.error
        if modes == 9 or last < 1e-8:
            break
    assert modes == 9 or last < 1e-8


def test_the_ladder_is_climbed_once_by_all_who_ask():
    made = exponential_fit.Ladder(1.0 - 1e-7, 100)
    first, again = iter(made), iter(made)
    ahead = [next(first) for _ in range(3)]
    assert all(a is b for a, b in zip(ahead, again)) and next(again) is next(first)


@pytest.mark.parametrize(
    "order, horizon, states", [(0.6, 3000, 6), (0.2, 1000, 4), (1.4, 5000, 7), (-0.5, 900, 5)]
)
def test_with_states_given_the_last_lags_err_six_times_as_much(order, horizon, states):
    """The error at lag j is within (1 + 5 j/horizon)(1 − 0.875/j) of one number, and alternates there."""
    memory = fit_states(order, horizon, states)
    lags = np.arange(1, horizon + 1)
    error = memory.kernel(lags) / gl_weights(-memory.beta, horizon)[1:] - 1.0
    profile = (1.0 + 5.0 * lags / horizon) * (1.0 - 0.875 / lags)
    sizes = np.abs(extrema(error / profile)[1])
    assert len(sizes) == 2 * states + 1 and sizes.max() < 1.006 * sizes.min()
    assert np.abs(error).max() <= memory.tolerance <= 1.01 * np.abs(error).max()


@pytest.mark.parametrize("order, horizon", [(0.6, 3000), (1.3, 700)])
@pytest.mark.parametrize("ratio", [1.02, 1.7, 2.3, 3.1, 4.4, 5.3, 30.0])
def test_what_is_left_of_a_tolerance_goes_to_the_last_lags(order, horizon, ratio):
    """As many halves of ease as keep 99 % of the tolerance, by the sizes of the error where it is largest."""
    beta = math.ceil(order) - order
    fit = next(f for f in ladder(beta, horizon) if f.modes == 4)
    tolerance = ratio * fit.error
    found = eased(beta, horizon, fit, tolerance)
    worst = np.abs(relative_error(beta, horizon, found))
    assert worst.max() <= 0.99 * tolerance or found is fit
    halves = round(2.0 * (worst[-1] / found.error - 1.0))
    assert worst[-1] == pytest.approx((1.0 + 0.5 * halves) * found.error, rel=0.02)
    if halves < 10:  # one half more would be too much: its error, from the best with that profile
        easier = Problem(beta, math.log(horizon), 0.5 * (halves + 1)).solve(fit, 300, 1.005)
        assert np.abs(relative_error(beta, horizon, easier)).max() > 0.97 * tolerance
    else:
        assert halves == 10 and ratio > 4.0


@pytest.mark.parametrize("ease", [0.0, 0.5, 5.0])
def test_the_profile_is_that_of_its_description(ease):
    problem = Problem(0.3, math.log(2500.0), ease)
    lags = np.array([1, 2, 7, 199, 2500])
    scale, target = problem.scaled(lags)
    with mp.workdps(40):
        for j, made, inverse in zip(lags.tolist(), scale, target):
            profile = (1 + mp.mpf(ease) * j / 2500) * (1 - mp.mpf("0.175") * ease / j)
            weight = mp.gammaprod([j + mp.mpf(0.3)], [mp.mpf(0.3), j + 1])
            assert float(made) == pytest.approx(float(weight * profile), rel=1e-13)
            assert float(inverse) == pytest.approx(float(1 / profile), rel=1e-14)


@pytest.mark.parametrize("horizon", [100, 199, 200, 201, 5000, 10**8])
@pytest.mark.parametrize("density", [40, 300])
def test_every_small_lag_is_looked_at_and_the_others_are_dense(horizon, density):
    lags = Problem(0.4, math.log(horizon)).lags(density)
    head = min(200, horizon)
    assert lags[:head].tolist() == list(range(1, head + 1)) and lags[-1] == horizon
    steps = np.diff(lags)
    assert np.all(steps > 0) and np.all(steps <= lags[:-1] / density * (1.0 + 0.51 / density) + 1.0)
    assert len(lags) <= head + max(0.0, math.log(horizon / 200)) * density + 3


@pytest.mark.parametrize("seed", range(6))
def test_weights_for_given_poles_come_near_the_best_there_are(seed):
    """Against the linear programme that makes the largest relative error least, at every lag."""
    random = np.random.default_rng(seed)
    beta, horizon = float(random.uniform(0.05, 0.95)), int(10 ** random.uniform(2.0, 3.2))
    fit = fit_states(1.0 - beta, horizon, 2 + seed % 4)
    poles = np.array(fit.poles) ** random.uniform(0.85, 1.15, fit.states)
    lags = np.arange(1, horizon + 1)
    basis = (poles ** (lags[:, None] - 1.0)) / gl_weights(-beta, horizon)[1:, None]
    slack = -np.ones((horizon, 1))
    best = optimize.linprog(
        [*np.zeros(len(poles)), 1.0],
        A_ub=np.block([[basis, slack], [-basis, slack]]),
        b_ub=np.concatenate([np.ones(horizon), -np.ones(horizon)]),
        bounds=[(None, None)] * (len(poles) + 1),
    )
    found = np.abs(basis @ best_weights(beta, horizon, poles) - 1.0).max()
    assert best.fun * (1.0 - 1e-6) <= found <= 1.05 * best.fun


def test_no_weights_suit_poles_that_are_one():
    assert np.all(np.isneginf(best_weights(0.4, 100, np.array([0.0, 0.0]))))


def test_a_step_of_newtons_is_none_where_no_number_holds_it():
    step = exponential_fit._newton_step
    assert step(np.array([[2.0, 1e-9], [4.0, 3e-9]]), np.array([1.0, 5.0])) == pytest.approx([-1.0, 3e9])
    assert step(np.array([[1.0, 2.0], [2.0, 4.0]]), np.array([1.0, 1.0])) is None
    assert step(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([1.0, 1.0])) is None
    assert step(np.array([[1.0, math.inf], [2.0, 1.0]]), np.array([1.0, 1.0])) is None
    assert step(np.array([[1e-300, 0.0], [0.0, 1.0]]), np.array([1e300, 1.0])) is None


def test_places_are_the_nearest_lags_that_rise_and_end_at_the_horizon():
    def distinct(*lags, horizon):
        return exponential_fit._distinct(np.log(lags), horizon).tolist()

    assert distinct(1.0, 2.4, 2.6, 9.6, 20.4, horizon=20) == [1, 2, 3, 10, 20]
    assert distinct(1.0, 1.1, 1.2, 3.2, 18.0, horizon=20) == [1, 2, 3, 4, 20]
    assert distinct(1.0, 1.0, 1.0, horizon=2) == [1, 2, 3]


def test_stretching_keeps_the_power_law_and_the_slowest_mode():
    """Twice as far in log lag: places and rates twice as far apart, weights falling as the lag's β − 1."""
    rates, weights = np.array([-6.0, -3.0, -1.0]), np.array([-4.0, -2.0, -1.0])
    fit = Alternation(rates, weights, 1e-3, np.array([1, 2, 5, 10, 30, 60, 100]))
    made = exponential_fit._stretched(fit, math.log(100.0), Problem(0.3, math.log(10_000.0)))
    assert made.log_rates == pytest.approx([-11.0, -5.0, -1.0])
    assert made.log_weights == pytest.approx(weights + math.log(2.0) + 0.7 * (made.log_rates - rates))
    assert made.places.tolist() == [1, 4, 25, 100, 900, 3600, 10_000]
    slope = 3.0 * (math.pi / math.log(800.0)) ** 2  # of exp(−π² n / ln 8R) by ln R
    assert made.error == pytest.approx(1e-3 * math.exp(slope * math.log(100.0)))


TOLERANCE_SAID = "the tolerance {} is not between 1e-08 and 0.1"


def same(rates):
    """A machine that holds every rate."""
    return rates


@pytest.mark.parametrize("tolerance, kept", [(0.1, True), (1e-8, True), (0.1000001, False), (9.99e-9, False)])
def test_tolerances_are_taken_to_their_limits_and_no_further(tolerance, kept):
    for fit in (lambda: fit_exponential(0.6, 100, tolerance), lambda: fit_rounded(0.6, 100, tolerance, same)):
        if kept:
            assert fit().certificate.kernel <= tolerance
        else:
            with pytest.raises(ValueError, match=re.escape(TOLERANCE_SAID.format(tolerance))):
                fit()


@pytest.mark.parametrize("horizon", [100, 10**8])
def test_horizons_are_taken_to_their_limits(horizon):
    memory = fit_exponential(0.6, horizon, 0.1)
    assert memory.horizon == horizon and memory.certificate.kernel <= 0.1
    beyond = 99 if horizon == 100 else 10**8 + 1
    with pytest.raises(ValueError, match=f"the horizon {beyond} is not between 100 and 100000000 samples"):
        fit_exponential(0.6, beyond, 0.1)
    with pytest.raises(ValueError, match=f"the horizon {beyond}"):
        fit_states(0.6, beyond, 2)


@pytest.mark.parametrize("whole", [-1, 0, 1, 2])
def test_orders_are_taken_to_a_ten_millionth_of_a_whole_one(whole):
    for side in (-1.0, 1.0):
        near, nearer = whole + side * 1.001e-7, whole + side * 0.999e-7
        if -1.0 < near < 2.0:
            memory = fit_exponential(near, 100, 1e-2)
            assert memory.differences == math.ceil(near) and memory.certificate.kernel <= 1e-2
        for order in {nearer} | ({near} if not -1.0 < near < 2.0 else set()):
            with pytest.raises(ValueError, match="not between -1 and 2, or within 1e-7 of a whole one"):
                fit_exponential(order, 100, 1e-2)


def test_one_state_is_the_fewest():
    memory = fit_exponential(1e-7, 100, 0.1)
    assert memory.states == 1 and (memory.multiplies, memory.words, memory.lead) == (2, 2, 1.0)
    assert fit_states(1e-7, 100, 1).states == 1
    for states in (0, 60):
        with pytest.raises(ValueError, match=f"no best fit with {states} states"):
            fit_states(1e-7, 100, states)


@pytest.mark.parametrize("order", [1.3, -0.4])
def test_rounded_memories_are_as_small_as_free_ones_where_nothing_is_rounded(order):
    for tolerance in (1e-2, 3e-5):
        free, held = fit_exponential(order, 2000, tolerance), fit_rounded(order, 2000, tolerance, same)
        assert held.states == free.states and held.tolerance <= tolerance
        assert held.certificate.kernel == held.tolerance


def test_poles_that_become_one_or_leave_the_circle_are_given_up():
    """Two rates made one, a rate above 1, a rate of 0; a pole at 0 and one next to 1 can be held."""
    fit = next(f for f in ladder(0.4, 500) if f.modes == 4)
    for rates in (
        [0.9, 0.3, 0.05, 0.05],
        [1.1, 0.3, 0.05, 0.01],
        [0.9, 0.3, 0.05, 0.0],
        [0.3, 0.9, 0.05, 0.01],
    ):
        assert exponential_rounded._held(0.6, 500, fit, lambda _, r=rates: np.array(r)) is None
    held = exponential_rounded._held(0.6, 500, fit, lambda _: np.array([1.0, 0.3, 0.05, 1e-9]))
    assert held.poles == (0.0, 0.7, 0.95, 1.0 - 1e-9)


def test_what_no_rounding_can_hold_is_refused_with_its_numbers():
    said = "poles as they are held miss the tolerance 0.001 at the horizon 100; allow more"
    with pytest.raises(ValueError, match=said):
        fit_rounded(1e-7, 100, 1e-3, lambda rates: np.full(len(rates), 0.5))
