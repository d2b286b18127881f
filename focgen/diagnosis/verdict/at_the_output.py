"""What an effect changes at the output, which may be read with less noise than the signal of its own segment.

A nominal chain is off by itself by part of the noise, for it was fitted until what was left could not be
seen. The output was read when it was fitted, too. So a signal in between, read with more noise, does not make
the chain any worse: what an effect changes counts where it is seen best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.belief.standing import holds
from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import Cause, without_family
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.verdict import compose
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig


def seen_at_the_output(
    rig: Rig, logs: Sequence[Experiment], explanations: Sequence[Explanation]
) -> tuple[Explanation, ...]:
    """Explanations whose causes change what they change where it is seen best, at the end of their segment or
    at the output. Those that left a segment, for the chain was as good as sure to be off by itself, are back
    where that is not so any more."""
    seen = list(explanations)
    for place, e in enumerate(explanations[:-1]):
        whole = e if e.causes else e.whole
        if whole is None or all(c.rivals[0].off < np.log(NUMBERS.rare) for c in whole.causes):
            continue  # what changes so much is in no chain that was fitted
        each = (whole, *(_without(whole, c) for c in whole.causes))
        there, *gone = (_output(rig, (*seen[:place], one, *seen[place + 1 :]), logs) for one in each)
        clearer = [_clearer(logs, there, without, c) for without, c in zip(gone, whole.causes, strict=True)]
        causes = tuple(_changed(c, times) for c, times in zip(whole.causes, clearer))
        if max(clearer) > 1.0 and (e.causes or not any(holds(c.rivals[0].off) for c in causes)):
            seen[place] = replace(whole, causes=causes)
    return tuple(seen)


def _changed(cause: Cause, times: float) -> Cause:
    """A cause whose rivals all change so many times as much, if that is more."""
    more = max(times, 1.0)
    rivals = tuple(replace(r, change=more * r.change, form=more * r.form) for r in cause.rivals)
    return replace(cause, rivals=rivals)


def _without(e: Explanation, cause: Cause) -> Explanation:
    return replace(e, best=without_family(e.best, cause.rivals[0].effect, Weighing(e.ar)))


def _clearer(
    logs: Sequence[Experiment], there: Sequence[np.ndarray], gone: Sequence[np.ndarray], cause: Cause
) -> float:
    """How many times as clearly as its own segment the output shows a cause, by what the chain makes of it
    with the cause ``there`` and ``gone``."""
    left, change = 0.0, 0.0
    for log, made, other in zip(logs, there, gone, strict=True):
        read = log.read("output")
        left += float(np.sum((log["output"] - made)[read] ** 2))
        change += float(np.sum((other - made)[read] ** 2))
    return float(np.sqrt(change / max(left, 1e-300))) / max(cause.rivals[0].change, 1e-300)


def _output(rig: Rig, explanations: Sequence[Explanation], logs: Sequence[Experiment]) -> list[np.ndarray]:
    """The output that the whole chain makes, by experiment."""
    rigs = compose.compose(rig, explanations, logs)
    return [made["output"] for made in compose.simulated(rigs.fitted, rigs.placed, logs)]
