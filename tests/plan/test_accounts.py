"""Each part of a bound beside what the plan's own operations can cost, counted by other means.

Red when a part is less than its roundings add up to, or more than a little above: a bound that has become
loose is red as well as one that no longer holds.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.fractional.transfer import TransferFunction
from focgen.plan.gain_errors import floating_pieces
from focgen.plan.plan import Plan
from focgen.plan.setpoint import set_point_error
from tests.controllers import simple
from tests.plan.accounts import Found, Real, Walk, Whole
from tests.plan.derived import dressed, planned, truth
from tests.plan.gain_walk import U64, pieces

ARITHMETICS = ("q15", "q31", "f32", "f64")
RANGES = ControllerRanges((-0.9, 0.9), (-0.9, 0.9), (-10.0, 10.0))
NEAR = {"q15": 5e-4, "q31": 5e-4, "f32": 5e-4, "f64": 0.012}
"""By how much a part may be above; in f64 the doubles of tables and reference are as coarse as the type."""
ABOVE = {("f64", "gain"): 0.1}
BELOW = {("f64", "inner"): 0.5, ("f64", "gain"): 0.1, ("f64", "rounding"): 0.02}
"""By how much it may be above or below, where what the plan's own doubles are off by is no less."""


def walked(plan: Plan, early: bool = False) -> Walk:
    kind = Real if plan.floating else Whole
    return kind(plan, truth(plan), early, set_point_error(plan))


def check(plan: Plan) -> bool:
    """Every part; False where the recursion is too slow to be followed."""
    walk, bound, near = walked(plan), plan.error_bound, NEAR[plan.arithmetic]
    if not walk.ok:
        return False
    found, parts = walk.found(), dict(bound.parts)
    assert parts.keys() <= {*found.parts, "inner integral"}
    for cause, value in found.parts.items():
        loose = found.loose.get(cause, 0.0)
        if plan.arithmetic == "f64" and cause == "weights":
            value = 0.0
            assert parts[cause] >= loose * (1.0 - 1e-5)
        part = parts.get(cause, 0.0)
        less = BELOW.get((plan.arithmetic, cause), 1e-6)
        more = ABOVE.get((plan.arithmetic, cause), near)
        assert value * (1.0 - less) <= part <= value * (1.0 + more) + loose * 1.01, cause
    assert parts.get("inner integral", 0.0) == pytest.approx(found.ceiling, rel=1e-5)
    assert math.fsum(parts.values()) <= bound.operator <= (1.0 + 1e-6) * math.fsum(parts.values())
    assert bound.output_per_sample == pytest.approx(
        walk.output(bound.operator_per_sample or bound.operator, bound.operator), rel=max(near, 0.011)
    )
    check_early(plan, found)
    return True


def check_early(plan: Plan, late: Found) -> None:
    """After one sample."""
    bound = plan.error_bound
    if not late.ceiling:
        assert bound.operator_per_sample == 0.0
        return
    first = walked(plan, early=True).found()
    value, loose = first.settled + first.growth, sum(first.loose.values())
    near = NEAR[plan.arithmetic]
    assert value * (1.0 - 10.0 * near) <= bound.operator_per_sample <= value * (1.0 + near) + 1.01 * loose


@pytest.mark.parametrize("seeds", [range(a, a + 8) for a in range(0, 40, 8)], ids=lambda s: str(s.start))
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_every_part_of_a_bound_is_what_its_roundings_add_up_to(arithmetic, seeds):
    """Controllers of every kind with short memory, dressed with all that one can have."""
    plans = [plan for seed in seeds if (plan := planned(dressed(seed), arithmetic))]
    assert sum(check(plan) for plan in plans) >= 5


@pytest.mark.parametrize(
    ("arithmetic", "seed"),
    [
        *((a, seed) for a in ARITHMETICS for seed in (2, 11)),
        ("q15", 4),
        ("f32", 4),
        ("q31", 9),
        ("f64", 9),
    ],
)
def test_every_part_of_a_bound_with_modes_is_likewise(arithmetic, seed):
    plan = planned(dressed(seed), arithmetic, memory="exponential", tolerance=0.05, horizon=100)
    assert plan is not None and plan.states and check(plan)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("worst", (0, 1, 2))
@pytest.mark.parametrize("reach", [(0.0, 0.875), (-0.5, 0.875), (0.0, 1.35)])
def test_a_gain_is_looked_at_where_it_is_held_worst(arithmetic, worst, reach):
    """Of three breakpoints one gain is almost half a count off, the others not at all; the signal ends at the
    outer ones or goes beyond them."""
    bits = {"q15": 15, "q31": 31, "f32": 24, "f64": 53}[arithmetic]
    gains = [0.875, 0.625, 0.75]
    gains[worst] += 0.499 * 2.0**-bits
    schedule, ranges = GainSchedule((0.0, 0.4375, 0.875), tuple(gains)), replace(RANGES, schedule=reach)
    plan = planned(simple(TransferFunction([(0.9, 0.0)]), gain=schedule, ranges=ranges), arithmetic)
    assert check(plan)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("reach", [(-0.9, 0.9), (0.2, 0.7)])
def test_modes_of_two_differences_are_counted_likewise(arithmetic, reach):
    """What drives them is a difference, which is rounded, once and as much in their means."""
    ranges = ControllerRanges(reach, (0.0, 0.0), (-10.0, 10.0))
    made = simple(TransferFunction([(0.9, 0.0), (0.003, 1.4)]), ranges=ranges)
    plan = planned(made, arithmetic, memory="exponential", tolerance=0.05, horizon=100)
    assert {bank.differences for bank in plan.direct.banks} == {2} and check(plan)


def test_a_gain_in_double_is_known_to_its_own_roundings():
    """Breakpoints and gains that are dyadic: no table is off, and what is left is counted to a hundredth."""
    schedule = GainSchedule((0.1875, 0.40625, 0.6875), (0.8125, -0.625, 0.375))
    ranges = replace(RANGES, schedule=(0.0625, 0.96875))
    made = simple(TransferFunction([(0.9, 0.0)]), gain=schedule, ranges=ranges)
    plan = planned(made, "f64")
    found, counted = floating_pieces(plan, 1.0, U64), pieces(plan, 1.0, U64)
    assert len(found) == len(counted) == 4
    for one, (error, largest) in zip(found, counted):
        assert error <= one.error * (1.0 + 1e-9) and one.error <= 1.012 * error and one.largest == largest
