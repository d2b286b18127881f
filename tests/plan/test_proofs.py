"""Formats, blocks and proofs of integer plans, against exact integers and adversarial runs.

Red when an integer node can overflow, or a proof names a worst case that is not reached.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.fractional.weights import gl_weights
from focgen.plan.blocks import finished, split
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.formats import WORDS, Interval, nearest, shift
from focgen.plan.plan import Plan, Sum
from focgen.plan.proofs import prove
from focgen.plan.scenario import Scenario
from focgen.plan.worst import worst_case_input
from tests.controllers import random_controller, seed_controller, simple

FIXED = ("q15", "q31")


def planned(seed, arithmetic, **how):
    try:
        return build_plan(random_controller(seed, **how), arithmetic)
    except PlanError as reason:
        pytest.skip(str(reason))


def sums(plan: Plan) -> list[Sum]:
    found = (plan.direct, plan.inner and plan.inner.rest, plan.feedback and plan.feedback.table)
    return [s for s in found if s]


# --------------------------------------------------------------------------------------------- weights


def test_block_scaling_keeps_the_weights_that_one_scale_loses():
    """In one 16-bit scale 453 weights of α = 0.6 are left of a thousand; in blocks, all of them."""
    weights = gl_weights(0.6, 1000)
    assert np.count_nonzero(np.rint(weights * 2**15)) == 453
    for arithmetic in FIXED:
        plan = build_plan(seed_controller(1000), arithmetic)
        assert np.count_nonzero(plan.direct.weights) == plan.direct.taps == 1001


@pytest.mark.parametrize("arithmetic", FIXED)
@pytest.mark.parametrize("order", [0.05, 0.3, 0.6, 0.95, 1.3, 1.9])
@pytest.mark.parametrize("length", [1, 7, 1000, 20000])
def test_every_weight_survives_and_is_close(arithmetic, order, length):
    word, weights = WORDS[arithmetic], gl_weights(order, length)
    drafts = split(weights, 0, word.limit, word)
    kept = np.concatenate([d.counts for d in drafts])
    assert np.all(kept != 0) and np.abs(kept).max() <= word.limit
    error = sum(float(np.abs(d.counts * 2.0**d.exponent - d.real).sum()) for d in drafts)
    assert error <= len(drafts) * 2.0 ** -(word.bits - 1) * np.abs(weights).sum()
    assert len(drafts) <= 8 + length // 24
    firsts = [d.first for d in drafts]
    assert firsts == sorted(firsts) and sum(len(d.real) for d in drafts) == length + 1


@pytest.mark.parametrize("arithmetic", FIXED)
def test_a_small_weight_among_large_ones_gets_a_block_of_its_own(arithmetic):
    """As where two terms of opposite sign nearly cancel at one lag."""
    weights = np.array([1.0, -0.6, 0.3, 0.2, 0.1, 3e-12, -0.1, -0.12])
    drafts = split(weights, 0, WORDS[arithmetic].limit, WORDS[arithmetic])
    kept = np.concatenate([d.counts * 2.0**d.exponent for d in drafts])
    assert np.allclose(kept, weights, rtol=2e-4, atol=0.0)


def test_blocks_are_contiguous_and_their_sums_meet_at_the_total():
    plan = build_plan(seed_controller(300), "q15")
    blocks = plan.direct.blocks
    assert [b.first for b in blocks[:-1]] == [b.last + 1 for b in blocks[1:]]
    assert (blocks[-1].first, blocks[0].last) == (0, 300)
    for block in blocks:
        assert block.sum.lsb == block.lsb * plan.error.lsb
        assert block.sum.lsb * 2**block.align == plan.direct.total.lsb == plan.wide.lsb
    exact = 1.32 * 0.01**-0.6 * gl_weights(0.6, 300) + np.eye(1, 301)[0]
    assert np.allclose(plan.direct.values, exact, rtol=0, atol=2.0**-15 * exact[0])


def test_blocks_far_below_the_total_are_made_coarser_rather_than_shifted_out_of_their_type():
    word = WORDS["q15"]
    drafts = split(np.array([1.0, 1e-9]), 0, word.limit, word)
    blocks = finished(drafts, 0, drafts[0].exponent, Interval(-word.limit, word.limit), word, "")
    assert all(0 <= b.align <= word.sum_bits - 4 for b in blocks)


# --------------------------------------------------------------------------------------------- formats


@pytest.mark.parametrize("arithmetic", FIXED)
@pytest.mark.parametrize(
    "seed", [*range(30), *(pytest.param(s, marks=pytest.mark.long) for s in range(30, 60))]
)
def test_formats_hold_what_the_ranges_say(seed, arithmetic):
    plan = planned(seed, arithmetic)
    bits, ranges = plan.error.bits, plan.controller.ranges
    top = 2 ** (bits - 1)
    for form, reach in ((plan.reference, ranges.reference), (plan.measurement, ranges.measurement)):
        assert (form.low, form.high) == tuple(nearest(x / form.lsb) for x in reach)
    assert plan.reference.lsb == plan.measurement.lsb == plan.error.lsb
    forms = [plan.reference, plan.measurement, plan.error, plan.output, plan.gain, plan.filtered, plan.wide]
    forms += [plan.increment, plan.product] + [b.sum for s in sums(plan) for b in s.blocks]
    for form in forms:
        assert math.frexp(form.lsb)[0] == 0.5, "a power of two"
        limit = 2 ** (form.bits - 1)
        assert -limit <= form.low <= 0 or form.low <= form.high
        assert -limit <= form.low and form.high < limit
    largest = max(
        abs(plan.error.low), abs(plan.error.high), abs(plan.reference.high), abs(plan.reference.low)
    )
    assert largest > top // 4 or abs(plan.measurement.low) > top // 4 or plan.measurement.high > top // 4


@pytest.mark.parametrize("seed", range(60))
def test_q15_needs_no_wider_product_than_16_by_16(seed):
    plan = planned(seed, "q15")
    assert plan.error.bits == plan.gain.bits == plan.output.bits == 16
    for table in sums(plan):
        assert max(abs(w) for w in table.weights) < 2**15
        assert all(b.sum.ctype == "int32_t" for b in table.blocks)
    assert plan.filtered.bits == (16 if plan.feedback else 32)
    if plan.schedule:
        points = plan.schedule.breakpoints
        assert all(abs(s) < 2**15 for s in plan.schedule.slopes)
        assert max(b - a for a, b in pairwise(points)) < 2**15
        assert plan.schedule.signal.high - points[0] < 2**15


@pytest.mark.parametrize("arithmetic", FIXED)
@pytest.mark.parametrize("unit", [1e-25, 1e-9, 1.0, 1e9, 1e25])
def test_any_unit_gives_the_same_machine(arithmetic, unit):
    """A controller in millimetres and in kilometres: only the size of one count differs."""
    unit = 2.0 ** round(math.log2(unit))
    near = build_plan(seed_controller(40), arithmetic)
    ranges = ControllerRanges((0.0, 0.02 * unit), (0.0, 0.02 * unit), (0.0, 10.0), (0.0, 0.25))
    gain = near.controller.gain
    far_gain = GainSchedule(gain.breakpoints, tuple(g / unit for g in gain.gains))
    far = build_plan(seed_controller(40, ranges=ranges, gain=far_gain), arithmetic)
    assert far.error.lsb == near.error.lsb * unit
    assert (far.direct.weights, far.schedule.gains) == (near.direct.weights, near.schedule.gains)
    assert [p.worst for p in far.proofs] == [p.worst for p in near.proofs]


def test_a_steady_error_of_one_count_still_moves_the_integrator():
    """Guard bits: the smallest error that can be read must not be lost, however slow the controller is."""
    for gain in (1.0, 1e-3, 1e-6):
        for transfer in ([(1.0, 0.0)], [(1.0, 0.0), (1.0, 1.0)], [(0.2, 0.0), (1.0, 1.0)]):
            plan = build_plan(simple(TransferFunction(transfer), gain=gain, integrator=True), "q15")
            ref = np.ones((1, 4), dtype=np.int64)
            d = execute(plan, Scenario(ref, np.zeros_like(ref))).d[0]
            expected = gain * transfer[0][0] * plan.error.lsb * 0.005
            assert d[-1] * plan.increment.lsb == pytest.approx(expected, rel=0.05)


# ----------------------------------------------------------------------------------------- worst cases


def exact_sum(table: Sum, past: np.ndarray, block=None) -> int:
    """The sum (or one block's own) at the last sample, in Python's integers; ``past`` oldest first."""
    parts = []
    for b in table.blocks:
        each = [int(w) * int(past[-1 - b.first - i]) for i, w in enumerate(b.weights)]
        parts.append(sum(each) if block else shift(sum(each), b.align))
    return parts[table.blocks.index(block)] if block else sum(parts)


@pytest.mark.parametrize("arithmetic", FIXED)
@pytest.mark.parametrize("seed", range(20))
def test_sums_over_the_error_reach_their_proved_worst_case_and_no_more(seed, arithmetic):
    plan = planned(seed, arithmetic, longest=200)
    proofs = {p.node: p for p in plan.proofs}
    for table in (plan.direct, plan.inner and plan.inner.rest):
        if table is None:
            continue
        nodes = [(f"{table.name}[{b.first}..{b.last}]", b) for b in table.blocks] + [
            (f"{table.name} total", None)
        ]
        for node, block in nodes:
            raw = worst_case_input(plan, node)
            reached = [exact_sum(table, e, block) for e in raw.ref - raw.meas]
            half = (1 << block.align) >> 1 if block else 0
            assert max(map(abs, reached)) + half <= proofs[node].worst <= proofs[node].limit
            if plan.error.low < 0 < plan.error.high:  # elsewhere the proof mixes in the 0 of init
                assert max(map(abs, reached)) + half == proofs[node].worst


@pytest.mark.parametrize(
    "seed, arithmetic",
    [
        pytest.param(
            seed, arithmetic, marks=() if seed < 8 and (seed // 2 + i) % 2 == 0 else pytest.mark.long
        )
        for seed in range(10)
        for i, arithmetic in enumerate(FIXED)
    ],
)
def test_adversarial_runs_stay_within_the_proofs(seed, arithmetic):
    """Every node's worst input, run: what is seen from outside is within the proof, and near it for sums."""
    plan = planned(seed, arithmetic)
    proofs = {p.node: p.worst for p in plan.proofs}
    recursive_or_drifting = plan.feedback or plan.inner
    for node in proofs:
        trace = execute(plan, worst_case_input(plan, node))
        assert np.abs(trace.d).max() <= proofs["increment"]
        if node == "increment" and not recursive_or_drifting:
            reached = int(np.abs(trace.d[:, -1]).max())
            assert proofs["increment"] - reached <= 2 ** -(plan.gain.bits - 3) * proofs["increment"] + 1


def test_the_recursion_comes_near_its_proved_reach():
    """The l1 norm is what a finite adversarial input reaches, but for the last digits."""
    controller = simple(TransferFunction([(1.0, 0.5)], [(0.1, 0.7), (1.0, 0.0)]), length=60)
    plan = build_plan(controller, "q31")
    proved = next(p.worst for p in plan.proofs if p.node == "v")
    trace = execute(plan, worst_case_input(plan, "v"))
    reached = np.abs(trace.d[:, -1] * plan.increment.lsb / (plan.constant_gain * plan.gain.lsb)).max()
    assert 0.99 * proved * plan.filtered.lsb <= reached <= proved * plan.filtered.lsb


# -------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    "node, change",
    [
        ("direct[0..0]", lambda p: _heavier(p, -1, 5)),
        ("direct[32..63]", lambda p: _heavier(p, -7, 5)),
        ("gain product", lambda p: replace(p, product=replace(p.product, ctype="int32_t"))),
        ("increment", lambda p: replace(p, gain_shift=p.gain_shift - 4)),
        (
            "integrator sum",
            lambda p: replace(p, increment=replace(p.increment, ctype="int64_t"), gain_shift=13),
        ),
        ("gain", lambda p: replace(p, schedule=replace(p.schedule, gains=(40000,) * len(p.schedule.gains)))),
        ("error", lambda p: replace(p, reference=replace(p.reference, high=60000))),
    ],
)
def test_a_plan_that_could_overflow_is_not_proved(node, change):
    plan = build_plan(seed_controller(100), "q15")
    with pytest.raises(PlanError, match=node.replace("[", r"\[").replace("]", r"\]")):
        prove(change(plan))


