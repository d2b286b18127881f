"""The pictures of a diagnosis: ladder, residual, loops, waterfall, candidates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.explain import Explanation, problem_residual
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
    return found | ({"candidates.png": candidates(evidence)} if any(e.causes for e in evidence.explanations) else {})


def _gap_ratio(e: Explanation) -> float:
    return float(np.mean(problem_residual(e.nominal) ** 2) / max(np.mean(problem_residual(e.best) ** 2), 1e-300))


def ladder(evidence: Evidence) -> bytes:
    """Root-mean-square residual of every segment on its measured input: as given, refitted, with the effects."""
    with figure(1, 1) as (fig, axis):
        for i, e in enumerate(evidence.explanations):
            given = e.nominal.problem.residual(e.given)
            parts = [given, problem_residual(e.nominal), problem_residual(e.best)]
            heights = [float(np.sqrt(np.mean(p**2))) / e.segment.level_out * 100 for p in parts]
            for j, (height, colour) in enumerate(zip(heights, ("measured", "bad", "good"))):
                label = ("as given", "refitted", "with effects")[j] if i == 0 else None
                axis.bar(i + (j - 1) * 0.27, height, 0.25, color=COLOURS[colour], label=label)
        axis.set_xticks(range(len(evidence.explanations)),
                        [f"{e.segment.entry} → {e.segment.exit}" for e in evidence.explanations])
        axis.set_ylabel("RMS error, % of the signal's range")
        axis.set_title("Where: each segment on its measured input")
        axis.legend()
        return png(fig)


def _thin(*signals: np.ndarray) -> list[np.ndarray]:
    step = max(1, len(signals[0]) // _POINTS)
    return [s[::step] for s in signals]


def residual(e: Explanation) -> bytes:
    """The worst segment's residual against level, rate, direction and time, before and after the effects."""
    run = e.segment.run
    rate = np.where(run.rest, 0.0, np.diff(e.segment.x, prepend=0.0) / run.h)
    views = {f"{e.segment.entry} (level)": e.segment.x, f"rate of {e.segment.entry}, 1/s": rate,
             "direction": np.sign(rate) + 0.15 * np.sin(np.arange(len(rate))), "session's time, s": run.clock}
    before, after = problem_residual(e.nominal), problem_residual(e.best)
    with figure(2, 2) as (fig, axes):
        for axis, (label, view) in zip(axes.ravel(), views.items()):
            place, a, b = _thin(view, before, after)
            axis.plot(place, a, ".", ms=1.5, color=COLOURS["bad"], label="refitted")
            axis.plot(place, b, ".", ms=1.5, color=COLOURS["good"], label="with effects")
            axis.set_xlabel(label)
            axis.set_ylabel(f"error of {e.segment.exit}")
        axes[0, 0].legend(markerscale=5)
        fig.suptitle(f"What {e.segment.entry} → {e.segment.exit} leaves")
        return png(fig)


def loops(evidence: Evidence, logs: Sequence[Experiment]) -> bytes:
    """Output against input, measured and simulated, before and after, for the two longest experiments."""
    longest = sorted(range(len(logs)), key=lambda i: -len(logs[i]))[:2]
    entry = "command" if all("command" in log for log in logs) else "pressure"
    with figure(len(longest), 2, squeeze=False) as (fig, axes):
        for row, i in zip(axes, sorted(longest)):
            for axis, name in zip(row, ("refitted", "explained")):
                x, y, made = _thin(logs[i][entry], logs[i]["output"], evidence.simulated[name][i]["output"])
                axis.plot(x, y, color=COLOURS["measured"], lw=0.8, label="measured")
                axis.plot(x, made, color=COLOURS["model"], lw=0.8, label=name)
                axis.set_title(logs[i].name)
                axis.set_xlabel(entry)
                axis.set_ylabel("output")
                axis.legend()
        return png(fig)


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
        axis.set_title(f"GOF {gap.gof['as given']:.3f} → {gap.gof['explained']:.3f} of a possible {gap.gof['possible']:.3f}")
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
            axis.set_xlabel("standard deviations behind")
            axis.set_title(cause.rivals[0].effect)
        return png(fig)
