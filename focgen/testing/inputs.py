"""What candidates are tried with: the scenarios of ``verify``, and those that show a bound that is left."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focgen.plan.plan import Plan
from focgen.plan.scenario import Scenario, Track, to_physical, to_raw
from focgen.verification.scenarios import mixed, raw_scenarios, worst_cases

_TRACKED = 8  # samples after which the bound's runs set the output anew: its error adds up in between


@dataclass(frozen=True, eq=False)
class Trial:
    """Raw inputs, by the name of what they are; ``physical``: the same in physical units."""

    label: str
    raw: Scenario
    physical: Scenario


def exact_trials(plan: Plan, samples: int, seed: int, plain: bool) -> list[Trial]:
    """Those of ``verify``; for a ``plain`` step all in one run without events."""
    scenarios = raw_scenarios(plan, samples, seed)
    whole = {label: replace(s, damages=()) for label, s in scenarios.items()}  # a state is its owner's affair
    found = [Trial(label, s, to_physical(plan, s)) for label, s in whole.items()]
    return [_one_run(plan, found)] if plain else found


def bounded_trials(plan: Plan, samples: int, seed: int, plain: bool) -> list[Trial]:
    """Inputs within their ranges, worst cases among them, and an output that is set anew every few samples
    where it is an integral: its error adds up otherwise.
    """
    inside = mixed(plan.controller, samples, seed)
    found = [Trial("mixed", to_raw(plan, inside), inside)]
    if plan.integrator and not plain:
        often = _often(plan, replace(mixed(plan.controller, samples, seed + 1), resets=(), tracks=()), seed)
        found.append(Trial("output set often", to_raw(plan, often), often))
    worst = worst_cases(plan)
    found.append(Trial("worst cases", worst, to_physical(plan, worst)))
    return [_one_run(plan, found)] if plain else found


def _often(plan: Plan, scenario: Scenario, seed: int) -> Scenario:
    rng = np.random.default_rng([seed, 8])
    low, high = plan.controller.ranges.output
    places = [(lane, k) for lane in range(scenario.lanes) for k in range(0, scenario.samples, _TRACKED)]
    return replace(scenario, tracks=tuple(Track(*p, float(rng.uniform(low, high))) for p in places))


def _one_run(plan: Plan, trials: list[Trial]) -> Trial:
    """Every lane of every trial behind one another, without resets and tracks."""
    raw, physical = (_joined([getattr(t, kind) for t in trials]) for kind in ("raw", "physical"))
    return Trial("all inputs in one run", raw, physical)


def _joined(scenarios: list[Scenario]) -> Scenario:
    names = ("ref", "meas", "sched") if scenarios[0].sched is not None else ("ref", "meas")
    rows = {name: np.concatenate([getattr(s, name).ravel() for s in scenarios])[None, :] for name in names}
    return Scenario(rows["ref"], rows["meas"], rows.get("sched"))
