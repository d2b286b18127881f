"""Formats and the box of parameters in whole numbers, beside fractions, and every end of a box at its edge.

Red when a count is not the nearest, a scale coarser than it need be, or a slope beyond what is said of it.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule, Tunable
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.formats import WORDS, Interval, exponent_for, nearest, weighted
from focgen.plan.gains import nearest_fraction
from focgen.plan.plan import Plan
from focgen.plan.scenario import Params
from focgen.plan.tuning import (
    REFUSED_GAIN,
    REFUSED_HIGH,
    REFUSED_LOW,
    applied,
    default_params,
    gain_intervals,
    margin,
    overshoot,
    reciprocal,
    refused,
    segment,
    tuned,
)
from focgen.plan.values import interpolated
from tests.controllers import simple
from tests.plan.derived import dressed, planned
from tests.plan.ledger import shift

ARITHMETICS = ("q15", "q31", "f32", "f64")
fixed = pytest.mark.parametrize("arithmetic", ("q15", "q31"))


def test_the_nearest_whole_number():
    rng = np.random.default_rng(1)
    near = [k + d for k in (0.0, 1.0, 7.0, 2.0**30) for d in (-0.5, -0.5 + 2.0**-22, 0.0, 0.25, 0.5)]
    for x in [*rng.normal(0.0, 1e3, 200).tolist(), *near, *(-x for x in near), 0.5 - 2.0**-54, 2.0**60]:
        exact = int(abs(Fraction(x)) + Fraction(1, 2))
        assert nearest(x) == (exact if x >= 0 else -exact)
    for p, q in product(range(-30, 31), range(1, 9)):
        assert nearest_fraction(Fraction(p, q)) == math.floor(Fraction(p, q) + Fraction(1, 2))


def test_the_smallest_exponent_that_holds_a_number():
    rng = np.random.default_rng(2)
    for counts in (20, 2**15 - 1, 2**15 - 4, 2**31 - 1, 2**63 - 2**59 - 1):
        edges = [*map(float, (counts, counts + 0.5, counts + 0.499, 1.0, 2.0, 2.0**-40 * counts))]
        for x in [*(10.0 ** rng.uniform(-9, 9, 60)).tolist(), *edges]:
            k = exponent_for(x, counts, "here", "it")
            held = [int(Fraction(x) / Fraction(2) ** e + Fraction(1, 2)) for e in (k, k - 1)]
            assert held[0] <= counts < held[1]
    assert exponent_for(0.0, 10, "here", "it") == -150
    assert exponent_for(2.0**149, 1, "here", "it") == 149
    assert exponent_for(2.0**-148, 1, "here", "it") == -148
    assert exponent_for(1.5 * 2.0**-149, 1, "here", "it") == -148
    for far in (2.0**150, 2.0**-150, math.inf):
        with pytest.raises(PlanError, match=r"here.*it reaches .*no fixed-point format.*nearer to 1"):
            exponent_for(far, 1, "here", "it")


@pytest.mark.parametrize("each", [(-7, 5), (2, 9), (-4, -1), (0, 3)])
def test_a_weighted_sum_reaches_its_corners(each):
    for weights in ([3, -2, 0], [1], [-5, -1], [0, 0], [4, 4, -9, 2]):
        sums = [sum(w * x for w, x in zip(weights, xs)) for xs in product(each, repeat=len(weights))]
        assert weighted(weights, Interval(*each)) == Interval(min(sums), max(sums))


RUNS = [1, 2, 3, 5, 7, 64, 100, 4095, 4096, 4097, 32767, 2**20 + 1, 2**31 - 1]


@pytest.mark.parametrize("run", RUNS)
def test_a_reciprocal_has_30_bits(run):
    per, by = reciprocal(run)
    assert 2**29 <= per <= 2**30 and abs(Fraction(per) - Fraction(2**by, run)) <= Fraction(1, 2)
    assert run & (run - 1) or per == 2**30


@fixed
@pytest.mark.parametrize("run", [1, 2, 7, 100, 4096, 32767])
def test_a_slope_is_as_fine_as_its_word_and_leaves_its_ends_by_no_more_than_is_said(arithmetic, run):
    word, rng = WORDS[arithmetic], np.random.default_rng(run)
    for far in (0, 1, 9, 500, word.limit // 3, 2 * word.limit, run * word.limit):
        rise = Interval(-far, min(far, 2 * far // 3 + 1))
        made, (per, whole) = segment(rise, run, word), reciprocal(run)
        assert (made is None) == (((far * per) >> whole) + 1 > word.limit)
        if made is None:
            continue
        assert made[0] == per and made[1] + made[2] == whole
        to_slope, by = made[1:]
        tried = sorted({0, rise.low, rise.high, *rng.integers(rise.low, rise.high + 1, 40).tolist()})
        slopes = {r: shift(r * per, to_slope) for r in tried}
        assert max(map(abs, slopes.values())) <= word.limit
        full = by == min(word.sum_bits - 2, whole)
        assert full or shift(far * per, to_slope - 1) + 2 >= word.limit
        beyond = overshoot(rise, run, *made)
        places = range(run) if run <= 100 else [*range(9), *range(run - 400, run)]
        left = max(
            max(g - max(r, 0), min(r, 0) - g)
            for r, slope in slopes.items()
            for g in (shift(slope * n, by) for n in places)
        )
        assert left <= beyond <= max(left, 0) + 3 + run * far / 2**by / 2**25 + run / 2**by


@fixed
def test_interpolation_keeps_within_its_margin(arithmetic):
    """And the gain's format is what its corners and that much more need, as fine as its word allows."""
    seen = 0
    for seed in range(2, 60, 3):
        plan = planned(dressed(seed), arithmetic)
        if plan is None:
            continue
        box, word, controller = plan.tuning, WORDS[arithmetic], plan.controller
        ends = gain_intervals(box)
        low, high = min(i.low for i in ends), max(i.high for i in ends)
        beyond = 0
        for i, run in enumerate(np.diff(plan.schedule.breakpoints).tolist() if plan.schedule else ()):
            made = box.reciprocals[i], box.to_slopes[i], plan.schedule.slope_shifts[i]
            assert made == segment(ends[i + 1] - ends[i], run, word)
            beyond = max(beyond, overshoot(ends[i + 1] - ends[i], run, *made))
        assert beyond <= margin(word) and (plan.gain.low, plan.gain.high) == (low - beyond, high + beyond)
        factor = 0.5 * plan.sample_time if plan.integrator else 1.0
        largest, (least, most) = max(map(abs, controller.gains)) * factor, controller.factors
        for value, lsb, limit in (
            (largest, box.nominal_lsb, word.limit),
            (most, box.factor.lsb, word.limit),
            (largest * most, plan.gain.lsb, word.limit - margin(word)),
        ):
            assert nearest(value / lsb) <= limit < nearest(2.0 * value / lsb)
        assert (box.factor.low, box.factor.high) == (
            nearest(least / box.factor.lsb),
            nearest(most / box.factor.lsb),
        )
        assert box.nominal == tuple(nearest(g * factor / box.nominal_lsb) for g in controller.gains)
        assert box.nominal_lsb * box.factor.lsb * 2.0**box.to_gain == plan.gain.lsb
        check_default(plan)
        seen += plan.schedule is not None
    assert seen >= 4


