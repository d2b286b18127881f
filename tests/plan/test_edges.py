"""Every documented limit of a plan: what is just at it is planned, what is just beyond it is refused.

Red when a limit has moved, or a message names other numbers than those that decided.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import realise
from focgen.plan.proofs import prove
from focgen.plan.slewing import slewed
from focgen.plan.stability import inverse
from tests.controllers import simple
from tests.plan.accounts import Real, Whole
from tests.plan.derived import planned, truth

ARITHMETICS = ("q15", "q31", "f32", "f64")
FIXED = ("q15", "q31")
UNIT = TransferFunction([(1.0, 0.0)])
RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))


def refused(controller, arithmetic: str, says: str, **how) -> PlanError:
    with pytest.raises(PlanError, match=says) as caught:
        build_plan(controller, arithmetic, **how)
    return caught.value


@pytest.mark.parametrize("arithmetic", FIXED)
def test_a_node_may_reach_the_last_count_of_its_type(arithmetic):
    plan = build_plan(simple(UNIT), arithmetic)
    top = 2 ** (plan.error.bits - 1) - 1
    for high, kept in ((top + plan.measurement.low, True), (top + plan.measurement.low + 1, False)):
        changed = replace(plan, reference=replace(plan.reference, low=0, high=high))
        if kept:
            error = prove(changed)[0]
            assert (error.node, error.worst, error.limit, error.margin_bits) == ("error", top, top, 0.0)
        else:
            with pytest.raises(PlanError, match=f"the node error reaches {top + 1}, beyond {top} of"):
                prove(changed)
    assert prove(plan)[0].margin_bits == pytest.approx(math.log2(top / prove(plan)[0].worst))


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_memory_has_1_to_1000000_samples(arithmetic):
    for length in (1, 1_000_000):
        assert build_plan(simple(UNIT), arithmetic, length=length).length == length
    for length in (0, 1_000_001, 2.0):
        refused(simple(UNIT), arithmetic, rf"the memory length is {length!r}", length=length)


@pytest.mark.parametrize("wrong", (math.nan, math.inf, -math.inf))
def test_every_number_has_to_be_finite(wrong):
    given = simple(UNIT, gain=GainSchedule((0.0, 1.0), (1.0, 2.0)), ranges=RANGES)
    assert planned(given, "f64")
    changed = [replace(given, sample_time=wrong)]
    changed += [replace(given, gain=GainSchedule((0.0, wrong), (1.0, 2.0)))]
    changed += [replace(given, gain=GainSchedule((0.0, 1.0), (1.0, wrong)))]
    for name in ("reference", "measurement", "output", "schedule"):
        changed += [replace(given, ranges=replace(RANGES, **{name: (0.0, wrong)}))]
    for one in changed:
        refused(one, "f64", "a number that is not finite, or a sample_time that is not positive")
    for time in (0.0, -0.01):
        refused(replace(given, sample_time=time), "f64", "sample_time that is not positive")
    refused(
        replace(given, ranges=replace(RANGES, schedule=None)), "f64", "the scheduling signal has no range"
    )


@pytest.mark.parametrize("arithmetic", FIXED)
def test_a_range_needs_16_counts(arithmetic):
    """The larger one sets the count; the output's may have as few, the schedule's too."""
    plan = build_plan(simple(UNIT, ranges=RANGES), arithmetic)
    lsb = plan.measurement.lsb
    for counts, kept in ((16, True), (15, False)):
        ranges = replace(RANGES, measurement=(1.0 - counts * lsb, 1.0))
        if kept:
            assert build_plan(simple(UNIT, ranges=ranges), arithmetic).measurement.lsb == lsb
        else:
            said = refused(simple(UNIT, ranges=ranges), arithmetic, f"spans only {counts} counts")
            assert said.where == "simple [ranges]" and "the measurement range" in said.what
    schedule = GainSchedule((0.0, 1.0), (1.0, 2.0))
    top = 2 ** (plan.error.bits - 1) - 2
    for counts, kept in ((16, True), (15, False)):
        ranges = replace(RANGES, schedule=(float(top - counts), float(top)))
        made = simple(UNIT, gain=GainSchedule((top - 100.0, float(top)), (1.0, 1.5)), ranges=ranges)
        if kept:
            assert build_plan(made, arithmetic).schedule.signal.lsb == 1.0
        else:
            refused(made, arithmetic, f"the schedule range .* spans only {counts} counts")
    assert build_plan(simple(UNIT, gain=schedule, ranges=RANGES), arithmetic)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_slew_limit_is_counted(arithmetic):
    """At least 16 counts a sample in integers, at most from one end of the range to the other, as far as the
    type reaches."""
    made = simple(UNIT, integrator=True, ranges=RANGES)
    plan = build_plan(replace(made, slew_limit=3.0), arithmetic)
    lsb, slew = plan.integrator.state.lsb, plan.integrator.slew
    if arithmetic == "f64":
        assert slew == 0.03
    elif arithmetic == "f32":
        assert slew == float(np.float32(0.03)) or slew == round(0.03 / lsb)
    else:
        assert slew == round(0.03 / lsb)
        state = plan.integrator.state
        whole = min(state.high - state.low, 2 ** (state.bits - 1) - 1)
        assert build_plan(replace(made, slew_limit=1e9), arithmetic).integrator.slew == whole
        for counts, kept in ((15.51, True), (15.49, False)):
            slow = replace(made, slew_limit=counts * lsb / 0.01)
            if kept:
                assert build_plan(slow, arithmetic).integrator.slew == 16
            else:
                refused(slow, arithmetic, f"only 15 counts a sample in {arithmetic}")
    kind = int if isinstance(slew, int) else np.float32 if arithmetic == "f32" else float
    change = np.array([-2 * slew, -slew, slew // 2, slew, 2 * slew]).astype(kind)
    assert slewed(plan, change).tolist() == np.clip(change, -slew, slew).tolist()
    free = build_plan(made, arithmetic)
    assert slewed(free, change) is change
    refused(replace(made, integrator=False, slew_limit=3.0), arithmetic, "which only an integrator can keep")


@pytest.mark.parametrize("arithmetic", FIXED)
def test_the_gain_at_rest_may_lose_half_of_itself(arithmetic):
    """c + s at 10 ms: 100 + c and -100, in so many bits; what is kept is held within half of it."""
    kept = lost = 0
    for c in (10.0 ** np.linspace(-8.0, -1.0, 60)).tolist():
        made = simple(TransferFunction([(c, 0.0), (1.0, 1.0)]), integrator=True)
        plan, step = planned(made, arithmetic), 2.0 ** (7 - (15 if arithmetic == "q15" else 31))
        held = round((100.0 + c) / step) * step - round(100.0 / step) * step
        if plan is None:
            assert abs(held - c) > 0.5 * c
            lost += 1
        else:
            assert abs(sum(plan.direct.values) - c) <= 0.5 * c
            kept += 1
    assert kept > 5 and lost > 5


@pytest.mark.parametrize("arithmetic", ("q15", "f64"))
def test_rounding_may_cost_half_of_the_signal(arithmetic):
    """Slower and slower lags, until the arithmetic is refused: by the numbers that it names."""
    kept, said = 0, None
    for time in (10.0 ** np.arange(0.3, 14.0, 1.2)).tolist():
        made = simple(TransferFunction([(1.0, 0.0)], [(0.01 * time, 1.0), (1.0, 0.0)]), length=2)
        try:
            plan = build_plan(made, arithmetic)
        except PlanError as reason:
            said = said or reason
            continue
        parts, kept = dict(plan.error_bound.parts), kept + 1
        walk = (Real if plan.floating else Whole)(plan, truth(plan), False, 0.0)
        if walk.ok:
            assert parts["weights"] + parts["rounding"] <= 0.5 * walk.G * walk.reach * (1.0 + 1e-4)
    assert kept >= 2 and said
    numbers = re.search(r"may cost (\S+) of a signal that reaches (\S+);", str(said))
    if numbers:
        assert float(numbers[1]) > 0.5 * float(numbers[2])


def test_a_schedule_too_steep_names_its_breakpoints():
    """A slope of one count a count is the steepest that a word has room for, times its limit."""
    schedule = GainSchedule((0.0, 0.25, 0.25004, 1.0), (1.0, -1.0, 1.0, 1.0))
    said = refused(
        simple(UNIT, gain=schedule, ranges=RANGES), "q15", "between the breakpoints 0.25 and 0.25004"
    )
    assert "too steep for 16 bits" in said.what
    assert planned(simple(UNIT, gain=schedule, ranges=RANGES), "q31")
    near = GainSchedule((0.5, 0.5 + 1e-9), (1.0, 2.0))
    refused(simple(UNIT, gain=near, ranges=RANGES), "f32", "breakpoints coincide as float")
    assert planned(simple(UNIT, gain=near, ranges=RANGES), "f64")
    for end in ("first", "last"):  # breakpoints beyond the range of the signal count nothing
        points = (-2.0, -1.0, 0.5) if end == "first" else (0.5, 2.0, 3.0)
        made = planned(simple(UNIT, gain=GainSchedule(points, (1.0, 9.0, 2.0)), ranges=RANGES), "q31")
        assert made.schedule.signal.low <= min(made.schedule.breakpoints)
        assert max(made.schedule.breakpoints) <= made.schedule.signal.high


@pytest.mark.parametrize("sign", (1.0, -1.0))
def test_a_recursion_is_bounded_with_all_that_is_left_out_of_it(sign):
    """1/(1 - 0.5 z^-1 - 0.1 z^-9), its last coefficient left out: 2.5, and no more than that is told."""
    found = inverse(np.array([1.0, -0.5]), 0.1)
    response, whole = np.zeros(4000), np.array([1.0, -0.5] + [0.0] * 7 + [-0.1 * sign])
    for k in range(len(response)):
        past = response[max(0, k - 9) : k][::-1]
        response[k] = (k == 0) - whole[1 : len(past) + 1] @ past
    assert np.abs(response).sum() <= found.norm * (1.0 + 1e-9) and found.norm == pytest.approx(2.5, rel=1e-5)
    assert inverse(np.array([1.0, -0.5]), 0.44) is not None, "a residual of 0.88"
    assert inverse(np.array([1.0, -0.5]), 0.46) is None
    alone = inverse(np.array([1.0, -0.5]))
    assert alone.norm_after(np.array([1.0, 1.0])) == pytest.approx(4.0, rel=1e-5)


def test_a_slow_oscillation_is_followed_until_its_norm_is_known():
    """A pair of poles 3e-5 inside the circle: the shortest inverse that proves it would give 1.6 % more."""
    pole = (1.0 - 3e-5) * np.exp(1.0j)
    den = np.real(np.poly([pole, pole.conjugate()]))
    exact = np.abs(lfilter([1.0], den, np.eye(1, 1 << 20)[0])).sum()
    assert exact <= inverse(den).norm <= 1.001 * exact


@pytest.mark.parametrize(
    "den", ([(0.05, 1.0), (1.0, 0.0)], [(0.6, 1.0), (1.0, 0.0)], [(0.01, 2.0), (0.01, 1.0), (1.0, 0.0)])
)
def test_a_recursion_leaves_the_counts_free_that_its_rounding_needs(den):
    """In 16 bits an input may reach so far that v and all its rounding just fit; one count more does not."""
    made = simple(TransferFunction([(1.0, 0.0)], den))

    def of(n: int):
        reach = ControllerRanges((-n / 2**14, n / 2**14), (0.0, 0.0), (-9.0, 9.0))
        return planned(replace(made, ranges=reach), "q15")

    low, high, coarse = 16400, 32767, of(32767).filtered.lsb
    assert of(low).filtered.lsb < coarse
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if of(middle).filtered.lsb < coarse else (low, middle)
    plan = of(low)
    back = np.array([1.0, *plan.feedback.table.values])  # as they are held
    response, direct = lfilter([1.0], back, np.eye(1, 1 << 14)[0]), np.array(plan.direct.values)
    norm = np.abs(response).sum()
    carried = np.abs(np.diff(response, prepend=0.0)).sum()
    aligned = len(plan.direct.blocks) + len(plan.feedback.table.blocks) + 1
    noise = 0.5 * carried + 0.5 * aligned * 2.0**-plan.narrow * norm + 2.0 * max(1.0, norm * back.sum())
    reach = np.abs(np.convolve(direct, response)).sum() * low * 2.0**-14 / plan.filtered.lsb
    step = reach / low
    assert reach + noise <= 32766.5 and reach + step + noise > 32765.5


@pytest.mark.parametrize("arithmetic", FIXED)
def test_a_recursion_may_rest_at_nothing(arithmetic):
    """Of a derivative: its steady gain is 0, of the finest count that a product has room for."""
    plan = planned(simple(TransferFunction([(0.1, 1.0)], [(0.05, 1.0), (1.0, 0.0)])), arithmetic)
    assert (plan.feedback.steady, plan.feedback.steady_shift) == (0, 2 * plan.error.bits - 2)


@pytest.mark.parametrize("highest", ("num", "den"))
def test_orders_end_at_8_over_the_lowest(highest):
    """Of either polynomial; the lowest is of the denominator."""
    for lowest, order, kept in ((0.0, 8.0, True), (0.0, 8.25, False), (1.5, 9.5, True), (1.5, 9.75, False)):
        other = [(1.0, lowest)]
        one = [(1e-14, order), (1.0, lowest)]
        made = simple(TransferFunction(*((one, other) if highest == "num" else (other, one))), length=12)
        if kept:
            assert realise(made).den[-1].order == 0.0
            assert max(t.order for t in (*realise(made).direct, *realise(made).den)) == 8.0
        else:
            with pytest.raises(
                PlanError, match=rf"has the order {order - lowest:g} over its lowest.*orders up to 8"
            ):
                realise(made)


def test_one_integral_may_be_left_over():
    for order, kept in ((-1.0, True), (-1.25, False)):
        for integrator, remedy in (
            (True, "leave one integral"),
            (False, "set integrator = true and multiply"),
        ):
            made = simple(TransferFunction([(1.0, order)]), integrator=integrator)
            if kept:
                assert realise(made).rest == ((1.0, 0.0),)
            else:
                with pytest.raises(PlanError, match=rf"integrates more than once \(order -1.25\).*{remedy}"):
                    realise(made)


def test_an_order_is_whole_where_its_decimals_are():
    for high, low, left in ((1.3, 0.3, 1.0), (2.4, 0.4, 2.0), (1.3, 0.3000000000000003, 0.9999999999999997)):
        den = realise(simple(TransferFunction([(1.0, 0.0)], [(1.0, high), (1.0, low)]))).den
        assert [term.order for term in den] == [left, 0.0]
    for off in (0.9e-9, -0.9e-9, 2.3e-16):
        den = realise(simple(TransferFunction([(1.0, 0.0)], [(1.0, 1.0 + off), (1.0, 0.0)]))).den
        assert den[0].order == 1.0 + off != 1.0


def test_v_that_rounds_up_beyond_its_type_is_narrowed_once_more():
    """(2^31 - 1) 2^30 and seven eighths of 2^30 are 61 bits; without their last 30 they are 2^31."""
    least = 2.0**-31
    made = simple(TransferFunction([(1.0 - 0.125 * least, 0.0), (-0.875 * least, 1.0)]), sample_time=1.0)
    plan = planned(replace(made, ranges=ControllerRanges((-0.5, 0.5), (0.0, 0.0), (-9.0, 9.0))), "q31")
    assert plan.wide.high == (2**31 - 1) * 2**30 + 7 * 2**27
    assert (plan.narrow, plan.filtered.high) == (31, 2**30)
