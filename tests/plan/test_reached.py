"""Proofs beside a second ledger of what every node can reach, and formats as fine as their types allow.

Red when a proof is of less than a node can reach, or of more; or when half of a count would have fitted.
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.fractional.transfer import TransferFunction
from focgen.plan.plan import Plan, Sum
from tests.controllers import simple
from tests.plan.derived import Weights, planned, plans, truth
from tests.plan.ledger import half, hull, minus, plus, reached, shift, shifted, span, times, worst

SUMS = {16: 32, 32: 64}
SEEDS = [range(a, a + 10) for a in range(0, 40, 10)]
of_seeds = pytest.mark.parametrize("seeds", SEEDS, ids=lambda seeds: str(seeds.start))
fixed = pytest.mark.parametrize("arithmetic", ("q15", "q31"))


def top(bits: int) -> int:
    return 2 ** (bits - 1) - 1


def counts(x: float, lsb: float) -> int:
    """The nearest whole number, halves away from zero."""
    size = int(Fraction(abs(x)) / Fraction(lsb) + Fraction(1, 2))
    return size if x >= 0 else -size


@of_seeds
@fixed
def test_a_proof_is_of_what_its_node_can_reach(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        proofs = {proof.node: proof for proof in plan.proofs}
        expected = reached(plan, proofs["v"].worst)
        assert {n for n in proofs if not n.startswith("set point")} == expected.keys()
        for node, value in expected.items():
            assert proofs[node].worst == value, (plan.name, node)
            assert proofs[node].limit == top(int(proofs[node].ctype.strip("int_"))), node


@of_seeds
@fixed
def test_inputs_and_output_are_as_fine_as_their_type_allows(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        ranges, limit = plan.controller.ranges, top(plan.error.bits)

        def taken(lsb, ranges=ranges):
            (a, b), (c, d) = ([counts(x, lsb) for x in one] for one in (ranges.reference, ranges.measurement))
            return (a, b), (c, d), hull(minus((a, b), (c, d)), (0, 0))

        made = taken(plan.error.lsb)
        assert made == (span(plan.reference), span(plan.measurement), span(plan.error))
        assert max(map(worst, made)) <= limit < max(map(worst, taken(plan.error.lsb / 2)))
        out, lsb = ranges.output, plan.output.lsb
        assert span(plan.output) == (counts(out[0], lsb), counts(out[1], lsb))
        assert worst(span(plan.output)) <= limit < max(abs(counts(x, lsb / 2)) for x in out)


def finest(weights: np.ndarray, largest: int, bits: int) -> int:
    """log2 of the finest scale in which each weight fits its type, and their sum, times a sample, its own."""
    room, k = top(SUMS[bits]) - 2 ** (SUMS[bits] - 4), -200
    size = [abs(Fraction(float(w))) for w in weights]

    def fits(k):
        scale = Fraction(2) ** -k
        each = [int(x * scale + Fraction(1, 2)) for x in size]
        whole = int(sum(size) * largest * scale + Fraction(1, 2))
        return max(each) <= top(bits) and max(whole, sum(each) * largest) <= room

    k = math.frexp(float(max(size)))[1] - bits - 1
    while not fits(k):
        k += 1
    return k


def cut(weights: np.ndarray, first: int, largest: int, bits: int, allowed: float) -> list[tuple[int, int]]:
    """(first, scale) of a block, halved until no weight is lost and their errors are few."""
    if not weights.any():
        return [(first, 0)]
    k = finest(weights, largest, bits)
    lost = any(w and abs(w) < 2.0 ** (k - 1) for w in weights)
    if len(weights) == 1 or not (lost or 0.5 * len(weights) * 2.0**k > allowed):
        return [(first, k)]
    n = len(weights) // 2
    return cut(weights[:n], first, largest, bits, allowed) + cut(
        weights[n:], first + n, largest, bits, allowed
    )


def check_blocks(plan: Plan, table: Sum, exact: Weights, largest: int, lsb: float) -> None:
    """Blocks of an octave at most, each as fine as it can be, unless it would be shifted out of its sum."""
    bits, first = plan.error.bits, table.first
    weights, at, expected = exact.taps[first : first + table.taps], first, []
    allowed = 2.0 ** -(bits + 1) * float(np.abs(weights).sum())
    while at < first + len(weights):
        stop = min(max(1, 2 * at), first + len(weights))
        expected += cut(weights[at - first : stop - first], at, largest, bits, allowed)
        at = stop
    blocks = table.blocks[::-1]
    assert [b.first for b in blocks] == [at for at, _ in expected]
    for block, (at, k) in zip(blocks, expected):
        own = weights[at - first : at - first + len(block.weights)]
        assert block.sum.lsb == block.lsb * lsb and block.sum.lsb * 2**block.align == table.total.lsb
        most = SUMS[bits] - 4
        assert not own.any() or block.lsb == 2.0**k or (block.align == most and block.lsb > 2.0**k)
        assert np.abs(np.array(block.weights) - own / block.lsb).max() <= 0.5 + 1e-9


@of_seeds
@fixed
def test_blocks_are_cut_and_scaled_as_is_told(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        true, e = truth(plan), worst(span(plan.error))
        if plan.direct:
            check_blocks(plan, plan.direct, true.direct, e, plan.error.lsb)
        if plan.inner:
            check_blocks(plan, plan.inner.rest, true.rest, e, plan.error.lsb)
        if plan.feedback:
            whole = top(plan.error.bits) + 1
            check_blocks(plan, plan.feedback.table, true.den, whole, plan.filtered.lsb)


def shifts(plan: Plan) -> list[int]:
    """Every shift to the lsb of p."""
    tables = [t for t in (plan.direct, plan.feedback and plan.feedback.table) if t]
    found = [part.align for t in tables for part in (*t.blocks, *t.banks) if any(part.weights)]
    return found + ([plan.inner.to_wide] if plan.inner else [])


def finer(table: Sum, by: int) -> tuple[int, int]:
    """The range of a sum of formats' own ranges, aligned ``by`` bits finer."""
    return plus(*(shifted(span(part.sum), part.align - by) for part in (*table.blocks, *table.banks)))


