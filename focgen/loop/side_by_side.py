"""Steps from rest with the ideal controller and with the one that will run, side by side."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.equilibrium import rest, within_reach
from focgen.control.measures import StepMeasures, measure_step
from focgen.loop.bench import Bench
from focgen.loop.chain import chain
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.relaxation import Plant, run_with_effects
from focgen.loop.run import LoopRun, run_loop
from focgen.loop.stepper import FloatStepper
from focgen.plan.plan import Plan
from focgen.rig.rig import Rig


@dataclass(frozen=True)
class Steps:
    """What the step to an operating point does: with the ``ideal`` and the ``running`` controller, and the
    latter with the rig's ``effects`` (None where it has none); ``peak_pressure`` of the running one.
    """

    ideal: StepMeasures
    running: StepMeasures
    effects: StepMeasures | None
    peak_pressure: float


def run_steps(bench: Bench, controller: Controller, plan: Plan, seconds: float) -> list[Steps]:
    """Step the loop from rest to each operating point and follow it for ``seconds``."""
    samples = max(20, math.ceil(seconds / controller.sample_time))
    prepared, columns = chain(bench.rig, controller.sample_time, samples), len(bench.points)
    reference = np.tile(bench.references, (samples, 1))
    steppers = (
        FloatStepper(controller, samples, columns, bench.start.command, reference=bench.start.output),
        PlanStepper(plan, columns, bench.start.command, reference=bench.start.output),
    )
    ideal, running = (
        run_loop(prepared, stepper, reference, bench.start, bench.delay, bench.pressure_known, False)
        for stepper in steppers
    )
    effects = _with_effects(bench, controller, plan, reference)
    found = zip(_measures(ideal, bench), _measures(running, bench), effects, running.peak_pressure.tolist())
    return [Steps(*step) for step in found]


def run_corner(
    bench: Bench, rig: Rig, controller: Controller, plan: Plan, seconds: float
) -> list[StepMeasures | None]:
    """The steps of the running controller on another ``rig``, its effects included; None at a set point that
    no command holds there.
    """
    there = replace(bench, rig=rig, start=rest(rig, bench.ranges.output))
    samples = max(20, math.ceil(seconds / controller.sample_time))
    reference = np.tile(bench.references, (samples, 1))
    found: list[StepMeasures | None]
    if rig.effects:
        found = _with_effects(there, controller, plan, reference)
    else:
        prepared = chain(rig, controller.sample_time, samples)
        stepper = PlanStepper(plan, len(bench.points), there.start.command, reference=there.start.output)
        run = run_loop(prepared, stepper, reference, there.start, bench.delay, bench.pressure_known, False)
        found = [*_measures(run, there)]
    reached = within_reach(rig, list(bench.references), bench.ranges.output)
    return [one if there_too else None for one, there_too in zip(found, reached)]


def _with_effects(
    bench: Bench, controller: Controller, plan: Plan, reference: Array
) -> list[StepMeasures | None]:
    if not bench.rig.effects:
        return [None] * len(bench.points)
    plant = Plant.of(bench.rig, controller.sample_time, bench.start, len(reference))
    stepper = PlanStepper(plan, len(bench.points), bench.start.command, reference=bench.start.output)
    run = run_with_effects(plant, stepper, reference, bench.start, bench.delay, bench.pressure_known)
    return [*_measures(run, bench)]


def _measures(run: LoopRun, bench: Bench) -> list[StepMeasures]:
    return [
        measure_step(run.output[:, i], run.sample_time, bench.start.output, reference)
        for i, reference in enumerate(bench.references)
    ]
