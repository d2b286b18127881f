"""The reference beside the description, stepped by the book, with all that a controller can have and do.

Red when a bit of an answer, or of the state that is left, is not what the description gives.
"""

from __future__ import annotations

import numpy as np
import pytest

from focgen.fractional.transfer import TransferFunction
from focgen.plan.ending import endings
from focgen.plan.execute import execute
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario, Track, to_raw
from focgen.verification.scenarios import mistuned, mixed
from focgen.verification.unusable import strewn
from tests.controllers import simple
from tests.plan.book import Machine, by_the_book
from tests.plan.derived import dressed, planned

ARITHMETICS = ("q15", "q31", "f32", "f64")
LANES, SAMPLES = 8, 26


def scenarios(plan: Plan, seed: int) -> list[Scenario]:
    """Inside and beyond the ranges; of a floating plan with inputs and states that cannot be used."""
    found = [mixed(plan.controller, LANES * SAMPLES, seed, beyond) for beyond in (False, True)]
    raw = [mistuned(plan, to_raw(plan, physical), seed) for physical in found]
    return [raw[0], strewn(plan, raw[1], seed)] if plan.floating else raw


def check(plan: Plan, seed: int) -> None:
    for raw in scenarios(plan, seed):
        u, d, flags, machines = by_the_book(plan, raw)
        trace, ends = endings(plan, raw)
        again = execute(plan, raw)
        for made in (trace, again):
            assert (
                np.array_equal(made.u, u) and np.array_equal(made.d, d) and np.array_equal(made.flags, flags)
            )
        for lane, (end, machine) in enumerate(zip(ends, machines)):
            state(plan, end, machine, trace.u[lane, -1])


def state(plan: Plan, end, machine: Machine, last) -> None:
    """What the C keeps."""
    lags, past = plan.error_lags, [*end.error[::-1], *[end.error_rest] * (plan.error_lags + 1)]
    assert past[:lags] == machine.errors[:lags] and end.output == last
    if plan.feedback:
        past = [*end.filtered[::-1], *[end.filtered_rest] * (plan.filtered_lags + 1)]
        assert past[: plan.filtered_lags] == machine.filtered[: plan.filtered_lags]
        assert end.carry == machine.carry
    if plan.inner:
        assert (end.inner, end.r) == (machine.z, machine.r)
    if plan.integrator:
        assert end.integral == machine.total_i
        assert end.starting == (machine.fresh and (plan.schedule is not None or plan.tuning is not None))
        assert machine.fresh or end.increment == machine.d
    for (name, i), means in end.means.items():
        assert means.tolist() == list(machine.banks[name][i][0])
        assert end.rests[name, i].tolist() == list(machine.banks[name][i][1]) or not plan.floating
    if plan.set_point:
        wanted = {"lag": machine.lag, "latest": machine.latest} if plan.floating else {"set_point": machine.F}
        assert end.aim == wanted
    if plan.tuning:
        assert (end.applied.low, end.applied.high) == (machine.low, machine.high)
        own = machine.own.gains if plan.schedule else (machine.constant,)
        assert tuple(map(float, end.applied.gains)) == tuple(map(float, own))


@pytest.mark.parametrize(
    "seed", [*range(5), *(pytest.param(s, marks=pytest.mark.long) for s in range(5, 18))]
)
@pytest.mark.parametrize("arithmetic", ARITHMETICS)
def test_the_reference_does_what_is_written(arithmetic, seed):
    plan = planned(dressed(seed, 12), arithmetic)
    if plan:
        check(plan, seed)


@pytest.mark.parametrize(
    ("arithmetic", "seed"),
    [
        pytest.param("q15", 1, marks=pytest.mark.long),
        ("q31", 2),
        ("f32", 11),
        ("f64", 0),
        ("q15", 4),
        pytest.param("f32", 5, marks=pytest.mark.long),
    ],
)
def test_the_reference_does_with_modes_what_is_written(arithmetic, seed):
    plan = planned(dressed(seed, 12), arithmetic, memory="exponential", tolerance=0.05, horizon=100)
    assert plan.states
    check(plan, seed)


@pytest.mark.parametrize("arithmetic", ("f32", "f64"))
@pytest.mark.parametrize("order", ("track, reset", "reset, track", "track, track", "reset, reset"))
def test_what_is_called_between_steps_that_are_left_out_counts_in_its_order(arithmetic, order):
    """Ahead of one good sample: a reset forgets a track, a track moves what a reset has set."""
    plan = planned(simple(TransferFunction([(1.0, 0.0), (0.01, 0.5)]), integrator=True, length=5), arithmetic)
    kind = np.float32 if arithmetic == "f32" else np.float64
    ref = np.full((1, 7), 0.3, kind)
    ref[0, 2:5] = np.nan
    events = [(word.strip(), k) for k, word in zip((3, 4), order.split(","))]
    resets = tuple(Reset(0, k, kind(0.1), kind(0.2), kind(3.0 + k)) for word, k in events if word == "reset")
    tracks = tuple(Track(0, k, kind(-2.0 - k)) for word, k in events if word == "track")
    raw = Scenario(ref, np.zeros_like(ref), None, resets, tracks)
    u, d, flags, _ = by_the_book(plan, raw)
    made = execute(plan, raw)
    assert np.array_equal(made.u, u) and np.array_equal(made.d, d) and np.array_equal(made.flags, flags)
