"""The realisable form of a transfer function, its weight tables, and the stability of its recursion.

Red when the realised form is not the transfer function, or an unstable recursion is taken.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction, polynomial
from focgen.plan.build import build_plan
from focgen.plan.canonical import folded, inner_limits, memory_bias, realise, tables, tail_l1
from focgen.plan.execute import execute
from focgen.plan.remarks import remarks
from focgen.plan.scenario import Scenario, physical_trace, to_raw
from focgen.plan.stability import inverse
from tests.controllers import random_controller, seed_controller, simple


def form_of(num, den=((1.0, 0.0),)):
    return realise(simple(TransferFunction(num, den)))


@pytest.mark.parametrize("seed", range(30))
def test_the_form_is_the_transfer_function(seed):
    """(direct + rest/s) / den at random points of the right half plane."""
    controller = random_controller(seed)
    form, rng = realise(controller), np.random.default_rng(seed)
    s = rng.uniform(0.1, 10.0, 20) + 1j * rng.uniform(-10.0, 10.0, 20)
    direct, rest, den = (
        sum((t.coefficient * s**t.order for t in terms), np.zeros(20, complex))
        for terms in (form.direct, form.rest, form.den)
    )
    assert np.allclose((direct + rest / s) / den, controller.transfer(s), rtol=1e-12)
    assert form.den[-1].order == 0.0
    assert all(t.order >= 0.0 for t in form.direct) and all(0.0 <= t.order < 1.0 for t in form.rest)


def test_terms_of_negative_order_leave_a_sum_of_the_remaining_order():
    form = form_of([(2.0, 0.0), (3.0, -0.9), (4.0, -1.0), (5.0, 0.8)])
    assert form.direct == ((5.0, 0.8), (2.0, 0.0))
    assert [t.coefficient for t in form.rest] == [3.0, 4.0]
    assert [t.order for t in form.rest] == pytest.approx([0.1, 0.0], abs=1e-15)
    shifted = form_of([(1.32, 0.6), (1.0, 0.0)], [(1.0, 1.0)])
    assert not shifted.direct and [t.order for t in shifted.rest] == pytest.approx([0.6, 0.0])


def test_an_order_is_the_decimal_number_that_is_written():
    """1.3 − 0.3 is 1, although the doubles next to them differ by less."""
    form = form_of([(1.0, 2.3), (1.0, 1.4)], [(1.0, 1.3), (1.0, 0.3)])
    assert [t.order for t in form.direct] == [2.0, 1.1] and [t.order for t in form.den] == [1.0, 0.0]


@pytest.mark.parametrize("arithmetic", ["f64", "q31", "q15"])
@pytest.mark.parametrize("off", [9e-10, -9e-10, 1e-15])
def test_an_order_beside_a_whole_number_is_not_that_number(arithmetic, off):
    """What C computes of 0.1 (h s)^β, whose first weight is 0.1, is within the bound, and has a past."""
    step, order = 1e-6, 1.0 + off
    term = 0.1 * float(mpmath.mpf(step) ** mpmath.mpf(order)), order
    ranges = ControllerRanges((-1.0, 1.0), (0.0, 0.1), (-1.0, 1.0))
    given = simple(TransferFunction([term]), sample_time=step, length=40, ranges=ranges)
    plan = build_plan(given, arithmetic)
    scenario = Scenario(np.array([[1.0] + [0.0] * 39]), np.zeros((1, 40)))
    seen = physical_trace(plan, execute(plan, to_raw(plan, scenario))).u[0]
    exact = [float(0.1 * (-1) ** j * mpmath.binomial(mpmath.mpf(order), j)) for j in range(40)]
    assert np.abs(seen - exact).max() <= plan.error_bound.operator
    assert plan.direct.last == 40 and any("is no whole number" in said for said in remarks(plan))


def test_an_exponential_memory_of_such_an_order_says_what_to_write():
    with pytest.raises(PlanError, match="write 1, or use memory short"):
        build_plan(simple(TransferFunction([(0.1, 0.9999999991)])), "f64", memory="exponential")


def test_tables_are_equation_10_in_exact_arithmetic():
    """The folded, normalised weights against mpmath's binomials."""
    controller = simple(
        TransferFunction([(0.7, 0.35), (2.0, -0.4)], [(0.2, 1.3), (0.5, 0.6), (3.0, 0.0)]), length=40
    )
    h = mpmath.mpf(controller.sample_time)
    with mpmath.workdps(40):
        w = lambda order, j: (-1) ** j * mpmath.binomial(mpmath.mpf(order), j)
        scale = sum(a * h**-o for a, o in controller.transfer.den)
        direct = [mpmath.mpf(0.7) * h ** -mpmath.mpf(0.35) * w(0.35, j) / scale for j in range(41)]
        rest = [
            h / 2 * 2 * h ** -(1 - mpmath.mpf(0.4)) * w(mpmath.mpf(1) - mpmath.mpf(0.4), j) / scale
            for j in range(41)
        ]
        back = [sum(a * h**-o * w(o, j) for a, o in controller.transfer.den) / scale for j in range(41)]
    made = tables(controller, 40)
    for table, exact in ((made.direct, direct), (made.rest, rest), (made.feedback, back)):
        assert np.allclose(table.weights, np.array(exact, dtype=float), rtol=1e-12, atol=1e-18)
    assert made.feedback.weights[0] == pytest.approx(1.0, abs=1e-15)


def test_tables_of_whole_orders_end_at_the_order():
    made = tables(simple(TransferFunction([(1.0, 2.0), (1.0, -1.0)], [(1.0, 1.0), (1.0, 0.0)])), 500)
    assert [len(t.weights) for t in (made.direct, made.rest, made.feedback)] == [3, 1, 2]


