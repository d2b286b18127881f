"""What a coarse converter hides from a search: effects held against one another with its steps simulated.

To a search, which goes without the steps, they are an error as large as what another effect changes. With the
steps in its model a rig alone leaves little, and nothing that inputs predict. What another effect changes
moves the times at which the levels change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from focgen.diagnosis.belief.choice import rarity
from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.belief.standing import behind, holds
from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.hypotheses.converter import Converter
from focgen.diagnosis.hypotheses.rivals import Cause, Rival, change_of, share_of
from focgen.diagnosis.hypotheses.search import Ranking, evidence, family, is_itself, on_all, rank
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import CandidateEffect

_STEPS = 6  # iterations


@dataclass(frozen=True, eq=False)
class SeenThrough:
    """An effect found with the steps simulated: a fit without them, and the ``cause`` that it is."""

    best: Fit
    cause: Cause


def seen_through(
    converter: Converter,
    best: Fit,
    nominal: Fit,
    rankings: Sequence[Ranking],
    candidates: Sequence[CandidateEffect],
    surroundings: Surroundings,
    threshold: float,
) -> SeenThrough | None:
    """The likeliest effect beside those of ``best`` with the steps of the ``converter`` simulated; None where
    inputs predict little of what is left, or none is likelier than none. ``nominal``: the fit without any
    effect; ``surroundings``: what else makes a misfit; ``threshold``: nats that noise does not reach."""
    base = converter.stepped(best)
    if base.predictable_share < NUMBERS.left:
        return None
    plain = _every_family(_ranked(best, rankings, candidates))
    tried = {n: s for n, f in plain.items() if evidence(s := converter.stepped(f), base) > threshold}
    if not tried:
        return None
    ground = Ground.of(converter.stepped(nominal), base, [*tried.values()], WHITE, surroundings)
    rare = {n: rarity([plain[n].problem.candidates[-1]]) for n in tried}
    odds = {n: ground.compared(f) + rare[n] for n, f in tried.items()}
    first = max(odds, key=lambda n: odds[n])
    there = ground.odds(tried[first]) + rare[first]
    if there <= ground.closer(tried[first]):
        return None
    more = there - odds[first]

    def rival(name: str, of: Fit) -> Rival:
        stage = plain[name].problem.candidates[-1].stage
        apart, gain = behind(odds[name], odds[first]), evidence(of, base)
        return Rival(name, stage, apart, gain, of, odds[name] + more, change_of(of, base))

    rivals = tuple(sorted((rival(n, f) for n, f in tried.items()), key=lambda r: r.separation))
    if holds(rivals[0].off):
        return None
    share = share_of(nominal, best, tried[first])
    return SeenThrough(plain[first], Cause(rivals, rivals[0].gain, share))


def _every_family(ranking: Ranking) -> dict[str, Fit]:
    """A fit of each family, the foremost of its forms: what is far behind without the steps need not be with
    them."""
    problem, found = ranking.base.problem, dict(ranking.best)
    for left in sorted(ranking.left, key=lambda f: f.sse / len(f.innovations)):
        if family(left) not in found:
            whole = on_all(left, problem, round(problem.slack / left.problem.slack))
            found[family(left)] = fit(whole.problem, whole.vector, WHITE, _STEPS)
    return {name: f for name, f in found.items() if is_itself(f)}


def _ranked(best: Fit, rankings: Sequence[Ranking], candidates: Sequence[CandidateEffect]) -> Ranking:
    """What each further family does beside ``best``, without the steps."""
    problem = best.problem
    for ranking in rankings:
        if ranking.base.problem.candidates == problem.candidates:
            return ranking
    return rank(problem, best.vector, problem.untried(candidates))
