"""Plans with an exponential memory: bounds, proofs and responses against truths that know nothing of the
plan.

Red when a bound or a proof does not hold for modes.
"""

from dataclasses import replace

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.banks import drive_error
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.formats import span
from focgen.plan.ideal import ideal
from focgen.plan.response import designed_response, running_response
from focgen.plan.scenario import Reset, Scenario, physical_trace, to_physical, to_raw
from focgen.plan.worst import worst_case_input
from tests.controllers import random_controller, random_scenario, seed_controller, simple
from tests.plan.test_bounds import shares

ARITHMETICS = ("f64", "f32", "q31", "q15")
ASKED = {"memory": "exponential", "tolerance": 1e-3, "horizon": 10_000}
RANGES = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-60.0, 60.0))
SUM = simple(TransferFunction([(1.32, 0.6), (1.0, 0.0)]), ranges=RANGES)
RECURSION = simple(
    TransferFunction([(0.02, 1.3), (0.5, 0.6), (1.0, 0.0)], [(0.1, 0.8), (1.0, 0.0)]), ranges=RANGES
)


@pytest.mark.parametrize(
    "seed", [*(2, 3, 5, 7), *(pytest.param(s, marks=pytest.mark.long) for s in (0, 1, 4, 6, *range(8, 300)))]
)
def test_bounds_hold_for_physical_inputs_anywhere_in_their_ranges(seed):
    """Against the same poles and weights in float64, each mode as a recursion of its own."""
    controller = random_controller(seed)
    physical = random_scenario(controller, seed, lanes=3, samples=160)
    for arithmetic in ARITHMETICS:
        try:
            plan = build_plan(controller, arithmetic, **ASKED)
        except PlanError:
            continue
        reference = ideal(controller, physical, plan.length, plan.memories)
        operator, output = shares(plan, physical, to_raw(plan, physical), reference)
        assert operator <= 1.0 and output <= 1.0, arithmetic


@pytest.mark.parametrize(
    "arithmetic, near",
    [
        ("q15", 0.2),
        pytest.param("q31", 0.2, marks=pytest.mark.long),
        pytest.param("f32", 0.01, marks=pytest.mark.long),
        ("f64", 3e-4),
    ],
)
def test_bounds_are_not_far_above_what_extreme_inputs_reach(arithmetic, near):
    plan, rng = build_plan(SUM, arithmetic, **ASKED), np.random.default_rng(1)
    ref = np.repeat(rng.choice([-1.0, 1.0], (6, 1500)), 2, axis=1) * rng.uniform(0.999, 1.0, (6, 3000))
    physical = Scenario(ref, -ref)
    reference = ideal(SUM, physical, plan.length, plan.memories)
    operator, _ = shares(plan, physical, to_raw(plan, physical), reference)
    assert near < operator <= 1.0


@pytest.mark.parametrize("controller", [SUM, RECURSION], ids=["sum", "recursion"])
def test_truncation_holds_against_infinite_memory(controller):
    """Within the horizon by the smaller bound, beyond it by the larger one."""
    asked = {**ASKED, "horizon": 500, "tolerance": 1e-2}
    plan = build_plan(controller, "f64", **asked)
    rng = np.random.default_rng(2)
    ref = np.repeat(rng.uniform(-1.0, 1.0, (4, 100)), 50, axis=1)
    ref[0], ref[1, 2500:] = 1.0, -ref[1, :2500]
    physical = Scenario(ref, np.zeros_like(ref), None, tuple(Reset(i, 0, -1.0, 0.0, 0.0) for i in range(4)))
    same, endless = ideal(controller, physical, plan.length, plan.memories), ideal(controller, physical)
    error, bound = np.abs(same.d - endless.d), plan.error_bound
    assert bound.within_horizon < bound.truncation
    assert error[:, :500].max() <= bound.within_horizon
    assert 1e-3 * bound.truncation < error.max() <= bound.truncation


@pytest.mark.parametrize(
    "controller, arithmetic",
    [
        *(pytest.param(SUM, arithmetic, id=f"sum-{arithmetic}") for arithmetic in ARITHMETICS),
        *(pytest.param(RECURSION, arithmetic, id=f"recursion-{arithmetic}") for arithmetic in ("f32", "q15")),
        *(
            pytest.param(RECURSION, arithmetic, id=f"recursion-{arithmetic}", marks=pytest.mark.long)
            for arithmetic in ("f64", "q31")
        ),
    ],
)
def test_after_a_reset_nothing_moves(controller, arithmetic):
    """The error has been constant for ever, and goes on: the memory adds nothing, not even a rounding."""
    plan = build_plan(controller, arithmetic, **ASKED)
    resets = (Reset(0, 3, 0.71, -0.2, 0.0), Reset(1, 5, -0.33, 0.1, 0.0))
    ref, meas = np.full((2, 40), 0.9), np.full((2, 40), 0.4)
    for r in resets:
        ref[r.lane, r.sample :], meas[r.lane, r.sample :] = r.ref, r.meas
    raw = to_raw(plan, Scenario(ref, meas, None, resets))
    after = [execute(plan, raw).d[r.lane, r.sample :] for r in resets]
    if controller is SUM:
        assert all(np.ptp(d) == 0 for d in after)
    allowed = 1e-3 if arithmetic == "q15" else 1e-5
    for d, r in zip(after, resets):
        assert np.abs(d * plan.increment.lsb - (r.ref - r.meas)).max() < allowed


