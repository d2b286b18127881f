"""Integrals of f32 in whole counts: what they add up, and the error from which on any arithmetic acts.

Red when an increment is lost, or acted on though it is said to be too small.
"""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from cffi import FFI

from focgen.codegen.generate import generate
from focgen.compiler import compile_shared
from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.counts import MOST, NOTHING, counts_of, values_of
from focgen.plan.ending import endings
from focgen.plan.execute import execute
from focgen.plan.integrals import STEPS, added_up
from focgen.plan.least_error import smallest_error
from focgen.plan.plan import Format
from focgen.plan.remarks import remarks
from focgen.plan.scenario import Reset, Scenario, nearest_raw, to_raw
from focgen.resources import shipped
from focgen.verification.host import FLAGS
from tests.controllers import seed_controller, simple

ARITHMETICS = ("q15", "q31", "f32", "f64")


def integral(gain: float = 1.0, step: float = 1e-4, output: float = 12.0, **more):
    """gain / s at a rate, ±``output``."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-output, output))
    found = simple(TransferFunction([(1.0, 0.0)]), integrator=True, ranges=ranges, gain=gain, **more)
    return replace(found, sample_time=step)


def held(plan, e: float, u0: float, samples: int) -> np.ndarray:
    """The output, physical, after a reset to a constant error."""
    ref, meas = np.full((1, samples), e), np.zeros((1, samples))
    raw = to_raw(plan, Scenario(ref, meas, None, (Reset(0, 0, e, 0.0, u0),)))
    return execute(plan, raw).u[0] * plan.output.lsb


def test_a_small_error_moves_a_large_output():
    """10 kHz, gain 1, u = 11 V, 0.003 for ten seconds: a float stood still."""
    plan = build_plan(integral(), "f32")
    u = held(plan, 0.003, 11.0, 100_000)
    d = Fraction(float(np.float32(0.5e-4) * np.float32(0.003)))
    exact = 11.0 + np.array([float(2 * d * n) for n in range(1, 100_001, 9999)])
    assert np.abs(u[::9999][: len(exact)] - exact).max() <= 0.5 * float(np.spacing(np.float32(11.0)))


RUN = """#include "c.h"
void run(uint32_t count, float e, float start, float *u);
void run(uint32_t count, float e, float start, float *u)
{
    static c_state state;

    c_reset(&state, e, 0.0f, start);
    while (count-- > 0u) {
        *u = c_step(&state, e, 0.0f);
    }
}
"""


@pytest.mark.parametrize("samples", [10**6, pytest.param(STEPS, marks=pytest.mark.long)])
@pytest.mark.parametrize("rate", [1.0, 50e3])
def test_adding_up_costs_no_digit(rate, samples, tmp_path):
    """In compiled C: after 10^8 steps the output is the sum of the rounded increments, to its last digit."""
    made = generate(integral(1.0, 1.0 / rate), tmp_path / "c", "f32", name="c")
    (tmp_path / "run.c").write_text(RUN)
    compile_shared([made.folder / "c.c", tmp_path / "run.c"], tmp_path / "run.so", FLAGS, [made.folder])
    ffi = FFI()
    ffi.cdef("void run(uint32_t, float, float, float *);")
    library, u = ffi.dlopen(str(tmp_path / "run.so")), ffi.new("float *")
    for share in (0.9, 0.013):
        e = np.float32(share * rate / samples)  # moves the output by so many volts
        for start, sign in ((-1.0, 1.0), (11.0, -1.0)):
            e = np.float32(sign * e)
            library.run(samples, float(e), start, u)
            d = np.float32(made.plan.constant_gain) * e
            exact = Fraction(start) + 2 * samples * Fraction(float(d))
            assert abs(float(Fraction(u[0]) - exact)) <= float(np.spacing(np.float32(12.0)))
    assert added_up(made.plan) < 0.01


def test_the_bits_of_the_c_are_those_of_the_reference(tmp_path):
    """Counts of random floats, with every exponent, and of what has none; floats of random counts."""
    code = '#include "foc_integral.h"\nint64_t counts(float x, int up); float value(int64_t n, float lsb);\n'
    code += "int64_t counts(float x, int up) { return foc_counts_f32(x, (int16_t)up); }\n"
    code += "float value(int64_t n, float lsb) { return foc_value_f32(n, lsb); }\n"
    (tmp_path / "c.c").write_text(code)
    compile_shared([tmp_path / "c.c"], tmp_path / "c.so", FLAGS, [shipped("c_runtime")])
    ffi = FFI()
    ffi.cdef("int64_t counts(float, int); float value(int64_t, float);")
    library, rng = ffi.dlopen(str(tmp_path / "c.so")), np.random.default_rng(5)
    bits = rng.integers(0, 2**32, 3000, dtype=np.uint32)
    bits |= np.where((bits >> 23) & 255 == 255, np.uint32(1 << 22), np.uint32(0))  # quiet, if a NaN
    near = np.concatenate([k + np.array([-0.5, -0.25, 0.0, 0.25, 0.5]) for k in (0.0, 1.0, 2.0, 2.0**22)])
    special = [0.0, -0.0, np.inf, -np.inf, np.nan, 1e-45, 2.0**61, -(2.0**61), 3e38]
    for up in (-60, -3, 0, 1, 20, 57, 126):
        scaled = np.ldexp(np.concatenate([near, -near]), -up)
        x = np.concatenate([bits.view(np.float32), np.array([*scaled, *special], np.float32)])
        expected = counts_of(x, up)
        assert [library.counts(v, up) for v in x.tolist()] == expected.tolist()
        state, n = Format("int64_t", 2.0**-up, 0, 0), expected[expected != NOTHING]
        assert [library.value(k, state.lsb) for k in n.tolist()] == values_of(n, state).tolist()
    assert {MOST, -MOST, NOTHING} <= set(expected.tolist())


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize(
    "controller",
    [integral(), integral(0.02), integral(3e-3, 2e-5), seed_controller(20)],
    ids=["1", "slow", "slower", "seed"],
)
def test_the_smallest_error_is_acted_on_and_what_is_smaller_is_not(controller, arithmetic):
    plan = build_plan(controller, arithmetic)
    least = smallest_error(plan)
    high = plan.controller.ranges.output[1]
    u0 = nearest_raw(high * (1.0 - 1e-6 if plan.floating else 0.5), plan.output)[()]
    sched = None if plan.schedule is None else np.full((1, 2), plan.schedule.breakpoints[-1], u0.dtype)

    def left(e):
        """The integral after two steps with a raw error."""
        e = np.full((1, 2), e, u0.dtype)
        scenario = Scenario(e, np.zeros_like(e), sched, (Reset(0, 0, e[0, 0], e.dtype.type(0), u0),))
        return endings(plan, scenario)[1][0].integral

    def moved(e):
        return left(e) != left(0)

    if plan.floating:
        assert moved(least * 1.01) and not moved(least * 0.99)
    else:
        n = round(least / plan.error.lsb)
        assert least == n * plan.error.lsb and moved(n) and (n == 1 or not (moved(n - 1) and moved(1 - n)))


def test_what_cannot_be_held_is_said(tmp_path):
    """A gain that leaves no count of a small error; increments that dwarf the output."""
    slow = integral(1e-9, 2e-5)
    assert "the integral need not move" in remarks(build_plan(slow, "f64"))[0]
    assert remarks(build_plan(integral(), "f32")) == []
    wild = integral(1e9, 1e-4)
    assert "rounding adds up" in remarks(build_plan(wild, "f32"))[0]
    manifest = generate(wild, tmp_path, "f32").manifest
    assert manifest["remarks"] and manifest["smallest_error"] > 0.0


NEGATIVE = TransferFunction([(0.5, 0.7), (2.0, 0.0), (0.3, -0.4)])


def test_the_open_loop_ramp_of_short_memory_is_said_and_is_there():
    """Long after a step the integral of s^-0.4 rises by what the remark says, a second."""
    controller = replace(simple(NEGATIVE, length=60), gain=0.01)
    plan = build_plan(controller, "f64")
    said = [remark for remark in remarks(plan) if "a ramp of" in remark]
    slope = float(re.search(r"a ramp of (\S+) times", said[0])[1])
    e = np.full((1, 400), 0.5)
    u = execute(plan, Scenario(e, np.zeros_like(e))).u[0] / 0.01
    assert np.diff(u)[100:] / 0.01 == pytest.approx(slope * 0.5, rel=3e-3)  # three digits are said
    longer = build_plan(replace(controller, memory="exponential"), "f64")
    assert not any("a ramp of" in remark for remark in remarks(longer))


def test_what_negative_orders_cost_is_said():
    """That a reset starts it at 0, that the bound is the clamp, until when it is better, and what the
    trapezoid is off by."""
    given = dict(memory="exponential", operator="continuous", tolerance=0.02)
    plan = build_plan(simple(NEGATIVE), "f32", **given)
    start, clamp, trapezoid = remarks(plan)
    assert "starts at 0" in start
    samples, bound = int(re.search(r"within (\d+) samples", clamp)[1]), plan.error_bound
    assert samples * bound.operator_per_sample <= 0.01 * bound.operator
    half = 0.05 * np.pi
    assert f"{100 * (1 - half / np.tan(half)):.2g} % low" in trapezoid
    assert len(remarks(build_plan(simple(NEGATIVE), "f32", band=(0.1, 2.0), **given))) == 2
