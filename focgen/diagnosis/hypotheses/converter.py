"""A coarse converter, read off the levels that the output takes, and what can be told beside it.

A search does without it: steps have no slope. To the search a rounding in steps of q is an error of a root
mean square of at most q/√12, which real converters, with uneven or sluggish steps, exceed by little. What an
effect changes by less than that could be the converter's as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.hypotheses.rivals import Cause, Rival, share_of
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import CandidateEffect, Problem
from focgen.rig.engine import slot_in


@dataclass(frozen=True, eq=False)
class Converter:
    """The rounding ``candidate``, its ``entries`` of a problem's vector, and its ``step`` as a share of the
    output's level."""

    candidate: CandidateEffect
    entries: tuple[float, ...]
    step: float

    @property
    def uneven(self) -> float:
        """Root mean square, as a share of the output's level, that real steps miss the ideal ones by."""
        return NUMBERS.uneven * self.step

    def explains(self, of: Fit) -> bool:
        """Whether the residual is no larger than what a converter's steps leave."""
        return rms(of.weighed) < NUMBERS.uneven * self.step

    def beside(
        self, best: Fit, nominal: Fit, causes: tuple[Cause, ...], weighing: Weighing
    ) -> tuple[Fit, tuple[Cause, ...]]:
        """With the rounding put to what was found without it: a cause, and where it brings the model closer
        a part of it."""
        problem = best.problem.with_candidates([*best.problem.candidates, self.candidate])
        both = fit(problem, np.r_[best.vector, self.entries], weighing, 0)
        rival = Rival(self.candidate.effect, self.candidate.stage, 0.0, 0.0, both)
        closer = rms(both.weighed) < rms(best.weighed)
        return both if closer else best, (*causes, Cause((rival,), 0.0, share_of(nominal, best, both)))


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def converter_of(problem: Problem, candidates: Sequence[CandidateEffect]) -> Converter | None:
    """The one whose levels the segment's output shows, if any."""
    for candidate in candidates:
        values = candidate.form.seen(problem.segment.y) if candidate.form.seen else None
        if values is not None:
            slot = slot_in(candidate.form, candidate.stage)
            scales = [problem.references.scale(p, slot) for p in candidate.form.parameters]
            entries = tuple(v / s for v, s in zip(values, scales))
            return Converter(candidate, entries, values[0] / problem.segment.level_out)
    return None
