"""The bit-true reference against an interpreter that reads the model's description line by line.

The interpreter steps one sample at a time in Python's unbounded integers (or numpy scalars, one rounding an
operation), keeps its histories as lists, and checks at every node that the value lies in the range that was
proved.

Red when the reference departs from the description, or a value leaves its proved range.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.plan import Plan, Sum
from focgen.plan.scenario import Reset, Scenario, Track, to_raw
from tests.controllers import random_controller, random_scenario, seed_controller, simple

ARITHMETICS = ("f64", "f32", "q31", "q15")


def counts(x: np.float32, state) -> int:
    """What an integral in counts takes in: the nearest, halves away from zero, at most 2^61."""
    exact = abs(Fraction(float(x))) / Fraction(state.lsb)
    whole = min(int(exact + Fraction(1, 2)), 2**61)
    return -whole if x < 0 else whole


def nearest_float(n: int, state) -> np.float32:
    """What it gives: of the floats around so many counts the nearest, halves to an even mantissa."""
    exact = Fraction(n) * Fraction(state.lsb)
    near = np.float32(float(exact))
    tried = [np.nextafter(near, np.float32(end)) for end in (-np.inf, np.inf)] + [near]
    odd = lambda x: int(x.view(np.uint32)) & 1
    return min(tried, key=lambda x: (abs(Fraction(float(x)) - exact), odd(x)))


class Interpreter:
    """One controller, stepped by the book."""

    def __init__(self, plan: Plan):
        self.plan = plan
        self.number = {"float": np.float32, "double": np.float64}.get(plan.error.ctype, int)
        self.limits = {p.node: p.worst for p in plan.proofs}
        self.start(self.number(0), self.clamp(self.number(0), plan.output))

    def shift(self, x, n):
        if self.plan.floating or n == 0:
            return x
        return (x + 2 ** (n - 1)) // 2**n

    def clamp(self, x, format_):
        number = self.number if format_.floating else int
        return max(min(x, number(format_.high)), number(format_.low))

    def taken_in(self, x, state):
        return counts(x, state) if self.plan.floating and not state.floating else x

    def given(self, integral, state, shift):
        if self.plan.floating and not state.floating:
            return nearest_float(integral, state)
        return self.shift(integral, shift)

    def seen(self, node, value, spare=0):
        """A proof bounds this value."""
        if node in self.limits or not self.plan.floating:
            assert abs(value) + spare <= self.limits[node], node
        return value

    def saturate(self, x, format_):
        if self.plan.floating:
            return x
        top = 2 ** (format_.bits - 1)
        assert -top <= x < top, "in range a narrowing never saturates"
        return x

    def total(self, table: Sum, past):
        """``past[j]`` is the sample of lag j."""
        total = self.number(0)
        for block in table.blocks:
            part = self.number(0)
            for lag in range(block.last, block.first - 1, -1):
                part = part + self.number(block.weights[lag - block.first]) * past[lag]
                if not self.plan.floating:
                    self.seen(f"{table.name}[{block.first}..{block.last}]", part)
            total = total + self.shift(part, block.align)
        return self.seen(f"{table.name} total", total)

    def input(self, x, format_):
        x = self.number(x)
        return x if self.plan.floating else self.clamp(x, format_)

    def start(self, e, u0):
        """The past is a constant e."""
        plan = self.plan
        self.errors = [e] * (plan.error_lags + 1)
        self.z, self.carry, self.fresh = 0, 0, True
        direct = self.total(plan.direct, self.errors) if plan.direct else self.number(0)
        if plan.inner:
            self.z = self.taken_in(self.number(0), plan.inner.state)
            self.r = self.taken_in(self.total(plan.inner.rest, self.errors), plan.inner.state)
        if plan.feedback:
            product = self.number(plan.feedback.steady) * e
            self.v = self.saturate(self.shift(product, plan.feedback.steady_shift), plan.filtered)
        else:
            self.v = self.saturate(self.shift(direct, plan.narrow), plan.filtered)
        self.filtered = [self.v] * plan.filtered_lags
        self.set(u0)

    def set(self, u0):
        """The integral that gives u0."""
        integrator = self.plan.integrator
        if integrator:
            wide = u0 if self.plan.floating else u0 * 2**integrator.to_output
            self.total_i = self.taken_in(wide, integrator.state)

    def reset(self, ref, meas, u0):
        e = self.input(ref, self.plan.reference) - self.input(meas, self.plan.measurement)
        self.start(e, self.clamp(self.number(u0), self.plan.output))

    def track(self, u):
        self.set(self.clamp(self.number(u), self.plan.output))

    def step(self, ref, meas, sched):
        e = self.seen("error", self.input(ref, self.plan.reference) - self.input(meas, self.plan.measurement))
        self.errors = [e, *self.errors[:-1]]
        before, self.v = self.v, self.filter()
        g = self.gain(None if sched is None else self.input(sched, self.plan.schedule.signal))
        flags = 0
        if not self.plan.floating:
            flags = 8 * (
                (self.input(ref, self.plan.reference), self.input(meas, self.plan.measurement)) != (ref, meas)
            )
        if sched is not None:
            s, points = self.input(sched, self.plan.schedule.signal), self.plan.schedule.breakpoints
            flags |= 4 * (s < points[0] or s > points[-1]) | (0 if self.plan.floating else 8 * (s != sched))
        u, d = self.actuate(g, before)
        return u, d, flags | (u >= self.plan.output.high) | 2 * (u <= self.plan.output.low)

    def filter(self):
        plan = self.plan
        p = self.total(plan.direct, self.errors) if plan.direct else None
        if plan.inner:
            r = self.taken_in(self.total(plan.inner.rest, self.errors), plan.inner.state)
            self.seen("inner sum", self.z + (r + self.r))
            self.z, self.r = self.clamp(self.z + (r + self.r), plan.inner.state), r
            aligned = self.given(self.z, plan.inner.state, plan.inner.to_wide)
            p = aligned if p is None else p + aligned
        self.seen("p", p)
        if plan.feedback is None:
            return self.seen("v", self.saturate(self.shift(p, plan.narrow), plan.filtered))
        x = p - self.total(plan.feedback.table, [None, *self.filtered])
        if plan.floating:
            v = x
        else:
            x = self.seen("x", x + self.carry)
            v = self.shift(x, plan.narrow)
            self.carry = x - v * 2**plan.narrow
        v = self.seen("v", self.saturate(v, plan.filtered))
        self.filtered = [v, *self.filtered[:-1]]
        return v

    def gain(self, s):
        schedule = self.plan.schedule
        if schedule is None:
            return self.number(self.plan.constant_gain)
        points, gains = schedule.breakpoints, schedule.gains
        if s < points[0]:
            return self.number(gains[0])
        for i in range(len(points) - 1):
            if s < points[i + 1]:
                product = self.number(schedule.slopes[i]) * (s - self.number(points[i]))
                self.seen("slope product", product)
                return self.seen(
                    "gain", self.number(gains[i]) + self.shift(product, schedule.slope_shifts[i])
                )
        return self.number(gains[-1])

    def actuate(self, g, before):
        plan = self.plan
        d = self.seen("increment", self.shift(self.seen("gain product", g * self.v), plan.gain_shift))
        if plan.integrator is None:
            return self.clamp(d, plan.output), d
        d = self.taken_in(d, plan.increment)
        first = self.taken_in(self.shift(g * before, plan.gain_shift), plan.increment)
        previous = first if self.fresh else self.d
        self.fresh, self.d = False, d
        total = self.seen("integrator sum", self.total_i + (d + previous))
        self.total_i = self.clamp(total, plan.integrator.state)
        u = self.given(self.total_i, plan.integrator.state, plan.integrator.to_output)
        return self.clamp(u, plan.output), d


def by_the_book(plan: Plan, raw: Scenario):
    """u, d and flags of every lane."""
    rows = []
    for lane in range(raw.lanes):
        machine, row = Interpreter(plan), []
        for k in range(raw.samples):
            for r in (r for r in raw.resets if (r.lane, r.sample) == (lane, k)):
                machine.reset(r.ref, r.meas, r.u0)
            for t in (t for t in raw.tracks if (t.lane, t.sample) == (lane, k)):
                machine.track(t.u)
            each = (x[lane, k].item() if not plan.floating else x[lane, k] for x in (raw.ref, raw.meas))
            row.append(machine.step(*each, None if raw.sched is None else raw.sched[lane, k]))
        rows.append(row)
    u, d, flags = (np.array([[s[i] for s in row] for row in rows]) for i in range(3))
    return u, d, flags


def planned(controller, arithmetic):
    try:
        return build_plan(controller, arithmetic)
    except PlanError as reason:
        pytest.skip(str(reason))


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize(
    "seed", [*range(20), *(pytest.param(s, marks=pytest.mark.long) for s in range(20, 40))]
)
def test_reference_equals_the_description(seed, arithmetic):
    controller = random_controller(seed, longest=24)
    plan = planned(controller, arithmetic)
    raw = to_raw(plan, random_scenario(controller, seed, lanes=2, samples=60, wild=seed % 2 == 0))
    u, d, flags = by_the_book(plan, raw)
    trace = execute(plan, raw)
    assert np.array_equal(trace.u, u) and np.array_equal(trace.d, d)
    assert np.array_equal(trace.flags, flags)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_order_one_equals_the_recursion_written_by_hand(arithmetic):
    """(T s + 1)/s by hand: d_k = c0 e_k + c1 e_{k−1}, u integrates it; in the plan's own numbers, bit for
    bit.
    """
    controller = seed_controller(transfer=TransferFunction([(1.32, 1.0), (1.0, 0.0)]), gain=40.0)
    plan = build_plan(controller, arithmetic)
    assert plan.error_lags == 1 and plan.direct.taps == 2
    raw = to_raw(plan, random_scenario(controller, 3, lanes=1, samples=400))
    raw = Scenario(raw.ref, raw.meas)
    number = int if not plan.floating else (plan.error.ctype == "float" and np.float32) or np.float64
    c0, c1 = (number(w) for w in plan.direct.weights)
    g, low, high = number(plan.constant_gain), number(plan.output.low), number(plan.output.high)
    expected, total, old, before = [], number(0), number(0), number(0)
    if arithmetic == "f32":
        total, before = Fraction(0), Fraction(0)
    for e in (raw.ref - raw.meas)[0]:
        e = number(e)
        if arithmetic == "f32":  # in counts: exact, but for the rounding of d to 2^-57
            d = Fraction(round(Fraction(float(g * (c1 * old + c0 * e))) * 2**57), 2**57)
            total = min(max(total + (d + before), Fraction(float(low))), Fraction(float(high)))
            expected.append(np.float32(float(total)))
        elif plan.floating:
            d = g * (c1 * old + c0 * e)
            total = min(max(total + (d + before), low), high)
            expected.append(total)
        else:
            a1, a0 = (b.align for b in plan.direct.blocks)
            p = (c1 * old + (1 << a1 >> 1) >> a1) + (c0 * e + (1 << a0 >> 1) >> a0)
            v = p + (1 << plan.narrow >> 1) >> plan.narrow
            d = g * v + (1 << plan.gain_shift >> 1) >> plan.gain_shift
            n = plan.integrator.to_output
            total = min(max(total + d + before, low << n), high << n)
            expected.append(total + (1 << n >> 1) >> n)
        old, before = e, d
    assert np.array_equal(execute(plan, raw).u[0], np.array(expected))


def test_backward_euler_is_what_order_one_in_the_denominator_runs():
    """1/(T s + 1): v_k = (e_k + (T/h) v_{k−1}) / (1 + T/h)."""
    controller = simple(TransferFunction([(1.0, 0.0)], [(0.3, 1.0), (1.0, 0.0)]))
    plan = build_plan(controller, "f64")
    e = np.random.default_rng(1).uniform(-1.0, 1.0, 200)
    v, expected = 0.0, []
    for x in e:
        v = (x + 30.0 * v) / 31.0
        expected.append(v)
    trace = execute(plan, Scenario(e[None], np.zeros((1, 200))))
    assert np.allclose(trace.u[0], expected, rtol=0, atol=1e-15)


def test_a_zero_and_an_integrator_that_cancel_are_the_average_of_two_samples():
    """s · 1/s, as the module's description says."""
    controller = simple(TransferFunction([(1.0, 1.0)]), integrator=True)
    plan = build_plan(controller, "f64")
    e = np.random.default_rng(2).uniform(-1.0, 1.0, 100)
    trace = execute(plan, Scenario(e[None], np.zeros((1, 100))))
    assert np.allclose(trace.u[0], 0.5 * (e + np.concatenate([[0.0], e[:-1]])), rtol=0, atol=1e-12)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_reset_is_bumpless(arithmetic):
    """After reset(r, m, u0) a constant error moves the output at the rate of its steady gain, from u0 on, at
    once.
    """
    controller = seed_controller(length=50)
    plan = build_plan(controller, arithmetic)
    samples, at = 40, 20
    ref, meas, sched = np.full((1, samples), 0.011), np.full((1, samples), 0.0105), np.full((1, samples), 0.2)
    resets = (Reset(0, at, 0.011, 0.0105, 4.0),)
    u = execute(plan, to_raw(plan, Scenario(ref, meas, sched, resets))).u[0] * plan.output.lsb
    steps = np.diff(np.concatenate([[4.0], u[at:]]))
    steady = float(np.sum(plan.direct.values)) * 0.0005 * controller.gain(0.2) * controller.sample_time
    assert np.allclose(steps, steady, atol=1.01 * plan.output.lsb if not plan.floating else 1e-5)


