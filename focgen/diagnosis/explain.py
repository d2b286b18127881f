"""Effects added to a segment one by one while the data ask for them, then each doubted again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.converter import Converter, converter_of
from focgen.diagnosis.disturbance import disturbance
from focgen.diagnosis.fit import Fit, Weighing, fit
from focgen.diagnosis.leftover import Leftover, foretold, leftover
from focgen.diagnosis.own import Own
from focgen.diagnosis.problem import Clue, Problem
from focgen.diagnosis.reconsider import reconsidered
from focgen.diagnosis.rivals import Cause, doubted, left_out
from focgen.diagnosis.scales import references
from focgen.diagnosis.search import Ranking, evidence, rank
from focgen.diagnosis.segments import Segment, is_single, owner
from focgen.logs.experiment import Experiment
from focgen.rig.effects import library
from focgen.rig.engine import fits_in
from focgen.rig.model import Rig

_DEPTH = 4
_MUCH = 0.4  # of a residual's mean square foretold by inputs: then effects of other stages are tried too
_MENDING = 0.6  # of the best further family's evidence: a form of a family found already then goes first
_WHOLE = 0.5  # of what inputs foretell of a residual: a further family has to explain as much
_TELLING = 0.01  # of a residual's mean square foretold by inputs: below it no form is tried
_SHARE = (
    0.06,
    0.15,
)  # of the gap that a further family has to close, and one that is easily confused with those found,
_MERGED = (0.15, 0.25)  # where the stages are merged
_CLEAN = (0.55, 0.75)  # of the remaining mean square: one that takes away as much has to close only
_WHITE = 0.01  # of a residual's mean square foretold by inputs: below it nothing is left but noise
_PURE = (0.2, 0.3)  # of the remaining mean square: one that takes away as much and leaves noise has to close
_LITTLE = (0.015, 0.05)  # of the gap
_SMALL = (0.015, 0.04)  # of the gap, for what a form lacks is seldom just what another family makes
_VISIBLE = (
    0.015,
    0.05,
)  # of the remaining mean square, the first effect and any further: below, one is of no use
_KNOWN = 0.12  # of what an effect takes from a residual has to be foretold by inputs
_SURE = (0.4, 0.6)  # of the remaining mean square: the first effect, and any further, that takes away as much
# takes no noise away
_NOISY = (
    0.15,
    0.03,
)  # the same where the input is measured, its noise still in it or not: that looks like a small effect


@dataclass(frozen=True)
class Asked:
    """What an effect has to show to be one. ``threshold``: nats of evidence that noise alone does not reach;
    ``trusted``: whether the input could be freed of its noise; ``converter``: that hides small ones."""

    threshold: float
    trusted: bool
    converter: Converter | None


@dataclass(frozen=True, eq=False)
class Explanation:
    """A segment explained. ``nominal``: its own parameters refitted; ``best``: with the effects; ``errors``:
    by family, the root-mean-square residual with that effect alone, as a share of the refitted nominal's;
    ``converter``: the coarse one that the output shows."""

    segment: Segment
    given: np.ndarray
    nominal: Fit
    best: Fit
    ar: np.ndarray
    causes: tuple[Cause, ...]
    left: Leftover
    left_nominal: Leftover
    errors: dict[str, float]
    converter: Converter | None = None

    @property
    def stage(self) -> str | None:
        """The one stage this segment is, None where stages are merged."""
        return self.segment.stages[0] if len(self.segment.stages) == 1 else None


def clues_for(segment: Segment, rig: Rig) -> list[Clue]:
    """Every form that may act in this segment. In a rig of one stage every family may, but of those that
    share a formula only the one at home there."""
    if not is_single(rig):
        return [
            Clue(e.name, form, e.stage)
            for e in library().values()
            if e.stage in segment.stages
            for form in e.forms
            if fits_in(form, e.stage, rig)
        ]
    stage, found = owner(rig), {}
    for effect in sorted(library().values(), key=lambda e: e.stage != stage):
        for form in effect.forms:
            if fits_in(form, stage, rig):
                found.setdefault(form.act, Clue(effect.name, form, stage))
    return list(found.values())


def guests_in(segment: Segment, rig: Rig) -> list[Clue]:
    """Forms that are at home in another stage and may sit in this one: tried where those at home leave
    much."""
    if is_single(rig):
        return []
    return [
        Clue(e.name, form, stage)
        for e in library().values()
        for stage in e.also
        if stage in segment.stages and e.stage not in segment.stages
        for form in e.forms
        if fits_in(form, stage, rig)
    ]


def _much_left(base: Fit) -> bool:
    """Whether inputs foretell most of what is left."""
    return foretold(base.problem.segment, base.weighed, base.problem.references.clocks["response"]) > _MUCH


def problem_of(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The segment's problem without effects."""
    scales = references(rig, segment, logs)
    stage = owner(rig) if owner(rig) in segment.stages else None
    load, response = (scales.levels["load"], scales.levels["response"])
    return Problem(segment, Own(rig, stage, load, response), scales)


