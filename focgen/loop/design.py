"""``design``: from a rig and a specification to a controller, eq. (6), and what it does as it will run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arguments import checked
from focgen.control.controller import ARITHMETICS, Controller, Source
from focgen.control.equilibrium import Equilibrium
from focgen.control.files import check_replaces_controller, controller_text
from focgen.control.inversion import Inversion
from focgen.control.measures import StepMeasures
from focgen.control.schedule import TOLERANCE, Table, gain_table
from focgen.control.units import units_of
from focgen.custody import sha256_of
from focgen.errors import DesignError, check_choice
from focgen.jsontext import UNWRITTEN
from focgen.loop.bench import Bench, prepare
from focgen.loop.frequency import PointMargins, margins_at, shapes
from focgen.loop.memory import MemoryChoice, choose_memory
from focgen.loop.side_by_side import Steps, run_corner, run_steps
from focgen.loop.tuning import HORIZON, OVERSHOOT, Specification, Tuned, fastest, meeting, tune
from focgen.loop.worst import Worst, worst_case
from focgen.output import check_apart, write_file
from focgen.plan.build import build_plan
from focgen.plan.plan import LONGEST, Plan
from focgen.rig.arguments import RigLike, file_of, rig_of
from focgen.rig.rig import Rig
from focgen.shown import Shown
from focgen.tomlfile import LARGEST, SMALLEST

SETTLING = 1.5  # s, where nothing is specified and it is feasible
_SLACK = 1.02  # of the specification, for the controller as it will run


@dataclass(frozen=True)
class OperatingPoint:
    """A step from rest to ``reference``, which ``pressure`` and ``command`` hold.

    ``K`` and ``K_o`` at that pressure, ``gain`` = K_o/K from the schedule table. ``ideal``: infinite
    memory in float64; ``running``: the plan, bit for bit; ``effects``: that on the rig with its effects, None
    where it has none. ``peak_pressure``: the largest on the way.
    """

    reference: float
    pressure: float
    command: float
    K: float
    K_o: float
    gain: float
    ideal: StepMeasures
    running: StepMeasures
    effects: StepMeasures | None
    peak_pressure: float

    @property
    def proof(self) -> StepMeasures:
        """What counts: the step with the rig's effects, where it has any."""
        return self.running if self.effects is None else self.effects


@dataclass(frozen=True)
class ScheduleReport:
    """The gain schedule, which is the controller: ``gains`` at ``breakpoints`` (pressures), held beyond.

    It realises (``intercept`` + ``slope`` p)/K(p) to within the relative ``error`` (wanted:
    ``tolerance``). ``lower_limit``: the pressure below which the formula is not followed;
    ``formula_at_rest``: the gain it would ask for at rest, against ``gains[0]``; ``K_zero``: the nearest
    pressure below where K(p) vanishes, None if nowhere. One breakpoint and no pressure where K is
    constant.
    """

    breakpoints: tuple[float, ...]
    gains: tuple[float, ...]
    intercept: float
    slope: float
    error: float
    tolerance: float
    lower_limit: float | None
    formula_at_rest: float | None
    K_zero: float | None


@dataclass(frozen=True, repr=False)
class Design(Shown):
    """A controller, the specification it was designed for, and the proof in simulation.

    ``settling_s`` (mean over the operating points) and ``overshoot_pct`` (largest) are of the controller as
    it will run, on the rig with its effects; ``holds`` says whether they keep the specification and every
    loop is stable. ``worst``: what becomes of margins and steps within the rig's uncertainty, which the
    specification is not judged by. ``rig``: what it was designed for.
    """

    controller: Controller
    specification: Specification
    schedule: ScheduleReport
    points: tuple[OperatingPoint, ...]
    margins: tuple[PointMargins, ...]
    memory: MemoryChoice
    delay: int
    settling_s: float
    overshoot_pct: float
    holds: bool
    worst: Worst
    notes: tuple[str, ...] = field(default=())
    rig: Rig | None = field(default=None, metadata=UNWRITTEN, compare=False)


