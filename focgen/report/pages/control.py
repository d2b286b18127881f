"""A design and a simulated loop as pages: the controller, its schedule and margins, the steps it makes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from focgen.arrays import Array, Bools
from focgen.control.controller import Controller
from focgen.control.measures import BAND
from focgen.loop.design import Design
from focgen.loop.frequency import PointMargins, Shapes, shapes
from focgen.loop.simulate import SetpointResult, Simulation
from focgen.plan.build import build_plan
from focgen.present import present
from focgen.report.control_summary import (
    margins_table,
    mean_settling,
    memory_line,
    points_table,
    schedule_lines,
    setpoints_table,
    specification_line,
)
from focgen.report.figures import Area, Axis, Figure, Line, Panel, Rule, curve
from focgen.report.page import Page, Section, TableOf
from focgen.report.pages.parts import notes, number, sentence
from focgen.report.style import CYCLE, GREY, with_unit
from focgen.report.worst_summary import worst_sentences, worst_table
from focgen.rig.rig import Rig

_TIME = Axis("time (s)")
_LOWEST, _HIGHEST = 1e-5, 1e3  # of |L|: what is drawn


# ---------------------------------------------------------------------------------------------- design


def design_page(design: Design, rig: Rig) -> Page:
    """The page of a design."""
    verdict = sentence(specification_line(design))
    return Page(
        f"A controller for {rig.name}",
        f"{sentence(schedule_lines(design)[0])} {verdict}",
        design_sections(design, rig),
    )


def design_sections(design: Design, rig: Rig) -> tuple[Section, ...]:
    """The controller, its margins, and what becomes of it within the rig's uncertainty."""
    told = tuple(map(sentence, [*schedule_lines(design), memory_line(design), specification_line(design)]))
    schedule = (_schedule(design, rig),) if design.schedule.breakpoints else ()
    worst = tuple(map(sentence, worst_sentences(design.worst)))
    return (
        Section("Controller", (*told, *notes(design.notes)), (points_table(design),), figures=schedule),
        Section(
            "Margins",
            worst,
            (margins_table(design), worst_table(design.worst)),
            figures=(_bode(design, rig),),
        ),
    )


def _schedule(design: Design, rig: Rig) -> Figure:
    schedule, unit = design.schedule, design.controller.units.schedule
    first, last = schedule.breakpoints[0], schedule.breakpoints[-1]
    inside = np.linspace(first, last, 200)
    beyond = np.linspace(first - 0.3 * (last - first), last + 0.1 * (last - first), 300)
    actuator: Any = rig.actuator  # a fractional one: others are not scheduled
    wanted = schedule.intercept + schedule.slope * inside
    x = Axis(with_unit("pressure", unit))
    gains = (
        Line("schedule table", beyond, design.controller.gain_at(beyond), "running", width=2.4),
        Line("K_o(p)/K(p)", inside, wanted / actuator.K(inside), "ideal", width=1.1),
        Line(
            "breakpoints",
            np.array(schedule.breakpoints),
            np.array(schedule.gains),
            "running",
            "none",
            dots=7.0,
        ),
        Rule(present(schedule.lower_limit), GREY, "dotted", upright=True),
    )
    places = np.array([p.pressure for p in design.points])
    line = (
        Line("K_o(p)", inside, wanted, "controller", width=1.8),
        Line(
            "operating points",
            places,
            np.array([p.K_o for p in design.points]),
            "controller",
            "none",
            dots=8.0,
        ),
    )
    rows = tuple((number(p), number(g)) for p, g in zip(schedule.breakpoints, schedule.gains))
    return Figure(
        "The gain schedule is the controller",
        "Above, the table that runs and the formula it stands for; left of the dotted line the gain is "
        "held. Below, the line K_o(p) through the operating points.",
        "Curves over the pressure: the scheduled gain, the formula behind it, and the line K_o(p).",
        (Panel(x, Axis("gain"), gains, height=280), Panel(x, Axis("K_o", from_zero=True), line, height=220)),
        TableOf((with_unit("pressure", unit), "gain"), rows, "The schedule"),
    )


