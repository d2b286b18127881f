"""A design and a simulation as JSON payloads and as text."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from focgen.control.files import source_table
from focgen.control.margins import Margins
from focgen.loop.design import Design, ScheduleReport
from focgen.loop.frequency import PointMargins
from focgen.loop.simulate import SetpointResult, Simulation
from focgen.report.page import TableOf, text_table
from focgen.report.worst_summary import worst_payload, worst_text

_LOOPS = ("frozen", "ideal", "sampled", "truncated", "running")


# ---------------------------------------------------------------------------------------------------- design


def design_payload(design: Design) -> dict[str, Any]:
    """What ``focgen design --json`` carries."""
    labels = point_labels(design)
    source = design.controller.designed_from
    return {
        "name": design.controller.name,
        "arithmetic": design.controller.arithmetic,
        "specification": {
            "settling_s": design.specification.settling,
            "overshoot_pct": design.specification.overshoot,
        },
        "holds": design.holds,
        "K_o": {"intercept": design.schedule.intercept, "slope": design.schedule.slope},
        "schedule": asdict(design.schedule),
        "settling_s": {label: point.proof.settling_s for label, point in zip(labels, design.points)},
        "overshoot_pct": {label: point.proof.overshoot_pct for label, point in zip(labels, design.points)},
        "mean_settling_s": design.settling_s,
        "max_overshoot_pct": design.overshoot_pct,
        "operating_points": [asdict(point) for point in design.points],
        "margins": {loop: _worst(design.margins, loop) for loop in _LOOPS},
        "worst": worst_payload(design.worst),
        "memory": asdict(design.memory) | {"rest_gain": design.memory.rest_gain},
        "delay_samples": design.delay,
        "transfer": str(design.controller.transfer),
        "ranges": asdict(design.controller.ranges),
        "designed_from": source and source_table(source),
        "notes": list(design.notes),
    }


def point_labels(design: Design) -> list[str]:
    """Names of the operating points: their pressures, or their set points where pressures do not tell them
    apart.
    """
    pressures = [f"{point.pressure:.4g}" for point in design.points]
    return (
        pressures if len(set(pressures)) == len(pressures) else [f"{p.reference:.4g}" for p in design.points]
    )


def _worst(points: tuple[PointMargins, ...], loop: str) -> dict[str, Any]:
    """The operating point with the smallest phase margin, and all of them."""
    worst = min(points, key=lambda point: getattr(point, loop).phase_deg)
    rows = [{"pressure": point.pressure, **asdict(getattr(point, loop))} for point in points]
    return {**asdict(getattr(worst, loop)), "pressure": worst.pressure, "by_operating_point": rows}


def _line_text(schedule: ScheduleReport) -> str:
    if not schedule.breakpoints:
        return f"K_o = {schedule.intercept:.4g}"
    sign = "−" if schedule.slope < 0.0 else "+"
    return f"K_o(p) = {schedule.intercept:.4g} {sign} {abs(schedule.slope):.4g} p"


def design_text(design: Design) -> str:
    """The design for people."""
    tables = text_table(points_table(design)), text_table(margins_table(design)), worst_text(design.worst)
    notes = "\n".join([memory_line(design), *(f"note: {note}" for note in design.notes)])
    return "\n\n".join(["\n".join(schedule_lines(design)), *tables, notes, specification_line(design)])


def schedule_lines(design: Design) -> list[str]:
    """The controller, K_o(p), and how its table realises that: its error, and where it is held."""
    schedule, controller = design.schedule, design.controller
    integral = " / s" if controller.integrator else ""
    lines = [
        f"{controller.name}: C(s) = {_gain_text(design)} ({controller.transfer}){integral}",
        _line_text(schedule),
    ]
    return lines + _table_lines(design) if schedule.breakpoints else lines


def _gain_text(design: Design) -> str:
    return "K_o(p)/K(p) ·" if design.schedule.breakpoints else f"{design.controller.gain:.6g} ·"


def _table_lines(design: Design) -> list[str]:
    schedule = design.schedule
    lines = [
        (
            f"schedule: {len(schedule.breakpoints)} breakpoints from {schedule.breakpoints[0]:.4g} to "
            f"{schedule.breakpoints[-1]:.4g}, within {100 * schedule.error:.2g} % of K_o/K "
            f"(wanted: {100 * schedule.tolerance:g} %), held beyond"
        )
    ]
    if schedule.formula_at_rest is not None:
        zero = "" if schedule.K_zero is None else f"; K(p) vanishes at p = {schedule.K_zero:.3g}"
        held = float(design.controller.gain_at(schedule.lower_limit))
        lines.append(
            f"below p = {schedule.lower_limit:.4g} the gain is held at {held:.4g}; the formula would ask for "
            f"{schedule.formula_at_rest:.4g} at rest{zero}"
        )
    return lines


def memory_line(design: Design) -> str:
    """The memory length, why it was taken, and what it costs at rest."""
    memory = design.memory
    text = (
        f"memory: L = {memory.length} ({memory.seconds:.3g} s), {memory.reason}: "
        f"{100 * memory.crossover_error:.2g} % at {memory.crossover_rad_s:.3g} rad/s"
    )
    for term in memory.bias:
        text += f"; at rest {term.coefficient:.4g} s^{term.order:g} reads {term.bias:.3g} instead of 0"
    return text


def specification_line(design: Design) -> str:
    """What was specified, and whether it is met."""
    asked = design.specification
    settling = "" if asked.settling is None else f" of at most {asked.settling:.3g} s"
    where = " with the rig's effects" if design.points[0].effects else ""
    verdict = f"kept{where}" if design.holds else f"NOT kept by the controller as it will run{where}"
    return (
        f"specification: mean settling time{settling}, overshoot of at most {asked.overshoot:g} %: {verdict} "
        f"({_seconds(design.settling_s)}, {design.overshoot_pct:.2g} %)"
    )


def points_table(design: Design) -> TableOf:
    """Steps from rest to the operating points, as they will run."""
    units = design.controller.units
    heads = (
        f"set point{_in(units.measurement)}",
        f"p{_in(units.schedule)}",
        "K",
        "K_o",
        "gain",
        "settling (s)",
        "overshoot (%)",
        "ideal (s)",
        f"peak p{_in(units.schedule)}",
        *(("with effects (s)", "(%)") if design.points[0].effects else ()),
    )
    rows = tuple(
        (
            f"{p.reference:.4g}",
            f"{p.pressure:.4g}",
            f"{p.K:.4g}",
            f"{p.K_o:.4g}",
            f"{p.gain:.4g}",
            _number(p.running.settling_s),
            f"{p.running.overshoot_pct:.1f}",
            _number(p.ideal.settling_s),
            f"{p.peak_pressure:.3g}",
            *((_number(p.effects.settling_s), f"{p.effects.overshoot_pct:.1f}") if p.effects else ()),
        )
        for p in design.points
    )
    return TableOf(
        heads,
        rows,
        f"Steps from rest, in {design.controller.arithmetic}, {_delayed(design.delay)}",
    )


def margins_table(design: Design) -> TableOf:
    """The margins where the phase margin is smallest, ideal and step by step towards what will run."""
    meaning = {
        "frozen": "K frozen (cancels)",
        "ideal": "ideal, slope of K(p)p",
        "sampled": "+ sampled, held, delayed",
        "truncated": f"+ memory of {design.memory.length}",
        "running": f"+ quantised ({design.controller.arithmetic})",
    }
    rows = []
    for loop, text in meaning.items():
        worst = min(design.margins, key=lambda point: getattr(point, loop).phase_deg)
        rows.append((text, *_margin_cells(getattr(worst, loop)), f"{worst.pressure:.4g}"))
    heads = (
        "loop",
        "gain (dB)",
        "phase (°)",
        "delay (s)",
        "crossover (rad/s)",
        "stable",
        f"at p{_in(design.controller.units.schedule)}",
    )
    return TableOf(heads, tuple(rows), "Margins, at the operating point with the smallest phase margin")


def _margin_cells(m: Margins) -> tuple[str, ...]:
    return (
        f"{m.gain_db:.1f}",
        f"{m.phase_deg:.1f}",
        f"{m.delay_s:.3g}",
        f"{m.crossover_rad_s:.3g}",
        "yes" if m.stable else "NO",
    )


# ------------------------------------------------------------------------------------------------ simulation


def simulation_payload(simulation: Simulation) -> dict[str, Any]:
    """What ``focgen simulate --json`` carries."""
    return {
        "setpoints": [asdict(result) for result in simulation.setpoints],
        "mean_settling_s": mean_settling(simulation),
        "holds": simulation.holds,
        "worst": worst_payload(simulation.worst),
        "consecutive": simulation.consecutive,
        "duration_s": simulation.duration,
        "arithmetic": simulation.arithmetic,
        "memory": simulation.controller.memory,
        "length": simulation.length,
        "states": simulation.states,
        "delay_samples": simulation.delay,
        "effects": list(simulation.effects),
        "notes": list(simulation.notes),
    }


def mean_settling(simulation: Simulation) -> float:
    """Mean settling time over the set points, s; NaN where one does not settle."""
    return sum(result.settling_s for result in simulation.setpoints) / len(simulation.setpoints)


def simulation_text(simulation: Simulation) -> str:
    """The simulation for people."""
    lines = [text_table(setpoints_table(simulation)), "", worst_text(simulation.worst), ""]
    lines += [f"note: {note}" for note in simulation.notes]
    bad = [r for r in simulation.setpoints if r.verdict != "settles"]
    if bad:
        what = "; ".join(f"{r.reference:.4g} {r.verdict}" for r in bad)
        lines.append(f"the loop does not hold its set points within {simulation.duration:.3g} s: {what}")
    else:
        lines.append(
            f"mean settling time {mean_settling(simulation):.3g} s, largest overshoot "
            f"{max(r.overshoot_pct for r in simulation.setpoints):.2g} %"
        )
    return "\n".join(lines)


def setpoints_table(simulation: Simulation) -> TableOf:
    """What every set point did: as it runs, ideal, and frozen."""
    unit = _in(simulation.controller.units.measurement)
    heads = (
        f"set point{unit}",
        "settling (s)",
        "overshoot (%)",
        f"steady error{unit}",
        "verdict",
        "ideal (s)",
        *(("without effects (s)", "(%)") if simulation.effects else ()),
        "frozen (s)",
        f"peak p{_in(simulation.controller.units.schedule)}",
    )
    rows = tuple(_setpoint_cells(result) for result in simulation.setpoints)
    order = "one after the other" if simulation.consecutive else "from rest"
    return TableOf(
        heads,
        rows,
        f"Steps {order}, in {simulation.arithmetic} with {simulation.remembers}, "
        f"{_delayed(simulation.delay)}"
        + (f"; effects: {', '.join(simulation.effects)}" if simulation.effects else ""),
    )


def _setpoint_cells(r: SetpointResult) -> tuple[str, ...]:
    frozen = "unstable" if r.frozen is None else _number(r.frozen.settling_s)
    bare = () if r.nominal is None else (_number(r.nominal.settling_s), f"{r.nominal.overshoot_pct:.1f}")
    return (
        f"{r.reference:.4g}",
        _number(r.settling_s),
        f"{r.overshoot_pct:.1f}",
        f"{r.steady_error:.2g}",
        r.verdict,
        _number(r.ideal.settling_s),
        *bare,
        frozen,
        f"{r.peak_pressure:.3g}",
    )


def _delayed(samples: int) -> str:
    return f"computation delay {samples} sample{'' if samples == 1 else 's'}"


def _in(unit: str) -> str:
    return f" ({unit})" if unit else ""


def _number(seconds: float) -> str:
    return f"{seconds:.2f}" if math.isfinite(seconds) else "–"


def _seconds(seconds: float) -> str:
    return f"{seconds:.3g} s" if math.isfinite(seconds) else "not all settle"
