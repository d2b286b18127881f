"""Every effect found held against its rivals, each in its place beside the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.fit import Fit, Weighing, fit
from focgen.diagnosis.problem import Clue, Problem
from focgen.diagnosis.search import Ranking, evidence, rank
from focgen.diagnosis.separation import separation
from focgen.rig.effects import confused

_SWAPS = 3
_LEVEL = 0.01  # standard deviations: as good as
_MENDED = 3  # rivals that get a second form where the best has one


@dataclass(frozen=True)
class Rival:
    """A family that may be the cause instead: ``separation`` from the best in standard deviations, ``gain``
    in nats."""

    effect: str
    stage: str
    separation: float
    gain: float
    fit: Fit


@dataclass(frozen=True, eq=False)
class Cause:
    """One effect of a segment: ``rivals``, the best first; ``share``: of the refitted gap's explained mean
    square."""

    rivals: tuple[Rival, ...]
    gain: float
    share: float


def doubted(best: Fit, nominal: Fit, rankings, clues, weighing: Weighing) -> tuple[Fit, tuple[Cause, ...]]:
    """Every effect held against its rivals beside the others; where one of them does better, it takes the
    place."""
    rankings = list(rankings)
    for _ in range(_SWAPS):
        causes = _causes(best, nominal, rankings, clues, weighing)
        usurper = min((r for c in causes for r in c.rivals), key=lambda r: r.separation, default=None)
        if usurper is None or usurper.separation >= 0:
            return best, causes
        best = usurper.fit
    return best, _causes(best, nominal, rankings, clues, weighing)


def _causes(best: Fit, nominal: Fit, rankings: list[Ranking], clues, weighing: Weighing) -> tuple[Cause, ...]:
    """A cause for every family of ``best``; what has to be ranked anew joins ``rankings``."""
    names = dict.fromkeys(c.effect for c in best.problem.clues)
    found = [_cause(name, best, nominal, rankings, clues, weighing) for name in names]
    return tuple(sorted(found, key=lambda c: -c.share))


def _cause(name: str, best: Fit, nominal: Fit, rankings: list[Ranking], clues, weighing: Weighing) -> Cause:
    """One effect of ``best`` and its rivals, the best first."""
    own = [c for c in best.problem.clues if c.effect == name]
    without = left_out(best, own, weighing)
    gain = evidence(best, without)
    same = (r for r in rankings if _alike(r.base.problem, without.problem))
    ranking = next(same, None)
    if ranking is None:
        untried = [c for c in clues if c.effect != name and not c.form.seen]
        ranking = rank(without.problem, without.vector, untried)
        rankings.append(ranking)
    others = _rivals(best, without, ranking, clues, weighing, len(own) > 1)
    rivals = [Rival(name, own[0].stage, 0.0, gain, best), *(_behind(r, name, best) for r in others)]
    return Cause(tuple(sorted(rivals, key=lambda r: r.separation)), gain, share_of(nominal, without, best))


def _alike(a: Problem, b: Problem) -> bool:
    """Whether two problems of a segment are the same."""
    return a.clues == b.clues and a.own.wide == b.own.wide


def share_of(nominal: Fit, without: Fit, best: Fit) -> float:
    """The part of what ``best`` explains of the refitted gap, as mean square, that is lost ``without``."""
    before, lost, after = (np.mean(f.weighed**2) for f in (nominal, without, best))
    return float(np.clip((lost - after) / max(before - after, 1e-300), 0, 1))


def _rivals(
    best: Fit, without: Fit, ranking: Ranking, clues, weighing: Weighing, mended: bool
) -> list[Rival]:
    """The families of ``ranking`` in the place of one of ``best``; ``mended``: that one has two forms, so
    the foremost of the others may have, too."""
    found, open_ = [], _indistinct(best, ranking)
    for other, candidate in ranking.best.items():
        if other in {c.effect for c in best.problem.clues}:
            continue
        again = fit(candidate.problem, candidate.vector, weighing, 6, leader=best)
        if mended and len(found) < _MENDED:
            again = _second_form(again, clues, weighing)
        apart = separation(best, again, without, other in open_)
        found.append(Rival(other, again.problem.clues[-1].stage, apart, evidence(again, without), again))
    return found


def _behind(rival: Rival, name: str, best: Fit) -> Rival:
    """The rival, not ahead of effect ``name`` where the experiments are made to show that one only."""
    if best.problem.lacks(rival.effect) and not best.problem.lacks(name):
        return replace(rival, separation=max(rival.separation, _LEVEL))
    return rival


def _indistinct(best: Fit, ranking: Ranking) -> set[str]:
    """The families that these experiments are not made to tell from those of ``best``: easily confused with
    one of them, and one of the two lacking what would show it; or confused with what that one is confused
    with, and lacking it themselves."""
    lacks, found = best.problem.lacks, set()
    for a in dict.fromkeys(c.effect for c in best.problem.clues):
        near = confused(a)
        further = set().union(*map(confused, near))
        for b in ranking.best:
            if (b in near and (lacks(b) or lacks(a))) or (b in further and lacks(b)):
                found.add(b)
    return found


def _second_form(of: Fit, clues, weighing: Weighing) -> Fit:
    """With the form of the same family beside it that helps most, where one does."""
    last = of.problem.clues[-1]
    forms = [c for c in clues if c.effect == last.effect and c.stage == last.stage and c != last]
    ranking = rank(of.problem, of.vector, forms)
    if ranking.winner is None:
        return of
    better = fit(ranking.best[ranking.winner].problem, ranking.best[ranking.winner].vector, weighing, 6)
    return better if evidence(better, of) > 0 else of


def left_out(of: Fit, clues: Sequence[Clue], weighing: Weighing) -> Fit:
    """``of`` without ``clues``, fitted again."""
    problem, head = of.problem, of.problem.head
    kept, vector, place = [], [of.vector[:head]], head
    for clue in problem.clues:
        count = len(clue.form.parameters)
        if clue not in clues:
            kept.append(clue)
            vector.append(of.vector[place : place + count])
        place += count
    return fit(problem.with_clues(kept), np.concatenate(vector), weighing, 8)
