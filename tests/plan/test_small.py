"""Slopes at the end of their word, and signals so small that products underflow.

Red when a slope that fits is refused, or a bound forgets what underflow takes.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.formats import WORDS
from focgen.plan.gains import _slope
from focgen.plan.plan import Plan
from focgen.plan.rounding import products_error
from focgen.plan.scenario import Scenario, to_raw
from tests.controllers import simple
from tests.plan.derived import plans, truth
from tests.plan.ledger import reached

UNIT = TransferFunction([(1.0, 0.0)])
RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_a_slope_is_as_steep_as_its_word(arithmetic):
    word = WORDS[arithmetic]
    for run in (1, 2, 3, 1000):
        assert _slope(run * word.limit, run, word) == (word.limit, 0)
        assert _slope(-run * word.limit, run, word) == (-word.limit, 0)
        assert _slope(run * word.limit + 1, run, word) is None and _slope(0, run, word) == (0, 0)
        for rise in (1, -1, 7, -1234, run * word.limit // 2, run * word.limit - 1):
            count, by = _slope(rise, run, word)
            exact = Fraction(rise << by, run)
            assert abs(count - exact) <= Fraction(1, 2) and abs(count) <= word.limit
            finer = (2 * exact.numerator * 2 + exact.denominator) // (2 * exact.denominator)
            assert by == word.sum_bits - 2 or abs(finer) > word.limit
    assert _slope(5, 0, word) is None and _slope(5, -1, word) is None


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_a_gain_leaves_three_counts_to_its_slopes(arithmetic):
    top = WORDS[arithmetic].limit
    for counts, halved in ((top - 3, False), (top - 2, True)):
        lsb = 2.0 ** -(top.bit_length())
        for gain in (counts * lsb, GainSchedule((0.0, 1.0), (0.5, -counts * lsb))):
            made = build_plan(simple(UNIT, gain=gain, ranges=RANGES), arithmetic)
            assert made.gain.lsb == lsb * (2.0 if halved else 1.0)


TINY = {"f32": 2.0**-126, "f64": 2.0**-1022}


def scaled(controller, size: float):
    """All signals times ``size``, a power of two; weights stay as they are."""
    ends = {
        name: tuple(x * size for x in getattr(controller.ranges, name))
        for name in ("reference", "measurement")
    }
    output = tuple(x * size for x in controller.ranges.output)
    return replace(
        controller, ranges=replace(controller.ranges, **ends, output=output), tunable=None, slew_limit=None
    )


def lost(plan: Plan) -> float:
    """Up to the least normal number with every operation of a sum, and as much again; of modes what their
    means gather until it is forgotten; behind 1/A."""
    true, tiny, whole = truth(plan), TINY[plan.arithmetic], 0.0
    for made in plan.sums:
        whole += 2.0 * made.taps + 4.0
        for bank in made.banks:
            whole += bank.modes
            whole += sum(
                abs(c) * (6.0 if bank.compensated else 3.0) / q for c, q in zip(bank.values, bank.real_rates)
            )
    return whole * tiny * (true.norm([1.0]) if true.den else 1.0)


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_what_underflows_is_in_the_bound(arithmetic):
    """Signals of some thousand least normal numbers: hardly anything but these costs anything."""
    seen = 0
    modes = simple(TransferFunction([(1.32, 0.6), (1.0, 0.0)]))
    modes = build_plan(modes, arithmetic, memory="exponential", tolerance=0.05, horizon=100)
    for plan in (modes, *plans(range(10), arithmetic), *plans(range(10, 20), arithmetic)):
        controller = plan.controller
        largest = max(map(abs, (*controller.ranges.reference, *controller.ranges.measurement)))
        size = 2.0 ** round(np.log2(TINY[arithmetic] / largest)) * 2.0**16
        given = {} if plan.memory == "short" else {"memory": "exponential", "tolerance": 0.05, "horizon": 100}
        if (plan.horizon or 0) > 100 or plan.inner or (truth(plan).den and truth(plan).norm([1.0]) is None):
            continue
        try:
            small = build_plan(replace(scaled(controller, size), setpoint_filter=None), arithmetic, **given)
        except PlanError as reason:
            assert "rounding in" in str(reason), "it may cost as much as the signal"
            continue
        seen += 1
        expected = lost(small)
        part = dict(small.error_bound.parts)["rounding"] / max(map(abs, controller.gains))
        assert 0.4 * expected <= part <= 2.1 * expected
    assert seen >= 6


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_bounds_hold_where_products_underflow(arithmetic):
    """Inputs of a few hundred least numbers: beside sums in fractions."""
    size, rng = TINY[arithmetic] * 2.0**-3, np.random.default_rng(4)
    ranges = ControllerRanges((-size, size), (0.0, 0.0), (-10.0 * size, 10.0 * size))
    made = simple(TransferFunction([(0.3, 0.5), (1.0, 0.0)]), ranges=ranges, length=9, gain=0.9)
    with pytest.raises(PlanError, match="may cost"):
        build_plan(made, arithmetic)
    ranges = replace(
        ranges, reference=(-(2.0**12) * size, 2.0**12 * size), output=(-(2.0**15) * size, 2.0**15 * size)
    )
    plan = build_plan(replace(made, ranges=ranges), arithmetic)
    ref = rng.uniform(*ranges.reference, (1, 60)) * 10.0 ** -rng.uniform(0.0, 4.0, (1, 60))
    trace = execute(plan, to_raw(plan, Scenario(ref, np.zeros_like(ref))))
    weights = [Fraction(float(w)) for w in truth(plan).direct.taps]
    x = [Fraction(0)] * 9 + [Fraction(float(v)) for v in ref[0]]
    for k in range(60):
        exact = Fraction(0.9) * sum(w * x[9 + k - j] for j, w in enumerate(weights))
        assert abs(Fraction(float(trace.d[0, k])) - exact) <= Fraction(plan.error_bound.operator)


def test_products_just_above_a_power_of_two_have_its_last_place():
    """(1 + 2^-42) x for x up to 1, in double: some are rounded by more than a number below 1 could be."""
    w, rng = 1.0 + 2.0**-42, np.random.default_rng(6)
    errors = []
    for x in (1.0 - rng.integers(0, 900, 400) * 2.0**-53).tolist():
        errors.append(abs(Fraction(w * x) - Fraction(w) * Fraction(x)))
    assert 2.0**-54 < max(errors) <= products_error(np.array([w]), 1.0, 2.0**-53) <= 2.0**-53


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
@pytest.mark.parametrize("output", [(-1.0, 10.0), (-10.0, 1.0)])
def test_an_integral_alone_reaches_its_own_ends(arithmetic, output):
    """Nothing is added to it: the proof of p is of the end that is farther, and of no count more or less."""
    made = simple(TransferFunction([(1.0, -0.5)]), ranges=replace(RANGES, output=output), length=9)
    plan = build_plan(made, arithmetic)
    proofs = {proof.node: proof.worst for proof in plan.proofs}
    assert plan.direct is None and proofs == reached(plan, proofs["v"])


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_formats_that_nothing_bounds_go_both_ways(arithmetic):
    plan = build_plan(simple(UNIT, integrator=True), arithmetic)
    for form in (plan.wide, plan.filtered, plan.product, plan.direct.total, plan.direct.blocks[0].sum):
        assert (form.low, form.high) == (-np.inf, np.inf)
    assert plan.increment.low < 0 < plan.increment.high and plan.gain.low == plan.gain.high > 0