def _heavier(plan: Plan, index: int, factor: int) -> Plan:
    blocks = list(plan.direct.blocks)
    heavy = tuple(factor * w for w in blocks[index].weights)
    blocks[index] = replace(blocks[index], weights=heavy)
    return replace(plan, direct=replace(plan.direct, blocks=tuple(blocks)))


def refused(controller, arithmetic="q15", **how) -> PlanError:
    with pytest.raises(PlanError) as caught:
        build_plan(controller, arithmetic, **how)
    assert len(str(caught.value).splitlines()) == 1
    return caught.value


def test_what_cannot_be_planned_is_refused_with_a_remedy():
    unit = TransferFunction([(1.0, 0.0)])
    far = ControllerRanges((1e6, 1e6 + 1.0), (1e6, 1e6 + 1.0), (0.0, 1.0))
    assert "subtract the offset" in str(refused(simple(unit, ranges=far)))
    huge = ControllerRanges((0.0, 1e300), (0.0, 1.0), (0.0, 1.0))
    assert "units" in str(refused(simple(unit, ranges=huge)))
    narrow = ControllerRanges((-1e12, 1e12), (-1e12, 1e12), (0.0, 1e-6))
    assert "output range" in str(refused(simple(unit, ranges=narrow, gain=1e9)))
    assert "zero" in str(refused(simple(unit, gain=0.0)))
    immense = refused(simple(TransferFunction([(1e60, 0.5)])))
    assert immense.where == "simple [transfer]" and "weight" in immense.what
    immense = refused(simple(TransferFunction([(1e60, 0.5)])), memory="exponential", tolerance=1e-3)
    assert immense.where == "simple [transfer]"
    assert "numerator" in str(refused(simple(TransferFunction([]))))
    assert "integrator = true" in str(refused(simple(TransferFunction([(1.0, -1.4)]))))
    assert "orders up to" in str(refused(simple(TransferFunction([(1.0, 9.0)]))))
    assert "memory length" in str(refused(simple(unit), length=0))
    assert "choose one of" in str(refused(simple(unit), arithmetic="q7"))
    assert "memory form" in str(refused(simple(unit, memory="endless")))
    steep = GainSchedule((0.5, 0.50001), (-1.0, 1.0))
    ranges = ControllerRanges((0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0))
    assert "steep" in str(refused(simple(unit, gain=steep, ranges=ranges)))