@pytest.mark.parametrize("arithmetic", ARITHMETICS)
@pytest.mark.parametrize("controller", [SUM, RECURSION], ids=["sum", "recursion"])
def test_the_running_response_is_that_of_the_impulse_response(controller, arithmetic):
    """The transform of what a reference with these poles answers to a unit sample; and near the designed
    one."""
    plan = build_plan(controller, arithmetic, **ASKED)
    unit = np.zeros((1, 4096))
    unit[0, 0] = 1.0
    answer = ideal(controller, Scenario(unit, np.zeros_like(unit)), plan.length, plan.memories).d[0]
    answer = answer - answer[-1] * (np.arange(4096) > 0)  # the slow modes' last, which a window would cut
    omega = np.array([3.0, 30.0, 200.0])
    expected = np.exp(-1j * np.outer(omega, np.arange(4096)) * plan.sample_time) @ answer
    near = 2e-2 if arithmetic == "q15" else 2e-3
    np.testing.assert_allclose(running_response(plan, omega), expected, rtol=near)
    slow = np.array([0.05, 0.5])
    np.testing.assert_allclose(running_response(plan, slow), designed_response(controller, slow), rtol=2e-2)


def test_every_mean_stays_where_it_is_proved_to():
    """Inputs that hold an end long enough for the means to get there, and the widest swings between."""
    for arithmetic in ("q31", "q15"):
        plan = build_plan(SUM, arithmetic, **{**ASKED, "horizon": 200})
        rng = np.random.default_rng(3)
        e = np.repeat(rng.choice([-1, 1], 40), 400) * int(plan.error.high)
        for bank in plan.direct.banks:
            worst = replay(bank, e)
            assert worst["mean"] <= span(bank.state).worst and worst["drive"] <= span(bank.drive).worst
            assert worst["mean"] >= 0.9 * span(bank.state).worst * (bank.real_rates[-1] > 0.01)
            assert worst["drive"] >= 0.9 * span(bank.drive).worst


def replay(bank, e) -> dict[str, int]:
    """Python's own integers, which cannot overflow."""
    means = [0] * bank.modes
    worst = {"mean": 0, "drive": 0}
    for value in (int(x) << bank.up for x in e):
        for i, rate in enumerate(bank.rates):
            drive = (value - means[i] + (1 << bank.to_drive >> 1)) >> bank.to_drive
            means[i] += (rate * drive + (1 << bank.rate_shift >> 1)) >> bank.rate_shift
            worst = {"mean": max(worst["mean"], abs(means[i])), "drive": max(worst["drive"], abs(drive))}
    return worst


@pytest.mark.parametrize(
    "controller, arithmetic",
    [
        pytest.param(
            controller, arithmetic, id=f"{name}-{arithmetic}", marks=pytest.mark.long if slow else ()
        )
        for name, controller in (("sum", SUM), ("recursion", RECURSION), ("paper", seed_controller()))
        for arithmetic, slow in (("q31", name == "recursion"), ("q15", name == "recursion"))
    ],
)
def test_worst_inputs_stay_within_the_proofs(controller, arithmetic):
    plan = build_plan(controller, arithmetic, **ASKED)
    proofs = {p.node: p for p in plan.proofs}
    for name in ("mean", "departure", "drive", "rate product", "sum"):
        assert f"direct bank 0 {name}" in proofs
    assert all(p.worst <= p.limit for p in proofs.values())
    for node in proofs:
        trace = execute(plan, worst_case_input(plan, node))
        assert np.abs(trace.d).max() <= proofs["increment"].worst


def test_slow_modes_have_the_width_they_need():
    long = {**ASKED, "horizon": 10**7}
    fast, slow = build_plan(SUM, "q15", **long).direct.banks
    assert (fast.state.bits, slow.state.bits) == (32, 64) and slow.rate.bits == 32
    fast, slow = build_plan(SUM, "q31", **long).direct.banks
    assert fast.rate_shift == 0 < slow.rate_shift and slow.rates[-1] > 10_000
    fast, slow = build_plan(SUM, "f32", **long).direct.banks
    assert not fast.compensated and slow.compensated
    (only,) = build_plan(SUM, "f64", **long).direct.banks
    assert not only.compensated


