"""The bounds beside exact arithmetic: sixty digits for controllers, fractions for single sums and gains.

Red when an error exceeds what is proved of it, or a proof is of another operation than the one that runs.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from focgen.control.controller import ControllerRanges, GainSchedule, Tunable
from focgen.errors import PlanError
from focgen.fractional.transfer import TransferFunction
from focgen.plan.build import build_plan
from focgen.plan.execute import execute
from focgen.plan.gain_errors import floating_pieces
from focgen.plan.rounding import half_place, taps_error
from focgen.plan.scenario import Params, Scenario, physical_trace, to_raw
from focgen.plan.tuning import applied, tuned
from focgen.plan.values import interpolated
from tests.controllers import random_controller, simple
from tests.equality.drawn import drawn
from tests.equality.inputs import driven
from tests.plan.exact import exact_operator

LANES, SAMPLES = 32, 44


def few(scenario: Scenario, lanes: list[int]) -> Scenario:
    """Some lanes of a scenario without resets."""
    tunes = tuple(replace(t, lane=lanes.index(t.lane)) for t in scenario.tunes if t.lane in lanes)
    sched = None if scenario.sched is None else scenario.sched[lanes]
    return Scenario(scenario.ref[lanes], scenario.meas[lanes], sched, tunes=tunes)


def shares(plan, physical: Scenario) -> np.ndarray:
    """The error in every sample over its bound, shape (lanes, samples)."""
    error = np.abs(
        physical_trace(plan, execute(plan, to_raw(plan, physical))).d - exact_operator(plan, physical)
    )
    bound, count = plan.error_bound, np.arange(1, physical.samples + 1)
    allowed = np.full(count.shape, bound.operator)
    if bound.operator_per_sample:
        allowed = np.minimum(allowed, count * bound.operator_per_sample)
    return error / allowed


@pytest.mark.parametrize(
    "seeds",
    [
        range(0, 36, 3),
        pytest.param(range(36), marks=pytest.mark.long),
        *(pytest.param(range(a, a + 60), marks=pytest.mark.long) for a in range(36, 960, 60)),
    ],
    ids=lambda seeds: f"{seeds.start}-{seeds.stop}-{seeds.step}",
)
def test_no_driven_error_exceeds_its_bound(seeds):
    """Every kind of controller that the campaign of equality draws, in four arithmetics."""
    found: dict[str, list[float]] = {"q15": [], "q31": [], "f32": [], "f64": []}
    for seed in seeds:
        one = drawn(seed)
        if one is None:
            continue
        physical = few(driven(one.plan, SAMPLES, seed), [seed % 8, 8 + seed % 8, 16 + seed % 16])
        worst = float(shares(one.plan, physical).max())
        assert worst <= 1.0, f"seed {seed} in {one.plan.arithmetic}: {worst}"
        found[one.plan.arithmetic].append(worst)
    assert all(len(one) >= len(seeds) // 8 for one in found.values())
    least = {"q15": 0.05, "q31": 0.03, "f32": 0.02, "f64": 5e-4}
    assert all(np.median(one) > least[name] for name, one in found.items()), "they are driven"


def test_half_a_last_place_is_what_rounding_costs():
    """Of any number up to a largest one; a power of two itself costs nothing."""
    rng = np.random.default_rng(1)
    for largest in (1.0, 1.0 + 2.0**-40, 1.99, 2.0, 3e-9, 7e20):
        x = largest * np.concatenate([rng.uniform(-1.0, 1.0, 4000), 1.0 - 10.0 ** -rng.uniform(1, 16, 4000)])
        for kind, unit in ((np.float32, 2.0**-24), (np.float64, 2.0**-53)):
            error = max(abs(Fraction(float(kind(v))) - Fraction(float(v))) for v in x.tolist())
            assert error <= half_place(largest, unit)
            known = kind is np.float64 or largest == 1.0 + 2.0**-40  # nothing in it is rounded as much
            assert known or error > 0.98 * half_place(largest, unit)
    assert half_place(2.0, 2.0**-24) == 2.0**-24 and half_place(0.0, 2.0**-24) == 0.0


@pytest.mark.parametrize("seed", range(12))
def test_a_sum_of_taps_is_within_its_last_places(seed):
    """Random weights, some of them 0 or powers of two; histories at and between their ends."""
    rng, unit = np.random.default_rng([seed, 3]), 2.0**-24
    weights = (rng.normal(size=rng.integers(1, 9)) * 10.0 ** rng.uniform(-3, 3)).astype(np.float32)
    weights = np.where(rng.random(len(weights)) < 0.2, np.float32(rng.choice([0.0, 0.25, -2.0])), weights)
    low, high = -float(rng.uniform(0.0, 2.0)), float(rng.uniform(0.1, 2.0))
    x = rng.uniform(low, high, (20_000, len(weights)))
    ends = rng.choice([low, high], x.shape) * (1.0 - rng.uniform(0.0, 1e-4, x.shape))
    x = np.clip(np.where(rng.random(len(x))[:, None] < 0.7, ends, x), low, high).astype(np.float32)
    made = np.zeros(len(x), np.float32)
    for lag in range(len(weights) - 1, -1, -1):
        made = made + weights[lag] * x[:, lag]
    exact = x.astype(np.longdouble) @ weights.astype(np.longdouble)  # 48 bits of product, 16 to spare
    worst = int(np.argmax(np.abs(made - exact)))
    terms = (Fraction(float(w)) * Fraction(float(v)) for w, v in zip(weights, x[worst]))
    error = abs(float(Fraction(float(made[worst])) - sum(terms)))
    span = float(x.min(initial=0.0)), float(x.max(initial=0.0))
    bound = taps_error(weights.tolist(), span, unit)
    assert error <= bound
    assert bound == 0.0 or error > bound / (2.0 + len(weights))


@pytest.mark.parametrize(
    "factors, arithmetic",
    [
        *((None, "f64"), ((0.4, 1.7), "f32")),
        *(pytest.param(*case, marks=pytest.mark.long) for case in ((None, "f32"), ((0.4, 1.7), "f64"))),
    ],
)
def test_the_gain_is_as_near_as_its_piece_of_the_schedule_says(arithmetic, factors):
    """Thousands of values of the scheduling signal and, where it has any, of the factors."""
    kind, unit = (np.float32, 2.0**-24) if arithmetic == "f32" else (np.float64, 2.0**-53)
    tried = 0
    for seed in range(150):
        controller, rng = random_controller(seed, 4), np.random.default_rng(seed)
        if not controller.scheduled:
            continue
        low, high = controller.ranges.output
        third = (high - low) / 3.0
        box = factors and Tunable(factors, (low, low + third), (high - third, high))
        plan = _built(replace(controller, tunable=box), arithmetic)
        if plan is None:
            continue
        factor = 0.5 * plan.sample_time if plan.integrator else 1.0
        s, worst = rng.uniform(*controller.ranges.schedule, 500), 0.0
        for _ in range(12 if factors else 1):
            on = rng.uniform(*(factors or (1.0, 1.0)), len(controller.gains))
            wanted = GainSchedule(controller.schedule.breakpoints, tuple(on * controller.gains))(s)
            schedule = plan.schedule
            if factors:
                params = Params(tuple(map(float, on.astype(kind))), plan.output.low, plan.output.high)
                schedule = tuned(schedule, applied(plan, params))
            made = interpolated(schedule, s.astype(kind), kind).astype(float)
            worst = max(worst, float(np.abs(made / factor - wanted).max()))
        bound = max(piece.error for piece in floating_pieces(plan, factor, unit))
        assert worst <= bound, seed
        assert arithmetic == "f64" or worst > (0.05 if factors else 0.1) * bound, seed
        tried += 1
    assert tried > 50


def _built(controller, arithmetic):
    try:
        return build_plan(controller, arithmetic, tunable=controller.tunable is not None)
    except PlanError:
        return None


def test_an_increment_that_is_hardly_a_count_is_rounded_to_one():
    """An output of a million, moved by 1e-9 of an error's unit: what counts round is more than floats do."""
    ranges = ControllerRanges((-1.0, 1.0), (-1.0, 1.0), (-1e6, 1e6))
    given = dict(integrator=True, ranges=ranges, gain=1e-9, sample_time=2.0**-10)
    plan = build_plan(simple(TransferFunction([(1.0, 0.0)]), **given), "f32")
    rng = np.random.default_rng(2)
    e = rng.uniform(0.5, 1.0, (1, 400)).astype(np.float32).astype(float)
    share = shares(plan, Scenario(e, np.zeros_like(e)))
    assert 0.9 < share.max() <= 1.0
    assert 0.5 * plan.increment.lsb > 100.0 * 2.0**-24 * plan.constant_gain, "beyond a float's rounding"