def test_track_follows_and_without_integrator_does_nothing():
    controller = seed_controller(length=20)
    plan = build_plan(controller, "q31")
    still = np.full((1, 10), 0.01)
    raw = to_raw(plan, Scenario(still, still, np.full((1, 10), 0.1), (), (Track(0, 5, 7.0),)))
    u = execute(plan, raw).u[0] * plan.output.lsb
    assert np.allclose(u[:5], 0.0) and np.allclose(u[5:], 7.0)
    filter_ = build_plan(simple(TransferFunction([(1.0, 0.0)])), "q31")
    raw = to_raw(filter_, Scenario(np.ones((1, 4)), np.zeros((1, 4)), None, (), (Track(0, 2, 5.0),)))
    assert np.allclose(execute(filter_, raw).u * filter_.output.lsb, 1.0, atol=1e-8)


def test_flags_say_what_happened():
    ranges = ControllerRanges((0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0))
    gain = GainSchedule((0.25, 0.75), (1.0, 2.0))
    plan = build_plan(simple(TransferFunction([(1.0, 0.0)]), gain=gain, ranges=ranges), "q15")
    ref = np.array([[0.5, 1.0, 0.0, 0.5, 0.5, 1.5]])
    meas = np.array([[0.25, 0.0, 1.0, 0.25, 0.25, 1.0]])
    sched = np.array([[0.5, 0.5, 0.5, 0.1, 0.9, 0.5]])
    flags = execute(plan, to_raw(plan, Scenario(ref, meas, sched))).flags[0]
    assert flags.tolist() == [0, 1, 2, 4, 4, 2 + 8]
