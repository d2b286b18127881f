"""The closed loop of a variant: steps from rest to the set points, and margins."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.arrays import Array, Complex
from focgen.control.controller import Controller
from focgen.control.equilibrium import Equilibrium, derived_ranges, holding, rest
from focgen.control.margins import Curve, Margins, curve, margins
from focgen.control.measures import measure_step
from focgen.loop.chain import Chain, chain
from focgen.loop.frequency import any_schedule, chain_transfer, held_response, sampled_response, slope_at
from focgen.loop.frozen import frozen_loop, frozen_margins
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.run import LoopRun, run_loop
from focgen.loop.stepper import FloatStepper, Stepper
from focgen.plan.plan import Plan
from focgen.plan.response import running_gain, running_response
from focgen.rig.rig import Rig
from focgen.studies.results import Loop

_SETTLINGS = 12.0  # time constants of the slowest frozen loop that a step is followed for
_FEWEST, _MOST, _UNKNOWN = 200, 20_000, 1000  # samples; the last where no loop gain reaches 1
_DELAY = 1  # sample, of the computation
_LOW = 1e-5  # of the sampling frequency: where the margins' curves begin
_DRAWN = 400  # samples of a response that is kept for the pictures


@dataclass(frozen=True, eq=False)
class Bench:
    """A rig made ready for loops at one sample time; ``points``: the equilibria at the set points."""

    rig: Rig
    chain: Chain
    start: Equilibrium
    points: tuple[Equilibrium, ...]

    @property
    def references(self) -> Array:
        """The set points, shape (points,)."""
        return np.array([point.output for point in self.points])


@dataclass(frozen=True, eq=False)
class Steps:
    """What the loop did, and the step to the middle set point for the pictures: ``time``, ``output``."""

    loop: Loop
    time: Array
    output: Array
    reference: float


@lru_cache(maxsize=8)
def _bench(rig: Rig, controller: Controller, setpoints: tuple[float, ...]) -> Bench:
    ranges, _ = derived_ranges(rig)
    start = rest(rig, controller.ranges.output)
    points = tuple(holding(rig, y, ranges) for y in setpoints)
    return Bench(rig, chain(rig, controller.sample_time, _samples(rig, controller, points)), start, points)


def _samples(rig: Rig, controller: Controller, points: tuple[Equilibrium, ...]) -> int:
    h = controller.sample_time
    found = [frozen_margins(frozen_loop(rig, controller, p.pressure), h).crossover_rad_s for p in points]
    slowest = min((w for w in found if math.isfinite(w)), default=None)
    if slowest is None:
        return _UNKNOWN
    late = math.ceil(rig.delays.total / h)
    return min(max(math.ceil(_SETTLINGS / slowest / h) + late, _FEWEST), _MOST)


def running_loop(base: Controller, rig: Rig, setpoints: tuple[float, ...], plan: Plan) -> Steps:
    """The loop of a ``plan``; ``base`` is the study's controller at the plan's sample time."""
    bench = _bench(rig, base, setpoints)
    stepper = PlanStepper(plan, len(bench.points), bench.start.command, reference=bench.start.output)
    at = any_schedule(base)
    unit = running_gain(plan, at)
    open_loop = _curve(rig, base, lambda omega: running_response(plan, omega, at) / unit)

    def gain(pressure: float) -> float:
        return running_gain(plan, pressure if base.scheduled else None)

    return _judged(bench, stepper, [open_loop.times(gain(p) * slope_at(rig, p)) for p in _pressures(bench)])


def ideal_loop(base: Controller, rig: Rig, setpoints: tuple[float, ...]) -> Steps:
    """The loop of infinite memory in float64."""
    bench = _bench(rig, base, setpoints)
    stepper = FloatStepper(
        base, bench.chain.samples, len(bench.points), bench.start.command, reference=bench.start.output
    )
    open_loop = _curve(rig, base, lambda omega: sampled_response(base, omega))
    found = [open_loop.times(float(base.gain_at(p)) * slope_at(rig, p)) for p in _pressures(bench)]
    return _judged(bench, stepper, found)


def _pressures(bench: Bench) -> list[float]:
    return list(dict.fromkeys(point.pressure for point in bench.points))


def _curve(rig: Rig, controller: Controller, response: Callable[[Array], Complex]) -> Curve:
    """The open loop but for controller gain and slope: hold and delays in it."""
    h, transfer = controller.sample_time, chain_transfer(rig)

    def loop(omega: Array) -> Complex:
        held = held_response(transfer, h, omega, delay=rig.delays.total)
        made: Complex = response(omega) * held * np.exp(-1j * omega * h * _DELAY)
        return made

    return curve(loop, _LOW * 2.0 * math.pi / h, math.pi / h)


def _judged(bench: Bench, stepper: Stepper, curves: list[Curve]) -> Steps:
    reference = np.tile(bench.references, (bench.chain.samples, 1))
    known = bench.rig.signals.pressure is not None
    run = run_loop(bench.chain, stepper, reference, bench.start, _DELAY, known, curvature=False)
    middle, thin = len(bench.points) // 2, max(1, bench.chain.samples // _DRAWN)
    return Steps(
        _loop(run, bench, [margins(one) for one in curves]),
        run.time[::thin],
        run.output[::thin, middle],
        float(bench.references[middle]),
    )


def _loop(run: LoopRun, bench: Bench, found: list[Margins]) -> Loop:
    begin = bench.start.output
    steps = [
        measure_step(run.output[:, i], run.sample_time, begin, y) for i, y in enumerate(bench.references)
    ]
    away = np.abs(run.output - bench.references) / np.abs(bench.references - begin)
    iae = float((away.sum(axis=0) * run.sample_time).mean())
    return Loop(
        finite(float(np.mean([s.settling_s for s in steps]))),
        finite(max(s.overshoot_pct for s in steps)),
        finite(iae),
        finite(min(m.phase_deg for m in found)),
        finite(min(m.gain_db for m in found)),
        finite(min(m.delay_s for m in found)),
        all(m.stable for m in found),
    )


def finite(value: float) -> float | None:
    """The value, or None where it is not a finite number."""
    return float(value) if math.isfinite(value) else None
