"""Pictures of a design and of a simulated closed loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from focgen.arrays import Array
from focgen.control.measures import BAND
from focgen.loop.design import Design
from focgen.loop.frequency import shapes
from focgen.loop.simulate import Simulation
from focgen.plan.build import build_plan
from focgen.present import present
from focgen.report.style import COLOURS, CYCLE, GREY, figure, png, with_unit
from focgen.rig.rig import Rig

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def simulation_pictures(simulation: Simulation) -> dict[str, bytes]:
    """Return ``setpoints.png``, like Fig. 10: output and command at every set point."""
    with figure(2, 1, size=(7.0, 6.2), sharex=True, height_ratios=(1.5, 1.0)) as (fig, (top, bottom)):
        draw = _draw_consecutive if simulation.consecutive else _draw_from_rest
        draw(top, bottom, simulation)
        units = simulation.controller.units
        top.set_ylabel(with_unit("output", units.measurement))
        bottom.set_ylabel(with_unit("command", units.output))
        bottom.set_xlabel("time (s)")
        effects = f"\nwith {', '.join(simulation.effects)}" if simulation.effects else ""
        what = f"({simulation.arithmetic}, {simulation.remembers})"
        top.set_title(f"Closed loop as it will run {what}{effects}")
        low, high = simulation.controller.ranges.output
        for limit in (low, high):
            if _reached(limit, simulation.running.command):
                bottom.axhline(limit, color=COLOURS["limit"], lw=0.8, ls=":")
        return {"setpoints.png": png(fig)}


def _reached(limit: float, command: Array) -> bool:
    """Whether the command stays at the limit for more than the moment it starts from."""
    return bool(np.count_nonzero(np.isclose(command, limit, rtol=0.0, atol=1e-9)) > 0.01 * command.size)


def _draw_from_rest(top: Axes, bottom: Axes, simulation: Simulation) -> None:
    run = simulation.running
    for i, result in enumerate(simulation.setpoints):
        colour = CYCLE[i % len(CYCLE)]
        _reference(top, run.time[[0, -1]], result.start, result.reference, colour)
        _other_loop(top, simulation, i, colour)
        top.plot(run.time, run.output[:, i], color=colour)
        bottom.step(run.time, run.command[:, i], where="post", color=colour, label=f"{result.reference:.4g}")
        _settling(top, run.time, run.output[:, i], result.settling_s, colour)
    other = "without the effects" if simulation.nominal is not None else "K frozen, linear"
    top.plot([], [], color=GREY, lw=0.9, ls=":", label=other)
    top.plot([], [], color=GREY, lw=0.8, ls="--", label="set point ±5 %")
    top.plot([], [], "o", color=GREY, mec="white", mew=0.8, label="settled")
    top.legend(ncols=3, loc="lower right")
    top.set_xlim(0.0, _interesting(simulation))
    bottom.legend(title=with_unit("set point", simulation.controller.units.measurement), ncols=4, loc="best")


def _other_loop(axes: Axes, simulation: Simulation, index: int, colour: str) -> None:
    """What to compare with, dotted: the loop without the rig's effects, or without any, the frozen one."""
    time, frozen = simulation.running.time, simulation.frozen[index]
    other = frozen if simulation.nominal is None else simulation.nominal.output[:, index]
    if other is not None:
        axes.plot(time, other, color=colour, lw=0.9, ls=":")


def _interesting(simulation: Simulation) -> float:
    times = [r.settling_s for r in simulation.setpoints]
    return (
        min(simulation.duration, 2.5 * max(times)) if all(map(math.isfinite, times)) else simulation.duration
    )


def _draw_consecutive(top: Axes, bottom: Axes, simulation: Simulation) -> None:
    run, colour = simulation.running, COLOURS["output"]
    for i, result in enumerate(simulation.setpoints):
        begin, end = i * simulation.duration, (i + 1) * simulation.duration
        _reference(top, (begin, end), result.start, result.reference, GREY)
        _settling(top, run.time, run.output[:, 0], begin + result.settling_s, colour)
    top.plot(run.time, run.output[:, 0], color=colour)
    if simulation.nominal is not None:
        top.plot(run.time, simulation.nominal.output[:, 0], color=GREY, lw=0.9, label="without the effects")
        top.legend(loc="lower right")
    bottom.step(run.time, run.command[:, 0], where="post", color=COLOURS["command"])


def _reference(
    axes: Axes, span: Sequence[float] | Array, start: float, reference: float, colour: str
) -> None:
    """The set point, dashed, in its ±5 % band."""
    half = BAND * abs(reference - start)
    axes.fill_between(span, reference - half, reference + half, color=colour, alpha=0.15, lw=0)
    axes.plot(span, [reference] * 2, color=colour, ls="--", lw=0.8)


def _settling(axes: Axes, time: Array, output: Array, settling: float, colour: str) -> None:
    if math.isfinite(settling):
        axes.plot(
            settling, np.interp(settling, time, output), "o", color=colour, mec="white", mew=0.8, zorder=5
        )


