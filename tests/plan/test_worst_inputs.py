"""The inputs that are said to be a node's worst, beside every other input of their length.

Red when another input takes the node further, a longer one much further, or a schedule to a larger gain.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan, Sum
from focgen.plan.values import scheduled_gain
from focgen.plan.worst import worst_case_input
from tests.controllers import simple
from tests.plan.derived import Weights, plans
from tests.plan.ledger import shift

ARITHMETICS = ("q15", "q31", "f32", "f64")
COUNT = 1 << 12
BEHIND = ("v", "x", "gain product", "increment")


def weights(table: Sum | None, block=None, bank=None) -> np.ndarray:
    """What a sum, or one part of it, answers to a unit sample."""
    if table is None:
        return np.zeros(COUNT)
    taps = np.zeros(max(table.last + 1, 2))
    for b in table.blocks:
        if bank is None and block in (None, b):
            taps[b.first : b.last + 1] = [w * b.lsb for w in b.weights]
    banks = [b for b in table.banks if block is None and bank in (None, b)]
    modes = [(b.differences, q, c) for b in banks for q, c in zip(b.real_rates, b.values)]
    return Weights(taps, taps, tuple(modes)).response(COUNT)


def filtered(plan: Plan) -> np.ndarray:
    """From e to v."""
    p = weights(plan.direct)
    if plan.inner:
        r = weights(plan.inner.rest)
        p = p + np.cumsum(r + np.concatenate([[0.0], r[:-1]]))
    if plan.feedback is None:
        return p
    return lfilter([1.0], np.concatenate([[1.0], weights(plan.feedback.table)[1:]]), p)


def responses(plan: Plan) -> dict[str, np.ndarray]:
    """By node, where its worst case is of its own sum, or of v."""
    found, v = {}, filtered(plan)
    for table in (plan.direct, plan.inner and plan.inner.rest):
        if table:
            found |= {f"{table.name}[{b.first}..{b.last}]": weights(table, b) for b in table.blocks}
            found |= {f"{table.name} bank {i} sum": weights(table, bank=b) for i, b in enumerate(table.banks)}
            found[f"{table.name} total"] = weights(table)
    if plan.inner:
        found["inner sum"] = found["rest total"]
    if plan.feedback and not plan.states:
        table = plan.feedback.table
        for b in table.blocks:
            found[f"feedback[{b.first}..{b.last}]"] = lfilter(np.trim_zeros(weights(table, b), "b"), [1.0], v)
        found["feedback total"] = lfilter(np.trim_zeros(weights(table), "b"), [1.0], v)
    if not plan.states and plan.inner is None:
        found["integrator sum"] = v + np.concatenate([[0.0], v[:-1]])
    return found | dict.fromkeys(BEHIND, v)


@pytest.mark.parametrize("seeds", [range(a, a + 10) for a in range(0, 40, 10)], ids=lambda s: str(s.start))
@pytest.mark.parametrize("arithmetic", ("q15", pytest.param("f64", marks=pytest.mark.long)))
def test_no_input_of_its_length_takes_a_node_further(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        ref, meas = plan.reference, plan.measurement
        low, high = ref.low - meas.high, ref.high - meas.low
        nodes = ["v"] if plan.floating else [proof.node for proof in plan.proofs]
        for node, response in responses(plan).items():
            if node not in nodes or not response.any():
                continue
            raw = worst_case_input(plan, node)
            n = raw.samples
            own, e = response[:n], (raw.ref - raw.meas)[:, ::-1]
            made, ends = e[:, : len(own)] @ own, np.outer(own, (low, high))
            most, least = ends.max(axis=1).sum(), ends.min(axis=1).sum()
            tiny = 1e-9 * np.abs(ends).sum()
            assert abs(made[0] - most) <= tiny and abs(made[1] - least) <= tiny, (plan.name, node)
            assert long_enough(plan, node, response, n), (plan.name, node)
            assert raw.lanes == 2 and (raw.sched is None) == (plan.schedule is None)


def long_enough(plan: Plan, node: str, response: np.ndarray, samples: int) -> bool:
    """All taps; of a recursion most of what it answers, where that dies away; of modes 400 samples."""
    if plan.states:
        return samples >= 400 or "[" in node
    if node.startswith(("direct", "rest", "inner")) or not (plan.feedback or plan.inner):
        return samples >= np.flatnonzero(response)[-1] + 1
    if plan.feedback is None:
        return samples >= plan.error_lags + 1
    size = np.abs(response)
    slow = plan.inner or size[-64:].max() > 1e-6 * size.max()
    return slow or samples >= plan.error_lags + 1 + 8 * plan.filtered_lags


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_it_runs_at_the_largest_gain_that_there_is(arithmetic):
    """Whichever segment has it; of the slope's product likewise. With factors they are the largest."""
    tried = 0
    for plan in plans(range(20), arithmetic):
        node = "v" if plan.floating else "gain product"
        raw = worst_case_input(plan, node)
        if plan.tuning:
            assert [tune.lane for tune in raw.tunes] == [0, 1] and {tune.sample for tune in raw.tunes} == {0}
            for tune in raw.tunes:
                assert tune.params.gain == (plan.tuning.factor.high,) * len(plan.tuning.nominal)
                assert (tune.params.u_min, tune.params.u_max) == (plan.output.low, plan.output.high)
        else:
            assert not raw.tunes
        if plan.schedule is None:
            continue
        signal, (s,) = plan.schedule.signal, set(raw.sched.ravel().tolist())
        assert signal.low <= s <= signal.high
        every = (
            range(signal.low, signal.high + 1)
            if arithmetic == "q15"
            else np.linspace(signal.low, signal.high, 4001)
        )
        sizes = np.abs(scheduled_gain(plan, np.array(every).astype(int if arithmetic[0] == "q" else float)))
        there = np.abs(scheduled_gain(plan, np.array([s])))[0]
        assert there >= (1.0 - (1e-5 if plan.floating else 0.0)) * sizes.max() - (plan.error.bits == 32)
        tried += 1
        if arithmetic == "q15" and any(proof.node == "slope product" for proof in plan.proofs):
            check_slope(plan)
    assert tried > 4


