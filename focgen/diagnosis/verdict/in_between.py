"""A signal in between that is read with so much noise that it hides what the output shows.

A session is explained segment by segment, each as far as the noise at its end lets see. What is ahead of a
noisy gauge may show at the output alone, of which the next segment takes it for what its input may be off by.
Without the gauge the output tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from focgen.diagnosis.fitting.predictability import predictable_share
from focgen.diagnosis.hypotheses.converter import rms
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import make
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.confidence import tied
from focgen.logs.experiment import Experiment
from focgen.rig.initial import in_windows
from focgen.rig.session import joined


def hiding(rigs: compose.Rigs, logs: Sequence[Experiment], explanations: Sequence[Explanation]) -> list[str]:
    """The signals in between whose noise the rest of the chain hears above the noise that comes after it, the
    loudest first, where inputs predict so much of what all explanations together leave of the output that
    without one of them far less might be left."""
    heard = {a.segment.exit: _heard(a, b) for a, b in pairwise(explanations)}
    loud = sorted((r for r in heard if heard[r] > 1.0), key=lambda r: -heard[r])
    return loud if loud and _still_foretold(rigs, logs, explanations) > 1.0 - NUMBERS.unlikely else []


def leaves_far_less(
    bare: compose.Rigs, shown: Sequence[Experiment], rigs: compose.Rigs, logs: Sequence[Experiment]
) -> bool:
    """Whether effects found without the signal bring the output far closer than what was found with it."""
    found, before = compose.gap(bare.fitted, bare.placed, shown), compose.gap(rigs.fitted, rigs.placed, logs)
    return bool(bare.placed) and found < NUMBERS.unlikely * before


def tell_the_same(bare: Sequence[Explanation], found: Sequence[Explanation]) -> bool:
    """Whether what is found without the signal may all be what was ``found`` with it. Then that tells the
    stages as well, and what it leaves more is the error of its numbers."""
    named = [(c.rivals[0].effect, c.rivals[0].stage) for e in found for c in e.causes]
    return all(any(name in rivals for name in named) for rivals in _sets(bare))


def gives_up(bare: Sequence[Explanation], found: Sequence[Explanation], role: str) -> bool:
    """Whether a cause that the signal itself shows has none of its families in a set without it. What is seen
    in a stage's own signal is there, however much of the output another one would explain."""
    told = {effect for rivals in _sets(bare) for effect, _ in rivals}
    shown = _sets([e for e in found if e.segment.exit == role])
    return any(told.isdisjoint(effect for effect, _ in rivals) for rivals in shown)


def _sets(explanations: Sequence[Explanation]) -> list[set[tuple[str, str]]]:
    """Of every cause the effects, and their stages, that it may be."""
    return [{(r.effect, r.stage) for r in tied(c.rivals)[0]} for e in explanations for c in e.causes]


def without(logs: Sequence[Experiment], role: str) -> tuple[Experiment, ...]:
    """The session as if a signal had not been logged, with a note on that."""
    note = f"the {role} is so noisy that it hides what the output shows: diagnosed without it"
    return tuple(log.without(role, note) for log in logs)


def with_signals(logs: Sequence[Experiment], of: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The session with all signals that the logs ``of`` it have."""
    return tuple(
        replace(log, signals=o.signals, readings=o.readings, begins={**o.begins, **log.begins})
        for log, o in zip(logs, of, strict=True)
    )


def _heard(e: Explanation, after: Explanation) -> float:
    """The root mean square of what the noise at the end of a segment makes of the next one's output, over
    that of what is left there."""
    own, then = e.best.problem.at_every_row, after.best.problem.at_every_row
    off = own.segment.y - own.simulate(e.best.vector)
    noise = np.concatenate([part[::-1] for part in own.segment.parts(off)])
    # as loud as it is where it was read, and forgotten where errors add up
    level = rms(e.best.problem.residual(e.best.vector)) * np.sqrt(max(1.0 - e.predictability.share, 0.0))
    noise *= level / max(rms(noise), 1e-300)
    moved = replace(then, segment=then.segment.anew(x=then.segment.x + noise), memory={})
    answer = then.segment.recent(moved.simulate(after.best.vector) - then.simulate(after.best.vector))
    return rms(answer) / max(rms(after.best.problem.residual(after.best.vector)), 1e-300)


def _still_foretold(
    rigs: compose.Rigs, logs: Sequence[Experiment], explanations: Sequence[Explanation]
) -> float:
    """The share that inputs predict of what the whole chain leaves of the output."""
    logs = in_windows(rigs.fitted, logs, rigs.placed)
    segment = make(logs, explanations[0].segment.entry, explanations[-1].segment.exit)
    made = np.concatenate([m["output"] for m in compose.simulated(rigs.fitted, rigs.placed, logs)])
    left = joined(logs, "output") - made
    left = left if segment.readings is None else left[segment.readings]
    response = explanations[-1].best.problem.references.clocks["response"]
    return predictable_share(segment, segment.weight * left, response)
