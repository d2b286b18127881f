"""Random controllers in every arithmetic: the C and the reference, written independently, agree in
every bit.

Red when one bit of one random controller differs.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from focgen.codegen.generate import folder_files
from focgen.control.files import controller_text
from focgen.errors import PlanError
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.verification.host import Library
from focgen.verification.verify import compare
from tests.controllers import random_controller

ARITHMETICS = ("f64", "f32", "q31", "q15")
WANTED = 200  # controllers in every arithmetic
BATCHES = 16  # compilations
SEEDS = 14  # to a batch: now and then one cannot be realised
LENGTHS = (1, 2, 3, 7, 8, 9, 63, 64, 65, 127, 128, 129)  # about the edges of blocks


def planned(seed: int):
    """The plans of one random controller, every arithmetic that can carry it; some with a length at a block's
    edge.
    """
    controller = random_controller(seed, 300)
    if seed % 3 == 0:
        controller = replace(controller, length=LENGTHS[seed // 3 % len(LENGTHS)])
    for arithmetic in ARITHMETICS:
        try:
            yield build_plan(controller, arithmetic, name=f"c{seed}_{arithmetic}")
        except PlanError:
            continue


def compiled(plans, folder: Path) -> Library:
    for plan in plans:
        write_files(folder, folder_files(plan, controller_text(plan.controller).encode()))
    return Library(plans, [folder] * len(plans), flags=("-std=c99", "-O1", "-ffp-contract=off"))


def check(seeds, folder: Path, samples: int) -> Counter[str]:
    """Compare every plan of the seeds; returns how many there were of each arithmetic."""
    plans = [plan for seed in seeds for plan in planned(seed)]
    library = compiled(plans, folder)
    for plan in plans:
        result = compare(plan, library, samples, seed=1)
        assert result.mismatches == 0, f"{plan.name}: {result.first}"
        assert result.within, f"{plan.name}: {result.max_error} against {result.error_bound}"
        assert result.samples >= samples
    return Counter(plan.arithmetic for plan in plans)


@pytest.mark.parametrize(
    "half", [None, *(pytest.param(h, marks=pytest.mark.long) for h in range(2 * BATCHES))]
)
def test_random_controllers_agree_in_every_bit(half, tmp_path):
    """200 controllers in four arithmetics, 10⁴ samples each, half a batch at a time, in the long suite; here
    the first four with fewer samples.
    """
    if half is None:
        assert min(check(range(4), tmp_path, 3_000)[arithmetic] for arithmetic in ARITHMETICS) >= 3
        return
    found = check(range(half * SEEDS // 2, (half + 1) * SEEDS // 2), tmp_path, 10_000)
    assert min(found[arithmetic] for arithmetic in ARITHMETICS) >= WANTED // BATCHES // 2


@pytest.mark.long
@pytest.mark.parametrize("batch", range(40))
def test_many_random_controllers_agree_in_every_bit(batch, tmp_path):
    assert check(range(1000 + batch * SEEDS, 1000 + (batch + 1) * SEEDS), tmp_path, 40_000)


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_first_order_equals_the_hand_written_recursion(arithmetic, tmp_path):
    """At α = 1 a lag 1/(T s + 1) is v_k = (e_k + A v_{k−1})/(1 + A), A = T/h: the same in the type's own
    arithmetic.
    """
    from focgen.fractional.transfer import TransferFunction
    from focgen.plan.scenario import Scenario
    from tests.controllers import simple

    controller = simple(TransferFunction([(1.0, 0.0)], [(0.15, 1.0), (1.0, 0.0)]), name="lag")
    plan = build_plan(controller, arithmetic)
    library = compiled([plan], tmp_path)
    kind = {"f64": np.float64, "f32": np.float32}.get(arithmetic, np.int64)
    rng = np.random.default_rng(5)
    span = (plan.reference.low, plan.reference.high)
    ref = rng.uniform(*span, (1, 3000)) if kind is not np.int64 else rng.integers(*map(int, span), (1, 3000))
    ref = ref.astype(kind)
    seen = library.run(plan, Scenario(ref, np.zeros_like(ref)))
    assert np.array_equal(seen.u[0], by_hand(plan, ref[0], kind))


def by_hand(plan, error, kind):
    """The recursion with the two weights the plan has at α = 1."""
    (b,), (a,) = plan.direct.weights, plan.feedback.table.weights
    out, v, carry = [], kind(0), 0
    for e in error:
        if kind is not np.int64:
            v = kind(kind(b) * e) - kind(kind(a) * v)
            u = kind(plan.constant_gain) * v
        else:
            half = lambda x, n: (x + ((1 << n) >> 1)) >> n
            x = half(int(b) * int(e), plan.direct.blocks[0].align) + carry
            x -= half(int(a) * int(v), plan.feedback.table.blocks[0].align)
            v = half(x, plan.narrow)
            carry = x - (v << plan.narrow)
            u = half(int(plan.constant_gain) * v, plan.gain_shift)
        out.append(min(max(u, plan.output.low), plan.output.high))
    return np.array(out, dtype=kind if kind is not np.int64 else np.int64)
