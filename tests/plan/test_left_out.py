"""What a memory leaves out, beside sums of what is left out.

Red when the truncation of a plan is less than that, or more than its derivation gives.
"""

from __future__ import annotations

import cmath
import math
from decimal import Context, Decimal, localcontext

import numpy as np
import pytest
from scipy.signal import lfilter

from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import normaliser
from focgen.plan.plan import Plan
from tests.controllers import simple
from tests.plan.derived import Truth, dressed, planned, truth


def tail(order: float, length: int) -> float:
    """Σ_{j>L} |w_j| of (1 − z)^β: the weights beyond β have one sign, and all of them add up to 0."""
    with localcontext(Context(prec=50)):
        weight, partial, early, beta = Decimal(1), Decimal(0), Decimal(0), Decimal(order)
        for j in range(max(length, int(order) + 1) + 1):
            partial += weight
            early += abs(weight) if j > length else 0
            weight *= 1 - (beta + 1) / (j + 1)
        return float(early + abs(partial)) if beta % 1 else float(early)


def parts(plan: Plan) -> dict[str, list[tuple[float, float]]]:
    """The realised polynomials, as (|c h^−β|, β)."""
    h, lowest = plan.sample_time, min(t.order for t in plan.controller.transfer.den)
    size = lambda c, o: (abs(c) * h**-o, o)
    whole = lambda x: float(round(x)) if abs(x - round(x)) < 1e-9 else x
    num = [(t.coefficient, whole(t.order - lowest)) for t in plan.controller.transfer.num]
    return {
        "direct": [size(c, o) for c, o in num if o >= 0],
        "rest": [size(0.5 * h * c, whole(o + 1.0)) for c, o in num if o < 0],
        "den": [size(t.coefficient, whole(t.order - lowest)) for t in plan.controller.transfer.den],
    }


def scale_of(plan: Plan) -> float:
    """The weight of the present v."""
    h, lowest = plan.sample_time, min(t.order for t in plan.controller.transfer.den)
    leads = {m.order: m.lead for m in plan.memories}
    orders = [(t.coefficient, t.order - lowest) for t in plan.controller.transfer.den]
    return abs(sum(c * h**-o * leads.get(o, 1.0) for c, o in orders))


def expected(plan: Plan, missed: dict[str, float], true: Truth) -> float:
    """Without feedback a sum's tail, and an integral's drift to its clamp; with it both behind 1/A∞."""
    (r0, r1), (m0, m1) = plan.controller.ranges.reference, plan.controller.ranges.measurement
    e, gain = (
        max(abs(r0 - m1), abs(r1 - m0)),
        max(map(abs, plan.controller.gains)) * plan.controller.factors[1],
    )
    drift = true.limits[1] - true.limits[0] if missed["rest"] else 0.0
    if true.den is None:
        return gain * (missed["direct"] * e + drift)
    v = (true.norm(true.direct.taps) if true.direct else 0.0) * e + true.norm([1.0]) * max(
        map(abs, true.limits)
    )
    return gain * endless(plan) * (missed["direct"] * e + missed["den"] * v + drift)


def endless(plan: Plan) -> float:
    """‖1/A∞‖₁ ≤ M / (1 − M t) of the first table that is long enough."""
    for length in (plan.length, 4096, 65536):
        whole = np.zeros(length + 1)
        for c, o in ((t.coefficient, t.order) for t in plan.controller.transfer.den):
            o -= min(t.order for t in plan.controller.transfer.den)
            whole += (
                c * plan.sample_time**-o * np.cumprod([1.0, *(1.0 - (o + 1.0) / np.arange(1, length + 1))])
            )
        made = np.abs(lfilter([1.0], np.trim_zeros(whole / whole[0], "b"), np.eye(1, 8192)[0])).sum()
        left = sum(c * tail(o, length) for c, o in parts(plan)["den"]) / abs(whole[0])
        if made * left < 1.0:
            return made / (1.0 - made * left)
    return math.inf


