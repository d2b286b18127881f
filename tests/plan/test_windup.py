"""What is said of the integral of the terms of negative order at a limit and at a reset, beside runs.

Red when it no longer does what is said, or what is said to help does not.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.remarks import remarks
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_raw
from tests.controllers import simple

RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (0.0, 10.0))
LASTED, LATER = 1500, 9000  # samples


def at_limit(order: float, arithmetic: str, turned: float, resets: tuple[Reset, ...] = ()) -> int:
    """For how many samples the output stays at its limit after the error has turned from 0.9."""
    transfer = TransferFunction([(1.0, 0.0), (2.0, -order)])
    controller = simple(transfer, integrator=True, ranges=RANGES, memory="exponential")
    plan = build_plan(controller, arithmetic)
    ref = np.concatenate([np.full(LASTED, 0.9), np.full(LATER, turned)])[None]
    scenario = to_raw(plan, Scenario(ref, np.zeros_like(ref), resets=resets))
    u = physical_trace(plan, execute(plan, scenario)).u[0]
    assert u[LASTED - 1] == 10.0
    return int(np.argmax(u[LASTED:] < 10.0)) if (u[LASTED:] < 10.0).any() else LATER


@pytest.mark.parametrize(
    "order, arithmetic",
    [
        (0.5, "f64"),
        (1.0, "q31"),
        pytest.param(0.5, "q31", marks=pytest.mark.long),
        pytest.param(1.0, "f64", marks=pytest.mark.long),
    ],
)
def test_ahead_of_an_integrator_it_winds_up_for_as_long_as_is_said(arithmetic, order):
    """Up to as long as the error has lasted, at a fifth of its size up to five times; a reset ends it."""
    same, fifth = (at_limit(order, arithmetic, -e) for e in (0.9, 0.18))
    assert 100 < same <= LASTED and same < fifth <= 5 * LASTED
    assert order < 1.0 or fifth > 4.5 * LASTED
    reset = Reset(0, LASTED, -0.18, 0.0, 10.0)
    assert at_limit(order, arithmetic, -0.18, (reset,)) == 0


@pytest.mark.parametrize("arithmetic", ["q15", "q31", "f32", "f64"])
def test_without_an_integrator_a_reset_ignores_its_output_and_the_remedy_does_not(arithmetic):
    """PI as 2 + 1/s, and as (2 s + 1) ahead of the integrator."""
    first = []
    for num, integrator in (([(2.0, 0.0), (1.0, -1.0)], False), ([(2.0, 1.0), (1.0, 0.0)], True)):
        controller = simple(TransferFunction(num), integrator=integrator, ranges=RANGES)
        plan, ref = build_plan(controller, arithmetic), np.zeros((1, 3))
        scenario = to_raw(plan, Scenario(ref, ref, resets=(Reset(0, 0, 0.0, 0.0, 6.0),)))
        first.append(physical_trace(plan, execute(plan, scenario)).u[0, 0])
        said = [r for r in remarks(plan) if "reset and track ignore" in r]
        assert len(said) == (not integrator)
    assert first == pytest.approx([0.0, 6.0], abs=1e-3)


def test_what_is_said_goes_with_the_integrals_that_there_are():
    half = TransferFunction([(1.0, 0.0), (2.0, -0.5)])
    for integrator, word in ((True, "winds up"), (False, "reset and track ignore")):
        plan = build_plan(simple(half, integrator=integrator, ranges=RANGES), "f64")
        assert [word in r for r in remarks(plan)].count(True) == 1
    plain = build_plan(simple(TransferFunction([(1.0, 0.0)]), integrator=True), "f64")
    assert not any("winds up" in r for r in remarks(plain))
