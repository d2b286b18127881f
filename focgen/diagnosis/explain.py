"""Effects added to a segment one by one while the data ask for them, then each doubted again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focgen.diagnosis.accept import Asked, begun_anew, chosen
from focgen.diagnosis.converter import Converter, converter_of
from focgen.diagnosis.disturbance import disturbance
from focgen.diagnosis.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.integrating import pace, settled
from focgen.diagnosis.leftover import LEFT, Leftover, leftover
from focgen.diagnosis.own import Own
from focgen.diagnosis.problem import Clue, Problem
from focgen.diagnosis.realign import realigned
from focgen.diagnosis.rivals import Cause, Rival, doubted, left_out
from focgen.diagnosis.scales import references
from focgen.diagnosis.search import Ranking, evidence, rank
from focgen.diagnosis.segments import Segment, is_single, owner
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Effect, library
from focgen.rig.engine import between_of, fits_in
from focgen.rig.model import Rig

_DEPTH = 4
# of the rig's response, and a sample at most: what columns may be out of step by; more is a delay
_OUT_OF_STEP = 0.05
_MUCH = 0.4  # of a residual's mean square foretold by inputs: then effects of other stages are tried too
_GAUGE = 0.01  # of its reading: by what a gauge may be off without being a fault
_WAYS = (Between.HELD, Between.STRAIGHT, Between.SMOOTH)  # of a command between its samples
_SMOOTHER = 0.95  # of the mean square that lines leave: a smooth curve, which takes longer, has to leave less
_RESTS = 0.5  # of a command's samples at which it rests: then it is no smooth curve
_FREED = 0.7  # of the mean square left: what is unlikely, such as an actuator far from the one given, has to
# leave less
_KEPT = 10.0  # times the pace at which a rig that integrates is searched where that shows nothing: of a small
# force the path shows more above the sensor's noise the longer it is kept
_BELIEVED = 6.0  # uncertainties that a number may be off beside an effect: beyond, something else is missing
_TELLING = 0.01  # of a residual's mean square foretold by inputs: below it no form is tried


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
    def strained(self) -> bool:
        """Whether it takes own parameters of the actuator three times their uncertainty off, or more."""
        return self.best.problem.own.strained(self.best.vector)

    @property
    def square(self) -> float:
        """The mean square that its effects leave."""
        return float(np.mean(self.best.weighed**2))

    @property
    def freed(self) -> bool:
        """Whether it had to be let go further than that."""
        return self.best.problem.own.far and self.strained

    @property
    def stage(self) -> str | None:
        """The one stage this segment is, None where stages are merged."""
        return self.segment.stages[0] if len(self.segment.stages) == 1 else None

    def told(self, rig: Rig) -> Rig:
        """``rig`` with what its command does between samples, where that is not as usual."""
        between = self.segment.between
        entry = self.segment.entry
        return (
            rig if entry != "command" or between == between_of(rig, entry) else replace(rig, between=between)
        )

    def kept_by(self, given: Rig, refitted: Rig) -> bool:
        """Whether the refit of its own parameters is part of the rig ``refitted``."""
        stages = self.segment.stages
        return any(
            getattr(a, stage) != getattr(b, stage)
            for a, b in ((given, refitted), (given.delays, refitted.delays))
            for stage in stages
        )


def clues_for(segment: Segment, rig: Rig) -> list[Clue]:
    """Every form that may act in this segment. In a rig of one stage every family may, but of those that
    share a formula only the one at home there. Where every experiment begins at rest, none that says where
    something lay before."""
    every = _placed_in(segment, rig)
    return every if segment.run.begins else [c for c in every if not c.form.begun]


def _placed_in(segment: Segment, rig: Rig) -> list[Clue]:
    if not is_single(rig):
        return [
            Clue(e.name, form, stage)
            for e in library().values()
            if (stage := _place(e, segment))
            for form in e.forms
            if fits_in(form, stage, rig)
        ]
    stage, found = owner(rig), {}
    for effect in sorted(library().values(), key=lambda e: e.stage != stage):
        for form in effect.forms:
            if fits_in(form, stage, rig):
                found.setdefault((form.act, form.begun), Clue(effect.name, form, stage))
    return list(found.values())


def _place(effect: Effect, segment: Segment) -> str | None:
    """Where a family is looked for: at home, or where it may be anywhere in the first stage: logs of stages
    that are merged do not tell which."""
    if effect.stage in segment.stages:
        return effect.stage
    return segment.stages[0] if effect.anywhere else None


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
    return base.foretold > _MUCH


def problem_of(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The segment's problem without effects."""
    scales = references(rig, segment, logs)
    freely = owner(rig) if owner(rig) in segment.stages else None
    load, response = (scales.levels["load"], scales.levels["response"])
    segment = replace(segment, pace=pace(rig, segment.stages, scales.clocks["response"]))
    slack = min(1.0, _OUT_OF_STEP * scales.clocks["response"] / segment.run.h)
    return Problem(segment, Own(rig, segment.stages, freely, load, response), scales, slack=slack)


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
    problem = _widened(_gauged(_held(rig, segment, logs)))
    found = _explained(rig, problem, threshold, only, trusted)
    if problem.segment.pace and not found.causes:
        segment = replace(problem.segment, pace=_KEPT * problem.segment.pace)
        kept = replace(problem, segment=segment, memory={})
        other = _explained(rig, kept, threshold, only, trusted)
        problem, found = (kept, other) if _borne_out(other, found) else (problem, found)
    if not found.strained or problem.own.far or found.left.share < LEFT:
        return found
    freed, asked = replace(problem, own=replace(problem.own, far=True), memory={}), _FREED * found.square
    beside = freed.with_clues(found.best.problem.clues)
    if beside.clues and np.mean(fit(beside, found.best.vector, Weighing(found.ar)).weighed ** 2) > asked:
        return found
    other = _explained(rig, freed, threshold, only, trusted)
    return other if other.square < asked else found


