"""Counts and scales that C's types cannot hold.

Red when C is written that counts on from 0, reads beside a table, or converts by a float that is none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focgen.codegen.fits import COUNT
from focgen.codegen.generate import folder_files, generate
from focgen.codegen.kernels import Kernels
from focgen.codegen.literals import literal
from focgen.codegen.lookahead import look_ahead
from focgen.control.controller import ControllerRanges, GainSchedule
from focgen.control.files import MOST_POINTS, controller_table
from focgen.errors import ControllerError, PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.plan import LONGEST
from focgen.verification.verify import verify
from tests.controllers import simple

PLAIN = TransferFunction([(1.0, 0.0)])


def scheduled(points: int):
    """Gains 1 … 2 over 0 … 1."""
    at = np.linspace(0.0, 1.0, points)
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-10.0, 10.0), (0.0, 1.0))
    return simple(PLAIN, gain=GainSchedule(tuple(at.tolist()), tuple((1.0 + at).tolist())), ranges=ranges)


@pytest.mark.parametrize("points", [MOST_POINTS + 1, COUNT + 1, 66_000])
def test_more_breakpoints_than_are_allowed_are_refused(tmp_path, points):
    with pytest.raises(ControllerError, match=f"has {points} values; give at most {MOST_POINTS}"):
        generate(controller_table(scheduled(points)), tmp_path / "folder", "f64")
    assert not (tmp_path / "folder").exists()


def test_as_many_as_are_allowed_are_all_used(tmp_path):
    generate(controller_table(scheduled(MOST_POINTS)), tmp_path, "f64", tunable=False)
    assert verify(tmp_path, samples=2000).holds


def test_no_plan_becomes_c_that_cannot_count_it():
    """Whatever way it came about."""
    plan = build_plan(scheduled(3), "f64")
    gains = tuple(np.linspace(1.0, 2.0, COUNT + 1).tolist())
    with pytest.raises(PlanError, match=f"at most {COUNT} can be counted"):
        folder_files(replace(plan, schedule=replace(plan.schedule, gains=gains)), b"")
    longer = replace(plan.direct, blocks=(replace(plan.direct.blocks[0], last=LONGEST + 1),))
    with pytest.raises(PlanError, match=f"at most {LONGEST} can be counted"):
        folder_files(replace(plan, schedule=None, direct=longer), b"")


@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
def test_weights_that_a_run_cannot_count_to_take_the_plain_form(arithmetic):
    """Blocks are filled up with zeros: fewer lags than 65536 may be more weights."""
    plan = build_plan(simple(TransferFunction([(1.0, 0.05)]), length=65_000), arithmetic)
    assert look_ahead(plan.direct) is None and Kernels("cortex-m4").slots(plan, "error") == 65_001
    shorter = build_plan(simple(TransferFunction([(1.0, 0.05)]), length=64_000), arithmetic)
    ahead = look_ahead(shorter.direct)
    assert max(run.weights for run in ahead.runs) <= COUNT and max(ahead.slices) <= 255


def scaled(size: float):
    return simple(PLAIN, ranges=ControllerRanges((-size, size), (-size, size), (-size, size)))


@pytest.mark.parametrize("arithmetic", ["q15", "q31"])
@pytest.mark.parametrize("size", [1e-60, 1e-38, 1e-33, 1e38, 1e40, 1e60])
def test_counts_that_single_precision_cannot_hold_are_refused(tmp_path, arithmetic, size):
    with pytest.raises(PlanError, match="nearer to 1"):
        generate(scaled(size), tmp_path / "folder", arithmetic)


@pytest.mark.parametrize(("arithmetic", "size"), [("q15", 1e-31), ("q31", 1e-26), ("q31", 1e37)])
def test_those_next_to_them_are_converted(tmp_path, arithmetic, size):
    generate(scaled(size), tmp_path, arithmetic)
    assert verify(tmp_path, samples=500).holds


@pytest.mark.parametrize("step", [1e-50, 1e40])
def test_a_sample_time_that_single_precision_cannot_hold_is_refused(tmp_path, step):
    with pytest.raises(PlanError, match="sample_time"):
        generate(replace(scaled(1.0), sample_time=step), tmp_path, "q31")


@pytest.mark.parametrize("kernels", [Kernels(), Kernels("cortex-m4")])
def test_a_past_whose_weights_are_all_lost_is_a_sum_of_nothing(tmp_path, kernels):
    """Of an order of 1e-12 q15 has the present alone: the past rounds to zero, lag by lag."""
    forgetful = TransferFunction([(1.0, 0.0)], [(50.0, 0.0), (0.4, 1e-12)])
    made = generate(simple(forgetful, length=200), tmp_path, "q15", target=kernels.target)
    assert not any(any(block.weights) for block in made.plan.feedback.table.blocks)
    assert verify(tmp_path, samples=500).holds


@pytest.mark.parametrize("bits", [16, 32, 64])
def test_a_constant_that_its_type_cannot_hold_is_none(bits):
    ctype, end = f"int{bits}_t", 1 << bits - 1
    assert literal(end - 1, ctype) == str(end - 1) and literal(-end, ctype)
    for value in (end, -end - 1):
        with pytest.raises(ValueError, match=f"is no {ctype}"):
            literal(value, ctype)
