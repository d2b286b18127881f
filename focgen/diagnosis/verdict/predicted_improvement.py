"""What the effects found promise for experiments not yet made: the part of them that can be predicted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import left_out
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.cross_validation import cross_validated
from focgen.diagnosis.verdict.improvement import Improvement, predict
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.rig import Rig


def paths(e: Explanation) -> list[CandidateEffect]:
    """The effects of a segment that wander: followed through the session, predicted by nothing."""
    return [c for c in e.best.problem.candidates if c.form.wanders]


def drifting(e: Explanation) -> bool:
    """Whether any of a segment's effects goes on through the session, in any of its forms."""
    forms = [f for name in e.best.problem.families for f in library()[name].forms]
    return any(p.clock == "session" for f in forms for p in f.parameters)


def promised(
    rig: Rig,
    logs: Sequence[Experiment],
    explanations: Sequence[Explanation],
    squares: dict[str, np.ndarray],
    floor: float,
) -> Improvement | None:
    """The shrink to expect, from ``squares``: the output's mean square errors of every experiment by rig, and
    the ``floor``'s. What wanders promises nothing."""
    lasting = [_lasting(e) for e in explanations]
    explained = squares["explained"]
    if lasting != list(explanations):
        rigs = compose.compose(rig, lasting, logs)
        made = compose.simulated(rigs.fitted, rigs.placed, logs)
        explained = np.maximum(compose.squares(logs, made), explained)
    foreseen, drifts = cross_validated(rig, logs, lasting), any(map(drifting, explanations))
    found = predict(squares["refitted"], explained, foreseen, floor, drifts)
    if found is not None and not any(e.best.problem.candidates for e in lasting):
        return replace(found, value=0.0)  # what returns to its mean neither mends nor harms
    return found


def _lasting(e: Explanation) -> Explanation:
    """Without what wanders, nominal parameters and other effects fitted again."""
    wandering = paths(e)
    return replace(e, best=left_out(e.best, wandering, Weighing(e.ar))) if wandering else e
