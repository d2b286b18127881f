"""The exponential memory against exact weights at every lag, 40-digit arithmetic and the full sum.

Red when a weight is off by more than its certificate says at any lag.
"""

import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional.exponential import (
    ExponentialMemory,
    fit_exponential,
    fit_states,
)
from focgen.fractional.exponential_certificate import certify
from focgen.fractional.exponential_fit import ladder
from focgen.fractional.exponential_rounded import fit_rounded
from focgen.fractional.weights import gl_weights
from focgen.plan.memory import ROUNDED
from tests.bench.memory import errors, exact_output

ORDERS = [0.6, 0.1, 0.9, 0.003, 0.9997, 1.2, 1.75, -0.4, -0.93]


def kernel(poles, weights, horizon):
    """h_0 … h_horizon, mode by mode."""
    tail = np.zeros(horizon)
    for p, w in zip(poles, weights):
        seen = horizon if p == 1.0 else 1 if p == 0.0 else min(horizon, math.ceil(-120.0 / math.log(p)))
        tail[:seen] += w * np.power(p, np.arange(seen, dtype=float))  # the rest is below 1e-52 of the mode
    return np.concatenate([[1.0], tail])


def differenced(e, m):
    for _ in range(m):
        e = np.diff(e, prepend=0.0)
    return e


def truths(beta, differences, horizon, poles, weights):
    """What the certificate bounds, by looking at every lag: kernel, largest, per_unit."""
    g = gl_weights(-beta, horizon)
    e = kernel(poles, weights, horizon) - g
    return np.max(np.abs(e) / g), np.max(np.abs(e)), np.sum(np.abs(differenced(e, differences)))


def bounds(certificate):
    return certificate.kernel, certificate.largest, certificate.per_unit


def by_turns(*cases):
    """Each order with one of ``cases`` here, by turns; with the others in the long suite."""
    return [
        pytest.param(order, *case, marks=() if i == turn % len(cases) else pytest.mark.long)
        for turn, order in enumerate(ORDERS)
        for i, case in enumerate(cases)
    ]


@pytest.mark.parametrize(
    "order, horizon, tolerance", by_turns((100, 1e-3), (30_000, 1e-6), (1_000_000, 1e-4))
)
def test_the_certificate_holds_at_every_lag_and_is_not_loose(order, horizon, tolerance):
    memory = fit_exponential(order, horizon, tolerance)
    found = truths(memory.beta, memory.differences, horizon, memory.poles, memory.weights)
    for bound, truth in zip(bounds(memory.certificate), found):
        assert truth <= bound <= 1.02 * truth + 1e-11
    assert found[0] <= tolerance
    assert min(memory.weights) > 0 and 0 < min(memory.poles) and max(memory.poles) < 1


@pytest.mark.parametrize(
    "seed", [*range(8), *(pytest.param(s, marks=pytest.mark.long) for s in range(8, 60))]
)
def test_the_certificate_holds_for_any_poles_and_weights(seed):
    """Bad fits, single wrong modes, coarse poles and equal ones: the bounds are true of them all."""
    rng = np.random.default_rng(seed)
    beta, differences = rng.uniform(0.02, 0.98), int(rng.integers(3))
    horizon = int(10 ** rng.uniform(3.7, 5.3))
    order = 1.0 - beta
    memory = fit_states(order, horizon, int(rng.integers(2, 9)))
    poles, weights = np.array(memory.poles), np.array(memory.weights)
    kind = seed % 4
    if kind == 0:
        poles = 1.0 - np.exp(rng.uniform(np.log(0.1 / horizon), 0.0, len(poles)))
    elif kind == 1:
        weights[rng.integers(len(weights))] *= 1.0 + rng.uniform(-1.0, 1.0)
    elif kind == 2:
        poles = np.minimum(np.round(poles * 2.0**10) / 2.0**10, 1.0 - 2.0**-11)
    else:
        poles[0] = 0.0
    certificate = certify(beta, differences, horizon, poles, weights)
    for bound, truth in zip(bounds(certificate), truths(beta, differences, horizon, poles, weights)):
        assert truth <= bound <= 1.2 * truth + 1e-9