def explain(
    rig: Rig,
    segment: Segment,
    logs: Sequence[Experiment],
    threshold: float,
    only: Sequence[str] | None = None,
    trusted: bool = True,
) -> Explanation:
    """Find the segment's effects; ``threshold``: nats of evidence that noise alone does not reach.

    ``only``: the effects to consider, of which each that finds anything to mend is taken; ``trusted``:
    whether the input could be freed of its noise.
    """
    problem, clues, guests = _held(rig, segment, logs), clues_for(segment, rig), guests_in(segment, rig)
    if only is not None:
        clues, guests, threshold = [c for c in clues if c.effect in only], [], 0.0
    segment, given, converter = problem.segment, problem.nominal(), converter_of(problem, clues)
    asked = Asked(threshold, trusted, converter)
    rankings, clues = _grown(problem, given, clues, guests, asked)
    weighing = Weighing(rankings[-1].ar)
    best = _dropped(rankings[-1].base, weighing, threshold)
    nominal = fit(problem, rankings[0].base.vector[: len(given)], weighing)
    best, causes = doubted(best, nominal, rankings, clues, weighing)
    if converter is not None:
        best, causes = converter.beside(best, nominal, causes, weighing)
    response = problem.references.clocks["response"]
    return Explanation(
        segment,
        given,
        nominal,
        best,
        weighing.ar,
        causes,
        leftover(segment, best.weighed, response),
        leftover(segment, nominal.weighed, response),
        rankings[0].errors,
        converter,
    )


def _grown(
    base: Problem,
    vector: np.ndarray,
    clues: list[Clue],
    guests: list[Clue],
    asked: Asked,
) -> tuple[list[Ranking], list[Clue]]:
    """A ranking for each effect that the data ask for, the last one being of what is left; and the clues
    that were tried."""
    rankings: list[Ranking] = []
    while len(rankings) < _DEPTH:
        untried = [c for c in clues if c not in base.clues and not c.form.seen]
        rankings.append(rank(base, vector, _worth_trying(base, vector, untried)))
        best = _chosen(rankings, asked, clues)
        if best is None and guests and _much_left(rankings[-1].base):
            clues, guests = clues + guests, []
            continue
        if best is None:
            break
        base, vector = best.problem, best.vector
    return rankings, clues