def _borne_out(kept: Explanation, usual: Explanation) -> bool:
    """Whether what a longer path shows is seen a little at the usual pace, too: what an input was measured
    wrong adds up in the path, and no force is behind it."""
    clues = kept.best.problem.clues
    if not kept.causes:
        return False
    beside, weighing = usual.nominal.problem.with_clues(clues), Weighing(usual.ar)
    return evidence(fit(beside, kept.best.vector, weighing, 12), usual.nominal) > 0.0


def _explained(
    rig: Rig, problem: Problem, threshold: float, only: Sequence[str] | None, trusted: bool
) -> Explanation:
    segment = problem.segment
    clues, guests = clues_for(segment, rig), guests_in(segment, rig)
    if only is not None:
        clues, guests, threshold = [c for c in clues if c.effect in only], [], 0.0
    segment, given, converter = problem.segment, problem.nominal(), converter_of(problem, clues)
    asked = Asked(threshold, trusted, converter, only is not None)
    rankings, clues = _grown(problem, given, clues, guests, asked)
    weighing = Weighing(rankings[-1].ar)
    best = realigned(_dropped(rankings[-1].base, weighing, threshold), weighing)
    nominal = fit(problem, rankings[0].base.vector[: len(given)], weighing)
    best, causes = doubted(best, nominal, rankings, clues, weighing)
    if converter is not None:
        best, causes = converter.beside(best, nominal, causes, weighing)
    found, (best, nominal) = best, map(settled, _between_anew(rig, best, nominal, weighing))
    segment = best.problem.segment
    causes = tuple(replace(c, rivals=tuple(_in_the_end(r, found, best) for r in c.rivals)) for c in causes)
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


def _between_anew(rig: Rig, best: Fit, nominal: Fit, weighing: Weighing) -> tuple[Fit, Fit]:
    """Both fits with the command running between its samples as suits what was found: a nominal rig far from
    what it models may be suited by another way. That has to leave much less: half a sample more or less may
    make up for a little of whatever a model lacks."""
    segment = best.problem.segment
    if rig.between is not None or segment.entry != "command" or not best.problem.clues:
        return best, nominal
    others = [replace(segment, between=way) for way in _ways(segment) if way != segment.between]
    tried = [_moved_to(best, other, weighing) for other in others]
    closest = min([best, *tried], key=lambda f: f.sse)
    if closest.sse > _FREED * best.sse:
        return best, nominal
    return closest, _moved_to(nominal, closest.problem.segment, weighing)


def _moved_to(of: Fit, segment: Segment, weighing: Weighing) -> Fit:
    """A fit made anew to another account of its segment."""
    problem = replace(of.problem, segment=segment, memory={})
    start = of.vector.copy()
    start[len(problem.own_start)] = 0.0  # the alignment made up for the wrong way
    return fit(problem, start, weighing, 8)


