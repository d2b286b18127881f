"""The pictures of a diagnosis: ladder, residual, loops, waterfall, candidates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from focgen.diagnosis.belief.standing import tied_within
from focgen.diagnosis.drawn import Drawn, Residual, Trace, sweeps
from focgen.diagnosis.model import Diagnosis
from focgen.report.style import COLOURS, figure, png, with_unit
from focgen.report.texts import pictured

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def diagnosis_pictures(found: Diagnosis) -> dict[str, bytes]:
    """Every picture of a diagnosis just made, PNG bytes by file name.

    Raises MissingExtra where matplotlib is not installed.
    """
    drawn = found.drawn
    assert drawn and drawn.residual  # None only where it was read from a file
    pictures = {
        "ladder.png": ladder(drawn),
        "residual.png": residual(drawn.residual, drawn),
        "loops.png": loops(drawn),
        "waterfall.png": waterfall(found),
    }
    return pictures | ({"candidates.png": candidates(drawn)} if drawn.rivals else {})


def ladder(drawn: Drawn) -> bytes:
    """Root-mean-square residual of every segment on its measured input: as given, refitted, with the
    effects.
    """
    kinds: tuple[tuple[str, str, str], ...] = (
        ("as_given", "as given", "measured"),
        ("refitted", "refitted", "bad"),
        ("explained", "with effects", "good"),
    )
    at = np.arange(len(drawn.segments))
    with figure(1, 1) as (fig, axis):
        for aside, (key, label, colour) in zip((-0.27, 0.0, 0.27), kinds):
            heights = [getattr(segment, key) for segment in drawn.segments]
            axis.bar(at + aside, heights, 0.25, color=COLOURS[colour], label=label)
        axis.set_xticks(at, [f"{segment.entry} → {segment.exit}" for segment in drawn.segments])
        axis.set_ylabel("RMS error, % of the signal's range")
        axis.set_title("Where: each segment on its measured input")
        axis.legend()
        return png(fig)


def residual(left: Residual, drawn: Drawn) -> bytes:
    """The worst segment's residual against level, rate, direction and time, before and after the effects.

    Lines are means: over bins of level and of rate, and of time; those over the level are drawn apart for
    rising and falling input, so that a gap between them is a loop.
    """
    entry, exit = drawn.worst
    unit = drawn.units[entry]
    kinds = (("refitted", "refitted", "bad"), ("explained", "with effects", "good"))
    with figure(2, 2) as (fig, axes):
        (by_level, by_rate), (by_way, by_time) = axes
        over = {"level": by_level, "rate": by_rate, "time": by_time}
        for key, label, colour in kinds:
            for axis, place in ((by_level, left.level), (by_rate, left.rate), (by_time, left.clock)):
                axis.plot(
                    place, getattr(left, key), ".", ms=1.2, alpha=0.35, color=COLOURS[colour], rasterized=True
                )
            for mean in (mean for mean in drawn.means if mean.of == key):
                style = "--" if mean.way == "falling" else "-"
                named = label if mean.over == "time" else None
                over[mean.over].plot(mean.place, mean.mean, style, color=_DARK[colour], lw=1.3, label=named)
        _by_direction(by_way, left)
        by_level.plot([], [], "-", color="black", label="mean, rising")
        by_level.plot([], [], "--", color="black", label="mean, falling")
        by_level.legend(fontsize=7)
        by_time.legend(fontsize=7)
        for axis, label in (
            (by_level, with_unit(entry, unit)),
            (by_rate, f"rate of {entry} ({unit or 1}/s)"),
            (by_time, "session's time (s)"),
        ):
            axis.set_xlabel(label)
        by_rate.locator_params(axis="x", nbins=5)
        by_rate.set_xlim(*(1.5 * np.quantile(left.rate, q) for q in (0.005, 0.995)))
        widest = 1.05 * np.quantile(np.abs(left.refitted), 0.999)
        for axis in axes.ravel():
            if axis is not by_way:
                axis.set_ylim(-widest, widest)
            axis.set_ylabel(with_unit(f"error of {exit}", drawn.units[exit]))
        fig.suptitle(f"What {entry} → {exit} leaves")
        return png(fig)


_DARK = {"bad": "#7A3500", "good": "#00513B"}  # of the means, on the points of their colour


def _by_direction(axis: Axes, left: Residual) -> None:
    """Where half and nine tenths of the residual lie while the input rises, holds, and falls."""
    for values, colour, aside in ((left.refitted, "bad", -0.16), (left.explained, "good", 0.16)):
        for place, sign in enumerate((1, 0, -1)):
            here = values[left.way == sign]
            if len(here) < 5:
                continue
            low, quarter, middle, upper, high = np.quantile(here, (0.05, 0.25, 0.5, 0.75, 0.95))
            axis.vlines(place + aside, low, high, color=COLOURS[colour], lw=1.0)
            axis.vlines(place + aside, quarter, upper, color=COLOURS[colour], lw=8.0)
            axis.plot(place + aside, middle, "o", color="white", ms=3.5)
    axis.set_xticks(range(3), ("rising", "holding", "falling"))
    axis.set_xlabel("direction")
    axis.set_xlim(-0.6, 2.6)


def loops(drawn: Drawn) -> bytes:
    """Output against input, measured and simulated, before and after, for the two experiments that tell most;
    against time where the input only steps.
    """
    chosen = sorted(drawn.traces, key=_telling)[-2:]
    swept = with_unit(drawn.entry, drawn.units[drawn.entry])
    with figure(len(chosen), 2, squeeze=False, sharex="row", sharey="row") as (fig, axes):
        for row, trace in zip(axes, chosen):
            place, label = (trace.input, swept) if sweeps(trace.input) else (trace.time, "time (s)")
            kinds = ((trace.refitted, "refitted", "bad"), (trace.explained, "with the effects", "good"))
            for axis, (made, what, colour) in zip(row, kinds):
                axis.plot(place, trace.measured, color=COLOURS["measured"], lw=0.7, label="measured")
                axis.plot(place, made, color=COLOURS[colour], lw=1.0)
                axis.set_title(f"{pictured(trace.name)}, {what}")
                axis.set_xlabel(label)
            row[0].set_ylabel(with_unit("output", drawn.units["output"]))
        axes[0, 0].legend(loc="best")
        return png(fig)


def _telling(trace: Trace) -> float:
    """How much the effects change of an experiment, one that sweeps three times."""
    changed = float(np.sqrt(np.mean((trace.refitted - trace.explained) ** 2)))
    return changed * (3.0 if sweeps(trace.input) else 1.0) + 1e-12 * len(trace.time)


def waterfall(diagnosis: Diagnosis) -> bytes:
    """The mean square gap: parameters, effects, unexplained, noise; the areas add up."""
    gap = diagnosis.gap
    square = [gap.as_given**2, gap.refitted**2, gap.explained**2, gap.floor**2]
    total = max(square[0], 1e-300)
    tops = [100 * s / total for s in square]
    names = ("parameters", "effects", "unexplained", "noise")
    bottoms, heights = [*tops[1:], 0.0], [a - b for a, b in zip(tops, [*tops[1:], 0.0])]
    colours = ("model", "good", "bad", "measured")
    with figure(1, 1) as (fig, axis):
        for name, bottom, height, colour in zip(names, bottoms, heights, colours):
            axis.bar(name, height, bottom=bottom, color=COLOURS[colour])
            axis.annotate(f"{height:.1f} %", (name, bottom + max(height, 0)), ha="center", va="bottom")
        axis.set_ylabel("% of the mean square error as given")
        given, explained, possible = (gap.gof[key] for key in ("as given", "explained", "possible"))
        axis.set_title(f"GOF {given:.3f} → {explained:.3f} of a possible {possible:.3f}")
        return png(fig)


def candidates(drawn: Drawn) -> bytes:
    """For each cause, how many standard deviations every other family is behind."""
    count = len(drawn.rivals)
    with figure(1, count, size=(max(7.0, 3.2 * count), 3.4), squeeze=False) as (fig, axes):
        for axis, rivals in zip(axes[0], drawn.rivals):
            shown = list(zip(rivals.effects, rivals.separations))[:8][::-1]
            names, behind = zip(*shown)
            colours = [COLOURS["good" if value < tied_within() else "measured"] for value in behind]
            axis.barh(names, behind, color=colours)
            axis.axvline(tied_within(), color=COLOURS["limit"], lw=0.8)
            axis.set_xlim(0.0, max(4.0, 1.08 * max(behind)))
            for place, (name, value) in enumerate(shown):
                text = "found" if name == rivals.effects[0] else f"{value:.1f}"
                axis.annotate(
                    text, (value, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=7
                )
            axis.set_xlabel(f"σ behind (below {tied_within():.1f}: tied)")
            axis.set_title(rivals.found)
        return png(fig)
