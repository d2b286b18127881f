"""``simulate``: the closed loop of Fig. 9 at set points as in Fig. 10, as it will run and as it should."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focgen.arguments import checked
from focgen.arrays import Array
from focgen.control.controller import Controller
from focgen.control.equilibrium import Equilibrium, derived_ranges, holding, rest, within_reach
from focgen.control.files import ControllerLike, controller_from
from focgen.control.measures import StepMeasures, measure_step
from focgen.control.setpoints import check_setpoints, default_setpoints
from focgen.control.units import check_one_unit
from focgen.custody import sha256_of
from focgen.errors import ControllerError, DesignError
from focgen.loop.bench import WATCHED
from focgen.loop.chain import chain
from focgen.loop.frozen import frozen_loop, frozen_margins, frozen_step
from focgen.loop.learned import learned_notes
from focgen.loop.plan_stepper import PlanStepper
from focgen.loop.relaxation import Plant, run_with_effects
from focgen.loop.run import LoopRun, run_loop
from focgen.loop.stepper import FloatStepper, Stepper
from focgen.loop.worst import Worst, worst_case
from focgen.plan.build import build_plan
from focgen.plan.plan import Plan
from focgen.rig.arguments import RigLike, file_of, rig_of
from focgen.rig.response import check_bounded
from focgen.rig.rig import Rig
from focgen.shown import Shown

_SETTLINGS = 8.0  # time constants of the slowest frozen loop that a step is followed for
_FEWEST, _MOST, _UNKNOWN = 200, 60_000, 1000  # samples; the last where no loop gain reaches 1
_UNITS = 30.0  # ratio of two ranges of the same signal from which on their units must differ
_SWING = 0.1  # of the step: movement in the last quarter that is called oscillation
Span = tuple[float, float]
_KEPT = 0.7  # of the movement in the quarter before


@dataclass(frozen=True)
class SetpointResult:
    """What one set point did. ``settling_s``, ``overshoot_pct``, ``steady_error`` are of the controller as
    it runs.

    ``start``: the set point before; ``ideal``: the controller with infinite memory in float64;
    ``frozen``: the continuous linear loop with K held at the set point's ``pressure``, None where that is
    unstable. ``nominal``: the controller as it runs on the rig without its effects, None where it has none;
    running and ideal meet them, ``frozen`` and ``pressure`` are of the nominal chain. ``verdict``: "settles",
    "oscillates", or "does not settle" within the time simulated.
    """

    reference: float
    start: float
    pressure: float
    settling_s: float
    overshoot_pct: float
    steady_error: float
    peak_pressure: float
    verdict: str
    ideal: StepMeasures
    frozen: StepMeasures | None
    nominal: StepMeasures | None


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Shown):
    """The set points' results and the signals behind them.

    ``running`` and ``ideal``: one column a set point, or one column in all where they are
    ``consecutive``; each set point lasts ``duration`` s. ``frozen`` (n, set points), None where unstable.
    ``nominal``: as ``running``, without the rig's ``effects``; None where it has none. ``holds``: all settle.
    ``worst``: what becomes of margins and steps within the rig's uncertainty, which ``holds`` does not ask.
    ``states``: how many exponentials the memory has, 0 where it is short and ``length`` counts.
    """

    rig: Rig
    controller: Controller
    arithmetic: str
    length: int
    delay: int
    consecutive: bool
    duration: float
    setpoints: tuple[SetpointResult, ...]
    running: LoopRun
    ideal: LoopRun
    frozen: tuple[Array | None, ...]
    nominal: LoopRun | None
    effects: tuple[str, ...]
    holds: bool
    worst: Worst
    notes: tuple[str, ...]
    states: int = 0

    @property
    def remembers(self) -> str:
        """What the controller's memory is, for people."""
        return f"{self.states} exponentials" if self.states else f"memory {self.length}"


@checked
def simulate(
    rig: RigLike,
    controller: ControllerLike,
    setpoints: Sequence[float] | None = None,
    *,
    consecutive: bool = False,
    duration: float | None = None,
    delay: int = 1,
    arithmetic: str | None = None,
    length: int | None = None,
) -> Simulation:
    """Close the loop and step it to each of ``setpoints``, from rest, or one after the other
    (``consecutive``). A rig that carries effects is simulated with them, from where their session ended.

    ``setpoints``: outputs (default: tenths 1 … 7 of the output range, Fig. 10). ``duration``: s a set point
    (default: 8 time constants of the slowest frozen loop). ``delay``: computation delay, 0 or 1 sample.
    ``arithmetic`` and ``length`` override the controller's.

    Raises DesignError where a set point cannot be reached, ControllerError where rig and controller do
    not fit together, PlanError where the controller cannot be realised, RigError and ControllerError for
    their files.
    """
    model, which = rig_of(rig), controller_from(controller)
    _check_options(duration, delay)
    ranges, derived = derived_ranges(model)
    _check_fit(model, which)
    notes = [*derived, *_said(model, which, file_of(rig))]
    check_bounded(model, WATCHED)
    plan = build_plan(which, arithmetic, length)
    start = rest(model, which.ranges.output)
    targets = _targets(model, which, setpoints, start, consecutive)
    notes += learned_notes(model, targets)
    points = [holding(model, target, ranges) for target in targets]
    return _Trial(model, which, plan, start, points, consecutive, delay).result(duration, tuple(notes))


