"""Which of two effects on one side of a stage's dynamics the signal passes first.

They are found one after the other, and each is put behind those before. A curve ahead of what remembers is
another rig than one behind it, and no slope leads from one to the other.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.hypotheses.search import evidence
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.rig.placed import on_one_side

_FITTED = 10  # iterations


def in_their_order(of: Fit) -> Fit:
    """A fit, or the likelier one with its last effect passed ahead of an earlier one, where inputs predict
    much of what is left."""
    if len(of.problem.candidates) < 2 or of.predictable_share < NUMBERS.left:
        return of
    best = of
    for order in _ahead(of.problem.candidates):
        shares = of.problem.shares(of.vector)
        moved = of.problem.with_candidates([of.problem.candidates[i] for i in order])
        start = np.concatenate([of.vector[: of.problem.head], *(shares[i] for i in order)])
        other = fit(moved, start, WHITE, _FITTED, leader=best)
        best = other if evidence(other, best) > 0.0 else best
    return best


def _ahead(candidates: tuple[CandidateEffect, ...]) -> Iterator[list[int]]:
    """The orders in which the last is passed ahead of one of the others that acts on the same side."""
    last = len(candidates) - 1
    for place, other in enumerate(candidates[:-1]):
        both = [(c.form, c.stage) for c in (other, candidates[-1])]
        if on_one_side(*both):
            yield [*range(place), last, *range(place, last)]
