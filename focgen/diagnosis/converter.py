"""A coarse converter, read off the levels that the output takes, and what can be told beside it.

A search does without it: steps have no slope. To the search a rounding in steps of q is an error of a root
mean square of at most q/√12, which real converters, with uneven or sluggish steps, exceed by little. What an
effect changes by less than that could be the converter's as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.fit import Fit, Weighing, fit
from focgen.diagnosis.problem import Clue, Problem
from focgen.diagnosis.rivals import Cause, Rival, share_of
from focgen.diagnosis.search import family
from focgen.rig.effects import confused, library
from focgen.rig.engine import slot_in

# of a step: root mean square that an effect has to change; the second for a curve of the reading, which
# uneven steps are, and what is confused with one
WITHIN = (0.15, 0.35)
EXPLAINED = 0.5  # of a step: a root mean square residual that uneven and sluggish steps still explain


@dataclass(frozen=True, eq=False)
class Converter:
    """The rounding ``clue``, its ``entries`` of a problem's vector, and its ``step`` as a share of the
    output's level."""

    clue: Clue
    entries: tuple[float, ...]
    step: float

    def hides(self, base: Fit, better: Fit) -> bool:
        """Whether the two differ by no more than a rounding does."""
        curve = library()[self.clue.effect].uneven
        bent = family(better) in (curve, *confused(curve))
        return rms(better.weighed - base.weighed) < WITHIN[bent] * self.step

    def explains(self, of: Fit) -> bool:
        """Whether the residual is no larger than what a converter's steps leave."""
        return rms(of.weighed) < EXPLAINED * self.step

    def beside(
        self, best: Fit, nominal: Fit, causes: tuple[Cause, ...], weighing: Weighing
    ) -> tuple[Fit, tuple[Cause, ...]]:
        """With the rounding put to what was found without it: a cause, and where it brings the model closer
        a part of it."""
        problem = best.problem.with_clues([*best.problem.clues, self.clue])
        both = fit(problem, np.r_[best.vector, self.entries], weighing, 0)
        rival = Rival(self.clue.effect, self.clue.stage, 0.0, 0.0, both)
        closer = rms(both.weighed) < rms(best.weighed)
        return both if closer else best, (*causes, Cause((rival,), 0.0, share_of(nominal, best, both)))


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def converter_of(problem: Problem, clues: Sequence[Clue]) -> Converter | None:
    """The one whose levels the segment's output shows, if any."""
    for clue in clues:
        values = clue.form.seen(problem.segment.y) if clue.form.seen else None
        if values is not None:
            slot = slot_in(clue.form, clue.stage)
            scales = [problem.references.scale(p, slot) for p in clue.form.parameters]
            entries = tuple(v / s for v, s in zip(values, scales))
            return Converter(clue, entries, values[0] / problem.segment.level_out)
    return None
