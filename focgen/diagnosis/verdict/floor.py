"""The floor that noise sets: the mean square at the output that no model explains."""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fitting.fit import problem_residual
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.rig.effects import STEP, library


def floor(last: Explanation, explained: float) -> float:
    """The noise's mean square at the output, its unit squared: what is left in the ``last`` segment, less
    what inputs predict of it; at most the mean square that is left with all effects, ``explained``.

    Noise is alike in all experiments: where most are explained better, the floor is theirs. Where errors add
    up, what is left is its recent part, which holds a part of the noise only. A rounding in
    steps of q turns noise of a root mean square s below q into errors of mean square q s √(2/π): that many
    readings lie a step off. The floor is the noise, not what the rounding makes of it.
    """
    segment = last.segment
    parts = [np.mean(p**2) / segment.recent_share for p in segment.parts(problem_residual(last.best))]
    found = min(float(np.mean(parts)) * (1 - last.predictability.share), float(np.median(parts)), explained)
    step = _step(last)
    return min(found, (np.sqrt(np.pi / 2) * explained / step) ** 2) if step else found


def _step(last: Explanation) -> float | None:
    """The step of the rounding that was found, in units of the output."""
    for cause in last.causes:
        rival = cause.rivals[0]
        if library()[rival.effect].rounds:
            placed = rival.fit.problem.placed(rival.fit.vector)
            return next(p.named[STEP] for p in placed if p.effect == rival.effect)
    return None