def _held(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The problem with the command as a staircase or as a polygon, whichever the log was: loggers differ."""
    problems = [problem_of(rig, replace(segment, held=held), logs) for held in {segment.held, False}]
    fits = [fit(p, p.nominal(), Weighing(np.ones(1)), 6) for p in problems]
    return min(fits, key=lambda f: f.sse).problem


def _worth_trying(base: Problem, vector: np.ndarray, clues: list[Clue]) -> list[Clue]:
    """All clues where inputs foretell something of the residual or it is slower than noise is, else none."""
    ground = fit(base, vector, Weighing(np.ones(1), max(1, len(base.segment.y) // 5000)), 6)
    left, segment, response = ground.weighed, base.segment, base.references.clocks["response"]
    told = foretold(segment, left, response) > _TELLING
    return clues if told or disturbance(segment.parts(left), segment.run.h, response).swings else []


def _chosen(rankings: Sequence[Ranking], asked: Asked, clues: Sequence[Clue]) -> Fit | None:
    """The winner where it is beyond chance and of use. Another form of what was found already goes before a
    further family, unless that explains clearly more: no form is quite what the rig does, and others mend
    what it lacks."""
    ranking = rankings[-1]
    if ranking.winner is None or ranking.gain[ranking.winner] < asked.threshold:
        return None
    winner, again = ranking.best[ranking.winner], _again(ranking)
    gained = evidence(again, ranking.base) if again is not None else 0.0
    mends = gained > asked.threshold and _mends(ranking.base, again, _VISIBLE[1], 0.0, asked.converter)
    mended = again if mends else None
    if gained > _MENDING * ranking.gain[ranking.winner]:
        return mended
    if not ranking.base.problem.clues:
        return winner if _useful(rankings, winner, asked) else mended
    tried = (f for f in (reconsidered(rankings, winner, clues), winner))
    return next((f for f in tried if _useful(rankings, f, asked) and not _marginal(rankings, f)), mended)


def _again(ranking: Ranking) -> Fit | None:
    """The best further form of a family found already."""
    already = {c.effect for c in ranking.base.problem.clues}
    known = [ranking.best[name] for name in already if name in ranking.best]
    return max(known, key=lambda f: evidence(f, ranking.base), default=None)


def _useful(rankings: Sequence[Ranking], winner: Fit, asked: Asked) -> bool:
    """Whether a family mends what an effect has to; a further one most of what inputs foretell."""
    base = rankings[-1].base
    measured, further = base.problem.segment.entry != "command", len(base.problem.clues) > 0
    visible = _NOISY[asked.trusted] if measured and not (further and asked.trusted) else _VISIBLE[further]
    return _mends(base, winner, visible, _WHOLE * further, asked.converter)


def _marginal(rankings: Sequence[Ranking], winner: Fit) -> bool:
    """Whether a further family closes only a small part of the gap: what the first one's form lacks looks
    like that, the more so to a family that is easily confused with it."""
    first, now, then = (float(np.mean(f.weighed**2)) for f in (rankings[0].base, rankings[-1].base, winner))
    response = winner.problem.references.clocks["response"]
    segment = winner.problem.segment
    noise = now * (1.0 - foretold(segment, rankings[-1].base.weighed, response))
    *others, last = winner.problem.clues
    name, close = last.effect, library()[last.effect].confused_with
    near = [c for c in others if c.effect in close or name in library()[c.effect].confused_with]
    alike = bool(near)
    asked = _MERGED if len(winner.problem.segment.stages) > 1 else _SHARE
    drawn = any(c.form.drawn for c in near)
    if now - then > _CLEAN[alike] * now and not drawn:
        asked = _SMALL
    elif now - then > _PURE[alike] * now and not drawn:
        asked = _LITTLE if foretold(segment, winner.weighed, response) < _WHITE else asked
    return now - then < asked[alike] * (first - min(noise, then))


def _mends(base: Fit, better: Fit, visible: float, whole: float, converter: Converter | None) -> bool:
    """Whether the residual falls visibly, by the part ``whole`` of what inputs foretell of it, and mostly
    so: what is not foretold is noise, and what takes that away no effect, unless it is most of all that is
    left; and what a coarse ``converter`` hides is no effect either."""
    before, after = (f.weighed for f in (base, better))
    old, new = np.mean(before**2), np.mean(after**2)
    if old - new < visible * new or (converter is not None and converter.hides(base, better)):
        return False
    response, segment = base.problem.references.clocks["response"], base.problem.segment
    known, left = foretold(segment, before, response), foretold(segment, after, response)
    sure = old - new > _SURE[bool(base.problem.clues)] * old
    told = sure or known * old - left * new > _KNOWN * (old - new)
    return told and old - new > whole * old * known


def _dropped(best: Fit, weighing: Weighing, threshold: float) -> Fit:
    """Without the effects that the later ones made needless."""
    while len(best.problem.clues) > 1:
        found = []
        for clue in best.problem.clues:
            without = left_out(best, [clue], weighing)
            found.append((evidence(best, without), without))
        least, without = min(found, key=lambda pair: pair[0])
        if least > threshold:
            break
        best = without
    return fit(best.problem, best.vector, weighing, 6)