def check_slope(plan: Plan) -> None:
    """Every place of every segment."""
    schedule, (s,) = plan.schedule, set(worst_case_input(plan, "slope product").sched.ravel().tolist())
    points, best, here = schedule.breakpoints, 0, 0
    for p, q, slope in zip(points, points[1:], schedule.slopes):
        best = max(best, abs(slope) * (q - 1 - p))
        here = abs(slope) * (s - p) if p <= s < q else here
    assert here == best


NEGATIVE = ControllerRanges((-1.0, -0.5), (-0.25, 1.0), (-10.0, 10.0), (0.0, 1.0))


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_errors_of_one_sign_have_a_worst_case_too(arithmetic):
    """e from -2 to -0.25: the highest sum has its negative weights at -2 and the others at -0.25."""
    plan = build_plan(simple(TransferFunction([(1.0, 0.5)]), ranges=NEGATIVE, length=30), arithmetic)
    raw = worst_case_input(plan, "v")
    e, own = (raw.ref - raw.meas)[:, ::-1] * plan.error.lsb, np.array(plan.direct.values)
    assert np.array_equal(e[0] == -0.25, own > 0.0) and np.array_equal(e[1] == -2.0, own > 0.0)


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
@pytest.mark.parametrize(
    "ranges", [((0.2, 1.0), (-1.0, 0.5)), ((-1.0, 0.1), (-0.3, 1.0)), ((0.5, 1.0), (-1.0, 0.25))]
)
def test_an_integral_starts_at_the_limit_that_it_is_driven_against(arithmetic, ranges):
    (r0, r1), (m0, m1) = ranges
    made = ControllerRanges(*ranges, (-2.0, 5.0))
    plan = build_plan(simple(TransferFunction([(1.0, 0.0)]), ranges=made, integrator=True), arithmetic)
    resets = worst_case_input(plan, "integrator sum").resets
    assert [(r.lane, r.sample, r.u0) for r in resets] == [(0, 0, plan.output.high), (1, 0, plan.output.low)]
    for r in resets:
        assert plan.reference.low <= r.ref <= plan.reference.high
        assert plan.measurement.low <= r.meas <= plan.measurement.high
        assert r.ref == r.meas or max(r0, m0) > min(r1, m1)
    assert worst_case_input(plan, "gain product").resets == ()


def test_a_steep_segment_is_run_where_its_product_is_largest():
    schedule = GainSchedule((0.0, 0.2, 0.9, 1.0), (3.0, 1.0, 1.5, 1.4))
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))
    plan = build_plan(simple(TransferFunction([(1.0, 0.0)]), gain=schedule, ranges=ranges), "q15")
    check_slope(plan)
    made, points = plan.schedule, plan.schedule.breakpoints
    s = int(worst_case_input(plan, "gain product").sched[0, 0])
    last = made.gains[0] + shift(made.slopes[0] * (s - points[0]), made.slope_shifts[0])
    assert last == max(made.gains)
