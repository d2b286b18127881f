"""What an input does between its samples, as suits what was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.fitting.fit import Fit, Known, Weighing, fit
from focgen.diagnosis.hypotheses.nuisances import ways
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import Segment
from focgen.rig.rig import Rig

_COMPARED = 3  # rivals that experiments are to tell apart


def between_anew(rig: Rig, best: Fit, nominal: Fit, weighing: Weighing) -> tuple[Fit, Fit]:
    """Both fits with the input running between its samples as suits what was found: a nominal rig far from
    what it models may be suited by another way. That has to leave much less: half a sample more or less may
    make up for a little of whatever a model lacks."""
    segment = best.problem.segment
    if rig.between is not None or len(ways(segment)) == 1 or not best.problem.candidates:
        return best, nominal
    others = [segment.anew(between=way) for way in ways(segment) if way != segment.between]
    tried = [moved_to(best, other, weighing) for other in others]
    closest = min([best, *tried], key=lambda f: f.sse)
    if closest.sse > NUMBERS.unlikely * best.sse:
        return best, nominal
    return closest, moved_to(nominal, closest.problem.segment, weighing)


def moved_to(of: Fit, segment: Segment, weighing: Weighing, known: Known | None = None) -> Fit:
    """A fit made anew to another account of its segment; ``known``: its Jacobian, taken as it was, where that
    account asks for as many numbers."""
    problem = replace(of.problem, segment=segment, memory={})
    start = _with_stands(of, problem)
    start[len(problem.nominal_start)] = 0.0  # the alignment made up for the wrong way
    return fit(problem, start, weighing, 8, known=known if len(start) == len(of.vector) else None)


def _with_stands(of: Fit, problem: Problem) -> np.ndarray:
    """The vector of a fit for a ``problem`` that may ask what a pump held as logs began, or not: a log that
    begins on its way asks it of all of them."""
    last = of.problem.head
    first = last - of.problem.stood
    stands = of.vector[first:last] if problem.stood == of.problem.stood else np.zeros(problem.stood)
    moved: np.ndarray = np.r_[of.vector[:first], stands, of.vector[last:]]
    return moved


def in_the_end(rivals: Sequence[Rival], found: Fit, best: Fit, weighing: Weighing) -> tuple[Rival, ...]:
    """Rivals with what was ``found`` as that is in the end, and the first of the others on the same account
    of what the command does between samples: experiments are chosen by what these would show."""

    def now(rival: Rival, near: bool) -> Rival:
        if rival.fit is found:
            return replace(rival, fit=best)
        segment = best.problem.segment
        if not near or rival.fit.problem.segment.between == segment.between:
            return rival
        return replace(rival, fit=moved_to(rival.fit, segment, weighing))

    return tuple(now(r, i < _COMPARED) for i, r in enumerate(rivals))