@checked
def design(
    rig: RigLike,
    out: str | Path | None = None,
    settling: float | None = None,
    overshoot: float | None = None,
    arithmetic: str = "q31",
    length: int | None = None,
    *,
    delay: int = 1,
    setpoints: Sequence[float] | None = None,
    lowest: float | None = None,
    tolerance: float = TOLERANCE,
) -> Design:
    """Invert the rig's model and find the gain schedule, eq. (6)–(7); write the controller to ``out`` where
    given.

    ``settling``: the mean settling time (5 %) over the operating points, s; ``overshoot``: the largest at
    any of them, % (default 5). Without either, 1.5 s or, where that is not feasible, the fastest; with an
    overshoot alone, the fastest. ``setpoints``: outputs that are the operating points (default: tenths 1
    … 7 of the output range, as in Fig. 10). ``lowest``: pressure below which the gain is held (default:
    the lowest operating point's). ``delay``: computation delay, 0 or 1 sample. ``tolerance``: relative
    error of the schedule table.

    Raises DesignError where the rig cannot be inverted or the specification is not feasible (naming what is),
    and PlanError where the controller does not fit the arithmetic. RigError: the file cannot be used.
    InputError: ``out`` is the rig's file, or something else than a controller.

    A rig that carries effects is designed for without them; the margins then hold those that are linear, and
    the steps that the specification is judged by hold all of them.
    """
    _check_wishes(settling, overshoot, arithmetic, length, delay, tolerance)
    if out is not None:
        check_apart([out], [rig])
        check_replaces_controller(out)
    given: dict[str, Any] = {
        "settling": settling,
        "overshoot": overshoot,
        "arithmetic": arithmetic,
        "length": length,
    }
    given |= {"delay": delay, "setpoints": setpoints, "lowest": lowest, "tolerance": tolerance}
    model, source = rig_of(rig), _source(file_of(rig), given)
    bench, notes = prepare(model, setpoints, lowest, delay)
    specification, tuned = _tuned(bench, settling, overshoot, notes)
    table, report = _schedule(bench, tuned, tolerance)
    draft = _controller(bench, tuned, table, arithmetic, source)
    memory = choose_memory(draft, _lowest_crossover(bench, tuned), length)
    controller = replace(draft, length=memory.length)
    result = _judged(bench, tuned, controller, specification, report, memory, notes)
    if out is not None:
        write_file(out, controller_text(controller), [rig])
    return result


def _check_wishes(
    settling: float | None,
    overshoot: float | None,
    arithmetic: str,
    length: int | None,
    delay: int,
    tolerance: float,
) -> None:
    if settling is not None and not SMALLEST <= settling <= LARGEST:
        remedy = f"give a time above 0 s, from {SMALLEST:g} to {LARGEST:g}"
        raise DesignError("--settling", f"is {settling:g}", remedy)
    if overshoot is not None and not (math.isfinite(overshoot) and overshoot >= 0.0):
        raise DesignError("--overshoot", f"is {overshoot:g}", "give percent, 0 or more")
    check_choice("--arithmetic", arithmetic, ARITHMETICS, DesignError)
    if length is not None and not 1 <= length <= LONGEST:
        raise DesignError("--length", f"is {length}", f"give 1 to {LONGEST} past samples")
    if delay not in (0, 1):
        raise DesignError("--delay", f"is {delay}", "give 0 or 1 sample")
    if not 0.0 < tolerance < 1.0:
        raise DesignError("tolerance", f"is {tolerance:g}", "give a relative error between 0 and 1")


def _source(path: Path | None, given: Mapping[str, Any]) -> Source | None:
    """What the controller says it was designed from, and with which options; nothing where that is no
    file."""
    if path is None:
        return None
    told = ((name, value) for name, value in given.items() if value is not None)
    options = ((name, tuple(value) if isinstance(value, (list, tuple)) else value) for name, value in told)
    return Source(path.name, sha256_of(path), tuple(options))


def _tuned(
    bench: Bench, settling: float | None, overshoot: float | None, notes: list[str]
) -> tuple[Specification, Tuned]:
    specification = Specification(settling, OVERSHOOT if overshoot is None else overshoot)
    if settling is not None or overshoot is not None:
        return specification, tune(bench, specification)
    specification = replace(specification, settling=SETTLING)
    found = meeting(bench, specification)
    if found is not None:
        return specification, found
    found = fastest(bench, specification.overshoot)
    if found.mean_settling > SETTLING:
        notes.append(
            f"{SETTLING:g} s is not feasible here; {found.mean_settling:.3g} s is the fastest with at most "
            f"{specification.overshoot:g} % overshoot"
        )
    return replace(specification, settling=max(found.mean_settling, SETTLING)), found


# --------------------------------------------------------------------------------------------- the controller


def _schedule(bench: Bench, tuned: Tuned, tolerance: float) -> tuple[Table | None, ScheduleReport]:
    line, inversion = tuned.line, tuned.inversion
    if not inversion.scheduled:
        gain = line.intercept / inversion.gain[0]
        return None, ScheduleReport((), (gain,), line.intercept, 0.0, 0.0, tolerance, None, None, None)

    def formula(pressure: Any) -> Any:
        return line(pressure) / inversion.K(pressure)

    try:
        table = gain_table(formula, *bench.span, tolerance)
    except ValueError as reason:
        raise DesignError("schedule", str(reason), "allow a larger tolerance") from None
    at_rest = inversion.K(bench.start.pressure)
    return table, ScheduleReport(
        table.schedule.breakpoints,
        table.schedule.gains,
        line.intercept,
        line.slope,
        table.error,
        tolerance,
        min(bench.span, key=lambda p: abs(p - bench.start.pressure)),
        float(line(bench.start.pressure) / at_rest) if at_rest else None,
        _zero_below(inversion, bench),
    )


