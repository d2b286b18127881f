"""Exponential memory in every arithmetic: C and reference agree in every bit, errors keep their bounds.

Red when one bit or one bound fails with modes.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.verification.verify import compare
from tests.controllers import random_controller, simple
from tests.verification.test_random import compiled

ARITHMETICS = ("f64", "f32", "q31", "q15")
BATCH = 5  # controllers to a compilation


def asked(seed: int) -> dict:
    """A random tolerance and horizon."""
    rng = np.random.default_rng([seed, 23])
    tolerance = float(10.0 ** rng.uniform(-5.0, -1.5))
    return {"memory": "exponential", "tolerance": tolerance, "horizon": int(10.0 ** rng.uniform(2.1, 6.0))}


def planned(seed: int):
    """The plans of one random controller with an exponential memory, every arithmetic that can carry it."""
    controller = random_controller(seed)
    for arithmetic in ARITHMETICS:
        try:
            yield build_plan(controller, arithmetic, name=f"c{seed}_{arithmetic}", **asked(seed))
        except PlanError:
            continue


def check(seeds, folder, samples: int) -> int:
    """Compare every plan of the seeds; returns how many of them have modes."""
    plans = [plan for seed in seeds for plan in planned(seed)]
    library = compiled(plans, folder)
    for plan in plans:
        result = compare(plan, library, samples, seed=1)
        assert result.mismatches == 0, f"{plan.name}: {result.first}"
        assert result.within, f"{plan.name}: {result.max_error} against {result.error_bound}"
        assert result.samples >= samples
    return sum(plan.states > 0 for plan in plans)


@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, BATCH), marks=pytest.mark.long)])
def test_random_controllers_agree_in_every_bit(seeds, tmp_path):
    assert check(seeds, tmp_path, 1600) >= 0.4 * 4 * len(seeds)


@pytest.mark.long
@pytest.mark.parametrize("batch", range(1, 60))
def test_many_random_controllers_agree_in_every_bit(batch, tmp_path):
    assert check(range(batch * BATCH, (batch + 1) * BATCH), tmp_path, 10_000) > 0


@pytest.mark.parametrize(
    "arithmetic", ["q31", *(pytest.param(a, marks=pytest.mark.long) for a in ("f64", "f32", "q15"))]
)
def test_orders_on_both_sides_of_one_together(arithmetic, tmp_path):
    """Two terms in one polynomial, above and below 1, and the same in the denominator."""
    transfer = TransferFunction([(0.02, 1.4), (0.3, 0.5), (1.0, 0.0)], [(0.004, 1.7), (0.1, 0.9), (1.0, 0.0)])
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-30.0, 30.0))
    controller = simple(transfer, name=f"both_{arithmetic}", ranges=ranges)
    plan = build_plan(controller, arithmetic, memory="exponential", tolerance=1e-4, horizon=10**5)
    assert {bank.differences for bank in plan.direct.banks} == {1, 2}
    result = compare(plan, compiled([plan], tmp_path), 4000, seed=3)
    assert result.mismatches == 0 and result.within


def test_a_whole_order_has_no_modes_and_the_same_bits_as_short_memory(tmp_path):
    pid = simple(TransferFunction([(2.0, 0.0), (0.5, -1.0), (0.1, 1.0)]), name="pid")
    plan = build_plan(pid, "q31", memory="exponential")
    short = build_plan(pid, "q31", length=30)
    assert plan.states == 0 and plan.direct == short.direct and plan.proofs == short.proofs
    assert plan.error_bound == replace(short.error_bound, within_horizon=0.0)