def check_default(plan: Plan) -> None:
    """A plan's own schedule is that of factors of 1."""
    one = applied(plan, default_params(plan))
    assert default_params(plan).gain == (round(1.0 / plan.tuning.factor.lsb),) * len(plan.tuning.nominal)
    if plan.schedule:
        assert one.gains == plan.schedule.gains and one.slopes == plan.schedule.slopes
    else:
        assert one.gains == (plan.constant_gain,)
    assert (one.low, one.high) == (plan.output.low, plan.output.high)


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_a_gain_in_the_box_is_within_its_format(arithmetic):
    """Whatever the factors, wherever the signal: and the format is no wider than a thousandth more."""
    kind, seen = np.float32 if arithmetic == "f32" else np.float64, 0
    for seed in range(2, 60, 3):
        plan = planned(dressed(seed), arithmetic)
        if plan is None:
            continue
        rng, box = np.random.default_rng(seed), plan.tuning
        reached = [f * n for f in (box.factor.low, box.factor.high) for n in box.nominal]
        far = 1e-3 * max(map(abs, reached))
        assert plan.gain.low < min(reached) and max(reached) < plan.gain.high
        assert min(reached) - far < plan.gain.low and plan.gain.high < max(reached) + far
        check_default_slopes(plan, kind)
        for _ in range(20 if plan.schedule else 0):
            factors = rng.choice([box.factor.low, box.factor.high], len(box.nominal))
            made = applied(plan, Params(tuple(map(float, factors)), plan.output.low, plan.output.high))
            assert made.gains == tuple(float(kind(f) * kind(n)) for f, n in zip(factors, box.nominal))
            points = np.array(plan.schedule.breakpoints, kind)
            s = np.concatenate(
                [points, np.nextafter(points, kind(-np.inf)), rng.uniform(points[0], points[-1], 50)]
            )
            g = interpolated(tuned(plan.schedule, made), s.astype(kind), kind)
            assert plan.gain.low <= g.min() and g.max() <= plan.gain.high
        seen += plan.schedule is not None
    assert seen >= 4


