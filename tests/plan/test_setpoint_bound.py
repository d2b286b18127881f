"""The set-point filter's numbers and its bound, beside exact lags and roundings counted one by one.

Red when its state can leave its proved ends, or its bound is less, or much more, than it can be off by.
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario
from focgen.plan.setpoint import Aim, set_point_error, set_points, start_of
from focgen.plan.values import kind_of
from tests.controllers import simple
from tests.plan.gain_walk import U64, half_place

ARITHMETICS = ("q15", "q31", "f32", "f64")
RANGES = [(-1.0, 1.0), (0.3, 1.1), (-0.9, -0.2), (-0.1, 0.7), (0.0, 12.7)]
CASES = [(a, r, s) for a in ARITHMETICS for r in RANGES for s in (0.4, 7.0, 900.0)]


def plan_of(arithmetic: str, reach: tuple[float, float], samples: float) -> Plan:
    """A filter of a time constant of so many samples of 2^-7 s."""
    ranges = ControllerRanges(reach, (-1.0, 1.0), (-10.0, 10.0))
    made = simple(TransferFunction([(1.0, 0.0)]), ranges=ranges, sample_time=2.0**-7)
    return build_plan(replace(made, setpoint_filter=samples * 2.0**-7), arithmetic)


def exact_rate(samples: float) -> Fraction:
    return 1 - Fraction((-1 / Decimal(samples)).exp())


@pytest.mark.parametrize(("arithmetic", "reach", "samples"), CASES)
def test_its_bound_is_what_its_roundings_add_up_to(arithmetic, reach, samples):
    plan, (low, high) = plan_of(arithmetic, reach, samples), reach
    made, q, largest = plan.set_point, float(exact_rate(samples)), max(-low, high)
    reference = 4.0 * U64 * largest / q
    if not plan.floating:
        assert made.rate == round(exact_rate(samples) * 2**30)
        far = max(high, 0.0) - min(low, 0.0)
        off = abs(float(Fraction(made.rate, 2**30) - exact_rate(samples))) / q
        half_counts = 2 * 0.5 * plan.reference.lsb
        own = set_point_error(plan) - half_counts
        assert 1.0 - 1e-9 <= own / (off * far + reference) <= 1.012
        return
    u = 2.0**-24 if arithmetic == "f32" else U64
    off = abs(float(Fraction(made.rate) - exact_rate(samples)))
    assert off <= half_place(q, u) * (1.0 + 1e-9) + U64 * q
    far = high - low + 4.0 * u * largest
    moved = half_place(far, u)  # by which a step of the reference may be off, and what is added to it
    far += (4.1 * u * far + made.drop) / q
    each = (1.0 - q) * (moved + half_place(far, u)) + half_place(made.rate * far, u)
    each += half_place((1.0 - q) * far, u) + off * far + made.drop
    value = each / q + half_place(largest + 4.1 * u * far / q, u) + reference
    less, more = (1e-6, 2e-4) if arithmetic == "f32" else (0.2, 0.012)  # whose exact rate is a double as well
    assert value * (1.0 - less) <= set_point_error(plan) <= value * (1.0 + more)


@pytest.mark.parametrize(("arithmetic", "reach", "samples"), [c for c in CASES if c[0] != "f64"])
def test_it_comes_near_its_bound_and_never_beyond(arithmetic, reach, samples):
    """Many lanes of noise, jumps and slow ramps, beside the exact lag of the same numbers."""
    plan, rng = plan_of(arithmetic, reach, samples), np.random.default_rng(int(10 * samples))
    kind, lsb, lanes, count = kind_of(plan.error), plan.reference.lsb, 60, 500
    rows = rng.uniform(*reach, (lanes, count))
    rows[::3] = np.sort(rng.uniform(*reach, (len(rows[::3]), 2)))[:, :1] + np.linspace(0, 30 * lsb, count)
    rows[1::3] = rng.choice(reach, (len(rows[1::3]), count))
    rows = np.clip(rows, *reach)
    raw = rows.astype(kind) if plan.floating else np.rint(rows / lsb).astype(kind)
    aim, start = Aim(plan, kind, lanes), raw[:, 0].copy()
    for lane in range(lanes):
        aim.settle(lane, start[lane])
    q, worst, y = np.longdouble(float(exact_rate(samples))), 0.0, start.astype(np.longdouble) * lsb
    for k in range(count):
        y = y + q * (raw[:, k] * np.longdouble(lsb) - y)
        made = aim.step(raw[:, k])
        assert made.min() >= plan.reference.low and made.max() <= plan.reference.high
        if not plan.floating:
            state = aim.state["set_point"]
            assert state.min() >= plan.set_point.low and state.max() <= plan.set_point.high
        worst = max(worst, float(np.abs(made * np.longdouble(lsb) - y).max()))
    assert worst <= set_point_error(plan)
    slow = samples > 100.0  # what piles up then needs longer than these lanes
    assert slow or worst > (0.02 if plan.floating else 0.3) * set_point_error(plan)


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
@pytest.mark.parametrize("reach", RANGES)
def test_the_ends_of_its_state_are_what_rounds_into_the_range(arithmetic, reach):
    plan = plan_of(arithmetic, reach, 7.0)
    made, y = plan.set_point, lambda state: (state + 2 ** (made.up - 1)) >> made.up
    assert (y(made.low), y(made.low - 1)) == (plan.reference.low, plan.reference.low - 1)
    assert (y(made.high), y(made.high + 1)) == (plan.reference.high, plan.reference.high + 1)
    proofs = {proof.node: proof.worst for proof in plan.proofs}
    far = plan.reference.high - plan.reference.low
    assert proofs["set point product"] == far * made.rate
    assert proofs["set point"] == max(-made.low, made.high) + 2 ** (made.up - 1)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("reach", RANGES)
def test_it_begins_at_what_is_nearest_to_0(arithmetic, reach):
    plan = plan_of(arithmetic, reach, 7.0)
    low, high = plan.reference.low, plan.reference.high
    assert start_of(plan) == (low if low > 0 else min(0, high))
    far, some = 10 * max(abs(low), abs(high)), (low + high) // 2 if not plan.floating else 0.5 * (low + high)
    resets = [Reset(0, k, ref, 0, 0) for k, ref in enumerate((some, far, -far))]
    seen = [
        y for _, _, y in set_points(plan, Scenario(np.zeros((1, 4)), np.zeros((1, 4)), None, tuple(resets)))
    ]
    assert seen == ([some, far, -far] if plan.floating else [some, high, low])


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_a_reset_to_what_cannot_be_used_is_as_an_init(arithmetic):
    plan = plan_of(arithmetic, (0.3, 1.1), 7.0)
    zeros = np.zeros((1, 4))
    bad = (Reset(0, 0, float("nan"), 0.5, 0.0), Reset(0, 1, 0.5, float("inf"), 0.0))
    assert [y for _, _, y in set_points(plan, Scenario(zeros, zeros, None, bad))] == [start_of(plan)] * 2


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_slowest_that_is_counted(arithmetic):
    assert plan_of(arithmetic, (-1.0, 1.0), 65536.0).set_point.rate > 0
    for samples in (65536.001, 0.0, -1.0):
        with pytest.raises(PlanError, match="not above 0 and at most 65536 samples"):
            plan_of(arithmetic, (-1.0, 1.0), samples)