@of_seeds
@fixed
def test_p_and_v_are_as_fine_as_their_types_allow(arithmetic, seeds):
    """Where nothing keeps p from a count half as large, it would not have fitted."""
    for plan in plans(seeds, arithmetic):
        assert min(shifts(plan)) >= 0
        bits = SUMS[plan.error.bits]
        if plan.feedback is None:
            made = [p for p in (plan.direct and finer(plan.direct, 0),) if p]
            made += [shifted(span(plan.inner.state), plan.inner.to_wide)] if plan.inner else []
            assert span(plan.wide) == plus(*made) and worst(plus(*made)) <= top(bits) - 2 ** (bits // 2)
            assert span(plan.filtered) == shifted(span(plan.wide), plan.narrow) and plan.filtered.bits == 32
            assert worst(span(plan.filtered)) <= top(32)
            assert plan.narrow == 0 or worst(shifted(span(plan.wide), plan.narrow - 1)) > top(32)
        else:
            made = [shifted(span(plan.inner.state), plan.inner.to_wide)] if plan.inner else []
            made += [finer(plan.direct, 0)] if plan.direct else []
            carry = half(plan.narrow)
            assert span(plan.wide) == plus(minus(plus(*made), finer(plan.feedback.table, 0)), (-carry, carry))
        if min(shifts(plan)) == 0:
            continue
        half_a_count = []
        if plan.direct:
            half_a_count.append(finer(plan.direct, 1))
        if plan.inner:
            half_a_count.append(shifted(span(plan.inner.state), plan.inner.to_wide - 1))
        p = plus(*half_a_count)
        if plan.feedback is None:
            assert worst(p) > top(bits) - 2 ** (bits // 2)
        else:
            s, carry = finer(plan.feedback.table, 1), half(plan.narrow + 1)
            x = plus(minus(p, s), (-carry, carry))
            assert max(worst(x), worst(p), worst(s)) + carry > top(bits)


@of_seeds
@fixed
def test_a_recursion_is_as_fine_as_its_type_allows_and_rests_where_it_should(arithmetic, seeds):
    seen = 0
    for plan in plans(seeds, arithmetic):
        if plan.feedback is None:
            continue
        back, proof = plan.feedback, next(p for p in plan.proofs if p.node == "v")
        assert plan.filtered.lsb == plan.wide.lsb * 2**plan.narrow
        assert proof.worst <= proof.limit and 2 * (proof.worst + 1) > proof.limit - 1
        ratio = Fraction(sum(map(Fraction, plan.direct.values)) if plan.direct else 0)
        ratio *= Fraction(plan.error.lsb) / Fraction(plan.filtered.lsb)
        ratio /= 1 + sum(map(Fraction, back.table.values))
        assert abs(back.steady - ratio * 2**back.steady_shift) <= Fraction(1, 2) + Fraction(1, 1000)
        fine = back.steady_shift == 2 * plan.error.bits - 2
        assert abs(back.steady) <= top(plan.error.bits) and (
            fine or 2 * abs(back.steady) + 1 > top(plan.error.bits)
        )
        seen += 1
    assert seen >= 3


@of_seeds
@fixed
def test_an_inner_integral_is_held_as_is_told(arithmetic, seeds):
    for plan in (p for p in plans(seeds, arithmetic) if p.inner):
        state, rest, bits = plan.inner.state, plan.inner.rest, SUMS[plan.error.bits]
        assert state.lsb == rest.total.lsb and plan.wide.lsb == state.lsb * 2**plan.inner.to_wide
        limits, den = truth(plan).limits, truth(plan).den
        if den:  # by the weights that run
            limits = np.array(limits) * (1.0 + sum(plan.feedback.table.values)) / den.total
        assert np.abs(np.array(span(state)) - np.array(limits) / state.lsb).max() <= 0.5 + 1e-9 * worst(
            span(state)
        )
        far = worst(plus(span(state), span(rest.total), span(rest.total)))
        assert state.bits == (32 if bits == 32 and far <= top(32) else 64)
        aligned = [part.align for part in (*rest.blocks, *rest.banks) if any(part.weights)]
        twice = plus(times(span(state), (2, 2)), finer(rest, 1), finer(rest, 1))
        assert min(aligned) == 0 or worst(finer(rest, 1)) > top(bits) or worst(twice) > top(64)


@of_seeds
@fixed
def test_gains_and_slopes_are_as_fine_as_their_word_allows(arithmetic, seeds):
    for plan in (p for p in plans(seeds, arithmetic) if p.tuning is None):
        controller, lsb, limit = plan.controller, plan.gain.lsb, top(plan.gain.bits)
        factor = 0.5 * plan.sample_time if plan.integrator else 1.0
        if plan.schedule is None:
            assert plan.constant_gain == counts(controller.gains[0] * factor, lsb)
            assert span(plan.gain) == (plan.constant_gain,) * 2
            assert abs(plan.constant_gain) <= limit - 3 < abs(counts(controller.gains[0] * factor, lsb / 2))
            continue
        schedule, signal = plan.schedule, plan.schedule.signal
        largest = max(map(abs, schedule.gains))
        assert limit - 3 >= largest > (limit - 3) // 2 - 1
        low, high = controller.ranges.schedule
        assert span(signal) == (counts(low, signal.lsb), counts(high, signal.lsb))
        far = max(abs(low), abs(high), high - low)
        assert counts(far, signal.lsb) <= limit - 1 < counts(far, signal.lsb / 2)
        given = controller.schedule.breakpoints  # beyond the signal's range none counts
        inside = [p for p in given if low < p < high]
        points = [low] * (given[0] <= low or not inside) + inside
        points += [high] * (given[-1] >= high or len(points) == 1)
        assert [counts(p, signal.lsb) for p in points] == list(schedule.breakpoints)
        wanted = [float(controller.schedule(p)) * factor for p in points]
        assert [counts(g, lsb) for g in wanted] == list(schedule.gains)
        check_slopes(plan)


def check_slopes(plan: Plan) -> None:
    """The nearest count of the finest scale that the word has room for; and what g reaches between them."""
    schedule, limit = plan.schedule, top(plan.gain.bits)
    seen = set(map(int, schedule.gains))
    for i, (p, q) in enumerate(pairwise(schedule.breakpoints)):
        exact = Fraction(int(schedule.gains[i + 1] - schedule.gains[i]), q - p)
        slope, by = int(schedule.slopes[i]), schedule.slope_shifts[i]
        assert abs(slope - exact * 2**by) <= Fraction(1, 2) and abs(slope) <= limit
        assert exact == 0 or by == SUMS[plan.gain.bits] - 2 or abs(round(2 * exact * 2**by)) >= limit
        seen |= {int(schedule.gains[i]) + shift(slope * (s - p), by) for s in (p, q - 1)}
    assert (plan.gain.low, plan.gain.high) == (min(schedule.gains) - 1, max(schedule.gains) + 1)
    assert plan.gain.low <= min(seen) and max(seen) <= plan.gain.high


@of_seeds
@fixed
def test_the_integral_is_as_fine_as_its_width_allows(arithmetic, seeds):
    """32 bits where no increment is lost in them."""
    for plan in plans(seeds, arithmetic):
        made = times(span(plan.filtered), span(plan.gain))
        assert span(plan.product) == made and plan.product.bits == 64
        assert plan.product.lsb == plan.filtered.lsb * plan.gain.lsb
        assert plan.increment.lsb == plan.product.lsb * 2**plan.gain_shift
        assert span(plan.increment) == shifted(made, plan.gain_shift)
        if plan.integrator is None:
            assert plan.increment.lsb == plan.output.lsb
            small = worst(span(plan.increment)) <= top(SUMS[plan.error.bits])
            assert plan.increment.bits == (SUMS[plan.error.bits] if small else 64)
            continue
        state, by, bits = plan.integrator.state, plan.integrator.to_output, plan.integrator.state.bits
        assert state.lsb * 2**by == plan.output.lsb and plan.increment.bits == bits
        assert span(state) == tuple(x * 2**by for x in span(plan.output))
        assert fits(plan, made, plan.gain_shift, by, bits)
        finer_fits = plan.gain_shift > 0 and by < bits and fits(plan, made, plan.gain_shift - 1, by + 1, bits)
        assert not finer_fits
        if bits == 64 and plan.error.bits == 16:
            assert lost_in_32(plan, made)


def fits(plan: Plan, product: tuple[int, int], shifted_by: int, to_output: int, bits: int) -> bool:
    d = worst(shifted(product, shifted_by))
    return worst(span(plan.output)) * 2**to_output + 2 * d + 2**to_output <= top(bits)


def lost_in_32(plan: Plan, product: tuple[int, int]) -> bool:
    """Whether the finest integral of 32 bits has too few counts for increments, or for the smallest of a
    steady error of one count."""
    whole = plan.gain_shift + plan.integrator.to_output
    tried = [by for by in range(whole + 1) if by >= whole - 32]
    by = next((by for by in tried if fits(plan, product, by, whole - by, 32)), None)
    if by is None:
        return True
    back, direct = plan.feedback, plan.direct
    still = sum(direct.values) if direct else 0.0
    still = abs(still / (1.0 + sum(back.table.values)) if back else still)
    box, schedule = plan.tuning, plan.schedule
    least = min(abs(g) for g in (schedule.gains if schedule else (plan.constant_gain,)) if g)
    slowest = (
        still * plan.error.lsb * least * plan.gain.lsb * (box.factor.low * box.factor.lsb if box else 1.0)
    )
    few = 0.0 < slowest < 16 * plan.product.lsb * 2**by
    return few or worst(shifted(product, by)) < 2**16


@of_seeds
def test_what_a_recursion_is_proved_to_reach_is_its_inputs_norm_and_its_roundings(seeds):
    """In 16 bits, where single counts are seen: of the integer weights, run sample by sample."""
    seen = 0
    for plan in (p for p in plans(seeds, "q15") if p.feedback):
        table, lsb, direct = plan.feedback.table, plan.filtered.lsb, plan.direct
        held = replace(truth(plan), den=_held(table))
        M, carried = held.norm([1.0]), held.norm([1.0, -1.0])
        if M is None:
            continue
        rest, e = held.den.total, worst(span(plan.error))
        reach = held.norm(_held(direct).response(512) if direct else [0.0]) * e * plan.error.lsb / lsb
        if plan.inner:
            reach += M * worst(span(plan.inner.state)) * plan.inner.state.lsb / lsb
        sums = [s for s in (direct, table) if s]
        aligned = sum(part.align > 0 for s in sums for part in (*s.blocks, *s.banks))
        drives = sum(abs(c) * b.drive.lsb for s in sums for b in s.banks for c in b.values) / plan.wide.lsb
        each = (0.5 * (aligned + bool(plan.inner)) + drives) * plan.wide.lsb / lsb
        exact = (sum(direct.values) if direct else 0.0) / rest * plan.error.lsb / lsb
        reset = 0.5 + abs(exact - plan.feedback.steady / 2**plan.feedback.steady_shift) * e
        reach += M * each + 0.5 * carried + reset * max(1.0, M * rest)
        proved = next(p.worst for p in plan.proofs if p.node == "v")
        assert reach * (1.0 - 1e-6) <= proved <= reach * (1.0 + 1e-5) + 1.0
        seen += 1
    assert seen >= 2


def _held(table: Sum) -> Weights:
    """The integer weights of a sum; 1 at lag 0 of a recursion's."""
    taps = np.array([0.0] * table.first + list(table.values))
    if table.first:
        taps[0] = 1.0
    modes = [(b.differences, q, c) for b in table.banks for q, c in zip(b.real_rates, b.values)]
    return Weights(taps, taps, tuple(modes))


@fixed
def test_a_flat_schedule_is_proved_likewise(arithmetic):
    """Its slopes are 0, and so is their product."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))
    flat = simple(TransferFunction([(1.0, 0.0)]), gain=GainSchedule((0.2, 0.7), (2.0, 2.0)), ranges=ranges)
    plan = planned(flat, arithmetic)
    proofs = {proof.node: proof.worst for proof in plan.proofs}
    assert proofs == reached(plan, proofs["v"]) and proofs["slope product"] == 0
