"""What one step costs on a core: exact executed instructions, estimated cycles, used stack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focgen.arrays import Numbers
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario
from focgen.targets.library import TargetLibrary
from focgen.targets.program import Program
from focgen.targets.timing import timing


@dataclass(frozen=True, eq=False)
class StepCosts:
    """Of every measured step: ``instructions`` that ran in it, and ``cycles`` by the timing model (None for a
    core without one); ``stack``: bytes that steps used at most, as seen.
    """

    instructions: Numbers
    cycles: Numbers | None
    stack: int


def step_costs(library: TargetLibrary, plan: Plan, steps: int, seed: int = 0) -> StepCosts:
    """Run ``steps`` steps on noise, steps and extremes within the ranges, after a reset that has filled the
    memory, and count in each of them what runs from the call of NAME_step to its return.
    """
    program, machine = library.program, library.machine
    outside = _outside(program, plan)
    model = timing(program)
    counts, cycles = [], []
    for ran in library.stepwise(plan, exercise(plan, steps + 1, seed)):
        inside = ran.without(outside)
        counts.append(int(inside.ran.sum()))
        cycles.append(model.cycles(inside) if model else 0.0)
    used = machine.stack_used()
    return StepCosts(np.array(counts), np.array(cycles) if model else None, used)


def exercise(plan: Plan, steps: int, seed: int) -> Scenario:
    """One lane of raw inputs: a reset, then a third noise, a third steps, a third from end to end."""
    rng = np.random.default_rng([seed, 23])
    third = -(-steps // 3)
    shapes = [rng.uniform(size=third), np.repeat(rng.uniform(size=third), 20)[:third],
              rng.integers(0, 2, third).astype(float)]  # fmt: skip
    forms = [plan.reference, plan.measurement, *([plan.schedule.signal] if plan.schedule else [])]
    signals = []
    for form in forms:
        unit = np.concatenate([rng.permutation(part) if i == 0 else part for i, part in enumerate(shapes)])
        values = form.low + (form.high - form.low) * np.roll(unit, int(rng.integers(third)))[:steps]
        signals.append(np.asarray(values if form.floating else np.round(values).astype(np.int64))[None])
    kind = np.float32 if plan.output.ctype == "float" else np.float64
    signals = [s.astype(kind) if plan.floating else s for s in signals]
    last = [s[0, -1] for s in signals]
    reset = Reset(0, 0, last[0], last[1], plan.output.low)
    return Scenario(signals[0], signals[1], signals[2] if plan.schedule else None, (reset,))


def _outside(program: Program, plan: Plan) -> list[tuple[int, int]]:
    """The code that runs besides the step: what feeds it."""
    names = (f"{plan.name}_run", f"{plan.name}_flags", f"{plan.name}_init", "focgen_run", "focgen_halt")
    found = [program[name] for name in names if name in program]
    return [(s.address, s.address + max(s.size, 2)) for s in found]