@pytest.mark.parametrize(
    "order, horizon, tolerance",
    [(0.6, 10**8, 1e-6), pytest.param(0.1, 10**8, 1e-3, marks=pytest.mark.long), (1.9, 10**7, 1e-7)],
)
def test_long_horizons_in_forty_digits(order, horizon, tolerance):
    memory = fit_exponential(order, horizon, tolerance)
    lags = np.unique(np.rint(np.geomspace(1, horizon, 120)).astype(int))
    with mp.workdps(40):
        b = mp.mpf(memory.differences) - mp.mpf(order)
        modes = [(mp.mpf(p), mp.mpf(w)) for p, w in zip(memory.poles, memory.weights)]
        worst = max(
            abs(sum(w * p ** (j - 1) for p, w in modes) / mp.gammaprod([j + b], [b, j + 1]) - 1)
            for j in map(int, lags)
        )
    assert 0.2 * tolerance < float(worst) <= memory.certificate.kernel <= tolerance


@pytest.mark.parametrize("order, horizon, tolerance", by_turns((1000, 1e-5), (10**5, 1e-8)))
def test_no_fewer_states_can_do_it(order, horizon, tolerance):
    """One state fewer: its error alternates 2n + 1 times beyond the tolerance, so nothing can improve it."""
    memory = fit_exponential(order, horizon, tolerance)
    fewer = next((f for f in ladder(memory.beta, horizon) if f.modes == memory.states - 1), None)
    if fewer is None:
        assert memory.states == 1
        return
    poles, weights = np.exp(-np.exp(fewer.log_rates)), np.exp(fewer.log_weights)
    e = (kernel(poles, weights, horizon) / gl_weights(-memory.beta, horizon) - 1.0)[fewer.places]
    assert len(e) == 2 * fewer.modes + 1 and np.all(np.diff(fewer.places) > 0)
    assert np.all(e[1:] * e[:-1] < 0)
    assert np.min(np.abs(e)) > tolerance / 1.01


def theoretical_states(horizon: int, tolerance: float) -> float:
    """ln(1/ε) ln(8R) / π², how the number of exponentials grows (Braess and Hackbusch 2005).

    Their bound for 1/x has 16/ε in place of 1/ε; orders close below a whole one come near it.
    """
    return math.log(1.0 / tolerance) * math.log(8.0 * horizon) / math.pi**2


@pytest.mark.parametrize("order", [0.1, 0.4, 0.6])
@pytest.mark.parametrize("horizon", [1000, 10**4, 10**6])
@pytest.mark.parametrize("tolerance", [1e-3, pytest.param(1e-4, marks=pytest.mark.long), 1e-6])
def test_states_within_two_of_theory(order, horizon, tolerance):
    assert fit_exponential(order, horizon, tolerance).states <= theoretical_states(horizon, tolerance) + 2


@pytest.mark.parametrize(
    "order, horizon",
    [
        *((order, 1000) for order in (-0.05, 0.6, 0.9)),
        *((-0.05, 10**8), *(pytest.param(order, 10**8, marks=pytest.mark.long) for order in (0.6, 0.9))),
    ],
)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, pytest.param(1e-8, marks=pytest.mark.long)])
def test_states_within_the_bound_with_its_constant(order, horizon, tolerance):
    """Braess and Hackbusch bound the error for 1/x by 16 exp(−π² n / ln 8R); the formula drops the 16."""
    assert fit_exponential(order, horizon, tolerance).states <= theoretical_states(horizon, tolerance / 16.0)


@pytest.mark.parametrize("tenths", range(1, 10))
def test_outputs_of_ten_states(tenths):
    memory = fit_states(tenths / 10, 10**4, 10)
    assert memory.multiplies <= 20 and memory.words <= 12
    assert max(errors(tenths / 10, 10**4, memory.run).values()) <= 1e-4


@pytest.mark.parametrize("order", [0.6, pytest.param(0.1, marks=pytest.mark.long)])
def test_outputs_of_twenty_states(order):
    memory = fit_states(order, 10**6, 20)
    assert memory.multiplies <= 40 and memory.words <= 22
    found = errors(order, 10**6, memory.run)
    assert max(found[key] for key in ("step", "ramp", "sine")) <= 2e-6
    assert found["noise"] <= 2.5e-6


