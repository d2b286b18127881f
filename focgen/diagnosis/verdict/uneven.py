"""Whether a stage has a pace that depends on its level, on time or on its speed, instead of what was found.

Nothing in the library does. A loop of hysteresis, a bent gain or one that drifts follows a time constant that
is another at another level or moment, if badly. So what was found is held against the same rig with one stage
of an uneven pace, and without one of the effects.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.diagnosis.belief.standing import sureness
from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, square_by
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.search import rank
from focgen.diagnosis.hypotheses.uneven_pace import uneven_paces
from focgen.diagnosis.verdict.moments import bases, log_odds

_ITERATIONS = 8


@dataclass(frozen=True, eq=False)
class Uneven:
    """A ``stage`` that is ``slowness`` times as slow at its highest level, at the session's end or at its
    greatest speed, ``by`` any of these, as at none; ``instead`` of these families; the log ``odds`` of that
    over what was found, and the ``share`` of the mean square without any effect that it leaves."""

    stage: str
    by: str
    slowness: float
    instead: frozenset[str]
    odds: float
    share: float

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return sureness(self.odds)


@lru_cache(maxsize=16)
def unevenly_paced(e: Explanation) -> Uneven | None:
    """The likeliest uneven pace instead of what was found, or of a part of it. None where errors add up, as
    there is no pace, or where a rounding was found, whose steps are no noise."""
    if e.segment.pace or any(c.family and c.family.rounds for c in e.best.problem.candidates):
        return None
    weighing = Weighing(e.ar)
    found = [_judged(e, base, weighing) for base in bases(e)]
    return max((one for one in found if one is not None), key=lambda one: one.odds, default=None)


def is_uneven(e: Explanation) -> bool:
    """Whether that is likelier than what was found."""
    uneven = unevenly_paced(e)
    return uneven is not None and uneven.odds > 0.0


def _judged(e: Explanation, base: Fit, weighing: Weighing) -> Uneven | None:
    """The likeliest uneven pace beside what ``base`` has."""
    ranking = rank(base.problem, base.vector, uneven_paces(base.problem))
    if ranking.winner is None:
        return None
    first = ranking.best[ranking.winner]
    best = fit(first.problem, first.vector, weighing, _ITERATIONS)
    before, after, left = (square_by(f, weighing) for f in (e.nominal, e.best, best))
    floor = max(min(after * (1.0 - e.predictability.share), left), 1e-300)
    count, had = len(e.segment.y), e.best.problem.families
    found = log_odds(before, after, floor, count, e.best.size, len(had))
    odds = log_odds(before, left, floor, count, best.size, len(base.problem.families) + 1) - found
    pace, (rate,) = best.problem.candidates[-1], best.problem.values(best.vector)[-1]
    instead = frozenset(had) - frozenset(base.problem.families)
    return Uneven(pace.stage, pace.form.name, float(np.exp(rate)), instead, odds, left / max(before, 1e-300))