def check_default_slopes(plan: Plan, kind) -> None:
    one = applied(plan, default_params(plan))
    assert default_params(plan) == Params(
        (1.0,) * len(plan.tuning.nominal), plan.output.low, plan.output.high
    )
    assert one.gains == tuple(float(kind(n)) for n in plan.tuning.nominal)
    if plan.schedule:
        assert one.slopes == plan.schedule.slopes and one.gains == plan.schedule.gains
        runs = [q - p for p, q in pairwise(plan.schedule.breakpoints)]
        assert all(
            abs(per * run - 1.0) <= 2.0 * np.finfo(kind).eps
            for per, run in zip(plan.tuning.reciprocals, runs)
        )


RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-2.0, 10.0), (0.0, 1.0))
BOX = Tunable((0.25, 2.0), (-2.0, 1.0), (4.0, 10.0))
TUNABLE = simple(
    TransferFunction([(1.0, 0.0)]), gain=GainSchedule((0.0, 0.5, 1.0), (1.0, -3.0, 2.0)), ranges=RANGES
)


def beyond(x, way: int, arithmetic: str):
    """The next number that the type has."""
    if arithmetic[0] == "q":
        return x + way
    kind = np.float32 if arithmetic == "f32" else np.float64
    return float(np.nextafter(kind(x), kind(way * np.inf)))


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_box_ends_where_it_says(arithmetic):
    """Every end is inside, the next number is not; what is wrong is named, all of it."""
    plan = planned(replace(TUNABLE, tunable=BOX), arithmetic)
    box, out = plan.tuning, plan.output
    assert (box.low[0], box.high[1]) == (out.low, out.high)
    for count, value in (
        (box.low[1], 1.0),
        (box.high[0], 4.0),
        (box.factor.low, 0.25),
        (box.factor.high, 2.0),
    ):
        lsb = box.factor.lsb if value in (0.25, 2.0) else out.lsb
        assert abs(count * lsb - value) <= (0.5 * lsb if arithmetic[0] == "q" else 0.0)
    good = Params((box.factor.low, box.factor.high, box.factor.low), box.low[0], box.high[1])
    assert refused(plan, good) == 0
    assert refused(plan, replace(good, u_min=box.low[1], u_max=box.high[0])) == 0
    for end, way in ((box.factor.low, -1), (box.factor.high, 1)):
        for place in range(3):
            gain = [*good.gain]
            gain[place] = beyond(end, way, arithmetic)
            assert refused(plan, replace(good, gain=tuple(gain))) == REFUSED_GAIN
    for name, ends, bit in (("u_min", box.low, REFUSED_LOW), ("u_max", box.high, REFUSED_HIGH)):
        for end, way in zip(ends, (-1, 1)):
            assert refused(plan, replace(good, **{name: beyond(end, way, arithmetic)})) == bit
    assert refused(plan, replace(good, gain=good.gain[:2])) == REFUSED_GAIN
    all_wrong = Params((0,) * 3, beyond(box.low[1], 1, arithmetic), beyond(box.high[0], -1, arithmetic))
    assert refused(plan, all_wrong) == REFUSED_GAIN | REFUSED_LOW | REFUSED_HIGH


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_limits_may_come_near_but_not_meet(arithmetic):
    plan = planned(replace(TUNABLE, tunable=BOX), arithmetic)
    lsb = {"f32": 2.0**-22, "f64": 2.0**-51}.get(arithmetic, plan.output.lsb)
    near = replace(TUNABLE, tunable=Tunable((0.25, 2.0), (-2.0, 2.0), (2.0 + lsb, 10.0)))
    made = planned(near, arithmetic).tuning
    assert made.low[1] < made.high[0] and made.high[0] == beyond(made.low[1], 1, arithmetic)
    met = replace(TUNABLE, tunable=Tunable((0.25, 2.0), (-2.0, 2.0), (2.0 + lsb / 3.0, 10.0)))
    with pytest.raises(PlanError, match=f"lets the limits meet in {arithmetic}"):
        from focgen.plan.build import build_plan

        build_plan(met, arithmetic, tunable=True)


def test_a_factor_needs_half_a_count_at_least():
    """In 16 bits a factor up to 1 has counts of 2^-15."""
    made = planned(replace(TUNABLE, tunable=replace(BOX, gain=(0.51 * 2.0**-14, 1.0))), "q15")
    assert made.tuning.factor.low == 1 and made.tuning.factor.lsb == 2.0**-14
    assert planned(replace(TUNABLE, tunable=replace(BOX, gain=(0.49 * 2.0**-14, 1.0))), "q15") is None
