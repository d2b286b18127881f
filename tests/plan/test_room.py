"""Usable inputs, memories and responses at their edges, beside what follows from weights and norms.

Red when an input is used that is none, a magnitude is beyond its bound, or a response is not the plan's.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.memory import ROUNDED, SPEEDS, by_speed
from focgen.plan.plan import Format, Plan, Sum
from focgen.plan.response import designed_response, filtered_response, running_gain, running_response
from focgen.plan.scenario import Scenario, nearest_raw
from focgen.plan.usable import filtered_reach, invalid_samples, l1_of, reach, usable
from tests.controllers import simple
from tests.plan.derived import Weights, plans, truth
from tests.plan.ledger import shift

ARITHMETICS = ("q15", "q31", "f32", "f64")
UNIT = TransferFunction([(1.0, 0.0)])
floating = pytest.mark.parametrize(("arithmetic", "most"), [("f32", 2.0**48), ("f64", 2.0**512)])
of_seeds = pytest.mark.parametrize(
    "seeds", [range(a, a + 10) for a in range(0, 40, 10)], ids=lambda s: str(s.start)
)


@floating
def test_an_input_is_usable_below_its_power_of_two(arithmetic, most):
    form = Format("float" if arithmetic == "f32" else "double", 1.0, -1.0, 1.0)
    kind = np.float32 if arithmetic == "f32" else np.float64
    below = np.nextafter(kind(most), kind(0.0))
    tried = np.array([0.0, -0.0, below, -below, most, -most, 1.5 * most, np.inf, -np.inf, np.nan], kind)
    assert usable(tried, form).tolist() == [True] * 4 + [False] * 6
    whole = Format("int16_t", 1.0, -1, 1)
    assert usable(np.array([[2**40, -(2**62)]]), whole).tolist() == [[True, True]]


@floating
def test_a_range_has_to_be_usable(arithmetic, most):
    """Of either input, and of the signal that the gain is scheduled by."""
    near = most * (1.0 - 2.0**-20)
    for changed in ({"reference": (-near, 1.0)}, {"measurement": (0.0, near)}, {"schedule": (-near, 1.0)}):
        ranges = replace(ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (-1.0, 1.0)), **changed)
        schedule = GainSchedule((-1.0, 1.0), (1e-9, 1e-8))
        build_plan(simple(UNIT, ranges=ranges, gain=schedule), arithmetic)
        ((name, (low, high)),) = changed.items()
        wide = (-most, high) if low < -1.0 else (low, most)
        with pytest.raises(PlanError, match=f"a range is too large for {arithmetic}") as caught:
            build_plan(simple(UNIT, ranges=replace(ranges, **{name: wide}), gain=schedule), arithmetic)
        assert ("or choose f64" in str(caught.value)) == (arithmetic == "f32")


@floating
def test_what_usable_inputs_make_stays_a_quarter_below_the_largest_number(arithmetic, most):
    """e reaches twice the largest input, the output takes 2 g e."""
    top = float(np.finfo(np.float32 if arithmetic == "f32" else np.float64).max)
    edge = top / 4.0 / (2.0 * most) / 2.0
    build_plan(simple(UNIT, gain=edge * 0.999), arithmetic)
    with pytest.raises(PlanError, match="the gain for an input is too large"):
        build_plan(simple(UNIT, gain=edge * 1.001), arithmetic)


def l1(made: Sum | None) -> float:
    """Taps; a mode's drive is at most as wide as what drives it."""
    if made is None:
        return 0.0
    modes = sum(2.0 * b.differences * abs(c) for b in made.banks for c in b.values)
    return sum(map(abs, made.values)) + modes


