"""The pictures of a diagnosis: ladder, residual, loops, waterfall, candidates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from focgen.diagnosis.explain import Explanation
from focgen.diagnosis.fit import problem_residual
from focgen.diagnosis.model import Diagnosis, Evidence
from focgen.logs.experiment import Experiment
from focgen.report.style import COLOURS, figure, png

_POINTS = 4000


def pictures(diagnosis: Diagnosis, evidence: Evidence, logs: Sequence[Experiment]) -> dict[str, bytes]:
    """Every picture, PNG bytes by file name."""
    worst = max(evidence.explanations, key=_gap_ratio)
    found = {
        "ladder.png": ladder(evidence),
        "residual.png": residual(worst),
        "loops.png": loops(evidence, logs),
        "waterfall.png": waterfall(diagnosis),
    }
    return found | (
        {"candidates.png": candidates(evidence)} if any(e.causes for e in evidence.explanations) else {}
    )


def _gap_ratio(e: Explanation) -> float:
    return float(
        np.mean(problem_residual(e.nominal) ** 2) / max(np.mean(problem_residual(e.best) ** 2), 1e-300)
    )


def ladder(evidence: Evidence) -> bytes:
    """Root-mean-square residual of every segment on its measured input: as given, refitted, with the
    effects.
    """
    with figure(1, 1) as (fig, axis):
        for i, e in enumerate(evidence.explanations):
            given = e.nominal.problem.residual(e.given)
            parts = [given, problem_residual(e.nominal), problem_residual(e.best)]
            heights = [float(np.sqrt(np.mean(p**2))) / e.segment.level_out * 100 for p in parts]
            for j, (height, colour) in enumerate(zip(heights, ("measured", "bad", "good"))):
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


def residual(e: Explanation) -> bytes:
    """The worst segment's residual against level, rate, direction and time, before and after the effects.

    Lines are means: over bins of level and of rate, and of time; those over the level are drawn apart for
    rising and falling input, so that a gap between them is a loop.
    """
    run, before, after = e.segment.run, problem_residual(e.nominal), problem_residual(e.best)
    level = _steady(e.segment.x, run)
    rate = _rate(level, run)
    still = 0.02 * np.quantile(np.abs(rate), 0.99)
    way = np.where(np.abs(rate) <= still, 0, np.sign(rate))
    with figure(2, 2) as (fig, axes):
        (by_level, by_rate), (by_way, by_time) = axes
        for values, colour, label in ((before, "bad", "refitted"), (after, "good", "with effects")):
            for axis, place in ((by_level, level), (by_rate, rate), (by_time, run.clock)):
                axis.plot(
                    *_thin(place, values), ".", ms=1.2, alpha=0.35, color=COLOURS[colour], rasterized=True
                )
            for sign, style in ((1, "-"), (-1, "--")):
                by_level.plot(
                    *_means(level[way == sign], values[way == sign]), style, color=_DARK[colour], lw=1.3
                )
            by_rate.plot(*_means(rate, values), color=_DARK[colour], lw=1.3)
            by_time.plot(*_means(run.clock, values, 60), color=_DARK[colour], lw=1.3, label=label)
        _by_direction(by_way, before, after, way)
        by_level.plot([], [], "-", color="black", label="mean, rising")
        by_level.plot([], [], "--", color="black", label="mean, falling")
        by_level.legend(fontsize=7)
        by_time.legend(fontsize=7)
        for axis, label in (
            (by_level, e.segment.entry),
            (by_rate, f"rate of {e.segment.entry} (1/s)"),
            (by_time, "session's time (s)"),
        ):
            axis.set_xlabel(label)
        by_rate.locator_params(axis="x", nbins=5)
        by_rate.set_xlim(*(1.5 * np.quantile(rate, q) for q in (0.005, 0.995)))
        widest = 1.05 * np.quantile(np.abs(before), 0.999)
        for axis in axes.ravel():
            if axis is not by_way:
                axis.set_ylim(-widest, widest)
            axis.set_ylabel(f"error of {e.segment.exit}")
        fig.suptitle(f"What {e.segment.entry} → {e.segment.exit} leaves")
        return png(fig)


_DARK = {"bad": "#7A3500", "good": "#00513B"}  # of the means, on the points of their colour


def _steady(x: np.ndarray, run) -> np.ndarray:
    """The input without its noise: medians of 0.25 s, experiment by experiment."""
    width = 2 * max(1, round(0.125 / run.h)) + 1
    parts = [median_filter(x[a:b], width, mode="nearest") for a, b in run.spans]
    return np.concatenate([uniform_filter1d(p, width, mode="nearest") for p in parts])


def _rate(level: np.ndarray, run) -> np.ndarray:
    return np.concatenate([np.gradient(level[a:b], run.h) for a, b in run.spans])


def _means(place: np.ndarray, values: np.ndarray, bins: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Mean of ``values`` (n,) over equal bins of ``place`` (n,) that hold enough samples."""
    if len(place) == 0:
        return np.array([]), np.array([])
    edges = np.linspace(place.min(), place.max() + 1e-300, bins + 1)
    index = np.clip(np.digitize(place, edges) - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    sums = np.bincount(index, weights=values, minlength=bins)
    kept = count >= max(5, 0.002 * len(place))
    return 0.5 * (edges[1:] + edges[:-1])[kept], sums[kept] / count[kept]


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


def loops(evidence: Evidence, logs: Sequence[Experiment]) -> bytes:
    """Output against input, measured and simulated, before and after, for the two experiments that tell most;
    against time where the input only steps.
    """
    chosen = _telling(evidence, logs)
    with figure(len(chosen), 2, squeeze=False, sharex="row", sharey="row") as (fig, axes):
        for row, i in zip(axes, chosen):
            x = logs[i][_entry(logs)]
            place, label = (x, _entry(logs)) if _places(x) >= _SWEEPING else (logs[i].time, "time (s)")
            for axis, name in zip(row, ("refitted", "explained")):
                where, y, made = _thin(place, logs[i]["output"], evidence.simulated[name][i]["output"])
                axis.plot(where, y, color=COLOURS["measured"], lw=0.7, label="measured")
                axis.plot(where, made, color=COLOURS["bad" if name == "refitted" else "good"], lw=1.0)
                axis.set_title(f"{logs[i].name}, {'refitted' if name == 'refitted' else 'with the effects'}")
                axis.set_xlabel(label)
            row[0].set_ylabel("output")
        axes[0, 0].legend(loc="best")
        return png(fig)


_SWEEPING = 20  # of 50 places in its range: an input that visits fewer only steps


def _entry(logs: Sequence[Experiment]) -> str:
    return "command" if all("command" in log for log in logs) else "pressure"


def _places(x: np.ndarray) -> int:
    """How many fiftieths of its range a signal visits."""
    return len(np.unique(np.round((x - x.min()) / max(float(np.ptp(x)), 1e-300) * 50)))


def _telling(evidence: Evidence, logs: Sequence[Experiment]) -> list[int]:
    """Up to two experiments where the effects changed the simulated output most, those that sweep first."""
    before, after = evidence.simulated["refitted"], evidence.simulated["explained"]

    def telling(i: int) -> float:
        changed = np.sqrt(np.mean((before[i]["output"] - after[i]["output"]) ** 2))
        sweeps = _places(logs[i][_entry(logs)]) >= _SWEEPING
        return float(changed) * (3.0 if sweeps else 1.0) + 1e-12 * len(logs[i])

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
