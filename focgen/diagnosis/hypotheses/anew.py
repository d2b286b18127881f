"""What was found before, looked for anew beside what was found last.

The numbers of the first effect were found while nothing stood for the second, so it took part of what that
makes; and a form that is right beside the second may have been the worse one alone. No slope leads from there
to where both are right, as with a valve's band. So each earlier effect is started again beside the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.hypotheses.search import (
    Ranking,
    best_start,
    coarseness,
    evidence,
    finish,
    footings,
    on_all,
)
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import CandidateEffect, Problem

_TRIED = 4  # fits of families beside which it is looked
_FITTED = 10  # iterations


def looked_anew(
    first: Fit, ranking: Ranking, candidates: Sequence[CandidateEffect], surroundings: Surroundings
) -> Ranking:
    """The ranking with what its base has found before looked for anew, among the forms of its families in
    ``candidates``, beside the foremost of those that are ranked; the same where the likeliest leaves little
    that inputs predict. ``first``: the fit without any effect; ``surroundings``: of the misfit."""
    foremost = list({f.sse: f for f in ranking.best.values()}.values())[:_TRIED]
    base = ranking.base
    if not foremost or not base.problem.candidates or foremost[0].predictable_share < NUMBERS.left:
        return ranking
    weighing, likelier = Weighing(ranking.ar), []
    for of in foremost:
        other = _anew(of, candidates)
        if other is not of:
            other = fit(other.problem, other.vector, weighing, _FITTED)
            ground = Ground.of(first, base, [of, other], weighing, surroundings)
            likelier += [other] if ground.compared(other) > ground.compared(of) else []
    if not likelier:
        return ranking
    known = (*ranking.best.values(), *ranking.left)
    whole = [f for f in known if len(f.innovations) == len(base.innovations)]
    return finish(base, [*likelier, *whole], ranking.errors)


def _anew(of: Fit, candidates: Sequence[CandidateEffect]) -> Fit:
    """A fit, or a likelier one with other numbers or forms of the effects ahead of its last. A form that
    jumps does so from sample to sample, and is tried on all of them."""
    problem = of.problem
    factor = 1 if any(c.form.jumps for c in problem.candidates) else coarseness(problem)
    thin = problem.thinned(factor)
    best = before = fit(thin, thin.stretched(of.vector, 1.0 / factor), WHITE, _FITTED)
    for place in range(len(problem.candidates) - 1):
        own = problem.candidates[place]
        for form in (c for c in candidates if may_be(c, own)):
            other = _replaced(best, place, form)
            best = other if other is not None and evidence(other, best) > 0.0 else best
    return of if best is before else on_all(best, problem, factor)


def may_be(form: CandidateEffect, own: CandidateEffect) -> bool:
    """Whether a form may be what stands for its family: one that wanders would follow anything."""
    alike = (form.effect, form.stage, form.form.rarer) == (own.effect, own.stage, own.form.rarer)
    return alike and form.form.wanders == own.form.wanders


def _replaced(of: Fit, place: int, form: CandidateEffect) -> Fit | None:
    """A fit with this form in the place of one of its effects, from the form's own start values."""
    problem, own = of.problem, list(_shares(of.problem, of.vector))
    kept = [c for i, c in enumerate(problem.candidates) if i != place]
    if form in kept:
        return None
    head = of.vector[: problem.head]
    bare = problem.with_candidates(kept)
    base = np.concatenate([head, *(v for i, v in enumerate(own) if i != place)])
    found = best_start(bare, footings(bare, base), form)
    if found is None:
        return None
    shares = list(_shares(found.problem, found.vector))
    shares.insert(place, shares.pop())
    kept.insert(place, form)
    vector = np.concatenate([found.vector[: problem.head], *shares])
    return fit(problem.with_candidates(kept), vector, WHITE, _FITTED, leader=of)


def _shares(problem: Problem, vector: np.ndarray) -> Sequence[np.ndarray]:
    """The part of a vector that each candidate effect has."""
    ends = np.cumsum([problem.head, *(len(c.form.parameters) for c in problem.candidates)])
    return [vector[a:b] for a, b in pairwise(ends)]