@pytest.mark.parametrize("seeds", [range(a, a + 10) for a in range(0, 40, 10)], ids=lambda s: str(s.start))
def test_short_memory_leaves_out_its_tails(seeds):
    seen = 0
    for plan in filter(None, (planned(dressed(seed), "f64") for seed in seeds)):
        scale, true = scale_of(plan), truth(plan)
        if true.den and true.norm([1.0]) is None:
            continue
        missed = {
            k: sum(c * tail(o, plan.length) for c, o in terms) / scale for k, terms in parts(plan).items()
        }
        value, bound = expected(plan, missed, true), plan.error_bound
        if math.isfinite(value):
            near = 2e-3 if true.den else 1e-6  # a slow recursion has not died away
            assert value * (1.0 - near) <= bound.truncation <= value * (1.0 + near)
            seen += 1
        assert bound.within_horizon is None
    assert seen >= 6


@pytest.mark.parametrize("seed", (0, 1, 2, 3))
def test_exponential_memory_leaves_out_what_its_certificate_says(seed):
    plan = planned(dressed(seed), "f64", memory="exponential", tolerance=0.05, horizon=100)
    scale, bound = scale_of(plan), plan.error_bound
    for told, past in ((bound.truncation, True), (bound.within_horizon, False)):
        proved = {m.order: m.certificate.output_error(1.0, past) for m in plan.memories}
        missed = {k: sum(c * proved.get(o, 0.0) for c, o in v) / scale for k, v in parts(plan).items()}
        assert told == pytest.approx(expected(plan, missed, truth(plan)), rel=1e-6)


BAND = [
    ([(1.32, 0.6), (1.0, 0.0)], [(1.0, 0.0)]),
    ([(1.0, 0.5), (0.2, -0.7)], [(1.0, 0.0)]),
    ([(0.01, 1.4), (1.0, 0.0)], [(0.05, 1.0), (0.4, 0.6), (1.0, 0.0)]),
    ([(1.0, 0.0)], [(1e-4, 2.0), (0.02, 1.0), (0.3, 0.5), (1.0, 0.0)]),
]


@pytest.mark.parametrize(
    ("num", "den"), [BAND[0], BAND[3], *(pytest.param(*one, marks=pytest.mark.long) for one in BAND[1:3])]
)
def test_in_a_band_it_is_what_tolerances_can_do_to_the_quotient(num, den):
    """Line by line, each power off by its tolerance the way that does most; within a hundredth of that."""
    ranges = ControllerRanges((-1.0, 0.5), (-2.0, 1.0), (-10.0, 10.0))
    given = dict(memory="exponential", operator="continuous", tolerance=0.02, band=(1.0, 40.0))
    plan = build_plan(simple(TransferFunction(num, den), gain=-1.7, ranges=ranges), "f64", **given)
    off, h, worst = {m.order: m.tolerance for m in plan.memories}, plan.sample_time, 0.0
    assert off and all(0.0 < t <= 0.02 for t in off.values())
    for w in np.exp(np.linspace(0.0, math.log(40.0), 3000)).tolist():
        power = lambda o, w=w: (1j * w) ** o if o % 1 else ((1.0 - cmath.exp(-1j * w * h)) / h) ** o
        size = lambda terms, w=w: sum(abs(c) * w**o for c, o in terms)
        wrong = lambda terms, w=w: sum(off.get(o, 0.0) * abs(c) * w**o for c, o in terms)
        rest = [(c, o + 1.0) for c, o in num if o < 0]
        direct = [(c, o) for c, o in num if o >= 0]
        rest = [(c, next((k for k in off if abs(k - o) < 1e-9), o)) for c, o in rest]
        b, a = wrong(direct) + wrong(rest) / w, wrong(den)
        whole = abs(sum(c * power(o) for c, o in den))
        worst = max(worst, (b + (size(direct) + size(rest) / w) / whole * a) / (whole - a))
    value = 1.7 * 2.5 * worst
    assert value * (1.0 - 1e-6) <= plan.error_bound.truncation <= 1.01 * value


@pytest.mark.parametrize("den", [den for _, den in BAND if len(den) > 1])
def test_the_weight_of_the_present_v_has_the_memories_leads(den):
    """A fitted power weighs the present sample with a number of its own."""
    given = dict(memory="exponential", operator="continuous", tolerance=0.02, band=(1.0, 40.0))
    plan = build_plan(simple(TransferFunction([(1.0, 0.0)], den)), "f64", **given)
    leads = {m.order: m.lead for m in plan.memories}
    assert min(abs(lead - 1.0) for lead in leads.values()) > 0.01
    assert normaliser(plan.controller, leads) == pytest.approx(scale_of(plan), rel=1e-12)
    assert normaliser(plan.controller, {}) == pytest.approx(sum(c * 0.01**-o for c, o in den), rel=1e-12)