def _bode(design: Design, rig: Rig) -> Figure:
    """The open loop at the operating point with the smallest phase margin."""
    loops = shapes(rig, design.controller, build_plan(design.controller), design.delay)
    worst = min(design.margins, key=lambda point: point.running.phase_deg)
    return bode_figure(loops, worst, design.controller, margins_table(design))


def bode_figure(loops: Shapes, worst: PointMargins, controller: Controller, numbers: TableOf) -> Figure:
    """Magnitude and phase of the open loop, ideal and as it will run."""
    tops, bottoms = [], []
    for name, loop, margin, colour in (
        ("ideal", loops.ideal, worst.ideal, "ideal"),
        ("as it will run", loops.running, worst.running, "running"),
    ):
        size = np.abs(loop.values) / np.interp(margin.crossover_rad_s, loop.omega, np.abs(loop.values))
        kept = (size > _LOWEST) & (size < _HIGHEST)
        phase = np.degrees(np.unwrap(np.angle(loop.values)))
        tops.append(curve(name, loop.omega[kept], size[kept], colour, width=1.8))
        bottoms.append(curve(name, loop.omega[kept], phase[kept], colour, width=1.8))
        at, where = np.array([margin.crossover_rad_s]), np.array([-180.0 + margin.phase_deg])
        bottoms.append(
            Line(
                f"{name}: {margin.phase_deg:.1f}°", at, where, colour, "none", dots=9.0, group="phase margin"
            )
        )
    place = f"p = {worst.pressure:.4g} {controller.units.schedule}".rstrip()
    x = Axis("frequency (rad/s)", log=True)
    return Figure(
        f"The open loop at {place}",
        "At the operating point with the smallest phase margin. The dots stand at the crossover; how far "
        "they are above −180° is the phase margin.",
        "Bode plot: magnitude and phase of the open loop over frequency, ideal and as it will run.",
        (
            Panel(x, Axis("|L|", log=True), (*tops, Rule(1.0))),
            Panel(x, Axis("phase (°)", low=-400.0, high=0.0), (*bottoms, Rule(-180.0)), height=260),
        ),
        numbers,
    )


# ------------------------------------------------------------------------------------------------ loop


def simulation_page(simulation: Simulation) -> Page:
    """The page of a simulated loop."""
    name = f"The closed loop of {simulation.rig.name} and {simulation.controller.name}"
    return Page(name, simulation_lead(simulation), simulation_sections(simulation))


def simulation_lead(simulation: Simulation) -> str:
    """How many steps settle, in a sentence."""
    results, count = simulation.setpoints, len(simulation.setpoints)
    bad = [r for r in results if r.verdict != "settles"]
    if bad:
        what = "; ".join(f"{r.reference:.4g} {r.verdict}" for r in bad)
        return f"{len(bad)} of {count} set points are not held within {simulation.duration:.3g} s: {what}."
    return (
        f"All {count} set points are reached and held: the output settles in {mean_settling(simulation):.3g} "
        f"s on average, and overshoots by {max(r.overshoot_pct for r in results):.2g} % at most."
    )


def simulation_sections(simulation: Simulation) -> tuple[Section, ...]:
    """The steps, and what becomes of them within the rig's uncertainty."""
    worst = tuple(map(sentence, worst_sentences(simulation.worst)))
    told = (simulation_lead(simulation), *worst, *notes(simulation.notes))
    tables = (worst_table(simulation.worst),)
    return (Section("Closed loop", told, tables, figures=(_steps(simulation),)),)


