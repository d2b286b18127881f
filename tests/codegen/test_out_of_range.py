"""What is beyond every count, turned into one, given to a step.

Red when the count that stands for it is in range, and no flag is raised.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule, Tunable
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.plan import FLAG_INPUT
from focgen.plan.scenario import Scenario, nearest_raw, raw_params
from focgen.plan.tuning import REFUSED_GAIN, REFUSED_HIGH, REFUSED_LOW, default_params, refused
from tests.controllers import simple

LARGEST = {"q15": 1.0 - 2.0**-15, "q31": 1.0 - 2.0**-31}


@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
@pytest.mark.parametrize("beyond", [np.inf, -np.inf])
@pytest.mark.parametrize("signal", ["ref", "meas", "sched"])
def test_what_no_count_can_be_is_out_of_range(arithmetic, beyond, signal):
    """Where a range ends with the type, too."""
    end = LARGEST[arithmetic]
    ranges = ControllerRanges((0.0, end), (0.0, end), (-end, end), (-end, end))
    schedule = GainSchedule((-end, 0.0, end), (1.0, 2.0, 3.0))
    controller = simple(TransferFunction([(1.0, 0.0)]), integrator=True, gain=schedule, ranges=ranges)
    plan = build_plan(controller, arithmetic)
    formats = {"ref": plan.error, "meas": plan.error, "sched": plan.schedule.signal}
    counts = {name: np.zeros((1, 2), np.int64) for name in formats}
    counts[signal][0, 1] = nearest_raw(np.float32(beyond), formats[signal])
    flags = execute(plan, Scenario(**counts)).flags[0]
    assert not flags[0] & FLAG_INPUT and flags[1] & FLAG_INPUT


@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
@pytest.mark.parametrize("beyond", [np.inf, -np.inf])
def test_parameters_beyond_every_count_are_refused(arithmetic, beyond):
    end = LARGEST[arithmetic]
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-end, end))
    box = Tunable((0.5, 2.0 * end), (-end, -0.5), (0.5, end))
    controller = simple(TransferFunction([(1.0, 0.0)]), integrator=True, ranges=ranges, tunable=box)
    plan = build_plan(controller, arithmetic, tunable=True)
    good = default_params(plan)
    given = type(good)((beyond,), beyond, beyond)
    assert refused(plan, good) == 0
    assert refused(plan, raw_params(plan, given)) == REFUSED_GAIN | REFUSED_LOW | REFUSED_HIGH