def _check_options(duration: float | None, delay: int) -> None:
    if duration is not None and not (math.isfinite(duration) and duration > 0.0):
        raise DesignError("--duration", f"is {duration:g}", "give a time above 0 s")
    if delay not in (0, 1):
        raise DesignError("--delay", f"is {delay}", "give 0 or 1 sample")


def _check_fit(rig: Rig, controller: Controller) -> None:
    """Refuse a signal in two units, or with ranges that are orders of magnitude apart."""
    check_one_unit(rig, controller)
    theirs, ours = rig.ranges, controller.ranges
    pairs: list[tuple[str, Span | None, str, Span | None]] = [
        ("output", theirs.output, "measurement", ours.measurement),
        ("command", theirs.command, "output", ours.output),
    ]
    pairs += [("pressure", theirs.pressure, "schedule", ours.schedule)]
    for signal, given, role, planned in pairs:
        if given is None or planned is None:
            continue
        ratio = max(map(abs, planned)) / max(map(abs, given))
        if not 1.0 / _UNITS < ratio < _UNITS:
            raise ControllerError(
                f"{controller.name} [ranges] {role}",
                f"is {list(planned)}, the rig's {signal} {list(given)}: a factor of {ratio:.3g}",
                "give both in the same unit",
            )


def _said(rig: Rig, controller: Controller, path: Path | None) -> list[str]:
    notes = []
    if controller.sample_time != rig.sample_time:
        notes.append(
            f"the controller runs at {controller.sample_time:g} s, the rig says {rig.sample_time:g} s"
        )
    source = controller.designed_from
    if source is not None and path is not None and sha256_of(path) != source.sha256:
        notes.append(f"the controller was designed from another state of the rig ({source.file})")
    if rig.effects:
        names = ", ".join(str(effect["name"]) for effect in rig.effects)
        notes.append(f"the rig has its effects in it ({names}); beside it stands the loop without them")
    if controller.scheduled and rig.signals.pressure is None:
        notes.append(
            "the rig logs no pressure: the schedule's signal is the command times the regulator's static gain"
        )
    return notes


def _targets(
    rig: Rig,
    controller: Controller,
    setpoints: Sequence[float] | None,
    start: Equilibrium,
    consecutive: bool,
) -> tuple[float, ...]:
    low, high = controller.ranges.reference
    if setpoints is None:
        return default_setpoints(start.output, rig.ranges.output or (low, high))
    targets = tuple(map(float, setpoints))
    check_setpoints(targets)
    outside = [t for t in targets if not low <= t <= high]
    if outside:
        raise DesignError(
            "--setpoints",
            f"{outside[0]:g} is outside the controller's reference range [{low:g}, {high:g}]",
            "give set points within it",
        )
    before = (start.output, *targets[:-1]) if consecutive else (start.output,) * len(targets)
    still = [t for t, b in zip(targets, before) if t == b]
    if still:
        raise DesignError(
            "--setpoints", f"{still[0]:g} is where the step starts", "give set points that move the output"
        )
    return targets