def _steps(simulation: Simulation) -> Figure:
    """Output and command at every set point."""
    units, run = simulation.controller.units, simulation.running
    draw = _in_a_row if simulation.consecutive else _from_rest
    tops, bottoms = draw(simulation)
    low, high = simulation.controller.ranges.output
    limits = tuple(Rule(v, "limit", "dotted") for v in (low, high) if _stays_at(v, run.command))
    end = None if simulation.consecutive else _interesting(simulation)
    effects = f", with {', '.join(simulation.effects)}" if simulation.effects else ""
    time = Axis(_TIME.label, low=0.0, high=end)
    return Figure(
        f"Steps to {len(simulation.setpoints)} set points",
        f"The controller bit for bit as it will run ({simulation.arithmetic}, "
        f"{simulation.remembers}){effects}. Set points are dashed in their band of ±5 %; a dot says where "
        "the output has settled.",
        "Curves over time: the output stepping to each set point, and the command that does it.",
        (
            Panel(time, Axis(with_unit("output", units.measurement)), tuple(tops), height=380),
            Panel(time, Axis(with_unit("command", units.output)), (*bottoms, *limits), height=230),
        ),
        setpoints_table(simulation),
    )


def _stays_at(limit: float, command: Array) -> bool:
    """Whether the command stays at the limit for more than the moment it starts from."""
    return bool(np.count_nonzero(np.isclose(command, limit, rtol=0.0, atol=1e-9)) > 0.01 * command.size)


def _interesting(simulation: Simulation) -> float:
    times = [r.settling_s for r in simulation.setpoints]
    return (
        min(simulation.duration, 2.5 * max(times)) if all(map(math.isfinite, times)) else simulation.duration
    )


def _from_rest(simulation: Simulation) -> tuple[list[Any], list[Any]]:
    run, tops, bottoms = simulation.running, [], []
    kept = run.time <= 1.2 * _interesting(simulation)
    for i, result in enumerate(simulation.setpoints):
        colour, name = CYCLE[i % len(CYCLE)], f"{result.reference:.4g}"
        tops += _reference(result, (0.0, simulation.duration), colour)
        tops.append(curve(f"to {name}", run.time[kept], run.output[kept, i], colour, width=1.8, group=name))
        tops += _other(simulation, i, kept)
        tops += _settled(run.time, run.output[:, i], 0.0, result.settling_s, colour)
        bottoms.append(
            curve(f"to {name}", run.time[kept], run.command[kept, i], colour, steps=True, group=name)
        )
    return tops, bottoms


def _other(simulation: Simulation, index: int, kept: Bools) -> list[Line]:
    """What to compare with, dotted: the loop without the rig's effects, or without any, the frozen one."""
    nominal, time = simulation.nominal, simulation.running.time
    other = simulation.frozen[index] if nominal is None else nominal.output[:, index]
    name = "K frozen, linear" if nominal is None else "without the effects"
    return [] if other is None else [curve(name, time[kept], other[kept], GREY, dash="dotted", width=1.2)]


def _in_a_row(simulation: Simulation) -> tuple[list[Any], list[Any]]:
    run, tops = simulation.running, []
    for i, result in enumerate(simulation.setpoints):
        span = (i * simulation.duration, (i + 1) * simulation.duration)
        tops += _reference(result, span, GREY)
        tops += _settled(run.time, run.output[:, 0], span[0], span[0] + result.settling_s, "output")
    tops.append(curve("output", run.time, run.output[:, 0], "output", width=1.8))
    if simulation.nominal is not None:
        tops.append(
            curve("without the effects", run.time, simulation.nominal.output[:, 0], GREY, dash="dotted")
        )
    return tops, [curve("command", run.time, run.command[:, 0], "command", steps=True)]


def _reference(result: SetpointResult, span: tuple[float, float], colour: str) -> list[Any]:
    half, x = BAND * abs(result.reference - result.start), np.array(span)
    level = np.full(2, result.reference)
    return [
        Area("±5 %", x, level - half, level + half, colour, group=""),
        Line("set point", x, level, colour, "dashed", 1.0, group=""),
    ]


def _settled(time: Array, output: Array, begin: float, settling: float, colour: str) -> list[Line]:
    if not math.isfinite(settling):
        return []
    at = np.array([settling])
    name = f"settled after {settling - begin:.3g} s"
    return [Line(name, at, np.interp(at, time, output), colour, "none", dots=9.0, group="")]
