"""Two effects at once, where the first one leaves much.

Effects are added one by one, and what stands beside a second one may look like anything: alone, each leaves
most of what the other makes. So where the first effect leaves much that inputs predict, or none was found,
the likeliest families are each taken for granted once, asked for another, and looked for anew beside that.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.belief.choice import beforehand
from focgen.diagnosis.belief.further import Ground
from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria
from focgen.diagnosis.hypotheses.anew import looked_anew
from focgen.diagnosis.hypotheses.search import Ranking, rank
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import CandidateEffect

_TRIED = 4  # families that are taken for granted


def two_at_once(
    rankings: Sequence[Ranking], candidates: Sequence[CandidateEffect], asked: AcceptanceCriteria
) -> tuple[list[Ranking], Fit] | None:
    """Two effects that leave little, of what they change, that inputs predict, and are likelier than what was
    found, and the rankings that lead to them; None where there are none, or nothing asks for them."""
    first, found = rankings[0], []
    if _explains(rankings[-1].base, first):
        return None
    for one in list(first.best.values())[:_TRIED]:
        second = rank(one.problem, one.vector, one.problem.untried(candidates))
        second = looked_anew(first.base, second, candidates, asked.surroundings)
        if second.winner is not None:
            found.append((second.best[second.winner], second))
    found = [(both, second) for both, second in found if _explains(both, first)]
    if not found:
        return None
    both, second = min(found, key=lambda pair: pair[0].sse)
    if not _likelier(both, first, rankings[-1].base, Weighing(second.ar), asked):
        return None
    return [first, second], both


def _explains(of: Fit, first: Ranking) -> bool:
    """Whether what inputs still predict beside effects is little of what they change."""
    before, after = (float(np.mean(f.weighed**2)) for f in (first.base, of))
    return of.predictable_share * after < NUMBERS.much * (before - after)


def _likelier(both: Fit, first: Ranking, found: Fit, weighing: Weighing, asked: AcceptanceCriteria) -> bool:
    """Whether two effects are likelier than what was found, and than none."""
    fits = [fit(f.problem, f.vector, weighing, 0) for f in (first.base, found, both)]
    ground = Ground.of(fits[0], fits[0], fits[1:], weighing, asked.surroundings)
    odds = [ground.odds(f) + beforehand(f.problem.candidates) for f in fits[1:]]
    return odds[1] > max(odds[0], 0.0)