class _Trial:
    """One simulation: the same steps for the running, the ideal and the frozen loop."""

    def __init__(
        self,
        rig: Rig,
        controller: Controller,
        plan: Plan,
        start: Equilibrium,
        points: Sequence[Equilibrium],
        consecutive: bool,
        delay: int,
    ) -> None:
        self.rig, self.controller, self.plan, self.start = rig, controller, plan, start
        self.points, self.consecutive, self.delay = points, consecutive, delay
        self.loops = [frozen_loop(rig, controller, point.pressure) for point in points]
        self.margins = [frozen_margins(loop, controller.sample_time) for loop in self.loops]

    def samples(self, duration: float | None) -> int:
        """Samples a set point."""
        h = self.controller.sample_time
        if duration is not None:
            if not 2 * h <= duration <= _MOST * h:
                raise DesignError("--duration", f"is {duration:g} s", f"give {2 * h:g} … {_MOST * h:g} s")
            return math.ceil(duration / h)
        speeds = [m.crossover_rad_s for m in self.margins if math.isfinite(m.crossover_rad_s)]
        if not speeds:
            return _UNKNOWN
        late = math.ceil(self.rig.delays.total / h)
        return min(max(math.ceil(_SETTLINGS / min(speeds) / h) + late, _FEWEST), _MOST)

    def result(self, duration: float | None, notes: tuple[str, ...]) -> Simulation:
        count = self.samples(duration)
        reference = self._reference(count)
        total, columns = reference.shape
        exact = FloatStepper(self.controller, total, columns, self.start.command, reference=self.start.output)
        running, ideal = (self._run(stepper, reference) for stepper in (self._planned(columns), exact))
        nominal = self._without_effects(self._planned(columns), reference) if self.rig.effects else None
        frozen = tuple(self._frozen(i, count) for i in range(len(self.points)))
        results = tuple(
            self._judged(i, count, running, ideal, frozen[i], nominal) for i in range(len(self.points))
        )
        return Simulation(
            self.rig,
            self.controller,
            self.plan.arithmetic,
            self.plan.length,
            self.delay,
            self.consecutive,
            count * self.controller.sample_time,
            results,
            running,
            ideal,
            frozen,
            nominal,
            tuple(str(effect["name"]) for effect in self.rig.effects),
            all(r.verdict == "settles" for r in results),
            self._worst(count, reference, results),
            notes,
            self.plan.states,
        )

    def _worst(self, count: int, reference: Array, results: Sequence[SetpointResult]) -> Worst:
        return worst_case(
            self.rig,
            self.controller,
            self.plan,
            self.delay,
            [point.pressure for point in self.points],
            [point.output for point in self.points],
            [StepMeasures(r.settling_s, r.overshoot_pct, r.steady_error) for r in results],
            lambda rig: self._corner(rig, count, reference),
        )

    def _corner(self, rig: Rig, count: int, reference: Array) -> list[StepMeasures | None]:
        """The steps on another rig; None at a set point that no command holds there."""
        there = copy(self)
        there.rig, there.start = rig, rest(rig, self.controller.ranges.output)
        run = there._run(there._planned(reference.shape[1]), reference)
        targets = [point.output for point in self.points]
        reached = within_reach(rig, targets, self.controller.ranges.output)
        return [there._measured(run, i, count) if reached[i] else None for i in range(len(targets))]

    def _measured(self, run: LoopRun, index: int, count: int) -> StepMeasures:
        begin, target = self._from(index), self.points[index].output
        return measure_step(self._part(run, index, count), self.controller.sample_time, begin, target)

    def _planned(self, columns: int) -> PlanStepper:
        return PlanStepper(self.plan, columns, self.start.command, reference=self.start.output)

    def _run(self, stepper: Stepper, reference: Array) -> LoopRun:
        """The loop with the rig as it is, effects included."""
        if not self.rig.effects:
            return self._without_effects(stepper, reference)
        plant = Plant.of(self.rig, self.controller.sample_time, self.start, len(reference))
        known = self.rig.signals.pressure is not None
        return run_with_effects(plant, stepper, reference, self.start, self.delay, known)

    def _without_effects(self, stepper: Stepper, reference: Array) -> LoopRun:
        prepared = chain(self.rig, self.controller.sample_time, len(reference))
        known = self.rig.signals.pressure is not None
        return run_loop(prepared, stepper, reference, self.start, self.delay, known)

    def _reference(self, count: int) -> Array:
        targets = np.array([point.output for point in self.points])
        return np.repeat(targets, count)[:, None] if self.consecutive else np.tile(targets, (count, 1))

    def _from(self, index: int) -> float:
        return self.points[index - 1].output if self.consecutive and index else self.start.output

    def _frozen(self, index: int, count: int) -> Array | None:
        if not self.margins[index].stable:
            return None
        begin = self._from(index)
        step = frozen_step(self.loops[index], np.arange(count) * self.controller.sample_time)
        return begin + step * (self.points[index].output - begin)

    def _part(self, run: LoopRun, index: int, count: int) -> Array:
        return (
            run.output[index * count : (index + 1) * count, 0] if self.consecutive else run.output[:, index]
        )

    def _judged(
        self,
        index: int,
        count: int,
        running: LoopRun,
        ideal: LoopRun,
        frozen: Array | None,
        nominal: LoopRun | None,
    ) -> SetpointResult:
        begin, target, h = self._from(index), self.points[index].output, self.controller.sample_time
        found, part = self._measured(running, index, count), self._part(running, index, count)
        peak = running.peak_pressure[0 if self.consecutive else index]
        return SetpointResult(
            target,
            begin,
            self.points[index].pressure,
            found.settling_s,
            found.overshoot_pct,
            found.steady_error,
            float(peak),
            _verdict(found, part, target - begin),
            self._measured(ideal, index, count),
            None if frozen is None else measure_step(frozen, h, begin, target),
            None if nominal is None else self._measured(nominal, index, count),
        )


def _verdict(found: StepMeasures, output: Array, step: float) -> str:
    quarter = max(1, len(output) // 4)
    late, before = np.ptp(output[-quarter:]), np.ptp(output[-2 * quarter : -quarter])
    if late > _SWING * abs(step) and late > _KEPT * before:
        return "oscillates"
    return "settles" if found.settled else "does not settle"


__all__ = ["SetpointResult", "Simulation", "simulate"]
