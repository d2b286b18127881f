"""The fit to s^α against (jω)^α in 40 digits, in the band, above it and at rest.

Red when the fit is off by more than its certificate says at any frequency of the band.
"""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest

from focgen.fractional import continuous_certificate, elementary
from focgen.fractional.continuous import (
    DEFAULT_BAND,
    ContinuousMemory,
    fit_band,
    fit_band_states,
    growth_limit,
)
from focgen.fractional.continuous_certificate import certify_band
from focgen.fractional.exponential import fit_states
from focgen.plan.memory import ROUNDED

LOW, HIGH = DEFAULT_BAND


def relative(memory: ContinuousMemory, theta) -> mp.mpc:
    """H(e^{jθ}) / (jθ)^α, from the memory's step as its docstring has it."""
    theta = mp.mpf(float(theta))
    delay = mp.e ** (mp.mpc(0, -1) * theta)
    modes = mp.fsum(mp.mpf(w) / (1 - mp.mpf(p) * delay) for w, p in zip(memory.weights, memory.poles))
    whole = (1 - delay) ** memory.differences
    return whole * (memory.lead + delay * modes) / mp.mpc(0, theta) ** memory.order


def in_band(memory: ContinuousMemory, count: int = 100) -> float:
    return max(float(abs(relative(memory, t) - 1)) for t in np.geomspace(*memory.band, count))


def above(memory: ContinuousMemory, count: int = 50) -> float:
    return max(float(abs(relative(memory, t))) for t in np.linspace(memory.band[1], math.pi, count))


@pytest.mark.parametrize(
    "states, limit",
    [
        (12, 1.5e-3),
        *(pytest.param(*case, marks=pytest.mark.long) for case in ((8, 1.2e-2), (9, 6e-3), (16, 2e-4))),
    ],
)
def test_a_few_modes_follow_s_to_the_alpha_over_four_decades(states, limit):
    """To 1.2, 0.6, 0.15 and 0.02 % with 8, 9, 12 and 16."""
    memory = fit_band_states(0.6, LOW, HIGH, states)
    with mp.workdps(40):
        assert in_band(memory) <= memory.tolerance <= limit
        assert above(memory) <= memory.certificate.above <= 2.0


@pytest.mark.parametrize("order", [*(pytest.param(a, marks=pytest.mark.long) for a in (0.1, 1.1, 1.9)), -0.5])
def test_other_orders_are_within_a_factor_of_five(order):
    memory = fit_band_states(order, LOW, HIGH, 9)
    with mp.workdps(40):
        assert in_band(memory) <= memory.tolerance <= 5 * 6e-3
        assert above(memory) <= memory.certificate.above <= growth_limit(order)


@pytest.mark.long
@pytest.mark.parametrize("order", [0.1, 0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5, 1.7, 1.9, -0.1, -0.5, -0.9])
def test_every_order_and_cost_is_within_a_factor_of_five(order):
    for states, limit in {8: 1.2e-2, 9: 6e-3, 12: 1.5e-3, 16: 2e-4}.items():
        memory = fit_band_states(order, LOW, HIGH, states)
        with mp.workdps(40):
            assert in_band(memory, 2000) <= memory.tolerance <= 5 * limit
            assert above(memory, 1000) <= memory.certificate.above <= growth_limit(order)


def test_the_weights_of_gruenwald_and_letnikov_cannot_be_as_good():
    """Their lag stays, however many modes follow them."""
    gl = fit_states(0.6, 1_000_000, 16)
    error = np.abs(gl.frequency_response(np.array([HIGH])) / (1j * HIGH) ** 0.6 - 1.0)
    assert error[0] == pytest.approx(0.3 * HIGH, rel=0.02)


@pytest.mark.parametrize("order", [0.6, 1.4])
def test_the_certificate_holds_between_all_lines_and_is_not_loose(order):
    memory = fit_band_states(order, LOW, HIGH, 8)
    theta = np.geomspace(LOW, HIGH, 200_001)
    seen = np.abs(memory.frequency_response(theta) / (1j * theta) ** order - 1.0).max()
    assert seen <= memory.certificate.error <= 1.03 * seen


@pytest.mark.parametrize("order", [0.6, 1.4])
def test_the_certificate_holds_however_coarse_its_lines_are(order, monkeypatch):
    memory = fit_band_states(order, LOW, HIGH, 8)
    for name in ("_FINEST", "_COARSEST", "_ABOVE"):
        monkeypatch.setattr(continuous_certificate, name, 0.6)
    proved = dataclasses.replace(memory).certificate
    assert memory.certificate.error <= proved.error and memory.certificate.above <= proved.above


