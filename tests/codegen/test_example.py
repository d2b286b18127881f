"""The program that comes with a folder: compiled and run, it prints what the reference computes.

Red when it calls the controller otherwise than its interface says, or prints another number.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from focgen.codegen.generate import folder_files
from focgen.control.controller import ControllerRanges
from focgen.control.files import controller_text
from focgen.fractional.transfer import TransferFunction
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.scenario import Scenario, to_raw
from tests.c_code import EXACT, compiler, run
from tests.conftest import paper_controller
from tests.controllers import simple

BELOW = ControllerRanges((-1.0, -0.1), (-1.0, 1.0), (-10.0, 10.0))
CONTROLLERS = {
    "scheduled": paper_controller(20),
    "below zero": simple(TransferFunction([(1.0, 0.0), (0.3, 0.5)]), ranges=BELOW, length=20),
}


@pytest.mark.parametrize(
    "name, arithmetic, floats",
    [
        pytest.param(name, arithmetic, floats, marks=() if (turn + i) % 2 == floats else pytest.mark.long)
        for turn, name in enumerate(CONTROLLERS)
        for i, arithmetic in enumerate(("f64", "f32", "q31", "q15"))
        for floats in (True, False)
    ],
)
def test_it_prints_what_the_reference_computes(name, arithmetic, floats, tmp_path):
    """Ten samples of half of the reference's range, the measurement at rest, the schedule at its middle."""
    controller = CONTROLLERS[name]
    plan = build_plan(controller, arithmetic)
    write_files(tmp_path, folder_files(plan, controller_text(controller).encode(), floats=floats))
    sources = [tmp_path / "example" / "main.c", tmp_path / f"{plan.name}.c"]
    run(*compiler("gcc"), *EXACT, "-I", tmp_path, *sources, "-o", tmp_path / "main.exe")
    said = run(tmp_path / "main.exe")
    printed = re.findall(r"^ *(\d+)  (\S+)(.*)$", said, re.MULTILINE)
    trace = execute(plan, to_raw(plan, middle(controller)))
    assert [int(k) for k, _, _ in printed] == list(range(10))
    expected = trace.u[0] * plan.output.lsb
    assert np.array([float(u) for _, u, _ in printed]) == pytest.approx(expected, rel=3e-7)
    assert [("at its upper end" in rest) for _, _, rest in printed] == [bool(f & 1) for f in trace.flags[0]]


def middle(controller) -> Scenario:
    ranges = controller.ranges
    ref = np.full((1, 10), sum(ranges.reference) / 2)
    sched = np.full((1, 10), sum(ranges.schedule) / 2) if controller.scheduled else None
    return Scenario(ref, np.zeros((1, 10)), sched)
