"""Every effect found held against its rivals, each in its place beside the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from focgen.diagnosis.belief.choice import NEAR, rarity
from focgen.diagnosis.belief.further import Ground, Surroundings
from focgen.diagnosis.belief.standing import any_of, behind, holds, nominal_off
from focgen.diagnosis.fitting.fit import Fit, Weighing, fit, problem_residual
from focgen.diagnosis.fitting.integrating import as_they_show
from focgen.diagnosis.hypotheses.search import Ranking, evidence, is_itself, on_all, rank
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.rig.effects import library

_SWAPS = 3
_TO_THE_END = 30  # iterations, of which a fit that is near its least takes one or two
_MENDED = 3  # rivals that get a second form where the best has one


@dataclass(frozen=True)
class Rival:
    """A family that may be the cause instead: its ``odds``, nats, over there being no such cause,
    ``separation`` from the best in standard deviations, ``gain`` in nats of the noise, ``change`` of the
    output as a share of the noise's root mean square. ``form``: by what the nominal form is off, likewise."""

    effect: str
    stage: str
    separation: float
    gain: float
    fit: Fit
    odds: float = np.inf
    change: float = np.inf
    form: float = 0.0

    @property
    def off(self) -> float:
        """Log odds that the nominal chain is off by itself instead; none where this is a rounding: steps are
        no part of a chain."""
        family = library()[self.effect]
        return -np.inf if family.rounds else nominal_off(self.change, family.static, self.form)

    @property
    def of_form(self) -> bool:
        """Whether the chain is off by its form, as its rig says, sooner than by part of the noise."""
        family = library()[self.effect]
        return not family.rounds and self.off > nominal_off(self.change, family.static)


@dataclass(frozen=True, eq=False)
class Cause:
    """One effect of a segment: ``rivals``, the best first; ``share``: of the refitted gap's explained mean
    square."""

    rivals: tuple[Rival, ...]
    gain: float
    share: float


@dataclass(frozen=True, eq=False)
class Beside:
    """What every effect is doubted with: the fit without any, the ``rankings`` made, which those made anew
    join, the ``candidates`` to try, the ``weighing`` of residuals, the ``surroundings``, whether effects are
    ``granted`` to be there, and the fits ``known`` from the search."""

    nominal: Fit
    rankings: list[Ranking]
    candidates: Sequence[CandidateEffect]
    weighing: Weighing
    surroundings: Surroundings
    granted: bool = False
    known: Sequence[Fit] = ()


@dataclass(frozen=True, eq=False)
class Examined:
    """Effects that stand, and what they rest on: ``best`` with the ``causes``. ``off``: the same with one
    more, which left because the nominal chain is as good as sure to be off by itself; None where none did."""

    best: Fit
    causes: tuple[Cause, ...]
    off: Examined | None = None


def reexamined(best: Fit, beside: Beside) -> Examined:
    """Every effect held against its rivals beside the others; where one of them does better, it takes the
    place, and where none is likelier than that nothing more is there, as what came later may make it, all
    leave it, of a family in two forms one of them first. So they do where the nominal chain is as good as
    sure to be off by itself."""
    off, swaps = None, 0
    while swaps < _SWAPS:
        causes = _causes(best, beside)
        first = [c.rivals[0] for c in causes]
        usurper = min(first, key=lambda r: r.separation, default=None)
        if usurper is not None and usurper.separation < 0:
            best, swaps = usurper.fit, swaps + 1
            continue
        needless = min(first, key=_needed, default=None)
        if needless is None or _needed(needless) >= 0.0 or beside.granted:
            return Examined(best, causes, off)
        off = Examined(best, causes) if holds(needless.off) else None
        best = _lighter(best, needless.effect, beside)
    return Examined(best, _causes(best, beside), off)


def _lighter(best: Fit, name: str, beside: Beside) -> Fit:
    """Without the form of this family that is missed least, for what two of them are not needed for one may
    be; without the family, where it has one form."""
    own = [c for c in best.problem.candidates if c.effect == name]
    weighing, known = beside.weighing, beside.known
    if len(own) == 1:
        return without_family(best, name, weighing, known)
    others = [left_out(best, [form], weighing, known) for form in own]
    return min(others, key=lambda without: evidence(best, without))


def _needed(rival: Rival) -> float:
    """Log odds of an effect over nothing being there; none are left where the nominal chain, off by
    itself, holds all that a set has to."""
    return -np.inf if holds(rival.off) else rival.odds


def _causes(best: Fit, beside: Beside) -> tuple[Cause, ...]:
    """A cause for every family of ``best``."""
    causes = (_cause(name, best, beside) for name in best.problem.families)
    return tuple(sorted(causes, key=lambda c: -c.share))


