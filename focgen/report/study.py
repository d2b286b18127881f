"""Pictures of a study of the memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from focgen.control.controller import ARITHMETICS
from focgen.present import present
from focgen.report.style import (
    BLUE,
    COLOURS,
    CYCLE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    figure,
    log_scales,
    png,
    sparse_ticks,
    with_unit,
)
from focgen.studies.results import Curves, Row, Study

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ARITHMETIC_COLOURS = dict(zip(ARITHMETICS, (BLUE, GREEN, ORANGE, RED, *CYCLE)))
_MOST_LINES = 5
LEAST = 1e-5  # % of the step: where the distance from the ideal is cut off
PLACES = {"short": "length", "exponential": "states"}  # what a form's size is
_MARKERS = {"short": "o", "exponential": "D"}
SHARES = {
    "multiplies": "multiplications a step",
    "cycles": "cycles a step",
    "instructions": "instructions a step",
    "ram_bytes": "state (bytes)",
}


def study_pictures(study: Study) -> dict[str, bytes]:
    """PNG bytes by file name: ``accuracy``, ``pareto``, and where there are any ``frequency``,
    ``loops``, ``plant``.
    """
    found = {"accuracy.png": accuracy(study), "pareto.png": fronts(study)}
    if any(curves.omega for curves in study.curves):
        found["frequency.png"] = frequency(study)
    if any(curves.time for curves in study.curves):
        found["loops.png"] = loops(study)
    if study.plant is not None:
        found["plant.png"] = plant(study)
    return found


def own_rows(study: Study) -> list[Row]:
    """The rows at the controller's own sample time, where there are any."""
    h = study.controller.sample_time
    own = [row for row in study.rows if row.sample_time == h and row.error is not None]
    return own or [row for row in study.rows if row.error is not None]


def accuracy(study: Study) -> bytes:
    """Error and bound against length, and against the number of exponentials, on one scale."""
    rows = own_rows(study)
    memories = [m for m in PLACES if any(r.memory == m for r in rows)] or ["short"]
    size = (7.6, 3.9) if len(memories) > 1 else (6.0, 3.9)
    with figure(1, len(memories), size=size, sharey=True, squeeze=False) as (fig, axes):
        for axis, memory in zip(axes[0], memories):
            _by_size(axis, [r for r in rows if r.memory == memory], memory)
        first, last = axes[0, 0], axes[0, -1]
        first.set_ylabel("error / largest output")
        last.plot([], [], color=GREY, label="worst error of four inputs")
        last.plot([], [], color=GREY, ls=":", label="proven bound")
        last.legend(loc="best")
        sparse_ticks(first.yaxis)
        return png(fig)


def _by_size(axis: Axes, rows: Sequence[Row], memory: str) -> None:
    """Error and bound of one form of memory, a colour for each arithmetic."""
    for arithmetic, colour in ARITHMETIC_COLOURS.items():
        _against(axis, [r for r in rows if r.arithmetic == arithmetic], PLACES[memory], colour, arithmetic)
    log_scales(axis, "xy" if memory == "short" else "y")
    axis.set_title(f"{memory.capitalize()} memory")
    if memory == "short":
        axis.set_xlabel("length L (past samples)")
        sparse_ticks(axis.xaxis)
    else:
        axis.set_xlabel("exponentials")
        locator: Any = axis.xaxis.get_major_locator()
        locator.set_params(integer=True)


def _against(axis: Axes, rows: Sequence[Row], place: str, colour: str, label: str) -> None:
    rows = sorted((r for r in rows if getattr(r, place) is not None), key=lambda r: getattr(r, place))
    if not rows:
        return
    x = [getattr(r, place) for r in rows]
    axis.plot(x, [present(r.error) for r in rows], "o-", color=colour, ms=3.5, label=label)
    axis.plot(x, [np.nan if r.bound is None else r.bound for r in rows], ":", color=colour, lw=1.0)


def fronts(study: Study) -> bytes:
    """Error against cycles (multiplications where no target is named) and against bytes of state."""
    first = next((name for name in ("cycles", "instructions") if study.pareto[name]), "multiplies")
    with figure(1, 2, size=(7.6, 3.9), sharey=True) as (fig, axes):
        for axis, cost in zip(axes, (first, "ram_bytes")):
            _front(axis, study, cost)
            axis.set_xlabel(
                SHARES[cost] + (f" on {_target(study)}" if cost in ("cycles", "instructions") else "")
            )
        axes[0].set_ylabel("error / largest output")
        axes[0].set_title("What accuracy costs")
        for memory in dict.fromkeys(row.memory for row in own_rows(study)):
            axes[1].plot([], [], _MARKERS[memory], color=GREY, ms=4, label=f"{memory} memory")
        for arithmetic in dict.fromkeys(row.arithmetic for row in own_rows(study)):
            axes[1].plot([], [], "s", color=ARITHMETIC_COLOURS[arithmetic], ms=4, label=arithmetic)
        axes[1].plot([], [], color=GREY, lw=0.9, label="best at its cost")
        axes[1].legend(loc="best")
        for axis in (axes[0].xaxis, axes[1].xaxis, axes[0].yaxis):
            sparse_ticks(axis)
        return png(fig)


def _target(study: Study) -> str:
    """The core that was counted on."""
    return present(next(row.compiled_for for row in study.rows if row.instructions is not None)).partition(
        ","
    )[0]