@pytest.mark.parametrize(
    "order, length",
    [
        pytest.param(order, length, marks=() if turn % 4 == i else pytest.mark.long)
        for turn, order in enumerate([0.1, 0.6, 0.97, 1.0, 1.4, 1.97, 2.0, 2.5])
        for i, length in enumerate([1, 2, 5, 100])
    ],
)
def test_tail_is_what_the_memory_leaves_out(order, length):
    """Against the sum itself, carried to 10^6 lags, and what is told to lie beyond those."""
    terms = polynomial([(1.0, order)])
    seen = float(np.abs(folded(terms, 1.0, 1_000_000).weights[length + 1 :]).sum())
    beyond = tail_l1(terms, 1.0, 1_000_000)
    assert beyond <= 1.001 * 1e6**-order / abs(math.gamma(1.0 - order)) if order % 1.0 else beyond == 0.0
    assert tail_l1(terms, 1.0, length) == pytest.approx(seen + beyond, rel=1e-9, abs=1e-12)


def test_memory_bias_of_the_model_is_the_documented_one():
    """T s^0.6 + 1 reads 1.149 at rest with L = 1000, h = 10 ms."""
    ((coefficient, order, bias),) = memory_bias(seed_controller(), 1000)
    assert (coefficient, order) == (1.32, 0.6)
    assert bias == pytest.approx(0.149, abs=5e-4)
    assert bias == pytest.approx(tables(seed_controller(), 1000).direct.total - 1.0, rel=1e-10)


def test_inner_limits_are_those_of_a_pid_controller():
    """The integral alone can take the output to either limit, at the smallest gain, and 0 is within."""
    ranges = ControllerRanges((0.0, 1.0), (0.0, 1.0), (2.0, 10.0), (0.0, 1.0))
    pid = TransferFunction([(3.0, 0.0), (1.0, -1.0)])
    assert inner_limits(simple(pid, ranges=ranges, gain=4.0), 1.0) == (0.0, 2.5)
    assert inner_limits(simple(pid, ranges=ranges, gain=-4.0), 1.0) == (-2.5, 0.0)
    schedule = GainSchedule((0.0, 1.0), (4.0, 8.0))
    assert inner_limits(simple(pid, ranges=ranges, gain=schedule), 1.0) == (0.0, 2.5)
    behind_lag = TransferFunction([(1.0, -1.0)], [(1.0, 1.0), (5.0, 0.0)])
    assert inner_limits(simple(behind_lag, ranges=ranges), 5.0) == (0.0, 50.0)


# ------------------------------------------------------------------------------------------- stability


@pytest.mark.parametrize("seed", range(40))
def test_stability_is_told_as_the_roots_tell_it(seed):
    rng = np.random.default_rng(seed)
    coefficients = np.concatenate([[1.0], rng.normal(0.0, 0.6, int(rng.integers(1, 12)))])
    radius = np.abs(np.roots(coefficients)).max()
    if abs(radius - 1.0) > 1e-3:
        assert (inverse(coefficients) is not None) == (radius < 1.0)


@pytest.mark.parametrize("seed", range(20))
def test_norms_bound_the_impulse_response_closely(seed):
    """Against a response followed until it has died away."""
    rng = np.random.default_rng([seed, 1])
    poles = rng.uniform(0.1, 0.98, 3) * np.exp(1j * np.array([0.0, 1.0, -1.0]) * rng.uniform(0.1, 3.0))
    poles[2] = np.conj(poles[1])
    denominator, numerator = np.real(np.poly(poles)), rng.normal(size=4)
    response, past = [], np.zeros(3)
    for k in range(4000):
        x = (numerator[k] if k < 4 else 0.0) - denominator[1:] @ past
        response.append(x)
        past = np.concatenate([[x], past[:2]])
    exact = float(np.abs(response).sum())
    assert exact <= inverse(denominator).norm_after(numerator) <= 1.001 * exact


def test_a_slow_recursion_is_still_bounded():
    """A pole at 1 − 10^−5: the norm is 10^5."""
    assert inverse(np.array([1.0, -(1.0 - 1e-5)])).norm == pytest.approx(1e5, rel=1e-3)
    time = 200.0
    oscillator = np.array([time**2 + 0.5, -2.0 * time**2 - 0.5, time**2]) / (time**2 + 0.5)
    assert inverse(oscillator) is None or inverse(oscillator).norm > 1e5


def test_an_unstable_memory_is_refused_and_the_named_one_works():
    """10 s^1.2 + 1 at 10 ms: unstable at L = 64."""
    lag = TransferFunction([(1.0, 0.0)], [(10.0, 1.2), (1.0, 0.0)])
    with pytest.raises(PlanError, match="unstable.*use a length of ") as caught:
        build_plan(simple(lag, length=64), "f64")
    works = int(caught.value.remedy.rsplit(" ", 1)[1])
    assert 64 < works < 256
    build_plan(simple(lag, length=works), "f64")
    with pytest.raises(PlanError, match="unstable"):
        build_plan(simple(lag, length=works - 1), "f64")


def test_a_recursion_that_no_memory_makes_stable_is_refused():
    with pytest.raises(PlanError, match="check the signs"):
        build_plan(simple(TransferFunction([(1.0, 0.0)], [(1.0, 1.0), (-1.0, 0.0)])), "f64")


def test_a_denominator_that_cancels_at_the_sample_time_is_refused():
    with pytest.raises(PlanError, match="cancels out"):
        build_plan(simple(TransferFunction([(1.0, 0.0)], [(-0.01, 1.0), (1.0, 0.0)])), "f64")