def _in_the_end(rival: Rival, found: Fit, best: Fit) -> Rival:
    """A rival that is what was ``found``, with what that is in the end."""
    return replace(rival, fit=best) if rival.fit is found else rival


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
        rankings.append(rank(base, vector, _worth_trying(base, vector, base.untried(clues))))
        best = chosen(rankings, asked, clues)
        if best is None and len(rankings) == 2 and (anew := begun_anew(rankings, asked, clues)):
            rankings[-1], best = anew
        if best is None and guests and _much_left(rankings[-1].base):
            clues, guests = clues + guests, []
            continue
        if best is None:
            break
        best = _widened_beside(best, asked.threshold)
        base, vector = best.problem, best.vector
    return rankings, clues


def _widened_beside(best: Fit, threshold: float) -> Fit:
    """Where a number of a stage stands at its end beside the effects found, it may pass that, if evidence
    asks for it: what no effect stands for would be mended by one that imitates it."""
    problem = best.problem
    if problem.own.wide or not problem.own.beyond(best.vector):
        return best
    wide = replace(problem, own=replace(problem.own, wide=True))
    now, then = (fit(p, best.vector, WHITE, 8) for p in (problem, wide))
    known = problem.own.precision > 0.0
    moved = np.abs(then.vector[: len(known)] - problem.own_start)[known]
    away = moved * np.sqrt(problem.own.precision[known])
    return then if evidence(then, now) > threshold and np.max(away) < _BELIEVED else best


def _held(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The problem with the command as a staircase, as a polygon or as a smooth curve, whichever the log was,
    where the rig does not say it: loggers differ."""
    ways = [segment.between] if segment.entry != "command" else _ways(segment)
    if rig.between is not None:
        ways = [rig.between]
    problems = [problem_of(rig, replace(segment, between=way), logs) for way in ways]
    if len(problems) == 1:
        return problems[0]
    *plain, last = [fit(p, p.nominal(), WHITE, 6) for p in problems]
    closest = min(plain, key=lambda f: f.sse)
    if ways[-1] == Between.SMOOTH and last.sse > _SMOOTHER * closest.sse:
        return closest.problem
    return min(closest, last, key=lambda f: f.sse).problem


def _ways(segment: Segment) -> list[Between]:
    """What a command may do between its samples."""
    rests = np.mean(np.diff(segment.x) == 0.0) > _RESTS
    return [way for way in _WAYS if not (rests and way == Between.SMOOTH)]


def _gauged(problem: Problem) -> Problem:
    """The problem with a gauge that is a little off, where that is all there is: no two agree for sure. Where
    a stage has a gain of its own, that is part of it."""
    if problem.own.has_gain or not _seems_more(problem, problem.nominal()):
        return problem
    gauged = replace(problem, gauge=_GAUGE)
    return problem if _seems_more(gauged, gauged.nominal()) else gauged


def _widened(problem: Problem) -> Problem:
    """The problem with a stage faster, or of another gain, than three times the uncertainty of what was given
    allows, and an actuator of any numbers, where that is all there is: then no effect stands for it."""
    ground = _ground(problem, problem.nominal())
    if not problem.own.beyond(ground.vector) or not _shows_more(ground):
        return problem
    wide = replace(problem, own=replace(problem.own, wide=True, far=True))
    return problem if _seems_more(wide, wide.nominal()) else wide


def _worth_trying(base: Problem, vector: np.ndarray, clues: list[Clue]) -> list[Clue]:
    """All clues where there seems to be more than noise; else none."""
    return clues if _seems_more(base, vector) else []


def _seems_more(base: Problem, vector: np.ndarray) -> bool:
    """Whether inputs foretell something of the residual, or it is slower or less steady than noise is."""
    return _shows_more(_ground(base, vector))


def _ground(base: Problem, vector: np.ndarray) -> Fit:
    return fit(base, vector, Weighing(np.ones(1), max(1, len(base.segment.y) // 5000)), 6)


def _shows_more(ground: Fit) -> bool:
    base = ground.problem
    left, response = ground.residual(), base.references.clocks["response"]
    found = disturbance(left, base.segment.run.h, response)
    kept = base.segment.pace > 0.0 and found.pushed  # an integral of what inputs do shows little of them
    return found.swings or found.hums or found.bursts or kept or ground.foretold > _TELLING


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