@pytest.mark.parametrize("seed", range(20))
def test_relative_error_of_inputs_whose_difference_keeps_its_sign(seed):
    rng = np.random.default_rng(seed)
    order = [0.3, 0.6, 0.85, -0.5, 1.4][seed % 5]
    memory = fit_exponential(order, 4000, 1e-3)
    v = rng.exponential(size=4001) * (rng.random(4001) < 10 ** rng.uniform(-3, 0))
    v[0] = rng.uniform(0, 5)
    x = v
    for _ in range(memory.differences):
        x = np.cumsum(x)
    exact = np.convolve(v, gl_weights(-memory.beta, 4000))[: len(v)]
    assert np.all(np.abs(memory.run(x) - exact) <= memory.certificate.kernel * exact + 1e-12 * x.max())


@pytest.mark.parametrize("order", [0.6, 0.2, 1.3, -0.5])
def test_the_worst_input_reaches_the_output_bound_and_none_exceeds_it(order):
    horizon = 20_000
    memory = fit_exponential(order, horizon, 1e-3)
    e = kernel(memory.poles, memory.weights, horizon) - gl_weights(-memory.beta, horizon)
    worst = np.sign(differenced(e, memory.differences))[::-1]
    weights = gl_weights(order, horizon)
    error = abs(memory.run(worst)[-1] - weights @ worst[::-1])
    bound = memory.certificate.output_error(1.0, past_horizon=False)
    assert 0.98 * bound < error <= bound


@pytest.mark.parametrize("order", [0.6, 0.9, 1.4])
def test_beyond_the_horizon_the_error_stays_bounded(order):
    memory = fit_exponential(order, 100, 1e-4)
    count = 1_000_000
    e = kernel(memory.poles, memory.weights, count) - gl_weights(-memory.beta, count)
    reached = np.sum(np.abs(differenced(e, memory.differences)[101:]))
    assert 0.9 * memory.certificate.beyond < reached <= memory.certificate.beyond
    assert np.sum(np.abs(differenced(e, memory.differences))) <= memory.certificate.output_error(1.0)


def test_at_rest_the_output_is_exactly_zero():
    for order in (0.6, 1.2):
        assert fit_exponential(order, 1000, 1e-3).frequency_response(np.zeros(1))[0] == 0.0
    memory = fit_exponential(0.6, 1000, 1e-3)
    y = memory.run(np.full(200_000, 3.7))
    assert abs(y[-1]) < 1e-14  # short memory would leave 3.7 · L^−0.6 / Γ(0.4) for ever
    assert math.isinf(fit_exponential(-0.4, 1000, 1e-3).certificate.output_error(1.0))