def _cause(name: str, best: Fit, beside: Beside) -> Cause:
    """One effect of ``best`` and its rivals, the best first. Of a rival that the experiments are not made to
    show, no more free values are counted than of the effect: they were not to be seen."""
    own = [c for c in best.problem.candidates if c.effect == name]
    without = without_family(best, name, beside.weighing, beside.known)
    ranking = _ranking(name, without, beside)
    fits, twin = {name: best} | dict(_rivals(best, ranking, beside, len(own) > 1)), _twin(name, best, beside)
    tried = [*fits.values(), *twin.values()]
    ground = Ground.of(beside.nominal, without, tried, beside.weighing, beside.surroundings)
    unseen = {n for n in (*fits, *twin) if n != name and best.problem.lacks(n)}

    def speaks(of: Fit, family: str) -> float:
        acts = [c for c in of.problem.candidates if c.effect not in without.problem.families]
        return ground.compared(of, best.size - without.size if family in unseen else None) + rarity(acts)

    fits |= {n: _foremost(n, f, fits.get(n), partial(speaks, family=n)) for n, f in twin.items()}
    odds = {n: speaks(f, n) for n, f in fits.items()}
    for other in _near(odds) if len(own) == 1 else ():
        forms = [fits[other], *_other_forms(other, fits[other], best, ranking, beside)]
        odds[other] = any_of([speaks(f, other) for f in forms])
    first = fits[max(odds, key=lambda n: odds[n])]
    there = ground.odds(first) - ground.compared(first)
    odds = {n: o + there for n, o in odds.items()}
    rivals = [
        Rival(
            n,
            _acting(f, n).stage,
            behind(odds[n], odds[name]),
            evidence(f, without),
            f,
            odds[n],
            change_of(f, without),
            lack_of(f),
        )
        for n, f in fits.items()
    ]
    share = share_of(beside.nominal, without, best)
    return Cause(tuple(sorted(rivals, key=lambda r: r.separation)), evidence(best, without), share)


def _acting(of: Fit, family: str) -> CandidateEffect:
    """The first form of a family that a fit has."""
    return next(c for c in of.problem.candidates if c.effect == family)


def _foremost(family: str, twin: Fit, ranked: Fit | None, speaks: Callable[[Fit], float]) -> Fit:
    """A twin, or what its family was ``ranked`` by, where that acts elsewhere and more speaks for it."""
    if ranked is None or _acting(ranked, family).form.rarer == _acting(twin, family).form.rarer:
        return twin
    return max(twin, ranked, key=speaks)


def _near(odds: Mapping[str, float]) -> list[str]:
    """The families that further forms may bring to the front, or keep there."""
    best = max(odds.values())
    return [name for name, o in odds.items() if o > best - NEAR]


def _other_forms(name: str, of: Fit, best: Fit, ranking: Ranking, beside: Beside) -> list[Fit]:
    """The further forms of a family, fitted beside the others where the best of it is."""
    problem, found = ranking.base.problem, []
    for left in ranking.left:
        candidate = left.problem.candidates[-1]
        if candidate.effect != name or candidate in of.problem.candidates:
            continue
        whole = on_all(left, problem, round(problem.slack / left.problem.slack))
        found.append(fit(whole.problem, whole.vector, beside.weighing, 6, leader=best))
    return found


def change_of(of: Fit, without: Fit) -> float:
    """The root mean square of what a fit's output is another by than ``without``, over that of what it
    leaves; of a whole path, where that shows, to which both are fitted anew."""
    left, before = (problem_residual(f) for f in as_they_show(of, without))
    change = left - before
    return float(np.sqrt(np.mean(change**2) / max(np.mean(left**2), 1e-300)))


def lack_of(of: Fit) -> float:
    """The root mean square by which the form of the nominal chain may be off, twice what its rig says, for
    other experiments show more of it; over that of what a fit leaves."""
    segment, known = of.problem.segment, of.problem.nominals.rig.uncertainty
    lack = np.hypot.reduce([getattr(known, stage).form for stage in segment.stages])
    if not lack:
        return 0.0
    left = float(np.sqrt(np.mean(problem_residual(of) ** 2)))
    return 2.0 * float(lack * np.std(segment.recent(segment.y))) / max(left, 1e-300)


def _ranking(name: str, without: Fit, beside: Beside) -> Ranking:
    """The families tried where an effect of this name is left out."""
    for ranking in beside.rankings:
        if alike(ranking.base.problem, without.problem):
            return ranking
    families = without.problem.families
    untried = [c for c in without.problem.untried(beside.candidates) if c.effect not in families]
    beside.rankings.append(rank(without.problem, without.vector, untried))
    return beside.rankings[-1]


def alike(a: Problem, b: Problem) -> bool:
    """Whether two problems of a segment are the same."""
    return a.candidates == b.candidates and a.nominals.wide == b.nominals.wide