def _zero_below(inversion: Inversion, bench: Bench) -> float | None:
    """The zero of K(p) nearest to the schedule."""
    roots = np.polynomial.Polynomial(inversion.gain).roots()
    real = roots.real[np.abs(roots.imag) < 1e-9 * np.maximum(np.abs(roots), 1e-300)]
    return float(min(real, key=lambda p: min(abs(p - e) for e in bench.span))) if len(real) else None


def _controller(
    bench: Bench, tuned: Tuned, table: Table | None, arithmetic: str, source: Source | None
) -> Controller:
    rig, inversion = bench.rig, tuned.inversion
    gain = float(f"{tuned.line.intercept / inversion.gain[0]:.6g}") if table is None else table.schedule
    return Controller(
        name=rig.name,
        sample_time=rig.sample_time,
        transfer=inversion.transfer,
        gain=gain,
        integrator=inversion.integrator,
        ranges=bench.ranges,
        arithmetic=arithmetic,
        units=units_of(rig, scheduled=table is not None),
        designed_from=source,
    )


def _lowest_crossover(bench: Bench, tuned: Tuned) -> float:
    """K_o times the static gains: where the loop with K frozen crosses 1, at its slowest operating point,
    rad/s.
    """
    static = abs(bench.rig.regulator.dc_gain * bench.rig.sensor.dc_gain)
    return float(np.min(np.abs(tuned.line(bench.pressures)))) * static


# ------------------------------------------------------------------------------------------------- judgement


def _judged(
    bench: Bench,
    tuned: Tuned,
    controller: Controller,
    specification: Specification,
    schedule: ScheduleReport,
    memory: MemoryChoice,
    notes: list[str],
) -> Design:
    plan = build_plan(controller)
    steps = run_steps(bench, controller, plan, _horizon(tuned, specification))
    points = tuple(
        _point(equilibrium, tuned, controller, step) for equilibrium, step in zip(bench.points, steps)
    )
    loops = shapes(bench.rig, controller, plan, bench.delay)
    found = tuple(
        margins_at(bench.rig, controller, plan, loops, p) for p in dict.fromkeys(bench.pressures.tolist())
    )
    settling = float(np.mean([point.proof.settling_s for point in points]))
    over = max(point.proof.overshoot_pct for point in points)
    notes = [*notes, *tuned.inversion.notes, *_remarks(bench, points)]
    kept = settling <= _SLACK * (specification.settling or math.inf) and over <= specification.overshoot + 0.5
    return Design(
        controller,
        specification,
        schedule,
        points,
        found,
        memory,
        bench.delay,
        settling,
        over,
        kept and all(m.running.stable for m in found),
        _worst(bench, controller, plan, points, _horizon(tuned, specification)),
        tuple(notes),
        bench.rig,
    )


def _worst(
    bench: Bench,
    controller: Controller,
    plan: Plan,
    points: Sequence[OperatingPoint],
    seconds: float,
) -> Worst:
    return worst_case(
        bench.rig,
        controller,
        plan,
        bench.delay,
        bench.pressures.tolist(),
        bench.references.tolist(),
        [point.proof for point in points],
        lambda rig: run_corner(bench, rig, controller, plan, seconds),
    )


def _horizon(tuned: Tuned, specification: Specification) -> float:
    return HORIZON * max(tuned.mean_settling, specification.settling or 0.0)


def _point(at: Equilibrium, tuned: Tuned, controller: Controller, step: Steps) -> OperatingPoint:
    K = float(tuned.inversion.K(at.pressure))
    return OperatingPoint(
        at.output,
        at.pressure,
        at.command,
        K,
        float(tuned.line(at.pressure)),
        float(controller.gain_at(at.pressure)),
        step.ideal,
        step.running,
        step.effects,
        step.peak_pressure,
    )


def _remarks(bench: Bench, points: tuple[OperatingPoint, ...]) -> list[str]:
    span = bench.rig.ranges.pressure
    high = max((point.peak_pressure for point in points), key=abs)
    if span is None or span[0] <= high <= span[1]:
        return []
    end = span[1] if high > span[1] else span[0]
    return [
        (
            f"on the way the pressure reaches {high:.3g}, beyond the rig's range ({end:g}): the model is "
            "extrapolated there"
        )
    ]
