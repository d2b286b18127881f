"""What the calls beside the step cost on a core: init, reset, track, save, restore, tune, one at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.arrays import Numbers
from focgen.plan.plan import Plan
from focgen.targets.driver import CALLS, DTYPES, PREPARE, given_width
from focgen.targets.library import PATIENCE, TargetLibrary
from focgen.targets.timing import timing


@dataclass(frozen=True)
class CallCost:
    """One call: instructions that ran from it to its return, and cycles by the timing model, None for a core
    without one.
    """

    instructions: int
    cycles: float | None


def call_costs(library: TargetLibrary, plan: Plan) -> dict[str, CallCost]:
    """Every call once, on the state that is there, in the middle of the ranges; ``tune`` takes parameters
    that are neither the default ones nor refused.
    """
    machine, model = library.machine, timing(library.program)
    machine.write(library.core.results, _arguments(plan).tobytes())
    run = f"{plan.name}_call"
    place = library.program[run]
    around = [(place.address, place.address + place.size)]
    machine.call(run, PREPARE, library.core.results, seconds=PATIENCE)
    found = {}
    for number, name in enumerate(CALLS):
        if name == "tune" and plan.tuning is None:
            continue
        machine.forget()
        machine.call(run, number, library.core.results, seconds=PATIENCE)
        ran = machine.executed().without(around)
        found[name] = CallCost(int(ran.ran.sum()), model.cycles(ran) if model else None)
    return found


def _arguments(plan: Plan) -> Numbers:
    """ref, meas, u0, u of track; parameters at the upper ends of their boxes."""
    forms = plan.reference, plan.measurement, plan.output, plan.output
    given = [0.5 * (float(form.low) + float(form.high)) for form in forms]
    if plan.tuning:
        box = plan.tuning
        given += [*[box.factor.high] * len(box.nominal), box.low[1], box.high[1], 0]
    kind = DTYPES[plan.output.ctype]
    assert len(given) == given_width(plan)
    return np.array(given if plan.floating else np.round(given), kind)
