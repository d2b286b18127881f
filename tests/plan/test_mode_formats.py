"""The formats of modes, and of the sums that they are in, beside what their histories can make of them.

Red when a format leaves out a value that can come, or is wider than it has to be.
"""

from __future__ import annotations

import math

import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.plan.banks import drive_error
from focgen.plan.plan import Bank
from tests.controllers import simple
from tests.plan.derived import planned, plans
from tests.plan.ledger import half, hull, minus, reached, shifted, span, weighted, worst
from tests.plan.test_reached import SEEDS, SUMS, finer, fixed, top


@fixed
def test_what_drives_round_is_a_count_of_each_and_what_their_means_shift_out(arithmetic):
    """Half a count of D at once, half of the past; half a count of L every sample, which q takes away."""
    slow = simple(TransferFunction([(1.32, 0.6), (1.0, 0.0)]))
    plan, shift_seen = planned(slow, arithmetic, memory="exponential", tolerance=1e-2, horizon=10**7), 0
    cost = 0.0
    for bank in plan.direct.banks:
        shift_seen += bank.rate_shift > 0
        for c, q in zip(bank.values, bank.real_rates):
            cost += abs(c) * bank.drive.lsb
            cost += abs(c) * 0.5 * bank.state.lsb / q * (bank.rate_shift > 0)
    assert drive_error(plan.direct) == pytest.approx(cost / plan.direct.total.lsb, rel=1e-12)
    proofs = {proof.node: proof.worst for proof in plan.proofs}
    assert proofs == reached(plan, proofs["v"])
    assert len(plan.direct.banks) == 2 and shift_seen == (arithmetic == "q31")


@pytest.mark.parametrize(
    "seeds, arithmetic",
    [
        pytest.param(seeds, kind, id=f"{seeds.start}-{kind}", marks=() if turn % 2 == i else pytest.mark.long)
        for turn, seeds in enumerate(SEEDS)
        for i, kind in enumerate(("q15", "q31"))
    ],
)
def test_the_formats_of_sums_and_modes_are_what_they_can_reach(arithmetic, seeds):
    for plan in plans(seeds, arithmetic):
        for table in plan.sums:
            whole = -top(plan.error.bits) - 1, top(plan.error.bits)
            each = span(plan.error) if table.history == "error" else whole
            unit = plan.error.lsb if table.history == "error" else plan.filtered.lsb
            assert span(table.total) == finer(table, 0)
            for block in table.blocks:
                assert span(block.sum) == weighted(block.weights, each)
                assert block.last - block.first + 1 == len(block.weights)
            for bank in table.banks:
                check_bank(bank, each, unit, plan.error.bits)


def check_bank(bank: Bank, each: tuple[int, int], unit: float, bits: int) -> None:
    """Of a history that leaves out the last count of its type, and has 0 in it."""
    most, rates = top(bits) - 1, [int(a) for a in bank.rates]
    u = hull((max(each[0], -most), min(each[1], most)), (0, 0))
    u = u if bank.differences == 1 else minus(u, u)
    spare = half(bank.to_drive) + (math.ceil(0.5 / min(bank.real_rates)) if bank.rate_shift else 0)
    low, high = u[0] * 2**bank.up, u[1] * 2**bank.up
    assert span(bank.rate) == (min(rates), max(rates)) and span(bank.state) == (low - spare, high + spare)
    far = high - low + spare
    assert span(bank.drive) == shifted((-far, far), bank.to_drive) and span(bank.sum) == weighted(
        bank.weights, span(bank.drive)
    )
    # D is as fine as its type allows, or as the history itself; weights as fine as theirs and their sum's
    guard = bank.to_drive - bank.up
    assert worst(span(bank.drive)) <= top(bits) and far + half(bank.to_drive) <= top(bank.state.bits)
    twice = worst(span(bank.drive)) * 2 > top(bits) or 2 * (far + half(bank.to_drive)) > top(bank.state.bits)
    assert guard == 0 or twice
    assert bank.state.lsb == unit * 2.0**-bank.up and bank.drive.lsb == unit * 2.0**guard
    assert (
        bank.rate.lsb == 2.0 ** -(bank.to_drive + bank.rate_shift)
        and bank.sum.lsb == bank.lsb * bank.drive.lsb
    )
    room = top(SUMS[bits]) - 2 ** (SUMS[bits] - 4)
    size = max(map(abs, bank.weights)), sum(map(abs, bank.weights)) * worst(span(bank.drive))
    assert size[0] <= top(bits) and size[1] <= room
    fine = 2 * size[0] + 1 >= top(bits) or 2 * size[1] + len(rates) * worst(span(bank.drive)) > room
    assert fine or bank.align == SUMS[bits] - 4
