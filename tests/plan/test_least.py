"""What integrals hold and act on, and what is said of it, beside runs and fractions.

Red when an integral is coarser than 64 bits allow, or a number in a remark is not what happens.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule, Tunable
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.counts import MOST, NOTHING, counts_of, taken_in, up_of, values_of
from focgen.plan.ending import endings
from focgen.plan.integrals import added_up
from focgen.plan.least_error import coarse, smallest_error
from focgen.plan.plan import Format, Plan
from focgen.plan.remarks import remarks
from focgen.plan.scenario import Reset, Scenario
from tests.controllers import simple
from tests.plan.derived import dressed, planned

ARITHMETICS = ("q15", "q31", "f32", "f64")
UNIT = TransferFunction([(1.0, 0.0)])


def integral(gain: float, step: float = 1e-4, output: float = 12.0, **more):
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-output, output))
    given = {"integrator": True, "ranges": ranges, "gain": gain, "sample_time": step, **more}
    return simple(given.pop("transfer", UNIT), **given)


def test_integrals_in_counts_are_as_fine_as_61_bits_allow():
    """Ends, and the largest increment: as far as every weight can take it, or a reset."""
    seen = set()
    for seed in range(40):
        plan = planned(dressed(seed), "f32")
        if plan is None or not plan.counted:
            continue
        e = max(-plan.error.low, plan.error.high)
        if plan.inner:
            r = sum(abs(w) for w in plan.inner.rest.values) * e
            seen.add(check_counts(plan, plan.inner.state, r))
        if plan.integrator and plan.feedback is None:
            z = plan.inner.state if plan.inner else None
            v = sum(map(abs, plan.direct.values)) * e if plan.direct else 0.0
            v += max(-z.low, z.high) * z.lsb if z else 0.0
            d = max(map(abs, (plan.gain.low, plan.gain.high))) * v
            seen.add(check_counts(plan, plan.integrator.state, d))
            assert plan.increment.lsb == plan.integrator.state.lsb
            assert (plan.increment.low, plan.increment.high) == (-MOST, MOST)
    assert seen == {"ends", "increments"}
    tiny = build_plan(integral(1e-30, output=1e-30), "f32")
    assert tiny.integrator.state.lsb == 2.0**-126, "a count is a normal float"


@pytest.mark.parametrize("places", (-4, 0, 1, 4))
def test_an_increment_is_never_more_than_it_may_be(places):
    """Just above a power of two, or a share of a millionth that its bound may be off by below it."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-1e-5, 1e-5))
    gain = 1.0 + places * 2.0**-23
    plan = build_plan(integral(gain, step=2.0**-10, ranges=ranges), "f32")
    increment = 2.0 * float(np.float32(gain * 2.0**-11))
    assert increment <= MOST * plan.integrator.state.lsb and plan.integrator.state.lsb == 2.0**-70


def check_counts(plan: Plan, state: Format, increment: float) -> str:
    """Which of both decides; the largest float is less than twice 2^60 counts."""
    ends = max(-state.low, state.high) * state.lsb
    far = max(ends, increment)
    assert far <= MOST * state.lsb * (1.0 + 1e-9) and 2.0 * far * (1.0 + 2e-6) >= MOST * state.lsb
    assert state.ctype == "int64_t"
    return "ends" if ends > increment else "increments"


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_the_ends_of_an_integral_in_counts_are_the_outputs(arithmetic):
    plan = build_plan(integral(1.0, output=0.7), arithmetic)
    state, end = plan.integrator.state, np.float32(0.7) if arithmetic == "f32" else 0.7
    assert [Fraction(x) * Fraction(state.lsb) for x in (state.low, state.high)] == [
        -Fraction(float(end)),
        Fraction(float(end)),
    ]
    assert plan.counted == (arithmetic == "f32")


def test_what_rounding_adds_up_to_is_told_of_integrators_in_counts_alone():
    plan = build_plan(integral(3.0), "f32")
    assert added_up(plan) == pytest.approx(1e8 * plan.integrator.state.lsb / 2.0**-20, rel=1e-12)
    for other in ("q15", "q31", "f64"):
        assert added_up(build_plan(integral(3.0), other)) is None
    inner = simple(TransferFunction([(1.0, -0.5)]))
    assert added_up(build_plan(inner, "f32")) is None and build_plan(inner, "f32").counted


def least_by_running(plan: Plan, which: str) -> float:
    """The least raw steady error that moves an integral, either way, after a reset to it."""

    def moved(e):
        e = np.full((1, 2), e, np.float32 if plan.error.ctype == "float" else float if plan.floating else int)
        raw = Scenario(e, np.zeros_like(e), None, (Reset(0, 0, e[0, 0], e.dtype.type(0), e.dtype.type(0)),))
        end = endings(plan, raw)[1][0]
        return any(getattr(end, each) != 0 for each in which.split())

    if plan.floating:
        low, high = 1e-30, 1.0
        while high / low > 1.0 + 1e-6:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if moved(middle) and moved(-middle) else (middle, high)
        return high
    n = next(n for n in range(1, 3000) if moved(n) and moved(-n))
    return n * plan.error.lsb


