"""The error from which on an integral is said to move always, driven into the reference from many pasts.

Red when an error of that size is left standing, or the figure is far above what is left.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import Run
from focgen.plan.least_error import out_of_reach, since_reset, smallest_error
from focgen.plan.plan import Plan
from focgen.plan.remarks import remarks
from focgen.plan.scenario import Reset, Scenario, to_raw
from tests.controllers import simple
from tests.plan.derived import dressed, planned

LAGGED = TransferFunction([(1.0, 1.0), (1.0, 0.0)], [(0.05, 0.5), (1.0, 0.0)])
WIDE = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-1e6, 1e6))
BEFORE, AFTER, COUNTED = 200, 3000, 1000


def driven(plan: Plan, e: float) -> np.ndarray:
    """What the integral is given in the last samples: after noise, and after a reset; either sign."""
    rng, ranges = np.random.default_rng(5), plan.controller.ranges
    ref = np.zeros((4, BEFORE + AFTER))
    sign = np.array([1.0, -1.0, 1.0, -1.0])[:, None]
    low, high = ranges.reference[0] - ranges.measurement[1], ranges.reference[1] - ranges.measurement[0]
    ref[:2, :BEFORE] = rng.uniform(low, high, (2, BEFORE))
    ref[:, BEFORE:] = sign * e
    meas = np.clip(-ref / 2.0, *ranges.measurement)
    ref = np.clip(ref + meas, *ranges.reference)
    point = None if plan.schedule is None else smallest_point(plan)
    sched = None if point is None else np.full(ref.shape, point)
    resets = tuple(Reset(lane, BEFORE, ref[lane, -1], meas[lane, -1], 0.0) for lane in (2, 3))
    run = Run(plan, to_raw(plan, Scenario(ref, meas, sched, resets)))
    given = run.r if acts_first(plan) else run.d
    return given[2 * since_reset(plan) :, -COUNTED:]


def acts_first(plan: Plan) -> bool:
    return plan.inner is not None and not since_reset(plan)


def smallest_point(plan: Plan) -> float:
    """The breakpoint of the smallest gain that is not 0."""
    pairs = zip(plan.schedule.gains, plan.schedule.breakpoints)
    return min((abs(g), p) for g, p in pairs if g)[1] * plan.schedule.signal.lsb


@pytest.mark.parametrize(
    "first, arithmetic",
    [
        pytest.param(first, arithmetic, marks=() if turn % 2 == i else pytest.mark.long)
        for turn, first in enumerate(range(0, 40, 10))
        for i, arithmetic in enumerate(("q15", "q31"))
    ],
)
def test_from_there_on_the_integral_moves_whatever_was_before(first, arithmetic):
    """The sum of what it is given grows, and has the sign of gain and error."""
    seen = 0
    for seed in range(first, first + 10):
        plan = planned(dressed(seed), arithmetic)
        least = None if plan is None else smallest_error(plan)
        if least is None or out_of_reach(plan) or plan.error_lags + plan.filtered_lags > AFTER - COUNTED:
            continue
        given = driven(plan, least)
        assert np.all(given.sum(axis=1) != 0), (plan.name, least / plan.error.lsb)
        seen += 1
    assert seen


@pytest.mark.parametrize("memory", ["short", "exponential"])
def test_a_recursion_takes_up_what_rounding_drops(memory):
    """A count of the error is lost in one increment, and not in many."""
    controller = simple(LAGGED, integrator=True, ranges=WIDE, sample_time=0.001, length=100)
    plan = build_plan(controller, "q15", memory=memory)
    least = smallest_error(plan) / plan.error.lsb
    assert least == round(least) and least <= 40
    assert np.all(driven(plan, smallest_error(plan)).sum(axis=1) != 0)


@pytest.mark.parametrize("den", [[(0.05, 0.5), (1.0, 0.0)], [(0.05, 1.0), (1.0, 0.0)]])
def test_a_little_less_is_left_where_increments_are_coarse(den):
    """A gain of 1e-10, of which q31 has a few counts a volt."""
    transfer = TransferFunction([(1.0, 1.0), (1.0, 0.0)], den)
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0))
    controller = simple(transfer, integrator=True, ranges=ranges, sample_time=0.001, length=100, gain=1e-10)
    plan = build_plan(controller, "q31")
    least = smallest_error(plan)
    assert np.all(driven(plan, least).sum(axis=1) != 0) and not np.any(driven(plan, 0.97 * least))
    assert any(f"a steady error below {least:.3g} may be left" in said for said in remarks(plan))


def test_what_holds_since_a_reset_says_so():
    """s^−0.5 by modes forgets a constant, and its integral may then stand where it cancels one."""
    transfer = TransferFunction([(1.0, 0.0), (2.0, -0.5)])
    controller = simple(transfer, integrator=True, memory="exponential", ranges=WIDE)
    assert since_reset(build_plan(controller, "q31")) and not since_reset(
        build_plan(controller, "q31", memory="short")
    )
    slow = build_plan(simple(transfer, integrator=True, memory="exponential", ranges=WIDE, gain=1e-9), "q31")
    assert any("even after a reset to it" in said for said in remarks(slow))
