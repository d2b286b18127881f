"""How far the clamped integral of the terms of negative order takes the output, beside runs.

Red when its clamp keeps the output from a limit that the controller would reach.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.canonical import tables
from focgen.plan.execute import execute
from focgen.plan.ideal import ideal
from focgen.plan.scenario import Scenario, physical_trace, to_raw
from focgen.plan.truncation import truncation
from tests.controllers import simple

RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-4.0, 10.0))
SLOW = TransferFunction([(1.0, 0.0), (5.0, -0.9)], [(1.0, 0.5), (1.0, 0.0)])
SHORT = (("f64", 300), ("f32", 300), ("q31", 60), ("q15", 60), ("q15", 300))


def held(error: float, samples: int) -> Scenario:
    """A large error up to the middle, then a small one of the same sign."""
    ref = np.concatenate([np.full(samples // 2, np.sign(error)), np.full(samples // 2, error)])[None]
    return Scenario(ref, np.zeros_like(ref))


@pytest.mark.parametrize(
    ("error", "end", "arithmetic", "length"),
    [
        pytest.param(*way, *short, marks=() if turn % 2 == i and short != ("q15", 300) else pytest.mark.long)
        for i, way in enumerate([(0.02, 10.0), (-0.02, -4.0)])
        for turn, short in enumerate(SHORT)
    ],
)
def test_a_steady_error_takes_the_output_to_its_limit_with_a_short_memory(arithmetic, length, error, end):
    """Behind a fractional denominator, whose gain at rest a short memory lowers."""
    plan = build_plan(simple(SLOW, ranges=RANGES), arithmetic, length)
    scenario = held(error, 8000)
    u = physical_trace(plan, execute(plan, to_raw(plan, scenario))).u[0]
    assert abs(u[-1] - end) <= plan.output.lsb * (arithmetic[0] == "q")
    assert abs(ideal(plan.controller, scenario, length).u[0, -1] - end) < 1e-9


@pytest.mark.parametrize("num", [[(1.0, 0.0), (5.0, -0.9)], [(5.0, -1.0)]])
def test_truncation_bounds_what_the_two_clamps_leave(num):
    """With infinite memory the denominator is another at rest, and so is the clamp, whole orders included."""
    controller = simple(TransferFunction(num, [(1.0, 0.5), (1.0, 0.0)]), ranges=RANGES)
    plan, scenario = build_plan(controller, "f64", 60), held(0.02, 4000)
    apart = np.abs(ideal(controller, scenario, 60).d - ideal(controller, scenario).d).max()
    assert 0.1 < apart <= truncation(plan, tables(controller, 60))