INNER = TransferFunction([(1e-3, -1.0)])


@pytest.mark.parametrize("arithmetic", ("q15", "q31", "f32"))
@pytest.mark.parametrize("output", (12.0, 3000.0))
def test_the_smallest_error_that_an_inner_integral_acts_on(arithmetic, output):
    plan = build_plan(integral(1.0, output=output, transfer=INNER, integrator=False), arithmetic)
    assert smallest_error(plan) == pytest.approx(least_by_running(plan, "inner"), rel=1e-5)


@pytest.mark.parametrize("arithmetic", ("q15", "q31", "f32"))
@pytest.mark.parametrize("transfer", ([(0.03, 0.0)], [(0.4, 0.0), (0.01, 0.5)]))
@pytest.mark.parametrize("den", ([(1.0, 0.0)], [(0.001, 1.0), (2.0, 0.0)]))
def test_the_smallest_error_that_an_integrator_acts_on(arithmetic, transfer, den):
    plan = build_plan(integral(-1e-4, transfer=TransferFunction(transfer, den), length=12), arithmetic)
    if arithmetic == "f32":
        assert smallest_error(plan) == pytest.approx(least_by_running(plan, "integral"), rel=1e-4)
    else:
        least = smallest_error(plan) / plan.error.lsb
        assert least == round(least) and abs(least - least_by_running(plan, "integral") / plan.error.lsb) <= 1