def test_float32_alone_would_stand_still():
    """A mean of one float stops on its way to a constant; the pair of floats goes on."""
    q, u = np.float32(2.0**-20), np.float32(1.0)
    alone = mean = rest = np.float32(0.999)
    rest = np.float32(0.0)
    for _ in range(200_000):
        alone = alone + q * (u - alone)
        drive = (u - mean) - rest
        step = rest + q * drive
        mean, rest = mean + step, step - ((mean + step) - mean)
    exact = 1.0 - (1.0 - float(np.float32(0.999))) * (1.0 - 2.0**-20) ** 200_000
    assert alone == np.float32(0.999)
    assert abs(float(mean) + float(rest) - exact) < 1e-8


def test_tolerance_and_horizon_come_from_the_controller_where_they_are_not_given():
    own = replace(SUM, memory="exponential", tolerance=3e-3, horizon=2000)
    plan = build_plan(own, "q31")
    assert (plan.memory, plan.tolerance, plan.horizon, plan.length) == ("exponential", 3e-3, 2000, 1)
    assert plan.memories[0].tolerance <= 3e-3 and plan.states == plan.memories[0].states
    assert build_plan(own, "q31", memory="short", length=7).states == 0
    assert build_plan(own, "q31", tolerance=1e-5).states > plan.states


@pytest.mark.parametrize(
    "transfer, asked, says",
    [
        (TransferFunction([(1.0, 2.5)]), {}, "exponential memory ends at 2"),
        (TransferFunction([(1.0, 0.6)]), {"tolerance": 1e-9}, "tolerance"),
        (TransferFunction([(1.0, 0.6)]), {"horizon": 10**9}, "horizon"),
        (TransferFunction([(1.0, 0.6)]), {"tolerance": float("nan")}, "tolerance"),
        (TransferFunction([(1.0, 0.0)], [(-0.05, 0.9), (1.0, 0.0)]), {}, "stable"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(transfer, asked, says):
    with pytest.raises(PlanError, match=says) as caught:
        build_plan(simple(transfer), "q31", **{**ASKED, **asked})
    assert len(str(caught.value).splitlines()) == 1


def test_to_physical_and_back_is_what_the_reference_sees():
    """Whole counts in, exact numbers out: the reference's inputs are the plan's."""
    plan = build_plan(SUM, "q15", **ASKED)
    raw = to_raw(plan, random_scenario(SUM, 5, lanes=2, samples=50))
    trace = physical_trace(plan, execute(plan, raw))
    reference = ideal(SUM, to_physical(plan, raw), plan.length, plan.memories)
    inputs = dict(plan.error_bound.parts)["inputs"]
    assert np.abs(trace.d - reference.d).max() <= plan.error_bound.operator - inputs


@pytest.mark.parametrize("arithmetic", ["q31", "q15"])
@pytest.mark.parametrize("horizon", [pytest.param(200, marks=pytest.mark.long), 10**7])
def test_rounding_of_the_drives_costs_what_is_said_and_no_more(arithmetic, horizon):
    """Each bank's integers against the same rates and weights without rounding; an adversary comes near."""
    plan = build_plan(SUM, arithmetic, **{**ASKED, "horizon": horizon})
    rng = np.random.default_rng(4)
    for bank in plan.direct.banks:
        alone = replace(plan.direct, banks=(bank,))
        allowed = drive_error(alone) * alone.total.lsb / plan.error.lsb  # in counts of e
        assert 0.25 * allowed < adversary(bank, plan.error, rng) <= allowed


def adversary(bank, form, rng) -> float:
    """The largest error that greedy search finds: each sample the one of several that adds most to it."""
    rates, weights = np.array(bank.real_rates), np.array(bank.values)
    whole, real, worst = np.zeros(bank.modes, np.int64), np.zeros(bank.modes), 0.0
    rate = np.array(bank.rates)
    for _ in range(3000):
        choices = rng.integers(int(form.low) // 2, int(form.high) // 2, 64)
        drives = ((choices[:, None] << bank.up) - whole + (1 << bank.to_drive >> 1)) >> bank.to_drive
        exact = choices[:, None] - real
        errors = (drives * 2.0 ** (bank.to_drive - bank.up) - exact) @ weights
        best = int(np.argmax(errors))
        worst = max(worst, float(errors[best]))
        low = int(np.argmin(errors))  # what lowers the error now raises it later
        whole = whole + ((rate * drives[low] + (1 << bank.rate_shift >> 1)) >> bank.rate_shift)
        real = real + rates * exact[low]
    return worst