def share_of(nominal: Fit, without: Fit, best: Fit) -> float:
    """The part of what ``best`` explains of the refitted gap, as mean square, that is lost ``without``."""
    before, lost, after = (np.mean(f.weighed**2) for f in (nominal, without, best))
    return float(np.clip((lost - after) / max(before - after, 1e-300), 0, 1))


def _rivals(best: Fit, ranking: Ranking, beside: Beside, mended: bool) -> list[tuple[str, Fit]]:
    """The families of ``ranking`` in the place of one of ``best``; ``mended``: that one has two forms, so
    the foremost of the others may have, too."""
    found: list[tuple[str, Fit]] = []
    for other, candidate in ranking.best.items():
        if other in best.problem.families:
            continue
        again = fit(candidate.problem, candidate.vector, beside.weighing, 6, leader=best)
        if mended and len(found) < _MENDED:
            again = _second_form(again, beside.candidates, beside.weighing)
        if is_itself(again):
            found.append((other, again))
    return found


def _twin(name: str, best: Fit, beside: Beside) -> dict[str, Fit]:
    """The family of another stage whose forms act alike, in the place of one of ``best``, where there is one:
    what is behind all dynamics may be of what moves, or of what reads it. A form without the like stays."""
    problem, found = best.problem, list(best.problem.candidates)
    for i, own in enumerate(found):
        if own.effect == name:
            like = [c for c in beside.candidates if c.form.act is own.form.act and c.effect != name]
            like = [c for c in like if c.form.rarer != own.form.rarer and c.effect not in problem.families]
            found[i] = like[0] if like else own
    other = next((c.effect for c, own in zip(found, problem.candidates) if c != own), None)
    if other is None:
        return {}
    return {other: fit(problem.with_candidates(found), best.vector, beside.weighing, 6, leader=best)}


def _second_form(of: Fit, candidates: Sequence[CandidateEffect], weighing: Weighing) -> Fit:
    """With the form of the same family beside it that helps most, where one does."""
    last = of.problem.candidates[-1]
    alike = (last.effect, last.stage, last.form.rarer)
    forms = [c for c in candidates if (c.effect, c.stage, c.form.rarer) == alike and c != last]
    ranking = rank(of.problem, of.vector, forms)
    if ranking.winner is None:
        return of
    better = fit(ranking.best[ranking.winner].problem, ranking.best[ranking.winner].vector, weighing, 6)
    return better if evidence(better, of) > 0 else of


def without_family(of: Fit, name: str, weighing: Weighing, known: Sequence[Fit] = ()) -> Fit:
    """``of`` without any form of this family, fitted again."""
    return left_out(of, [c for c in of.problem.candidates if c.effect == name], weighing, known)


def left_out(
    of: Fit, candidates: Sequence[CandidateEffect], weighing: Weighing, known: Sequence[Fit] = ()
) -> Fit:
    """``of`` without ``candidates``, fitted again, or what is ``known`` of the same families, if that is
    likelier. What was fitted beside an effect may be far from what it is without, as a valve's band that
    jumps, and a form that is right beside it the worse one without."""
    whole, vector = _without(of, candidates)
    found = [f.vector for f in known if f.problem.candidates == whole.candidates]
    best = min((fit(whole, s, weighing, 8) for s in (vector, *found)), key=lambda f: f.cost)
    for other in (f for f in known if _in_other_forms(f.problem, whole)):
        again = fit(other.problem, other.vector, weighing, 8)
        best = again if evidence(again, best) > 0.0 else best
    return best


def at_its_least(of: Fit, weighing: Weighing) -> Fit:
    """A fit taken to its end, or from the rig's own numbers as given, if that is likelier: what was fitted
    beside an effect may have taken them far from what they are without it."""
    given = np.concatenate([of.problem.nominal(), of.vector[of.problem.head :]])
    return min((fit(of.problem, s, weighing, _TO_THE_END) for s in (of.vector, given)), key=lambda f: f.cost)


def _in_other_forms(problem: Problem, of: Problem) -> bool:
    """Whether a problem has the same effects in the same places as another, and other forms of them."""
    places = ([(c.effect, c.stage, c.form.rarer) for c in p.candidates] for p in (problem, of))
    first, second = map(sorted, places)
    return first == second and problem.candidates != of.candidates


def without(of: Fit, candidates: Sequence[CandidateEffect], weighing: Weighing) -> Fit:
    """``of`` without ``candidates``, the rest as it was fitted beside them."""
    return fit(*_without(of, candidates), weighing, 0)


def _without(of: Fit, candidates: Sequence[CandidateEffect]) -> tuple[Problem, np.ndarray]:
    shares = zip(of.problem.candidates, of.problem.shares(of.vector))
    stay = [(c, share) for c, share in shares if c not in candidates]
    vector = [of.vector[: of.problem.head], *(share for _, share in stay)]
    return of.problem.with_candidates([c for c, _ in stay]), np.concatenate(vector)
