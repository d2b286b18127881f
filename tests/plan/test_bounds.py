"""The manifest's error bounds: never exceeded, and not so loose as to say nothing.

Red when an error exceeds its bound, or a bound is so wide that it says nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import tables
from focgen.plan.execute import execute
from focgen.plan.fixed_account import Fixed
from focgen.plan.ideal import ideal
from focgen.plan.plan import Plan
from focgen.plan.proofs import at_rest, reset_error
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_physical, to_raw
from focgen.plan.usable import reach
from focgen.plan.worst import worst_case_input
from tests.controllers import random_controller, random_scenario, seed_controller, simple

ARITHMETICS = ("f64", "f32", "q31", "q15")


def samples_since_reset(scenario: Scenario) -> np.ndarray:
    """1 at the first sample after init or a reset, and so on; shape (lanes, samples)."""
    count = np.tile(np.arange(1, scenario.samples + 1), (scenario.lanes, 1))
    for r in sorted(scenario.resets, key=lambda r: r.sample):
        count[r.lane, r.sample :] = np.arange(1, scenario.samples - r.sample + 1)
    return count


def shares(plan: Plan, physical: Scenario, raw: Scenario, reference) -> tuple[float, float]:
    """The largest errors of operator and output, as shares of their bounds."""
    trace, bound, count = (
        physical_trace(plan, execute(plan, raw)),
        plan.error_bound,
        samples_since_reset(physical),
    )
    allowed = np.full(count.shape, bound.operator)
    if bound.operator_per_sample:
        allowed = np.minimum(allowed, count * bound.operator_per_sample)
    operator = np.abs(trace.d - reference.d) / allowed
    output = np.abs(trace.u - reference.u) / (count * bound.output_per_sample)
    return float(operator.max()), float(output.max())


@pytest.mark.parametrize(
    "seed", [*range(40), *(pytest.param(s, marks=pytest.mark.long) for s in range(40, 800))]
)
def test_bounds_hold_for_physical_inputs_anywhere_in_their_ranges(seed):
    """Inputs, u0 and tracked outputs between the counts; every arithmetic against the same float64 run."""
    controller = random_controller(seed)
    physical = random_scenario(controller, seed, lanes=3, samples=160)
    reference = None
    for arithmetic in ARITHMETICS:
        try:
            plan = build_plan(controller, arithmetic)
        except PlanError:
            continue
        reference = reference or ideal(controller, physical, controller.length)
        operator, output = shares(plan, physical, to_raw(plan, physical), reference)
        assert operator <= 1.0 and output <= 1.0, arithmetic


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_bounds_hold_at_the_worst_input_and_are_not_far_above_it(arithmetic):
    """The input that makes the largest sum makes large errors too: the bound is within a small factor of
    them.
    """
    controller = seed_controller(300)
    plan, found = build_plan(controller, arithmetic), 0.0
    rng = np.random.default_rng(3)
    for node in ("v",) if plan.floating else ("direct total", "gain product"):
        worst = to_physical(plan, worst_case_input(plan, node))
        for _ in range(6):
            physical = replace(worst, sched=rng.uniform(0.0, 0.25, worst.ref.shape))
            operator, output = shares(
                plan, physical, to_raw(plan, physical), ideal(controller, physical, 300)
            )
            assert operator <= 1.0 and output <= 1.0
            found = max(found, operator)
    assert found > {"q15": 0.1, "q31": 0.1, "f32": 0.01, "f64": 1e-3}[arithmetic]


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_the_weights_share_is_what_an_adversary_can_make_of_their_errors(arithmetic):
    """Σ|ŵ − w| E is reached by e = ±E with the signs of the errors; the bound's part for it is that, and no
    more.
    """
    controller = simple(TransferFunction([(1.0, 0.6)]), length=200)
    plan = build_plan(controller, arithmetic)
    exact = _gl(0.6, 200) * 0.01**-0.6
    reached = float(np.abs(np.array(plan.direct.values) - exact).sum()) * 2.0
    part = dict(plan.error_bound.parts)["weights"]
    assert reached <= part <= 1.01 * reached + 1e-9


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_an_inner_integral_takes_up_every_error_of_its_addends(arithmetic):
    """By hand: what rounded inputs, rounded weights and aligned blocks add to r, twice a sample, since r and
    the r before it are both added."""
    controller = simple(TransferFunction([(1.0, -0.7)]), length=20)
    plan, exact = build_plan(controller, arithmetic), _gl(0.3, 20) * 0.01**-0.3 * 0.005
    rest = plan.inner.rest
    inputs = np.abs(exact).sum() * plan.error.lsb
    weights = np.abs(np.array(rest.values) - exact).sum() * 2.0
    aligned = 0.5 * sum(block.align > 0 for block in rest.blocks) * rest.total.lsb
    assert min(inputs, weights) > 0.05 * max(inputs, weights), "each of them is seen"
    growth = Fixed(plan, tables(controller, 20)).inner().growth
    assert growth == pytest.approx(2.0 * (inputs + weights + aligned), rel=1e-3)


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_what_is_reached_without_an_error_is_what_clamps_let_through(arithmetic):
    """In physical units, also where an inner integral is held in counts: the output's clamp, 10, and twice
    what the integral's, 10 as well, makes of it.
    """
    plan = build_plan(simple(TransferFunction([(1.0, -0.7)]), length=20), arithmetic)
    assert reach(plan, 0.0) == pytest.approx(30.0, rel=1e-6)
    assert plan.inner.state.lsb < 1e-9 or arithmetic == "f64"


def _gl(order: float, count: int) -> np.ndarray:
    weights = [1.0]
    for j in range(1, count + 1):
        weights.append(weights[-1] * (j - 1 - order) / j)
    return np.array(weights)


@pytest.mark.parametrize("seed", range(0, 80, 2))
def test_truncation_bound_holds_against_infinite_memory(seed):
    controller = random_controller(seed)
    try:
        plan = build_plan(controller, "f64")
    except PlanError as reason:
        pytest.skip(str(reason))
    physical = random_scenario(controller, seed, lanes=3, samples=400)
    same, endless = ideal(controller, physical, plan.length), ideal(controller, physical)
    assert plan.error_bound.truncation is not None
    error = float(np.abs(same.d - endless.d).max())
    assert error <= plan.error_bound.truncation * (1.0 + 1e-9) + plan.error_bound.operator


def test_truncation_bound_is_reached_by_a_constant_that_began_long_ago():
    """e at one end for ever, then at the other: all that the memory misses has one sign."""
    controller = simple(TransferFunction([(1.0, 0.6)]), length=50)
    plan = build_plan(controller, "f64")
    ref = np.concatenate([np.full((1, 1), -1.0), np.full((1, 200_000), 1.0), np.full((1, 1), -1.0)], axis=1)
    physical = Scenario(ref, -ref, None, (Reset(0, 0, -1.0, 1.0, 0.0),))
    error = np.abs(ideal(controller, physical, 50).d - ideal(controller, physical).d)[0]
    assert 0.98 * plan.error_bound.truncation < error.max() <= plan.error_bound.truncation


def test_truncation_of_an_integral_drifts_to_its_clamp_and_no_further():
    """What a memory of 20 leaves out of s^0.1 is integrated."""
    controller = simple(TransferFunction([(1.0, -0.9)]), length=20)
    bound = build_plan(controller, "f64").error_bound.truncation
    physical = Scenario(np.full((1, 5000), 0.4), np.zeros((1, 5000)))
    error = np.abs(ideal(controller, physical, 20).d - ideal(controller, physical).d)
    assert 0.1 * bound < error.max() <= bound


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_rounding_of_a_recursion_is_within_its_part_of_the_bound(arithmetic):
    """v_k = (e_k + v_{k−1})/2: exact weights and gain, inputs that are counts. Rounding is what is left."""
    controller = simple(TransferFunction([(1.0, 0.0)], [(0.01, 1.0), (1.0, 0.0)]))
    plan = build_plan(controller, arithmetic)
    raw = to_raw(plan, random_scenario(controller, 4, lanes=4, samples=300))
    physical = to_physical(plan, raw)
    error = physical_trace(plan, execute(plan, raw)).d - ideal(controller, physical, controller.length).d
    parts = dict(plan.error_bound.parts)
    assert 0.0 < np.abs(error).max() <= parts["rounding"] + parts.get("product", 0.0)


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_an_integral_takes_up_its_inputs_rounding_as_fast_as_the_bound_says(arithmetic):
    """1/s of inputs that all lie almost half a count off, with exact weights: the bound is reached."""
    controller = simple(TransferFunction([(1.0, -1.0)]), sample_time=2.0**-7)
    plan, samples = build_plan(controller, arithmetic), 1000
    off = 0.25 + 0.499 * plan.error.lsb
    physical = Scenario(np.full((1, samples), off), np.full((1, samples), -off))
    trace = physical_trace(plan, execute(plan, to_raw(plan, physical)))
    error = np.abs(trace.d - ideal(controller, physical, controller.length).d)[0]
    parts = dict(plan.error_bound.parts)
    growth = plan.error_bound.operator_per_sample - sum(parts.values()) + parts["inner integral"]
    assert 0.9 * growth * samples < error[-1] <= growth * samples + parts["product"]


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_a_steep_schedule_costs_what_the_bound_says(arithmetic):
    """A breakpoint and the scheduling signal each almost half a count off, on the steepest segment."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))
    lsb = 2.0**-14 if arithmetic == "q15" else 2.0**-30
    schedule = GainSchedule((0.25 + 0.499 * lsb, 0.5 + 0.499 * lsb), (0.0, 1.0))
    unit = TransferFunction([(1.0, 0.0)])
    controller = simple(unit, gain=schedule, ranges=ranges, integrator=True, sample_time=2.0**-6)
    plan = build_plan(controller, arithmetic)
    assert plan.schedule.signal.lsb == lsb
    at = 0.375 - 0.499 * lsb
    physical = Scenario(np.ones((1, 3)), -np.ones((1, 3)), np.full((1, 3), at))
    error = np.abs(
        physical_trace(plan, execute(plan, to_raw(plan, physical))).d - ideal(controller, physical, 1).d
    )
    parts = dict(plan.error_bound.parts)
    assert 0.8 * parts["gain"] < error.max() <= parts["gain"] + parts["product"]


