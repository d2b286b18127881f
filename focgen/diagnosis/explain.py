"""Effects added to a segment one by one while the data ask for them, then each doubted again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.fit import Fit, Weighing, fit
from focgen.diagnosis.leftover import Leftover, leftover
from focgen.diagnosis.own import Own
from focgen.diagnosis.problem import Clue, Problem
from focgen.diagnosis.scales import references
from focgen.diagnosis.search import Ranking, evidence, rank
from focgen.diagnosis.segments import Segment, is_single, owner
from focgen.diagnosis.separation import separation
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.engine import fits_in
from focgen.rig.model import Rig

_DEPTH = 4
_VISIBLE = (0.03, 0.05)  # of the remaining mean square, the first effect and any further: below, one is of no use


@dataclass(frozen=True)
class Rival:
    """A family that may be the cause instead: ``separation`` from the best in standard deviations, ``gain`` in nats."""

    effect: str
    stage: str
    separation: float
    gain: float
    fit: Fit


@dataclass(frozen=True, eq=False)
class Cause:
    """One effect of a segment: ``rivals``, the best first; ``share``: of the refitted gap's explained mean square."""

    rivals: tuple[Rival, ...]
    gain: float
    share: float


@dataclass(frozen=True, eq=False)
class Explanation:
    """A segment explained. ``nominal``: its own parameters refitted; ``best``: with the effects."""

    segment: Segment
    given: np.ndarray
    nominal: Fit
    best: Fit
    ar: np.ndarray
    causes: tuple[Cause, ...]
    left: Leftover
    left_nominal: Leftover

    @property
    def stage(self) -> str | None:
        """The one stage this segment is, None where stages are merged."""
        return self.segment.stages[0] if len(self.segment.stages) == 1 else None


def clues_for(segment: Segment, rig: Rig) -> list[Clue]:
    """Every form that may act in this segment."""
    single = is_single(rig)
    found = []
    for effect in library().values():
        stages = [owner(rig)] if single else [s for s in segment.stages if s == effect.stage]
        found += [Clue(effect.name, form, s) for s in stages for form in effect.forms if fits_in(form, s, rig)]
    return found


def problem_of(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The segment's problem without effects."""
    scales = references(rig, segment, logs)
    stage = owner(rig) if owner(rig) in segment.stages else None
    load, response = (scales.levels["load"], scales.levels["response"])
    return Problem(segment, Own(rig, stage, load, response), scales)


def explain(rig: Rig, segment: Segment, logs: Sequence[Experiment], threshold: float) -> Explanation:
    """Find the segment's effects; ``threshold``: nats of evidence that noise alone does not reach."""
    problem, clues = _held(rig, segment, logs), clues_for(segment, rig)
    segment, given = problem.segment, problem.nominal()
    rankings: list[Ranking] = []
    base, vector = problem, given
    while len(rankings) < _DEPTH:
        ranking = rank(base, vector, [c for c in clues if c not in base.clues])
        rankings.append(ranking)
        if not _worth(ranking, threshold, _VISIBLE[len(rankings) > 1]):
            break
        best = ranking.best[ranking.winner]
        base, vector = best.problem, best.vector
    last = rankings[-1]
    best, ar = last.base, last.ar
    best = _dropped(best, Weighing(ar), threshold)
    nominal = fit(problem, rankings[0].base.vector, Weighing(ar))
    causes = _causes(best, nominal, rankings, clues, Weighing(ar))
    response = problem.references.clocks["response"]
    return Explanation(segment, given, nominal, best, ar, causes,
                       leftover(segment, problem_residual(best), response),
                       leftover(segment, problem_residual(nominal), response))


def _held(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The problem with the command as a staircase or as a polygon, whichever the log was: loggers differ."""
    problems = [problem_of(rig, replace(segment, held=held), logs) for held in {segment.held, False}]
    fits = [fit(p, p.nominal(), Weighing(np.ones(1)), 6) for p in problems]
    return min(fits, key=lambda f: f.sse).problem


def problem_residual(of: Fit) -> np.ndarray:
    """Measured less simulated (n,)."""
    return of.problem.residual(of.vector)


def _worth(ranking: Ranking, threshold: float, visible: float) -> bool:
    """Whether the winner is beyond chance and of use."""
    if ranking.winner is None or ranking.gain[ranking.winner] < threshold:
        return False
    before, after = (np.mean(problem_residual(f) ** 2) for f in (ranking.base, ranking.best[ranking.winner]))
    return before - after > visible * after


def _dropped(best: Fit, weighing: Weighing, threshold: float) -> Fit:
    """Without the effects that the later ones made needless."""
    while len(best.problem.clues) > 1:
        found = []
        for i in range(len(best.problem.clues)):
            without = _without(best, [best.problem.clues[i]], weighing)
            found.append((evidence(best, without), without))
        least, without = min(found, key=lambda pair: pair[0])
        if least > threshold:
            break
        best = without
    return fit(best.problem, best.vector, weighing, 6)


def _without(of: Fit, clues: Sequence[Clue], weighing: Weighing) -> Fit:
    problem, head = of.problem, of.problem.head
    kept, vector, place = [], [of.vector[:head]], head
    for clue in problem.clues:
        count = len(clue.form.parameters)
        if clue not in clues:
            kept.append(clue)
            vector.append(of.vector[place:place + count])
        place += count
    return fit(problem.with_clues(kept), np.concatenate(vector), weighing, 8)


def _causes(best: Fit, nominal: Fit, rankings, clues, weighing: Weighing) -> tuple[Cause, ...]:
    found = []
    for name in dict.fromkeys(c.effect for c in best.problem.clues):
        own = [c for c in best.problem.clues if c.effect == name]
        without = _without(best, own, weighing)
        only = len(own) == len(best.problem.clues)
        ranking = rankings[0] if only else rank(without.problem, without.vector, [c for c in clues if c.effect != name])
        rivals = [Rival(name, own[0].stage, 0.0, evidence(best, without), best)]
        for other, candidate in ranking.best.items():
            if other != name and other not in {c.effect for c in without.problem.clues}:
                again = fit(candidate.problem, candidate.vector, weighing, 6)
                rivals.append(Rival(other, again.problem.clues[-1].stage, separation(best, again),
                                    evidence(again, without), again))
        before, after = (np.mean(problem_residual(f) ** 2) for f in (nominal, best))
        lost = np.mean(problem_residual(without) ** 2) - after
        share = float(np.clip(lost / max(before - after, 1e-300), 0, 1))
        rivals.sort(key=lambda r: r.separation)
        found.append(Cause(tuple(rivals), evidence(best, without), share))
    return tuple(sorted(found, key=lambda c: -c.share))


