"""Steps from rest with the ideal controller and with the one that will run, side by side."""

from __future__ import annotations

import math

import numpy as np

from focgen.control.controller import Controller
from focgen.control.measures import StepMeasures, measure_step
from focgen.loop.bench import Bench
from focgen.loop.chain import chain
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.run import LoopRun, run_loop
from focgen.loop.stepper import FloatStepper
from focgen.plan.model import Plan


def run_steps(
    bench: Bench, controller: Controller, plan: Plan, seconds: float
) -> list[tuple[StepMeasures, StepMeasures, float]]:
    """Return, for each operating point, what the ideal and what the running controller make of it, and the
    peak pressure of the latter.
    """
    samples = max(20, math.ceil(seconds / controller.sample_time))
    prepared, columns = chain(bench.rig, controller.sample_time, samples), len(bench.points)
    reference = np.tile(bench.references, (samples, 1))
    steppers = (
        FloatStepper(controller, samples, columns, bench.start.command),
        PlanStepper(plan, columns, bench.start.command),
    )
    ideal, running = (
        run_loop(prepared, stepper, reference, bench.start, bench.delay, bench.pressure_known, False)
        for stepper in steppers
    )
    return list(zip(_measures(ideal, bench), _measures(running, bench), running.peak_pressure.tolist()))


def _measures(run: LoopRun, bench: Bench) -> list[StepMeasures]:
    return [
        measure_step(run.output[:, i], run.sample_time, bench.start.output, reference)
        for i, reference in enumerate(bench.references)
    ]