@pytest.mark.parametrize("seed", (4, 5, 7, 14, 15, 24, 25))
def test_a_reset_starts_a_recursion_as_near_to_its_rest_as_said(seed):
    """Every few counts of e: the history's value against the exact rest of the integer recursion."""
    plan = build_plan(random_controller(seed), "q15")
    feedback, e = plan.feedback, np.arange(plan.error.low, plan.error.high + 1, 37)
    product = e * feedback.steady
    held = (product + (1 << feedback.steady_shift >> 1)) >> feedback.steady_shift
    ratio = sum(plan.direct.values) / at_rest(plan) * plan.error.lsb / plan.filtered.lsb
    worst = float(np.abs(held - e * ratio).max())
    assert 0.3 * reset_error(plan) < worst <= reset_error(plan)


def test_whole_orders_leave_nothing_out():
    pid = simple(TransferFunction([(2.0, 0.0), (0.5, -1.0), (0.1, 1.0)]), length=30)
    assert build_plan(pid, "f64").error_bound.truncation == 0.0


def test_with_an_inner_integral_the_error_grows_and_its_clamp_ends_it():
    controller = simple(TransferFunction([(1.0, 0.0), (3.0, -0.9)]), length=100)
    bound = build_plan(controller, "q15").error_bound
    assert 0.0 < bound.operator_per_sample < 0.01 * bound.operator
    assert bound.operator > 20.0, "the clamp's width, which is the output's"
    assert build_plan(simple(TransferFunction([(1.0, 0.5)])), "q15").error_bound.operator_per_sample == 0.0