@pytest.mark.parametrize(
    "seeds, arithmetic",
    [
        pytest.param(
            range(a, a + 10), kind, id=f"{a}-{kind}", marks=() if a // 10 % 2 == i else pytest.mark.long
        )
        for a in range(0, 40, 10)
        for i, kind in enumerate(("f32", "f64"))
    ],
)
def test_every_magnitude_is_bounded_by_norms(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        true, e = truth(plan), 3.0 * max(-plan.error.low, plan.error.high)
        if true.den and true.norm([1.0]) is None:
            continue
        assert [l1_of(made) for made in plan.sums] == pytest.approx(
            [l1(made) for made in plan.sums], rel=1e-12
        )
        z = max(map(abs, true.limits)) if plan.inner else 0.0
        p = l1(plan.direct) * e + z
        r = l1(plan.inner.rest) * e if plan.inner else 0.0
        v = p
        if plan.feedback:
            v = max(true.norm([1.0]) * p, abs(plan.feedback.steady) * e)
        assert filtered_reach(plan, e) == pytest.approx(v, rel=1e-4)
        after = p + (l1(plan.feedback.table) * v if plan.feedback else 0.0)
        gain, out = (max(abs(f.low), abs(f.high)) for f in (plan.gain, plan.output))
        drives = [
            2.0 * b.differences * (e if s.history == "error" else v) for s in plan.sums for b in s.banks
        ]
        assert reach(plan, e) == pytest.approx(
            max(after, z + 2.0 * r, out + 2.0 * gain * v, *drives, v), rel=1e-4
        )


def test_a_step_is_left_out_for_any_of_its_inputs():
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))
    plan = build_plan(simple(UNIT, gain=GainSchedule((0.0, 1.0), (1.0, 2.0)), ranges=ranges), "f32")
    rows = np.zeros((3, 1, 5), np.float32)
    rows[[0, 1, 2], 0, [0, 1, 2]] = [np.nan, np.inf, -np.inf]
    assert invalid_samples(plan, Scenario(*rows)).tolist() == [[True, True, True, False, False]]


# ------------------------------------------------------------------------------------------- memories


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_every_rate_is_held_by_the_speed_that_is_made_for_it(arithmetic):
    """In one bank and no other; as near as the counts of that one are."""
    rates = np.sort(10.0 ** np.random.default_rng(1).uniform(-9, 0, 200))[::-1]
    edges = [s.below for s in SPEEDS[arithmetic]][1:]
    rates = np.sort(np.concatenate([rates, edges, np.nextafter(edges, 0.0), np.nextafter(edges, 1.0)]))[::-1]
    found = by_speed(arithmetic, rates)
    assert np.array_equal(np.concatenate([place for _, place in found]), np.arange(len(rates)))
    for speed, place in found:
        slower = [s.below for s in SPEEDS[arithmetic] if s.below < speed.below]
        assert np.all(rates[place] < speed.below) and all(np.all(rates[place] >= edge) for edge in slower)
        if not speed.rate_bits:
            continue
        counts, unit = speed.nearest(rates[place]), 2.0 ** -(speed.to_drive + speed.rate_shift)
        top = 2 ** (speed.rate_bits - 1) - 1
        assert counts.min() >= 1 and counts.max() <= top and np.all(counts == np.rint(counts))
        assert speed.nearest(np.array([10.0, 1e-30])).tolist() == [top, 1]
        free = (counts > 1) & (counts < top)
        assert np.abs(counts[free] * unit - rates[place][free]).max() <= 0.5 * unit
    held = ROUNDED[arithmetic](rates)
    assert np.array_equal(ROUNDED[arithmetic](held), held)
    coarse = {"q15": 2.0**-8, "q31": 2.0**-13, "f32": 2.0**-24, "f64": 0.0}[arithmetic]
    near = (rates > 1e-7) & (rates < 0.99)  # half of the fewest counts that a bank begins with
    assert np.abs(held / rates - 1.0)[near].max() <= coarse


def test_which_modes_are_compensated_and_how_wide_their_state_is():
    """f32 where a tenth of its last digits would be lost; in integers a · D and L fit their types."""
    plain, slow = SPEEDS["f32"]
    assert not plain.compensated and slow.compensated and not SPEEDS["f64"][0].compensated
    for arithmetic, bits in (("q15", 16), ("q31", 32)):
        for speed in SPEEDS[arithmetic]:
            drive, rate = 2 ** (bits - 1), min(speed.below, 1.0) * 2 ** (speed.to_drive + speed.rate_shift)
            assert min(rate, 2 ** (speed.rate_bits - 1)) * drive <= 2 ** (speed.state_bits - 1)
            assert drive * 2**speed.to_drive <= 2 ** (speed.state_bits - 1)
            assert speed.below * 2 ** (speed.to_drive + speed.rate_shift) <= 2 ** (speed.rate_bits + 1)


