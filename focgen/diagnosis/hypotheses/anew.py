"""What was found before, looked for anew beside what was found last.

The numbers of the first effect were found while nothing stood for the second, so it took part of what that
makes. A form that is right beside the second may have been the worse one alone. No slope leads from there to
where both are right, as with a valve's band. So each earlier effect is started again, in every form of its
family, beside the last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.hypotheses.rivals import without
from focgen.diagnosis.hypotheses.search import (
    Ranking,
    best_start,
    coarseness,
    evidence,
    finish,
    footings,
    keeps_up,
    on_all,
)
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect

_TRIED = 4  # families: beside so many of the foremost the earlier effects are looked for
_FITTED = 10  # iterations


def looked_anew(
    first: Fit, ranking: Ranking, candidates: Sequence[CandidateEffect], surroundings: Surroundings
) -> Ranking:
    """The ranking with the earlier effects, those of its base, looked for anew beside the foremost families.

    It is the same where inputs predict little of what the likeliest leaves, and where nothing likelier is
    found. ``first``: the fit without any effect; ``candidates``: the forms; ``surroundings``: of the misfit.
    """
    base, foremost = ranking.base, _foremost(ranking)
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
    found = finish(base, [*likelier, *ranking.on_all], ranking.errors)
    return replace(found, left=(*found.left, *(f for f in ranking.left if f not in ranking.on_all)))


def _foremost(ranking: Ranking) -> list[Fit]:
    """The foremost fits; of twins, which leave the same, the first."""
    found: dict[float, Fit] = {}
    top = max(ranking.gain.values(), default=0.0)
    for name, of in ranking.best.items():
        if keeps_up(ranking.gain[name], top):
            found.setdefault(of.sse, of)
    return list(found.values())[:_TRIED]


def _anew(of: Fit, candidates: Sequence[CandidateEffect]) -> Fit:
    """A fit, or a likelier one with other numbers or forms of the effects ahead of its last. A form that
    jumps does so from sample to sample, and is tried on all of them."""
    problem = of.problem
    earlier = problem.candidates[:-1]
    forms = [[c for c in candidates if may_be(c, own)] for own in earlier]
    jumps = any(c.form.jumps for c in (*problem.candidates, *(c for each in forms for c in each)))
    factor = 1 if jumps else coarseness(problem)
    thin = problem.thinned(factor)
    best = before = fit(thin, thin.stretched(of.vector, 1.0 / factor), WHITE, _FITTED)
    for place, each in enumerate(forms):
        best = _replaced(best, place, each)
    return of if best is before else on_all(best, problem, factor)


def may_be(form: CandidateEffect, own: CandidateEffect) -> bool:
    """Whether a form may take the place of another: one of the same family, in the same place. One that
    wanders takes the place of none that does not, for it would follow anything."""
    alike = (form.effect, form.stage, form.form.rarer) == (own.effect, own.stage, own.form.rarer)
    return alike and form.form.wanders == own.form.wanders


def _replaced(of: Fit, place: int, forms: Sequence[CandidateEffect]) -> Fit:
    """A fit, or the likeliest with one of these forms in the ``place`` of one of its effects, from the form's
    own start values beside the others, which are fitted without it."""
    bare = without(of, [of.problem.candidates[place]], WHITE)
    problem, kept, best = bare.problem, list(bare.problem.candidates), of
    alone = fit(problem, bare.vector, WHITE, _FITTED)
    from_ = footings(problem, alone.vector) + footings(problem, bare.vector)
    for form in (f for f in forms if f not in kept):
        found = best_start(problem, from_, form)
        if found is None:
            continue
        shares = found.problem.shares(found.vector)
        shares.insert(place, shares.pop())
        whole = problem.with_candidates([*kept[:place], form, *kept[place:]])
        vector = np.concatenate([found.vector[: problem.head], *shares])
        other = fit(whole, vector, WHITE, _FITTED, leader=best)
        best = other if evidence(other, best) > 0.0 else best
    return best