def test_finer_arithmetic_has_smaller_bounds():
    bounds = {a: build_plan(seed_controller(1000), a).error_bound for a in ARITHMETICS}
    order = sorted(bounds, key=lambda a: bounds[a].operator)
    assert order == ["f64", "q31", "f32", "q15"]
    assert len({b.truncation for b in bounds.values()}) == 1
    for bound in bounds.values():
        assert sum(value for _, value in bound.parts) == pytest.approx(bound.operator, rel=1e-6)


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_a_bound_that_counts_one_rounding_less_is_exceeded(arithmetic):
    """The bound is needed: with inputs' and gain's shares left out, some run exceeds what is left of it."""
    exceeded = 0
    for seed in range(20):
        controller = random_controller(seed, longest=40)
        try:
            plan = build_plan(controller, arithmetic)
        except PlanError:
            continue
        if plan.error_bound.operator_per_sample:
            continue
        parts = dict(plan.error_bound.parts)
        less = parts.get("product", 0.0) + parts.get("rounding", 0.0) + parts.get("weights", 0.0)
        physical = random_scenario(controller, seed, lanes=2, samples=160)
        trace = physical_trace(plan, execute(plan, to_raw(plan, physical)))
        exceeded += float(np.abs(trace.d - ideal(controller, physical, plan.length).d).max()) > less
    assert exceeded > 3