def test_an_operator_wants_its_own_memory():
    given = {"memory": "exponential", "tolerance": 0.05}
    made = simple(TransferFunction([(1.0, 0.5)]), sample_time=0.01)
    with pytest.raises(PlanError, match="the operator 'other' is unknown.*choose gl or continuous"):
        build_plan(made, "f64", operator="other", **given)
    with pytest.raises(PlanError, match="a band belongs to the operator continuous"):
        build_plan(made, "f64", band=(0.1, 1.0), horizon=100, **given)
    with pytest.raises(PlanError, match="needs exponential memory"):
        build_plan(made, "f64", operator="continuous")
    with pytest.raises(PlanError, match="has the band 1 to 5 rad/s"):
        build_plan(made, "f64", operator="continuous", band=(1.0, 5.0), **given)
    own = build_plan(made, "f64", operator="continuous", **given)
    low, high = own.band
    assert high == pytest.approx(0.1 * math.pi / 0.01, rel=1e-9) and low == pytest.approx(
        1e-4 * high, rel=1e-9
    )
    assert (own.horizon, own.operator, own.tolerance) == (None, "continuous", 0.05)
    with pytest.raises(PlanError, match=r"\[transfer\].*has the order 2.4 over its lowest.*ends at 2"):
        build_plan(simple(TransferFunction([(1.0, 2.4)])), "f64", horizon=100, **given)
    highest = build_plan(simple(TransferFunction([(1.0, 1.95)])), "f64", horizon=100, **given)
    assert [m.order for m in highest.memories] == [1.95] and highest.length == 2


# ------------------------------------------------------------------------------------------ responses


def transform(made: Sum | None, z: np.ndarray, signed: float = 0.0) -> np.ndarray:
    """Σ w_j z^−j of what a sum answers, summed lag by lag until it has died away."""
    if made is None:
        return np.zeros(len(z), complex)
    taps = np.zeros(max(made.last + 1, 2))
    taps[made.first : made.last + 1] = made.values
    modes = tuple((b.differences, q, c) for b in made.banks for q, c in zip(b.real_rates, b.values))
    response = Weights(taps, taps, modes).response(1 << 13)
    return z[:, None] ** -np.arange(len(response)) @ response + signed


@pytest.mark.parametrize("seeds", [range(10), range(20, 30)], ids=lambda s: str(s.start))
@pytest.mark.parametrize("arithmetic", ("q15", "f64"))
def test_the_running_response_is_the_transform_of_its_weights(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        if plan.horizon and plan.horizon > 1000:
            continue
        h, controller = plan.sample_time, plan.controller
        omega = np.array([0.05, 0.4, 1.7, 3.1]) / h
        z = np.exp(1j * omega * h)
        trapezoid = (z + 1.0) / (z - 1.0)
        v = transform(plan.direct, z)
        if plan.inner:
            v = v + transform(plan.inner.rest, z) * trapezoid
        if plan.feedback:
            v = v / transform(plan.feedback.table, z, 1.0)
        assert np.allclose(filtered_response(plan, omega), v, rtol=1e-6, atol=1e-9 * np.abs(v).max())
        values = [None]
        if plan.schedule:
            values = np.random.default_rng(1).uniform(*controller.ranges.schedule, 5).tolist()
        for s in values:
            gain = running_gain(plan, s)
            assert gain == pytest.approx(held_gain(plan, s), rel=1e-12, abs=1e-300)
            whole = v * gain * (trapezoid if plan.integrator else 1.0)
            assert np.allclose(
                running_response(plan, omega, s), whole, rtol=1e-6, atol=1e-9 * np.abs(whole).max()
            )
            check_designed(plan, omega, s)


def held_gain(plan: Plan, s: float | None) -> float:
    """What a step takes for g, physical, h/2 inside."""
    if s is None:
        return plan.constant_gain * plan.gain.lsb
    schedule, n = plan.schedule, nearest_raw(s, plan.schedule.signal)[()]
    points = schedule.breakpoints
    if n < points[0]:
        return schedule.gains[0] * plan.gain.lsb
    for i in range(len(points) - 1):
        if n < points[i + 1]:
            run = schedule.slopes[i] * (n - points[i])
            return (
                schedule.gains[i] + (run if plan.floating else shift(int(run), schedule.slope_shifts[i]))
            ) * plan.gain.lsb
    return schedule.gains[-1] * plan.gain.lsb


def check_designed(plan: Plan, omega: np.ndarray, s: float | None) -> None:
    """The formula, at jω."""
    controller, jw = plan.controller, 1j * omega
    num, den = (
        sum(t.coefficient * jw**t.order for t in terms)
        for terms in (controller.transfer.num, controller.transfer.den)
    )
    exact = num / den * float(controller.gain_at(s)) / (jw if controller.integrator else 1.0)
    assert np.allclose(designed_response(controller, omega, s), exact, rtol=1e-9, atol=0.0)
