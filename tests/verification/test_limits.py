"""Output limits that an arithmetic holds to half a digit only: what verify says of C that is right.

Red when a fresh folder does not hold because of the rounding of its limits, or of a number that is to be
refused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.codegen.generate import generate
from focgen.control.controller import ControllerRanges, Tunable
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.scenario import physical_trace, to_raw
from focgen.plan.tuning import refused
from focgen.verification.errors_seen import errors_seen
from focgen.verification.scenarios import mistuned, mixed
from focgen.verification.verify import verify
from tests.controllers import simple

SMALL = simple(
    TransferFunction([(1.0, 0.5)]),
    gain=1e-5,
    sample_time=0.1,
    length=5,
    ranges=ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (0.3, 0.4)),
)
LARGE = simple(
    TransferFunction([(1.0, 0.5)]),
    gain=1e10,
    length=5,
    ranges=ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (3.3e10, 4e10)),
    tunable=Tunable((0.5, 2.0), (3.3e10, 3.3e10), (3.5e10, 4e10)),
)
BOX = Tunable((0.5, 2.0), (0.3, 0.31), (0.35, 0.4))


@pytest.mark.parametrize(
    "arithmetic",
    [pytest.param("f64", marks=pytest.mark.long), "f32", "q31", pytest.param("q15", marks=pytest.mark.long)],
)
def test_limits_ahead_of_which_little_happens_hold(tmp_path, arithmetic):
    """0.3 is no number in single precision; the bound of the signal ahead of the clamp is 10^-5 of that."""
    small = SMALL if arithmetic != "q15" else replace(SMALL, gain=0.1)
    generate(small, tmp_path, arithmetic)
    found = verify(tmp_path, samples=2000)
    assert found.holds


PERCENT = ControllerRanges((0.0, 1.0), (0.0, 1.0), (20.3, 99.9))
PI = simple(TransferFunction([(2.0, 0.0), (1.0, -0.9)]), length=100, ranges=PERCENT)


@pytest.mark.parametrize("arithmetic", [pytest.param("f64", marks=pytest.mark.long), "f32", "q31"])
def test_so_do_those_of_a_controller_that_integrates_by_itself(tmp_path, arithmetic):
    generate(PI, tmp_path, arithmetic)
    assert verify(tmp_path, samples=4000).holds


@pytest.mark.parametrize("arithmetic", [pytest.param("f64", marks=pytest.mark.long), "f32", "q31"])
def test_so_do_limits_that_are_tuned(tmp_path, arithmetic):
    generate(replace(SMALL, tunable=BOX), tmp_path, arithmetic, tunable=True)
    assert verify(tmp_path, samples=2000).holds


@pytest.mark.parametrize("arithmetic", ["f32", "q31"])
def test_an_error_ahead_of_the_clamp_is_still_seen(arithmetic):
    """Half the output's range off, between the limits."""
    wide = replace(SMALL, gain=0.1, ranges=replace(SMALL.ranges, output=(-0.4, 0.4)))
    plan = build_plan(wide, arithmetic)
    physical = mixed(wide, 2000, 1)
    trace = execute(plan, to_raw(plan, physical))
    assert errors_seen(plan, physical, trace, plan.error_bound).within
    half = 0.5 * (plan.output.high - plan.output.low)
    off = np.clip(trace.u + half, plan.output.low, plan.output.high)
    wrong = replace(trace, u=off.astype(trace.u.dtype), d=off.astype(trace.d.dtype))
    seen = errors_seen(plan, physical, wrong, plan.error_bound)
    assert seen.operator_share > 1.0 and physical_trace(plan, wrong).u.max() <= 0.4 + plan.output.lsb


@pytest.mark.parametrize(
    "arithmetic",
    [pytest.param("f64", marks=pytest.mark.long), "f32"],
)
def test_what_is_to_be_refused_is_beyond_the_box_as_the_type_has_it(tmp_path, arithmetic):
    """3.3e10 less 1000 is 3.3e10 in single precision."""
    plan = build_plan(LARGE, arithmetic, tunable=True)
    kind = np.float32 if arithmetic == "f32" else np.float64
    scenario = to_raw(plan, mixed(plan.controller, 400, 0))
    for seed in range(40):
        tunes = mistuned(plan, scenario, seed).tunes
        for tune in tunes[2::3]:
            ends = tune.params.u_min, tune.params.u_max
            typed = replace(
                tune.params,
                gain=tuple(float(kind(x)) for x in tune.params.gain),
                u_min=float(kind(ends[0])),
                u_max=float(kind(ends[1])),
            )
            assert refused(plan, tune.params) and refused(plan, typed)
    generate(LARGE, tmp_path, arithmetic, tunable=True)
    assert all(verify(tmp_path, samples=1000, seed=seed).holds for seed in range(2))