@pytest.mark.parametrize(("arithmetic", "gain"), [("q31", 1.0), ("f32", 1.0), ("f32", 1e-6)])
def test_of_two_integrals_the_inner_one_is_told(arithmetic, gain):
    """It may cancel an error as long as it stands, and then the integrator does not move either."""
    both = integral(gain, transfer=TransferFunction([(1.0, 0.0), (0.01, -0.5)]), length=30)
    plan = build_plan(both, arithmetic)
    least, seen = smallest_error(plan), least_by_running(plan, "inner")
    if arithmetic == "f32":
        assert least == pytest.approx(seen, rel=1e-4)
    else:  # half a count may be lost in each of its blocks
        assert seen <= least <= seen * (1.0 + 2.0 * len(plan.inner.rest.blocks))


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_where_nothing_moves_by_a_steady_error_there_is_none(arithmetic):
    assert smallest_error(build_plan(simple(UNIT), arithmetic)) is None
    derivative = integral(1.0, transfer=TransferFunction([(1.0, 1.0)]))
    assert smallest_error(build_plan(derivative, arithmetic)) is None


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_a_smaller_gain_acts_on_larger_errors(arithmetic):
    """The least of a schedule, 0 apart, and the least factor in a box."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-12.0, 12.0), (0.0, 1.0))
    schedule = GainSchedule((0.0, 0.5, 1.0), (-0.5, 0.0, -3e-3))
    least = smallest_error(build_plan(integral(schedule, ranges=ranges), arithmetic))
    near = smallest_error(build_plan(integral(3e-3), arithmetic))
    assert least == pytest.approx(near, rel=0.01 if arithmetic[0] == "f" else 1.1)
    box = Tunable((0.25, 4.0), (-12.0, -6.0), (6.0, 12.0))
    tuned = smallest_error(build_plan(integral(1e-4, tunable=box), arithmetic, tunable=True))
    quarter = smallest_error(build_plan(integral(0.25e-4), arithmetic))
    assert tuned == pytest.approx(quarter, rel=1e-4) or (arithmetic[0] == "q" and tuned <= 4.1 * quarter)
    whole = smallest_error(build_plan(integral(1e-4), arithmetic))
    assert arithmetic[0] == "q" or tuned > 1.9 * whole


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
def test_coarse_is_what_ignores_a_digit_of_a_measurement(arithmetic):
    """24 bits of the largest input: a gain that leaves just less or just more."""
    ranges = ControllerRanges((-1.0, 0.5), (0.0, 3.0), (-12.0, 12.0))
    least = smallest_error(build_plan(integral(1e-6, ranges=ranges), arithmetic))
    edge = 1e-6 * least / (3.0 * 2.0**-24)
    for share, ignored in ((0.99, True), (1.01, False)):
        plan = build_plan(integral(edge * share, ranges=ranges), arithmetic)
        ratio = smallest_error(plan) / (3.0 * 2.0**-24)
        assert arithmetic == "f32" or ratio == pytest.approx(1.0 / share, rel=1e-3)
        assert coarse(plan) == (ratio > 1.0)
        assert arithmetic == "f32" or coarse(plan) is ignored
    assert coarse(build_plan(integral(1e-12, ranges=ranges), arithmetic))


@pytest.mark.parametrize("arithmetic", ("q15", "q31"))
def test_coarse_in_integers_is_to_ignore_a_count(arithmetic):
    found = set()
    for gain in 10.0 ** -np.arange(0.0, 11.0, 0.5):
        plan = build_plan(integral(float(gain)), arithmetic)
        least = smallest_error(plan)
        if least is not None:
            assert coarse(plan) == (least > max(plan.error.lsb, 2.0**-24))
            found.add(coarse(plan))
    assert found == {False, True} or arithmetic == "q15"


def test_what_is_said_has_the_numbers_that_it_is_about():
    slow = integral(1e-9, 2e-5)
    for arithmetic, wider in (("q15", "q31 or f32"), ("q31", "f64"), ("f64", "lengthen the sample time")):
        plan = build_plan(slow, arithmetic)
        if smallest_error(plan) is not None and coarse(plan):
            (said,) = remarks(plan)
            left = f"a steady error below {smallest_error(plan):.3g} may be left"
            assert (left in said or "no steady error within the ranges" in said) and wider in said
    assert remarks(build_plan(slow, "f64")) and not remarks(build_plan(integral(1.0), "f64"))
    for gain in (1e3, 1e5, 1e6, 1e9):
        plan = build_plan(integral(gain), "f32")
        said = [remark for remark in remarks(plan) if "rounding adds up" in remark]
        assert bool(said) == (added_up(plan) > 0.5)
        assert not said or f"up to {added_up(plan):.2g} digits of the output in 1e+08 samples" in said[0]


def test_a_remark_on_a_ramp_is_of_every_fractional_integral():
    """s^-0.4 and s^-0.7 leave one each, 1/s none; its slope is the sum of all weights."""
    transfer = TransferFunction([(0.5, 0.3), (2.0, -1.0), (0.3, -0.4), (-0.2, -0.7)])
    plan = build_plan(simple(transfer, length=50), "f64")
    said = [r for r in remarks(plan) if "a ramp of" in r]
    assert len(said) == 2
    for text, (c, order) in zip(said, ((0.3, 0.6), (-0.2, 0.3))):
        weights = np.cumprod([1.0] + [1.0 - (order + 1.0) / j for j in range(1, 51)])
        slope = c * 0.01**-order * weights.sum()
        assert f"{c:.6g} s^{order - 1.0:.6g} becomes, after 50 samples, a ramp of {slope:.3g} times" in text


def test_how_long_an_inner_integral_is_better_than_its_clamp():
    plan = build_plan(simple(TransferFunction([(1.0, 0.0), (3.0, -0.9)]), length=20), "q31")
    (said,) = [r for r in remarks(plan) if "no better than its clamp" in r.replace("\n", " ")]
    samples = int(re.search(r"within (\d+) samples", said)[1])
    bound = plan.error_bound
    assert (
        samples * bound.operator_per_sample
        <= 0.01 * bound.operator
        < (samples + 1) * bound.operator_per_sample
    )
    assert "at most 1 % of that bound" in said


def test_counts_and_floats():
    """Every float to its nearest count, halves away from zero; counts to floats and back."""
    state = Format("int64_t", 2.0**-40, -(2**50), 2**50)
    assert up_of(state) == 40 and up_of(replace(state, lsb=2.0**7)) == -7
    rng = np.random.default_rng(3)
    x = np.concatenate(
        [rng.normal(size=300) * 10.0 ** rng.uniform(-14, 3, 300), (np.arange(-9, 10) + 0.5) * 2.0**-40]
    )
    for value, count in zip(x.astype(np.float32), counts_of(x.astype(np.float32), 40)):
        exact = abs(Fraction(float(value))) * 2**40
        assert count == (int(exact + Fraction(1, 2)) if value >= 0 else -int(exact + Fraction(1, 2)))
    edge = np.float32([2.0**20, 2.0**21, 2.0**22, -(2.0**30), np.inf, np.nan, -np.inf])
    assert counts_of(edge, 40).tolist() == [2**60, 2**61, 2**61, -(2**61), NOTHING, NOTHING, NOTHING]
    big = np.float32([2.0**30 / 2**40, (2.0**30 - 64) / 2**40, (2.0**24 + 2) / 2**40])
    assert counts_of(big, 40).tolist() == [2**30, 2**30 - 64, 2**24 + 2]
    assert values_of(counts_of(big, 40), state).tolist() == big.tolist()
    assert taken_in(np.int64(5), state) == 5 and taken_in(np.float32(2.0**-38), state) == 4
    floating = Format("float", 1.0, -1.0, 1.0)
    assert taken_in(np.float32(0.3), floating) == np.float32(0.3)


@pytest.mark.parametrize("ends", [(-12.0, 3.0), (-3.0, 12.0)])
def test_in_double_an_error_moves_the_integral_wherever_it_stands(ends):
    """A quarter of the last place of its farther end, since two increments are added, and halves rounded."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), ends)
    plan = build_plan(integral(1.0, ranges=ranges), "f64")
    d = smallest_error(plan) * plan.constant_gain
    end = max(ends, key=abs)
    assert abs(end) + 2.0 * d * 1.01 != abs(end) and abs(end) + 2.0 * d * 0.99 == abs(end)
