"""States that no run has left, in the floating arithmetics, as the reference sees them.

A step that finds such a state is left out, as one with an unusable input is: the output stands, or is the
one before any step where that is damaged, too. The memory then begins anew, as after a reset to this sample's
error and the output that stands. So a damage is a reset ahead of a sample that is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from focgen.plan.plan import Plan
from focgen.plan.scenario import Damage, Reset, Scenario, Trace, Tune
from focgen.plan.sums import Count
from focgen.plan.tuning import courses, default_params
from focgen.plan.usable import standing


def mended(plan: Plan, scenario: Scenario, execute: Callable[[Plan, Scenario], Trace]) -> Scenario:
    """The scenario without its damages; ``execute`` runs one that has none, to find what stands."""
    while scenario.damages:
        first: dict[int, Damage] = {}
        for damage in sorted(scenario.damages, key=lambda damage: damage.sample):
            first.setdefault(damage.lane, damage)
        now = tuple(first.values())
        rest = tuple(d for d in scenario.damages if d not in now)
        scenario = replace(_mended(plan, replace(scenario, damages=()), now, execute), damages=rest)
    return scenario


def _mended(
    plan: Plan, scenario: Scenario, damages: tuple[Damage, ...], execute: Callable[[Plan, Scenario], Trace]
) -> Scenario:
    """The same of at most one damage a lane."""
    left_out = scenario.ref.copy()
    for d in damages:
        left_out[d.lane, d.sample] = np.nan
    without = replace(scenario, ref=left_out)
    stood = execute(plan, without).u
    stands = [_stands(plan, scenario, d, stood[d.lane, d.sample]) for d in damages]
    resets = [_begun(scenario, damage, u0) for damage, u0 in zip(damages, stands)]
    places = {(d.lane, d.sample) for d in damages}
    tracks = tuple(t for t in scenario.tracks if (t.lane, t.sample) not in places)
    lost = [Tune(d.lane, d.sample, default_params(plan)) for d in damages if _untuned(plan, d)]
    return replace(without, resets=(*scenario.resets, *resets), tracks=tracks, tunes=(*scenario.tunes, *lost))


def _stands(plan: Plan, scenario: Scenario, damage: Damage, u: np.floating) -> Any:
    """The output at a damage, where ``u`` stood before."""
    if damage.what in ("integral", "all"):
        return _start(plan, scenario, damage)
    return standing(plan, u, (plan.output.low, plan.output.high)) if _untuned(plan, damage) else u


def _untuned(plan: Plan, damage: Damage) -> bool:
    """Whether a damage brings the default parameters back."""
    return plan.tuning is not None and damage.what in ("all", "limits", "gains")


def _start(plan: Plan, scenario: Scenario, damage: Damage) -> float:
    """0, within the limits that hold after a damage: the default ones where nothing is left of others."""
    low, high = plan.output.low, plan.output.high
    if plan.tuning and not _untuned(plan, damage):
        now = [one for sample, one in courses(plan, scenario)[damage.lane] if sample <= damage.sample][-1]
        low, high = now.low, now.high
    return min(max(0.0, low), high)


def _begun(scenario: Scenario, damage: Damage, u0: Count) -> Reset:
    at = damage.lane, damage.sample
    return Reset(*at, scenario.ref[at], scenario.meas[at], u0, keeps=True)
