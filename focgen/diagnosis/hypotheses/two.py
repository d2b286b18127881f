"""Two effects at once, where the first one leaves much, or more than a right form does.

Effects are added one by one, and what stands beside a second one may look like anything: alone, each leaves
most of what the other makes. So where the first effect leaves much that inputs predict, or none was found,
the likeliest families are each taken for granted once, asked for another, and looked for anew beside that.
Where it leaves less than that, and yet more than forms lack of a rig, others are asked on means of samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.belief.choice import beforehand
from focgen.diagnosis.belief.further import Ground
from focgen.diagnosis.fitting.fit import Fit, Weighing, fit
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria
from focgen.diagnosis.hypotheses.anew import looked_anew
from focgen.diagnosis.hypotheses.search import Ranking, family, on_all, rank
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.rig.effects import EQUATIONS

_TRIED = 4  # families that are taken for granted
_SEEN = 1500  # means of samples, on which others are asked
_SECONDS = 2  # effects beside each of these
_FITTED = 10  # iterations on every sample


@dataclass(frozen=True)
class TwoOthers:
    """Two ``families`` ``instead`` of the one found, and the log ``odds`` of them over it."""

    instead: str
    families: frozenset[str]
    odds: float


def two_at_once(
    rankings: Sequence[Ranking], candidates: Sequence[CandidateEffect], asked: AcceptanceCriteria
) -> tuple[list[Ranking], Fit] | None:
    """Two effects that leave little, of what they change, that inputs predict, and are likelier than what was
    found, and the rankings that lead to them; None where there are none, or nothing asks for them."""
    first, found = rankings[0], []
    if _explains(rankings[-1].base, first):
        return None
    for one in first.firsts()[:_TRIED]:
        second = _beside(one, first, candidates, asked)
        if second.winner is not None:
            found.append((second.best[second.winner], second))
    found = [(both, second) for both, second in found if _explains(both, first)]
    if not found:
        return None
    both, second = min(found, key=lambda pair: pair[0].sse)
    alone, two = _odds(both, first, rankings[-1].base, Weighing(second.ar), asked)
    return ([first, second], both) if two > max(alone, 0.0) else None


def two_others(
    found: Fit,
    first: Ranking,
    candidates: Sequence[CandidateEffect],
    weighing: Weighing,
    asked: AcceptanceCriteria,
) -> tuple[TwoOthers, ...]:
    """Two families each instead of the one that was ``found``, the likeliest first, where that leaves more
    than forms lack of a rig, and they do not; none where it explains its segment. What is found may have
    another effect beside it as well, which is too unlikely by itself to be named."""
    if len(found.problem.families) != 1 or _explains(found, first, NUMBERS.form**2):
        return ()
    (name,), known = found.problem.families, dict[frozenset[str], float]()
    for both in _pairs(found, first, candidates):
        whole = fit(both.problem, both.vector, weighing, _FITTED)
        families = frozenset(whole.problem.families)
        if name in families or _explains(whole, first, NUMBERS.form**2):
            alone, two = _odds(whole, first, found, weighing, asked)
            known[families] = max(two - alone, known.get(families, -np.inf))
    there = float(np.logaddexp.reduce([0.0, *(odds for f, odds in known.items() if name in f)]))
    others = [TwoOthers(name, f, odds - there) for f, odds in known.items() if name not in f]
    return tuple(sorted(others, key=lambda o: -o.odds))


def _pairs(found: Fit, first: Ranking, candidates: Sequence[CandidateEffect]) -> Iterator[Fit]:
    """The likeliest pairs with the one ``found``, beside others in another form, too, and of the likeliest
    others, as fits to all samples that have yet to be made: they are looked for on means of few. What changes
    the plant's own equation is left out, for beside that every run takes several times as long."""
    name, seconds = family(found), [c for c in candidates if not _in_the_plant(c)]
    firsts = [f for f in first.firsts(without=_in_the_plant) if family(f) != name]
    for one in [found, *firsts[:_TRIED]]:
        factor = max(1, min(len(one.problem.segment.y) // _SEEN, one.problem.coarsest))
        thin = one.problem.thinned(factor)
        beside = [c for c in thin.untried(seconds) if c.effect != family(one)]
        best = rank(thin, thin.stretched(one.vector, 1.0 / factor), beside).best
        others = [both for other, both in best.items() if other != name][:_SECONDS]
        for both in [*others, best[name]] if name in best else others:
            yield on_all(both, one.problem, factor)


def _in_the_plant(candidate: CandidateEffect) -> bool:
    """Whether it changes an equation, or the spring in it."""
    return candidate.form.slot in (*EQUATIONS.values(), "spring")


def _beside(
    one: Fit, first: Ranking, candidates: Sequence[CandidateEffect], asked: AcceptanceCriteria
) -> Ranking:
    """What is left where one effect is taken for granted, with that looked for anew beside it."""
    second = rank(one.problem, one.vector, one.problem.untried(candidates))
    return looked_anew(first.base, second, candidates, asked.surroundings)


def _explains(of: Fit, first: Ranking, most: float = NUMBERS.much) -> bool:
    """Whether what inputs still predict beside effects is little of what they change."""
    before, after = (float(np.mean(f.weighed**2)) for f in (first.base, of))
    return of.predictable_share * after < most * (before - after)


def _odds(
    both: Fit, first: Ranking, found: Fit, weighing: Weighing, asked: AcceptanceCriteria
) -> tuple[float, float]:
    """Log odds, over none, of what was found, and of two effects."""
    fits = [fit(f.problem, f.vector, weighing, 0) for f in (first.base, found, both)]
    ground = Ground.of(fits[0], fits[0], fits[1:], weighing, asked.surroundings)
    alone, two = (ground.odds(f) + beforehand(f.problem.candidates) for f in fits[1:])
    return alone, two
