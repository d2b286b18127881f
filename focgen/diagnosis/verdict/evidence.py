"""What a diagnosis rests on, and what its figures draw of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from focgen.arrays import Array
from focgen.control.units import units_of_rig
from focgen.diagnosis.drawn import Drawn, Mean, Residual, Rivals, SegmentError, Trace
from focgen.diagnosis.fitting.fit import problem_residual
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.logs.experiment import Experiment
from focgen.logs.thinning import thinned
from focgen.rig.effects import Run
from focgen.rig.rig import Rig
from focgen.rig.session import entry_of

MOST = 8000
"""Samples of all experiments together that are kept."""
POINTS = 4000
"""Samples of the worst segment's residual that are drawn."""
_FEWEST = 300  # of one experiment
_STILL = 0.02  # of the largest rate: below it the input holds


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a diagnosis rests on: signals by experiment (as given, refitted, explained), explanations by
    segment."""

    simulated: dict[str, list[dict[str, Array]]]
    explanations: tuple[Explanation, ...]


def drawn_of(rig: Rig, evidence: Evidence, logs: Sequence[Experiment]) -> Drawn:
    """What is drawn of a diagnosis, signals thinned to :data:`MOST` samples."""
    entry, worst = entry_of(logs), _worst_of(evidence)
    traces = tuple(_trace(evidence, logs, i, entry) for i in range(len(logs)))
    return Drawn(
        entry=entry,
        units=units_of_rig(rig),
        samples=sum(map(len, logs)),
        kept=sum(len(trace.time) for trace in traces),
        traces=traces,
        segments=tuple(map(_error, evidence.explanations)),
        worst=(worst.segment.entry, worst.segment.exit),
        means=_means_of(worst),
        rivals=tuple(
            Rivals(
                cause.rivals[0].effect,
                tuple(r.effect for r in cause.rivals),
                tuple(float(r.separation) for r in cause.rivals),
            )
            for e in evidence.explanations
            for cause in e.causes
        ),
        residual=_residual(worst),
    )


def _worst_of(evidence: Evidence) -> Explanation:
    """The segment whose residual the effects reduce most."""
    return max(evidence.explanations, key=_gap_ratio)


def _gap_ratio(e: Explanation) -> float:
    return float(
        np.mean(problem_residual(e.nominal) ** 2) / max(np.mean(problem_residual(e.best) ** 2), 1e-300)
    )


def _trace(evidence: Evidence, logs: Sequence[Experiment], i: int, entry: str) -> Trace:
    made = [evidence.simulated[name][i]["output"] for name in ("as given", "refitted", "explained")]
    log = logs[i]
    most = max(_FEWEST, MOST * len(log) // max(1, sum(map(len, logs))))
    kept = thinned(log[entry], log["output"], *made[1:], most=most)
    signals = (log.time, log[entry], log["output"], *made)
    return Trace(log.name, float(log.start), *(np.asarray(s, float)[kept] for s in signals))


def _segment_errors(e: Explanation) -> tuple[float, float, float]:
    """Root-mean-square residuals as given, refitted, and with the effects, % of the output's range."""
    parts = [e.nominal.problem.residual(e.given), problem_residual(e.nominal), problem_residual(e.best)]
    given, refitted, best = (float(np.sqrt(np.mean(p**2))) / e.segment.level_out * 100 for p in parts)
    return given, refitted, best


def _error(e: Explanation) -> SegmentError:
    return SegmentError(e.segment.entry, e.segment.exit, *_segment_errors(e))


def _steady(x: Array, run: Run) -> Array:
    """An input without its noise: medians of 0.25 s, experiment by experiment."""
    width = 2 * max(1, round(0.125 / run.h)) + 1
    parts = [median_filter(x[a:b], width, mode="nearest") for a, b in run.spans]
    return np.concatenate([uniform_filter1d(p, width, mode="nearest") for p in parts])


def _rate_of(level: Array, run: Run) -> Array:
    """Its rate of change, 1/s."""
    rates = [np.gradient(level[a:b], run.h) if b - a > 1 else np.zeros(b - a) for a, b in run.spans]
    return np.concatenate(rates)


def _way_of(rate: Array) -> Array:
    """1 where an input rises, −1 where it falls, 0 where it holds."""
    still = _STILL * np.quantile(np.abs(rate), 0.99)
    return np.where(np.abs(rate) <= still, 0, np.sign(rate))


def _means(place: Array, values: Array, bins: int = 24) -> tuple[Array, Array]:
    """Mean of ``values`` (n,) over equal bins of ``place`` (n,) that hold enough samples."""
    if len(place) == 0:
        return np.array([]), np.array([])
    edges = np.linspace(place.min(), place.max() + 1e-300, bins + 1)
    index = np.clip(np.digitize(place, edges) - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    sums = np.bincount(index, weights=values, minlength=bins)
    kept = count >= max(5, 0.002 * len(place))
    return 0.5 * (edges[1:] + edges[:-1])[kept], sums[kept] / count[kept]


def _residual(e: Explanation) -> Residual:
    """At most :data:`POINTS` of the samples, evenly."""
    run = e.segment.run
    level = _steady(e.segment.x, run)
    rate = _rate_of(level, run)
    signals = (level, rate, _way_of(rate), run.clock, problem_residual(e.nominal), problem_residual(e.best))
    every = max(1, len(level) // POINTS)
    return Residual(*(s[::every] for s in signals))


def _means_of(e: Explanation) -> tuple[Mean, ...]:
    run, level = e.segment.run, _steady(e.segment.x, e.segment.run)
    rate = _rate_of(level, run)
    way, found = _way_of(rate), []
    for of, residual in (("refitted", problem_residual(e.nominal)), ("explained", problem_residual(e.best))):
        for name, sign in (("rising", 1), ("falling", -1)):
            here = way == sign
            found.append(Mean("level", name, of, *_means(level[here], residual[here])))
        found.append(Mean("rate", "any", of, *_means(rate, residual)))
        found.append(Mean("time", "any", of, *_means(run.clock, residual, 60)))
    return tuple(found)
