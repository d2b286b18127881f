"""How well the effects found predict experiments that they were not fitted to: cross-validation.

The session is cut into parts, experiments where there are enough of them, else stretches of time. Each part
is predicted by a fit that does not see it (M. Stone, Cross-validatory choice and assessment of statistical
predictions, Journal of the Royal Statistical Society B 36, 1974).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.fitting.integrating import settled
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.verdict import compose
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig

_FOLDS = 4
_ITERATIONS = 4


def parts(logs: Sequence[Experiment]) -> np.ndarray:
    """The fold (n,) of every sample: neighbouring experiments about a quarter of the session long, or
    quarters of it where experiments are fewer."""
    lengths = [len(log) for log in logs]
    n = sum(lengths)
    if len(logs) < _FOLDS:
        return np.arange(n) * _FOLDS // n
    middles = np.cumsum(lengths) - 0.5 * np.array(lengths)
    return np.repeat((middles * _FOLDS / n).astype(int), lengths)


def cross_validated(rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation]) -> np.ndarray:
    """The output's mean square error of every experiment with the effects, each part of the session simulated
    by fits to the others."""
    fold, measured = parts(logs), np.concatenate([log["output"] for log in logs])
    error = np.empty(len(fold))
    for part in np.unique(fold):
        without = [_without(e, fold != part) for e in explanations]
        rigs = compose.compose(rig, without, logs)
        made = compose.simulated(rigs.fitted, rigs.placed, logs)
        simulated = np.concatenate([m["output"] for m in made])
        error[fold == part] = (measured - simulated)[fold == part]
    ends = np.cumsum([len(log) for log in logs])[:-1]
    return np.array([np.mean(part**2) for part in np.split(error, ends)])


def cross_validated_share(e: Explanation, logs: Sequence[Experiment]) -> float:
    """The part of a segment's own gap that its effects close at its own exit, each part of the session
    simulated by a fit to the others."""
    fold = parts(logs)
    error = np.empty(len(fold))
    for part in np.unique(fold):
        without = _fitted(e.best, e.ar, fold != part)
        error[fold == part] = e.best.problem.weighed(without.vector)[fold == part]
    before, after = (float(np.mean(f.weighed**2)) for f in (e.nominal, e.best))
    noise = after * (1.0 - e.predictability.share)
    return float((before - np.mean(error**2)) / max(before - noise, 1e-300))


def _without(e: Explanation, seen: np.ndarray) -> Explanation:
    """The explanation with its fit made to the samples ``seen`` (n,) only."""
    if not e.best.problem.candidates:
        return e
    return replace(e, best=_fitted(e.best, e.ar, seen))


def _fitted(best: Fit, ar: np.ndarray, seen: np.ndarray) -> Fit:
    problem, segment = best.problem, best.problem.segment
    masked = replace(segment, trust=segment.trust * seen)
    return settled(fit(replace(problem, segment=masked), best.vector, Weighing(ar), _ITERATIONS))