@pytest.mark.parametrize("order", [0.6, 1.3, -0.4])
def test_run_is_the_recursion_of_the_description(order):
    memory = fit_exponential(order, 500, 1e-3)
    x = np.random.default_rng(3).standard_normal(300)
    v = differenced(x, memory.differences)
    states, expected = np.zeros(memory.states), []
    for value in v:
        expected.append(value + states @ np.array(memory.weights))
        states = states * np.array(memory.poles) + value
    np.testing.assert_allclose(memory.run(x), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("order", [0.6, 1.3, -0.4])
def test_frequency_response_is_that_of_the_kernel(order):
    memory = fit_exponential(order, 100, 1e-3)
    omega = np.linspace(0.05, np.pi, 40)
    lags = np.arange(200_000)
    h = memory.kernel(lags)
    m = memory.differences
    expected = [(1 - np.exp(-1j * w)) ** m * np.sum(h * np.exp(-1j * w * lags)) for w in omega]
    np.testing.assert_allclose(memory.frequency_response(omega), expected, rtol=1e-9)
    np.testing.assert_array_equal(memory.kernel([0, 1]), [1.0, memory.kernel(np.array([1]))[0]])


def test_the_same_request_gives_the_same_numbers():
    first = fit_exponential(0.37, 12_345, 2e-5)
    fit_exponential.cache_clear()
    assert fit_exponential(0.37, 12_345, 2e-5) == first


def test_the_bench_compares_with_the_full_sum():
    x = np.sin(np.arange(400) * 0.1)
    full = np.convolve(x, gl_weights(0.6, 399))[:400]
    np.testing.assert_allclose(exact_output(0.6, x), full, atol=1e-12)
    for x in (np.ones(400), np.arange(400) * 0.01):
        full = np.convolve(x, gl_weights(0.6, 399))[:400]
        np.testing.assert_allclose(exact_output(0.6, x), full, atol=1e-12)


@pytest.mark.parametrize(
    "order, horizon, tolerance",
    [
        (1.0, 1000, 1e-3),
        (0.0, 1000, 1e-3),
        (2.0, 1000, 1e-3),
        (2.3, 1000, 1e-3),
        (-1.0, 1000, 1e-3),
        (1 + 1e-9, 1000, 1e-3),
        (math.nan, 1000, 1e-3),
        (0.6, 99, 1e-3),
        (0.6, 10**9, 1e-3),
        (0.6, 1000, 1e-12),
        (0.6, 1000, 0.5),
        (0.6, 1000, math.nan),
    ],
)
def test_what_cannot_be_fitted_is_refused(order, horizon, tolerance):
    with pytest.raises(ValueError):
        fit_exponential(order, horizon, tolerance)


def test_states_that_do_not_exist_are_refused():
    for states in (0, 200):
        with pytest.raises(ValueError):
            fit_states(0.6, 100, states)
    with pytest.raises(ValueError):
        certify(0.4, 1, 1000, [1.0], [0.3])
    with pytest.raises(ValueError):
        ExponentialMemory(0.6, 1000, 0.1, 1, (0.5,), (-0.3,)).certificate


@pytest.mark.parametrize(
    "order, arithmetic",
    [
        pytest.param(order, arithmetic, marks=() if (turn + i) % 4 == 0 else pytest.mark.long)
        for turn, order in enumerate([0.03, 0.1, 0.3, 0.6, 0.9, 1.2, 1.8, -0.4])
        for i, arithmetic in enumerate(["f32", "q31", "q15"])
    ],
)
def test_poles_as_an_arithmetic_holds_them(order, arithmetic):
    """Each lag up to the horizon with the rounded poles; at most one state more than free poles need."""
    tolerance, horizon = 1e-4, 10**5
    memory = fit_rounded(order, horizon, tolerance, ROUNDED[arithmetic])
    found = truths(memory.beta, memory.differences, horizon, memory.poles, memory.weights)
    for bound, truth in zip(bounds(memory.certificate), found):
        assert truth <= bound <= 1.02 * truth + 1e-11
    assert found[0] <= memory.tolerance <= tolerance
    assert memory.states <= fit_exponential(order, horizon, tolerance).states + 1
    rates = 1.0 - np.array(memory.poles)
    np.testing.assert_array_equal(ROUNDED[arithmetic](rates), rates)


@pytest.mark.long
@pytest.mark.parametrize("arithmetic", ["f64", "f32", "q31", "q15"])
@pytest.mark.parametrize("order", np.round(np.arange(-0.95, 2.0, 0.1), 2).tolist())
def test_every_lag_to_a_million_for_many_orders(order, arithmetic):
    memory = fit_rounded(order, 10**6, 1e-5, ROUNDED[arithmetic])
    found = truths(memory.beta, memory.differences, 10**6, memory.poles, memory.weights)
    for bound, truth in zip(bounds(memory.certificate), found):
        assert truth <= bound <= 1.02 * truth + 1e-11
    assert found[0] <= memory.tolerance <= 1e-5


@pytest.mark.parametrize("arithmetic", ["f32", pytest.param("q31", marks=pytest.mark.long), "q15"])
def test_rounded_poles_reach_the_longest_horizon(arithmetic):
    memory = fit_rounded(0.6, 10**8, 1e-4, ROUNDED[arithmetic])
    assert memory.states <= theoretical_states(10**8, 1e-4) + 2
    assert memory.certificate.kernel <= 1e-4


def test_rates_too_coarse_are_refused():
    with pytest.raises(ValueError, match="as they are held"):
        fit_rounded(0.6, 10**5, 1e-6, coarse)
    with pytest.raises(ValueError, match="tolerance"):
        fit_rounded(0.6, 10**5, 1.0, coarse)


def coarse(rates):
    """Powers of four."""
    return 4.0 ** np.round(np.log(rates) / np.log(4.0))
