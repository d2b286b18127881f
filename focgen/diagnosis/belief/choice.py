"""Which effect, if any, a residual asks for next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.diagnosis.belief.further import Ground
from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect

NEAR = 6.0  # nats: of families that are further behind no further form is asked
_BEHIND = 50.0  # nats, whatever nominal parameters cost: so far behind none is the likeliest


def prior(candidate: CandidateEffect, beside: Sequence[CandidateEffect]) -> float:
    """Log odds, before the data, of an effect ``beside`` others, or of another form of one that is there."""
    again = any(_where(c) == _where(candidate) for c in beside)
    return float(np.log(NUMBERS.again)) if again else rarity([candidate])


def beforehand(candidates: Sequence[CandidateEffect]) -> float:
    """Log odds, before the data, of effects with all their forms."""
    return sum(prior(c, candidates[:i]) for i, c in enumerate(candidates))


def rarity(candidates: Sequence[CandidateEffect]) -> float:
    """Log odds, before the data, that effects are there, whatever forms of them. Ahead of the dynamics and
    behind them, a family is there twice, which is as rare as two."""
    places = {_where(c) for c in candidates}
    behind = sum(rarer for _, rarer in places)
    return float(len(places) * np.log(NUMBERS.rare) + behind * np.log(NUMBERS.behind))


def _where(candidate: CandidateEffect) -> tuple[str, bool]:
    """The family, and whether it acts behind the dynamics of its stage."""
    return candidate.effect, candidate.form.rarer


def foremost_forms(ground: Ground, tried: Sequence[Fit]) -> list[Fit]:
    """Of every family the form that most speaks for, where that is within :data:`NEAR` of the foremost: one
    of five values may leave least, and one of two be the likelier."""
    best: dict[str, tuple[float, Fit]] = {}
    for of in tried:
        name, nats = of.problem.candidates[-1].effect, ground.roughly(of)
        if name not in best or nats > best[name][0]:
            best[name] = nats, of
    top = max((nats for nats, _ in best.values()), default=0.0)
    return [of for nats, of in best.values() if nats > top - NEAR]


def likeliest(ground: Ground, tried: Sequence[Fit]) -> tuple[Fit, float]:
    """Of candidates the one of the highest posterior odds over nothing more, and those, in nats, by what it
    explains: nominal parameters that come closer to those given choose among effects, and ask for none. So
    the likeliest of those that something is explained by, where there is one."""
    rough = [ground.roughly(f) + f.prior_penalty for f in tried]  # they may be kept closer to those given
    tried = [f for f, nats in zip(tried, rough) if nats > max(rough) - _BEHIND]
    last, beside = [f.problem.candidates[-1] for f in tried], ground.base.problem.candidates
    odds = [ground.odds(f) + prior(c, beside) for f, c in zip(tried, last)]
    asked = [o - ground.closer(f) for f, o in zip(tried, odds)]
    best = max(range(len(tried)), key=lambda i: (asked[i] > 0.0, odds[i]))
    alike = [i for i, c in enumerate(last) if c.effect == last[best].effect and odds[i] > odds[best] - 1.0]
    best = min(alike, key=lambda i: (asked[i] <= 0.0, tried[i].sse))
    return tried[best], asked[best]