def design_pictures(design: Design, rig: Rig) -> dict[str, bytes]:
    """Return ``margins.png`` (Bode plot of the open loops) and, where the gain is scheduled,
    ``schedule.png``.
    """
    found = {"margins.png": _margins_picture(design, rig)}
    if design.schedule.breakpoints:
        found["schedule.png"] = _schedule_picture(design, rig)
    return found


def _schedule_picture(design: Design, rig: Rig) -> bytes:
    with figure(2, 1, size=(7.0, 5.6), sharex=True) as (fig, (top, bottom)):
        _draw_gain(top, design, rig)
        _draw_K_o(bottom, design)
        top.set_title("The gain schedule is the controller")
        bottom.set_xlabel(with_unit("pressure", design.controller.units.schedule))
        return png(fig)


def _draw_gain(axes: Axes, design: Design, rig: Rig) -> None:
    """The table that runs, held beyond its ends, and the formula it stands for."""
    schedule = design.schedule
    first, last = schedule.breakpoints[0], schedule.breakpoints[-1]
    p = np.linspace(first, last, 400)
    beyond = np.linspace(first - 0.3 * (last - first), last + 0.1 * (last - first), 400)
    actuator: Any = rig.actuator  # a fractional one: others are not scheduled
    table, formula = design.controller.gain_at(beyond), _K_o(design, p) / actuator.K(p)
    axes.plot(beyond, table, color=COLOURS["running"], lw=2.2, label="schedule table")
    axes.plot(p, formula, color=COLOURS["ideal"], lw=0.7, zorder=3, label="$K_o(p)/K(p)$")
    axes.plot(schedule.breakpoints, schedule.gains, "o", color=COLOURS["running"])
    axes.axvline(present(schedule.lower_limit), color=GREY, lw=0.8, ls=":")
    axes.annotate(
        "held below",
        (schedule.lower_limit, 0.05),
        xycoords=("data", "axes fraction"),
        ha="right",
        xytext=(-4, 0),
        textcoords="offset points",
        fontsize=8,
        color=GREY,
    )
    axes.set_ylabel("gain")
    axes.legend()


def _draw_K_o(axes: Axes, design: Design) -> None:
    """The line K_o(p), and the operating points it goes through."""
    ends = np.array([design.schedule.breakpoints[0], design.schedule.breakpoints[-1]])
    places, values = [p.pressure for p in design.points], [p.K_o for p in design.points]
    axes.plot(ends, _K_o(design, ends), color=COLOURS["controller"], label="$K_o(p)$")
    axes.plot(places, values, "o", color=COLOURS["controller"], label="operating points")
    reach = [0.0, *(1.15 * _K_o(design, ends))]
    axes.set_ylim(min(reach), max(reach))
    axes.set_ylabel("$K_o$")
    axes.legend(loc="lower right")


def _K_o(design: Design, pressure: Array) -> Array:
    return design.schedule.intercept + design.schedule.slope * pressure


def _margins_picture(design: Design, rig: Rig) -> bytes:
    plan = build_plan(design.controller)
    loops = shapes(rig, design.controller, plan, design.delay)
    worst = min(design.margins, key=lambda point: point.running.phase_deg)
    with figure(2, 1, size=(7.0, 5.6), sharex=True) as (fig, (top, bottom)):
        for name, loop, colour in (
            ("ideal", loops.ideal, COLOURS["ideal"]),
            ("as it will run", loops.running, COLOURS["running"]),
        ):
            wanted = getattr(worst, "ideal" if name == "ideal" else "running")
            unit = np.interp(wanted.crossover_rad_s, loop.omega, np.abs(loop.values))
            phase = np.degrees(np.unwrap(np.angle(loop.values)))
            label = f"{name}: {wanted.phase_deg:.1f}°, {wanted.gain_db:.1f} dB, {wanted.delay_s:.2g} s"
            top.loglog(loop.omega, np.abs(loop.values) / unit, color=colour, label=label)
            bottom.semilogx(loop.omega, phase, color=colour)
            bottom.plot(wanted.crossover_rad_s, -180.0 + wanted.phase_deg, "o", color=colour)
        cross = worst.running.crossover_rad_s
        top.axhline(1.0, color=GREY, lw=0.8)
        bottom.axhline(-180.0, color=GREY, lw=0.8)
        top.set_xlim(cross / 300.0, loops.running.omega[-1] * 3.0)
        top.set_ylim(1e-5, 1e3)
        bottom.set_ylim(-400.0, 0.0)
        bottom.set_yticks(range(-360, 1, 90))
        top.set_ylabel("|L|")
        bottom.set_ylabel("phase (°)")
        bottom.set_xlabel("frequency (rad/s)")
        top.set_title(f"Open loop at p = {worst.pressure:.4g} {design.controller.units.schedule}".rstrip())
        top.legend()
        return png(fig)
