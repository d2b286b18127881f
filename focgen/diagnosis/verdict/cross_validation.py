"""How well the effects found predict experiments that they were not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.fitting.folds import fitted_to, folds, foreseen
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.verdict import compose
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig


def cross_validated(rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation]) -> np.ndarray:
    """The output's mean square error of every experiment with the effects, each part of the session simulated
    by fits to the others."""
    fold, measured = folds([len(log) for log in logs]), np.concatenate([log["output"] for log in logs])
    error = np.empty(len(fold))
    for part in np.unique(fold):
        without = [_without(e, fold != part) for e in explanations]
        rigs = compose.compose(rig, without, logs)
        made = compose.simulated(rigs.fitted, rigs.placed, logs)
        simulated = np.concatenate([m["output"] for m in made])
        error[fold == part] = (measured - simulated)[fold == part]
    ends = np.cumsum([len(log) for log in logs])[:-1]
    read = [part[log.read("output")] for log, part in zip(logs, np.split(error, ends))]
    return np.array([np.mean(part**2) for part in read])


def cross_validated_share(e: Explanation) -> float:
    """The part of a segment's own gap that its effects close at its own exit, each part of the session
    simulated by a fit to the others."""
    error = foreseen(e.best, Weighing(e.ar))
    before, after = (float(np.mean(f.weighed**2)) for f in (e.nominal, e.best))
    noise = after * (1.0 - e.predictability.share)
    return float((before - error) / max(before - noise, 1e-300))


def _without(e: Explanation, seen: np.ndarray) -> Explanation:
    """The explanation with its fit made to the samples ``seen`` (n,) only."""
    if not e.best.problem.candidates:
        return e
    rows = e.segment.readings
    return replace(e, best=fitted_to(e.best, Weighing(e.ar), seen if rows is None else seen[rows]))
