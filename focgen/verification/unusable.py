"""Floating inputs that cannot be used, strewn over a scenario: NaN, infinities and what is just too large."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from focgen.arrays import Numbers
from focgen.plan.plan import Plan
from focgen.plan.scenario import Damage, Scenario
from focgen.plan.usable import EXPONENT, invalid_samples

_SHARE = 0.1  # of the samples of an input
_LONGEST = 12  # samples in a row


def strewn(plan: Plan, scenario: Scenario, seed: int) -> Scenario:
    """A raw floating scenario in which inputs cannot be used now and then, alone and in rows; nor can an
    argument of every other reset and track; nor, twice a lane, the state.

    The first lane begins so, and the last holds some of the largest values that can be used.
    """
    rng = np.random.default_rng([seed, 48])
    kind = scenario.ref.dtype.type
    bad = np.array([np.nan, np.inf, -np.inf, limit(plan), -limit(plan)], kind)
    signals: dict[str, Any] = {"ref": scenario.ref.copy(), "meas": scenario.meas.copy()}
    if scenario.sched is not None:
        signals["sched"] = scenario.sched.copy()
    for values in signals.values():
        where = _places(rng, values.shape)
        values[where] = rng.choice(bad, np.count_nonzero(where))
    first = signals["ref"][0, :2]
    first[:] = bad[: first.size]
    others = [values[-1] for name, values in signals.items() if name != "meas"]
    _largest(rng, signals["meas"][-1], others, kind(limit(plan)))
    resets, tracks = _resets(rng, scenario, bad), _tracks(rng, scenario, bad)
    made = Scenario(**signals, resets=resets, tracks=tracks, tunes=scenario.tunes)
    return replace(made, damages=_damages(plan, made, rng))


def limit(plan: Plan) -> float:
    """The least magnitude that cannot be used."""
    return 2.0 ** EXPONENT[plan.output.ctype]


def _places(rng: np.random.Generator, shape: tuple[int, int]) -> Numbers:
    """Rows of samples, about ``_SHARE`` of all."""
    where = np.zeros(shape, bool)
    for lane in where:
        for _ in range(max(1, int(_SHARE * lane.size / (_LONGEST / 4)))):
            begin = int(rng.integers(lane.size))
            lane[begin : begin + int(_LONGEST ** rng.uniform())] = True
    return where


def _largest(rng: np.random.Generator, values: Numbers, others: list[Numbers], bound: float) -> None:
    """Put a few of the largest usable values in, where the other inputs are good, near the end: they stay in
    the memory.
    """
    good = np.flatnonzero(np.all(np.abs(others) < bound, axis=0))
    late = good[-(values.size // 4) :]
    if late.size:
        places = rng.choice(late, min(3, late.size), replace=False)
        values[places] = np.nextafter(bound, values.dtype.type(0)) * rng.choice([-1, 1], places.size)


def _damages(plan: Plan, scenario: Scenario, rng: np.random.Generator) -> tuple[Damage, ...]:
    """Of every lane's state one or two, ahead of samples that can be used; a plan without a past has none."""
    if not (plan.error_lags or plan.feedback or plan.integrator):
        return ()
    good, begun = ~invalid_samples(plan, scenario), {(r.lane, r.sample) for r in scenario.resets}
    kinds = ["error"] * bool(plan.error_lags) + ["all"] + ["integral"] * bool(plan.integrator)
    kinds += ["limits", "gains"] * bool(plan.tuning)
    found = []
    for lane in range(scenario.lanes):
        places = [k for k in np.flatnonzero(good[lane]).tolist() if (lane, k) not in begun]
        last = [k for k in places if not good[lane, min(k + 1, scenario.samples - 1)]]  # ahead of bad ones
        chosen = {int(rng.choice(some)) for some in (places, last) if some}
        found += [Damage(lane, k, kinds[(lane + i) % len(kinds)]) for i, k in enumerate(sorted(chosen))]
    return tuple(found)


def _resets(rng: np.random.Generator, scenario: Scenario, bad: Numbers) -> tuple[Any, ...]:
    changed = []
    for reset in scenario.resets:
        name = rng.choice(["ref", "meas", "u0"])
        changed.append(replace(reset, **{name: rng.choice(bad)}) if rng.random() < 0.5 else reset)
    return tuple(changed)


def _tracks(rng: np.random.Generator, scenario: Scenario, bad: Numbers) -> tuple[Any, ...]:
    return tuple(replace(t, u=rng.choice(bad)) if rng.random() < 0.5 else t for t in scenario.tracks)
