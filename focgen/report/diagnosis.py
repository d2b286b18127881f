"""The pictures of a diagnosis: ladder, residual, loops, waterfall, candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from focgen.diagnosis.drawn import entry_of, means, rate_of, segment_errors, steady, sweeps, way_of, worst_of
from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.fit import problem_residual
from focgen.diagnosis.model import Diagnosis, Evidence
from focgen.logs.experiment import Experiment
from focgen.report.style import COLOURS, figure, png, with_unit

_POINTS = 4000


def pictures(
    diagnosis: Diagnosis, evidence: Evidence, logs: Sequence[Experiment], units: Mapping[str, str]
) -> dict[str, bytes]:
    """Every picture, PNG bytes by file name; ``units`` by role."""
    worst = worst_of(evidence)
    found = {
        "ladder.png": ladder(evidence),
        "residual.png": residual(worst, units),
        "loops.png": loops(evidence, logs, units),
        "waterfall.png": waterfall(diagnosis),
    }
    return found | (
        {"candidates.png": candidates(evidence)} if any(e.causes for e in evidence.explanations) else {}
    )


def ladder(evidence: Evidence) -> bytes:
    """Root-mean-square residual of every segment on its measured input: as given, refitted, with the
    effects.
    """
    with figure(1, 1) as (fig, axis):
        for i, e in enumerate(evidence.explanations):
            for j, (height, colour) in enumerate(zip(segment_errors(e), ("measured", "bad", "good"))):
                label = ("as given", "refitted", "with effects")[j] if i == 0 else None
                axis.bar(i + (j - 1) * 0.27, height, 0.25, color=COLOURS[colour], label=label)
        axis.set_xticks(
            range(len(evidence.explanations)),
            [f"{e.segment.entry} → {e.segment.exit}" for e in evidence.explanations],
        )
        axis.set_ylabel("RMS error, % of the signal's range")
        axis.set_title("Where: each segment on its measured input")
        axis.legend()
        return png(fig)


def _thin(*signals: np.ndarray) -> list[np.ndarray]:
    step = max(1, len(signals[0]) // _POINTS)
    return [s[::step] for s in signals]


def residual(e: Explanation, units: Mapping[str, str]) -> bytes:
    """The worst segment's residual against level, rate, direction and time, before and after the effects.

    Lines are means: over bins of level and of rate, and of time; those over the level are drawn apart for
    rising and falling input, so that a gap between them is a loop.
    """
    run, before, after = e.segment.run, problem_residual(e.nominal), problem_residual(e.best)
    level = steady(e.segment.x, run)
    rate = rate_of(level, run)
    way = way_of(rate)
    with figure(2, 2) as (fig, axes):
        (by_level, by_rate), (by_way, by_time) = axes
        for values, colour, label in ((before, "bad", "refitted"), (after, "good", "with effects")):
            for axis, place in ((by_level, level), (by_rate, rate), (by_time, run.clock)):
                axis.plot(
                    *_thin(place, values), ".", ms=1.2, alpha=0.35, color=COLOURS[colour], rasterized=True
                )
            for sign, style in ((1, "-"), (-1, "--")):
                by_level.plot(
                    *means(level[way == sign], values[way == sign]), style, color=_DARK[colour], lw=1.3
                )
            by_rate.plot(*means(rate, values), color=_DARK[colour], lw=1.3)
            by_time.plot(*means(run.clock, values, 60), color=_DARK[colour], lw=1.3, label=label)
        _by_direction(by_way, before, after, way)
        by_level.plot([], [], "-", color="black", label="mean, rising")
        by_level.plot([], [], "--", color="black", label="mean, falling")
        by_level.legend(fontsize=7)
        by_time.legend(fontsize=7)
        for axis, label in (
            (by_level, with_unit(e.segment.entry, units[e.segment.entry])),
            (by_rate, f"rate of {e.segment.entry} ({units[e.segment.entry] or 1}/s)"),
            (by_time, "session's time (s)"),
        ):
            axis.set_xlabel(label)
        by_rate.locator_params(axis="x", nbins=5)
        by_rate.set_xlim(*(1.5 * np.quantile(rate, q) for q in (0.005, 0.995)))
        widest = 1.05 * np.quantile(np.abs(before), 0.999)
        for axis in axes.ravel():
            if axis is not by_way:
                axis.set_ylim(-widest, widest)
            axis.set_ylabel(with_unit(f"error of {e.segment.exit}", units[e.segment.exit]))
        fig.suptitle(f"What {e.segment.entry} → {e.segment.exit} leaves")
        return png(fig)


_DARK = {"bad": "#7A3500", "good": "#00513B"}  # of the means, on the points of their colour


def _by_direction(axis, before: np.ndarray, after: np.ndarray, way: np.ndarray) -> None:
    """Where half and nine tenths of the residual lie while the input rises, holds, and falls."""
    for values, colour, aside in ((before, "bad", -0.16), (after, "good", 0.16)):
        for place, sign in enumerate((1, 0, -1)):
            here = values[way == sign]
            if len(here) < 5:
                continue
            low, quarter, middle, upper, high = np.quantile(here, (0.05, 0.25, 0.5, 0.75, 0.95))
            axis.vlines(place + aside, low, high, color=COLOURS[colour], lw=1.0)
            axis.vlines(place + aside, quarter, upper, color=COLOURS[colour], lw=8.0)
            axis.plot(place + aside, middle, "o", color="white", ms=3.5)
    axis.set_xticks(range(3), ("rising", "holding", "falling"))
    axis.set_xlabel("direction")
    axis.set_xlim(-0.6, 2.6)


def loops(evidence: Evidence, logs: Sequence[Experiment], units: Mapping[str, str]) -> bytes:
    """Output against input, measured and simulated, before and after, for the two experiments that tell most;
    against time where the input only steps.
    """
    chosen = _telling(evidence, logs)
    with figure(len(chosen), 2, squeeze=False, sharex="row", sharey="row") as (fig, axes):
        for row, i in zip(axes, chosen):
            x = logs[i][entry_of(logs)]
            swept = with_unit(entry_of(logs), units[entry_of(logs)])
            place, label = (x, swept) if sweeps(x) else (logs[i].time, "time (s)")
            for axis, name in zip(row, ("refitted", "explained")):
                where, y, made = _thin(place, logs[i]["output"], evidence.simulated[name][i]["output"])
                axis.plot(where, y, color=COLOURS["measured"], lw=0.7, label="measured")
                axis.plot(where, made, color=COLOURS["bad" if name == "refitted" else "good"], lw=1.0)
                axis.set_title(f"{logs[i].name}, {'refitted' if name == 'refitted' else 'with the effects'}")
                axis.set_xlabel(label)
            row[0].set_ylabel(with_unit("output", units["output"]))
        axes[0, 0].legend(loc="best")
        return png(fig)


def _telling(evidence: Evidence, logs: Sequence[Experiment]) -> list[int]:
    """Up to two experiments where the effects changed the simulated output most, those that sweep first."""
    before, after = evidence.simulated["refitted"], evidence.simulated["explained"]

    def telling(i: int) -> float:
        changed = np.sqrt(np.mean((before[i]["output"] - after[i]["output"]) ** 2))
        weight = 3.0 if sweeps(logs[i][entry_of(logs)]) else 1.0
        return float(changed) * weight + 1e-12 * len(logs[i])

    return sorted(sorted(range(len(logs)), key=telling)[-2:])


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


def candidates(evidence: Evidence) -> bytes:
    """For each cause, how many standard deviations every other family is behind."""
    causes = [c for e in evidence.explanations for c in e.causes]
    with figure(1, len(causes), size=(max(7.0, 3.2 * len(causes)), 3.4), squeeze=False) as (fig, axes):
        for axis, cause in zip(axes[0], causes):
            shown = cause.rivals[:8][::-1]
            colours = [COLOURS["good" if r.separation < 2 else "measured"] for r in shown]
            axis.barh([r.effect for r in shown], [r.separation for r in shown], color=colours)
            axis.axvline(2.0, color=COLOURS["limit"], lw=0.8)
            axis.set_xlim(0.0, max(4.0, 1.08 * max(r.separation for r in shown)))
            for place, r in enumerate(shown):
                text = "found" if r is cause.rivals[0] else f"{r.separation:.1f}"
                axis.annotate(
                    text,
                    (r.separation, place),
                    xytext=(3, 0),
                    textcoords="offset points",
                    va="center",
                    fontsize=7,
                )
            axis.set_xlabel("σ behind (below 2: tied)")
            axis.set_title(cause.rivals[0].effect)
        return png(fig)