def test_float_weights_beyond_the_type_are_refused():
    assert "beyond float32" in str(refused(simple(TransferFunction([(1e38, 0.5)])), arithmetic="f32"))


def test_a_recursion_that_16_bits_cannot_hold_is_refused_and_31_can():
    slow = simple(TransferFunction([(1.0, 0.0)], [(4.0, 2.0), (0.01, 1.0), (1.0, 0.0)]), length=10)
    assert "q31" in str(refused(slow, "q15"))
    build_plan(slow, "q31")


def test_weights_that_would_lose_the_gain_at_rest_are_refused():
    """(s + 0.001) at 10 ms: 100.001 − 100 is 0 in 16 bits; integral action would be gone, or reversed."""
    derivative = TransferFunction([(1e-3, 0.0), (1.0, 1.0)])
    assert "gain at rest" in str(refused(simple(derivative, integrator=True), "q15"))
    plan = build_plan(simple(derivative, integrator=True), "q31")
    assert sum(plan.direct.values) == pytest.approx(1e-3, rel=1e-4)


def test_an_integral_may_grow_by_two_increments_of_the_same_sign():
    """In a range of errors that reaches further up than down; half a count of the output's shift besides."""
    ranges = ControllerRanges((0.0, 1.0), (0.0, 0.2), (0.0, 1.0))
    transfer = TransferFunction([(0.1, 0.5), (1.0, 0.0)])
    plan = build_plan(simple(transfer, integrator=True, ranges=ranges), "q15")
    proof = next(p for p in plan.proofs if p.node == "integrator sum")
    assert -plan.increment.low < 0.7 * plan.increment.high
    half = 1 << (plan.integrator.to_output - 1)
    assert proof.worst == plan.integrator.state.high + 2 * plan.increment.high + half


def test_the_worst_integral_starts_without_an_error_where_the_ranges_overlap():
    ranges = ControllerRanges((0.2, 1.0), (-1.0, 0.5), (0.0, 1.0))
    plan = build_plan(
        simple(TransferFunction([(0.1, 0.5), (1.0, 0.0)]), integrator=True, ranges=ranges), "q15"
    )
    for reset in worst_case_input(plan, "integrator sum").resets:
        assert reset.ref == reset.meas
        assert plan.reference.low <= reset.ref <= min(plan.reference.high, plan.measurement.high)