@pytest.mark.parametrize(
    "seed", [0, 1, 2, 3, 4, 5, *(pytest.param(s, marks=pytest.mark.long) for s in range(6, 12))]
)
def test_the_certificate_holds_for_any_rates_and_weights(seed):
    random = np.random.default_rng(seed)
    order, n = float(random.uniform(-0.95, 1.95)), int(random.integers(1, 9))
    rates = np.sort(np.exp(random.uniform(math.log(1e-5), 0.0, n)))[::-1]
    lead, *weights = random.normal(size=n + 1)
    low = float(np.exp(random.uniform(math.log(1e-4), math.log(0.05))))
    band = (low, min(30.0 * low, 0.5 * math.pi))
    proved = certify_band(order, band, rates, [lead, *weights])
    poles = tuple(1.0 - rates)
    memory = ContinuousMemory(order, band, 1.0, math.ceil(order), lead, poles, tuple(weights))
    with mp.workdps(30):
        assert in_band(memory, 300) <= proved.error
        assert above(memory, 300) <= proved.above


def test_a_constant_gives_exactly_nothing():
    """After a jump to a constant the modes forget it, and the differences have never seen it."""
    for order, x in ((0.6, [0.0, 1.0]), (1.4, [0.0, 1.0, 2.0])):
        memory = fit_band_states(order, 1e-3, 0.3, 4)
        v = np.diff(np.pad(x, (0, 200_000), mode="edge"), n=memory.differences)
        y, modes = 0.0, np.zeros(memory.states)
        for sample in v[:5]:
            y = memory.lead * sample + np.dot(memory.weights, modes)
            modes = modes * memory.poles + sample
        assert np.all(v[3:] == 0.0)
        settled = np.array(memory.weights) * modes * np.array(memory.poles) ** len(v)
        assert np.abs(settled).sum() < 1e-12 < abs(y)


def test_the_fewest_modes_are_found_that_keep_the_tolerance():
    memory = fit_band(0.6, 1e-3, 0.3, 1e-2)
    assert memory.tolerance <= 1e-2 and memory.states < 8
    fewer = fit_band_states(0.6, 1e-3, 0.3, memory.states - 1)
    assert fewer.tolerance > 0.9 * 1e-2


@pytest.mark.parametrize(
    "arithmetic",
    ["q15", pytest.param("q31", marks=pytest.mark.long), pytest.param("f32", marks=pytest.mark.long)],
)
def test_rates_as_a_machine_holds_them_are_certified_themselves(arithmetic):
    memory = fit_band(0.6, 1e-3, 0.3, 3e-3, ROUNDED[arithmetic])
    rates = 1.0 - np.array(memory.poles)
    np.testing.assert_array_equal(ROUNDED[arithmetic](rates), rates)
    with mp.workdps(40):
        assert in_band(memory) <= memory.tolerance <= 3e-3


def test_a_certificate_belongs_to_its_weights():
    memory = fit_band_states(0.6, 1e-3, 0.3, 5)
    spoilt = dataclasses.replace(memory, lead=1.1 * memory.lead)
    assert spoilt.certificate.error > 10.0 * memory.tolerance
    with mp.workdps(40):
        assert in_band(spoilt) <= spoilt.certificate.error


def test_sine_and_cosine_are_right_to_the_last_digits():
    x = np.linspace(-math.pi / 2, math.pi / 2, 501)
    sine, cosine = elementary.sine_cosine(x)
    with mp.workdps(40):
        for at, s, c in zip(x, sine, cosine):
            assert abs(mp.sin(mp.mpf(float(at))) - mp.mpf(float(s))) < 3e-16
            assert abs(mp.cos(mp.mpf(float(at))) - mp.mpf(float(c))) < 3e-16


@pytest.mark.parametrize(
    "order, low, high, tolerance, said",
    [
        (1.0, 1e-3, 0.3, 1e-2, "whole"),
        (2.5, 1e-3, 0.3, 1e-2, "between -1 and 2"),
        (0.6, 1e-3, 1.6, 1e-2, "half of the Nyquist"),
        (0.6, 0.3, 1e-3, 1e-2, "rise"),
        (0.6, 0.0, 0.3, 1e-2, "rise"),
        (0.6, math.nan, 0.3, 1e-2, "rise"),
        (0.6, 0.1, 0.3, 1e-2, "factor"),
        (0.6, 1e-3, 0.3, 0.5, "tolerance"),
    ],
)
def test_what_cannot_be_fitted_is_refused(order, low, high, tolerance, said):
    with pytest.raises(ValueError, match=said):
        fit_band(order, low, high, tolerance)
