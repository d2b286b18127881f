"""Proofs from their ground: intervals against every number in them, a box of parameters at its corners.

Red when an interval lacks a number that can come, or has one that cannot.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, Tunable
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.banks import departure
from focgen.plan.build import build_plan
from focgen.plan.formats import Interval, shift
from focgen.plan.stability import inverse
from tests.conftest import paper_controller
from tests.controllers import simple

SPANS = [Interval(*ends) for ends in ((-7, 5), (-3, -3), (0, 6), (2, 9), (-9, -2), (-1, 0))]


def numbers(span: Interval) -> range:
    return range(span.low, span.high + 1)


def spanned(values) -> Interval:
    found = list(values)
    return Interval(min(found), max(found))


@pytest.mark.parametrize(("a", "b"), list(product(SPANS, SPANS)))
def test_an_operation_gives_what_its_numbers_give(a, b):
    pairs = list(product(numbers(a), numbers(b)))
    assert a + b == spanned(x + y for x, y in pairs) and a - b == spanned(x - y for x, y in pairs)
    assert a * b == spanned(x * y for x, y in pairs)
    assert a.within(b) == spanned(max(b.low, min(x, b.high)) for x in numbers(a))
    assert a.hull(b.low) == spanned([*numbers(a), b.low]) and a.worst == max(map(abs, numbers(a)))
    for by in range(4):
        assert a.shifted(by) == spanned(np.floor(x / 2**by + 0.5) for x in numbers(a))


@pytest.mark.parametrize("u", SPANS)
@pytest.mark.parametrize(("up", "spare"), [(0, 1), (2, 3), (3, 0)])
def test_a_mode_departs_from_its_mean_as_far_as_their_ranges_let_it(u, up, spare):
    mean = Interval(u.low * 2**up - spare, u.high * 2**up + spare)
    farthest = max(abs(x * 2**up - y) for x, y in product(numbers(u), numbers(mean)))
    assert departure(u, mean, up) == Interval(-farthest, farthest)


@pytest.mark.parametrize("sign", (1.0, -1.0))
def test_what_a_numerator_leaves_out_is_in_the_norm_behind_a_recursion(sign):
    """(1 + 0.2 z^-9) / (1 - 0.9 z^-1), the second weight left out: no more than 10 and 2."""
    found = inverse(np.array([1.0, -0.9]))
    response = 0.9 ** np.arange(2000)
    true = np.abs(response + sign * 0.2 * np.concatenate([np.zeros(9), response[:-9]])).sum()
    bound = found.norm_after(np.array([1.0]), 0.2)
    assert true <= bound <= 12.001 and found.norm_after(np.array([1.0])) == pytest.approx(10.0, rel=1e-5)


BOX = Tunable((0.25, 2.0), (0.0, 1.0), (5.0, 10.0))


@pytest.mark.parametrize("arithmetic", ("q31", "q15"))
def test_the_box_of_parameters_is_proved_at_its_corners(arithmetic):
    """Each gain has a factor of its own: a slope is steepest between unlike ones."""
    plan = build_plan(replace(paper_controller(20), tunable=BOX), arithmetic, tunable=True)
    box, proofs = plan.tuning, {proof.node: proof.worst for proof in plan.proofs}
    corners = (int(box.factor.low), int(box.factor.high))
    made = [[f * int(n) for f in corners] for n in box.nominal]
    gains = [[shift(p, box.to_gain) for p in both] for both in made]
    half = (1 << box.to_gain) >> 1
    assert proofs["tuned gain product"] == max(abs(p) for both in made for p in both) + half
    steep = [
        (max(abs(b - a) for a, b in product(*pair)) * abs(int(per)), (1 << by) >> 1)
        for pair, per, by in zip(pairwise(gains), box.reciprocals, box.to_slopes)
    ]
    assert proofs["tuned slope product"] == max(s for s, _ in steep) + max(h for _, h in steep)


@pytest.mark.parametrize("wrong", ({"tolerance": 1}, {"horizon": 1000.5}))
def test_either_number_of_a_memory_is_held_to_its_type(wrong):
    with pytest.raises(PlanError, match="the tolerance .* and the horizon"):
        build_plan(paper_controller(20), "q31", memory="exponential", **wrong)


@pytest.mark.parametrize("arithmetic", ("q31", "q15"))
def test_a_sum_reaches_what_its_worst_pasts_give(arithmetic):
    """Errors of unlike ends, so that no end stands for the other."""
    ranges = ControllerRanges((-1.0, -0.1), (-1.0, 1.0), (-10.0, 10.0))
    controller = simple(TransferFunction([(1.0, 0.0), (0.3, 0.5)]), ranges=ranges, length=200)
    plan = build_plan(controller, arithmetic)
    low, high = int(plan.error.low), int(plan.error.high)
    assert -low != high and len(plan.direct.blocks) > 3
    for least, most, reached in ((low, high, plan.direct.total.low), (high, low, plan.direct.total.high)):
        sums = [sum(int(w) * (least if w > 0 else most) for w in b.weights) for b in plan.direct.blocks]
        assert reached == sum(shift(total, b.align) for total, b in zip(sums, plan.direct.blocks))