def _front(axis: Axes, study: Study, cost: str) -> None:
    for row in own_rows(study):
        if getattr(row, cost) is not None:
            marker, colour = _MARKERS[row.memory], ARITHMETIC_COLOURS[row.arithmetic]
            axis.plot(getattr(row, cost), present(row.error), marker, color=colour, ms=4, alpha=0.85)
    best = [study.rows[i] for i in study.pareto[cost]]
    axis.step(
        [getattr(r, cost) for r in best],
        [present(r.error) for r in best],
        where="post",
        color=GREY,
        lw=0.9,
        zorder=1,
    )
    log_scales(axis)


def chosen(study: Study, part: str) -> list[tuple[Row, Curves, str]]:
    """Rows in the controller's arithmetic to draw, with a colour each: some lengths, and one exponential."""
    rows = own_rows(study)
    wanted = study.controller.arithmetic
    if not any(r.arithmetic == wanted for r in rows):
        wanted = rows[0].arithmetic
    pairs = [
        (r, c)
        for r, c in zip(study.rows, study.curves)
        if r in rows and r.arithmetic == wanted and getattr(c, part)
    ]
    short = sorted((p for p in pairs if p[0].memory == "short"), key=lambda p: present(p[0].length))
    exponential = sorted(
        (p for p in pairs if p[0].memory == "exponential"), key=lambda p: -present(p[0].tolerance)
    )
    places = _spread([present(row.length) for row, _ in short])
    shown = [short[i] for i in places] + exponential[len(exponential) // 2 :][:1]
    return [(row, curves, CYCLE[i % len(CYCLE)]) for i, (row, curves) in enumerate(shown)]


def _spread(lengths: Sequence[int]) -> list[int]:
    """Indices of a few lengths, as even in log length as there are."""
    if not lengths:
        return []
    wanted = np.linspace(np.log(lengths[0]), np.log(lengths[-1]), min(_MOST_LINES, len(lengths)))
    return list(dict.fromkeys(int(np.argmin(np.abs(np.log(lengths) - place))) for place in wanted))


def row_label(row: Row) -> str:
    """A row's memory by its size."""
    return f"L = {row.length}" if row.memory == "short" else f"{row.states} exponentials"


def _style(row: Row) -> dict[str, Any]:
    return {"ls": "--", "lw": 1.8} if row.memory == "exponential" else {}


def frequency(study: Study) -> bytes:
    """What the memory adds to the controller's phase and magnitude, over the band that matters."""
    with figure(2, 1, size=(7.0, 5.2), sharex=True) as (fig, (top, bottom)):
        for row, curves, colour in chosen(study, "omega"):
            top.semilogx(curves.omega, curves.phase_deg, color=colour, label=row_label(row), **_style(row))
            bottom.semilogx(curves.omega, curves.magnitude_db, color=colour, **_style(row))
        top.axhspan(-2.0, 2.0, color=COLOURS["band"], zorder=0, lw=0, label="±2°")
        for place in (study.band.crossover_low, study.band.crossover_high):
            if place is not None:
                for axis in (top, bottom):
                    axis.axvline(place, color=GREY, lw=0.8, ls=":")
        if study.band.crossover_high is not None:
            bottom.annotate(
                "crossovers",
                (study.band.crossover_high, 0.92),
                xycoords=("data", "axes fraction"),
                xytext=(4, 0),
                textcoords="offset points",
                fontsize=8,
                color=GREY,
            )
        sparse_ticks(bottom.xaxis)
        top.set_ylabel("phase error (°)")
        bottom.set_ylabel("magnitude error (dB)")
        bottom.set_xlabel("frequency (rad/s)")
        top.set_title("The controller's response against infinite memory")
        top.legend(ncols=2)
        return png(fig)


def loops(study: Study) -> bytes:
    """The step to the middle set point by length, and what it is off the ideal."""
    at = [ideal.sample_time for ideal in study.ideal].index(own_rows(study)[0].sample_time)
    ideal = study.ideal_curves[at]
    time, perfect = np.array(ideal.time), np.array(ideal.output)
    unit, lines = study.controller.units.measurement, chosen(study, "time")
    with figure(2, 1, size=(7.0, 5.6), sharex=True, height_ratios=(1.4, 1.0)) as (fig, (top, bottom)):
        for row, curves, colour in lines:
            off = 100.0 * np.abs(np.array(curves.output) - perfect) / abs(ideal.reference - perfect[0])
            top.plot(curves.time, curves.output, color=colour, label=row_label(row), **_style(row))
            bottom.semilogy(curves.time, np.maximum(off, LEAST), color=colour, **_style(row))
        top.plot(time, perfect, color=COLOURS["ideal"], lw=0.9, label="infinite memory")
        top.axhline(ideal.reference, color=GREY, lw=0.8, ls="--")
        top.set_ylabel(with_unit("output", unit))
        bottom.set_ylim(LEAST, None)
        bottom.set_ylabel("off the ideal (% of step)")
        bottom.set_xlabel("time (s)")
        top.set_title(f"Closed loop, {lines[0][0].arithmetic}, {lines[0][0].sample_time:g} s")
        top.legend(loc="lower right", ncols=2)
        return png(fig)


def plant(study: Study) -> bytes:
    """The plant's step, simulated with each memory in its denominator, over an hour."""
    found = present(study.plant)
    with figure(1, 1, size=(7.0, 3.6)) as (fig, axis):
        for row, colour in zip(found.rows, CYCLE):
            label = f"L = {row.length}" if row.length else f"{row.states} exponentials"
            axis.semilogx(found.time, row.output, color=colour, label=label, lw=2.2 if row.states else 1.4)
        axis.semilogx(found.time, found.exact, color=COLOURS["ideal"], lw=0.9, label="exact")
        axis.set_xlabel("time after the step (s)")
        axis.set_ylabel("output")
        axis.set_title("Short memory in a plant's denominator")
        axis.legend(loc="best")
        return png(fig)
