"""Effects added to a segment one by one while the data ask for them, then each re-examined."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, Known, Weighing, fit, known_at
from focgen.diagnosis.fitting.integrating import settled
from focgen.diagnosis.fitting.predictability import Predictability, predictability
from focgen.diagnosis.fitting.realign import realigned
from focgen.diagnosis.hypotheses.accept import AcceptanceCriteria, select
from focgen.diagnosis.hypotheses.anew import looked_anew
from focgen.diagnosis.hypotheses.between_samples import between_anew, in_the_end, moved_to
from focgen.diagnosis.hypotheses.converter import Converter, converter_of
from focgen.diagnosis.hypotheses.foretelling import foretelling
from focgen.diagnosis.hypotheses.left import remembers, unleft
from focgen.diagnosis.hypotheses.longer_path import borne_out, may_show_more, times_as_long
from focgen.diagnosis.hypotheses.nuisances import lead_of, may_be_more, uncertain
from focgen.diagnosis.hypotheses.order import in_their_order
from focgen.diagnosis.hypotheses.rivals import Beside, Cause, Examined, lack_of, left_out, reexamined
from focgen.diagnosis.hypotheses.search import Ranking, evidence, rank
from focgen.diagnosis.hypotheses.seen_through import with_steps
from focgen.diagnosis.hypotheses.two import TwoOthers, two_at_once, two_others
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.candidates import CandidateEffect
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import Segment, is_single, owner
from focgen.diagnosis.problem.smooth import Strays
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.present import present
from focgen.rig.changeable import fits_in
from focgen.rig.effects import Effect, library
from focgen.rig.engine import between_of
from focgen.rig.placed import slot_in
from focgen.rig.rig import Actuator, Rig
from focgen.rig.session import run_of

_DEPTH = 4
_BELIEVED = 6.0  # uncertainties that a number may be off beside an effect: beyond, something else is missing


@dataclass(frozen=True, eq=False)
class Explanation:
    """A segment explained. ``nominal``: its nominal parameters refitted; ``best``: with the effects. Each has
    a ``predictability`` of its residual from the inputs. ``errors``: by family, the root-mean-square
    residual with that effect alone, as a share of the refitted nominal's; ``beside``: the same of one more
    beside those found, as a share of what they leave; ``converter``: the coarse one;
    ``whole``: what this is the part of that is not in question, or no effect at all; ``pairs``: makes the
    ``others``, once, which takes as long as the rest: of most explanations nobody asks for them.
    """

    segment: Segment
    given: np.ndarray
    nominal: Fit
    best: Fit
    ar: np.ndarray
    causes: tuple[Cause, ...]
    predictability: Predictability
    nominal_predictability: Predictability
    errors: dict[str, float]
    beside: dict[str, float] = field(default_factory=dict)
    converter: Converter | None = None
    whole: Explanation | None = None
    pairs: Callable[[], tuple[TwoOthers, ...]] = tuple

    @property
    def others(self) -> tuple[TwoOthers, ...]:
        """Two effects each that may be there instead of the one found."""
        return self.pairs()

    @property
    def strained(self) -> bool:
        """Whether it takes nominal parameters of the actuator three times their uncertainty off, or more."""
        return self.best.problem.nominals.strained(self.best.vector)

    @property
    def square(self) -> float:
        """The mean square that its effects leave."""
        return float(np.mean(self.best.weighed**2))

    @property
    def amiss(self) -> float:
        """The part of what it leaves that inputs predict, beyond what the nominal form is off by."""
        return max(0.0, self.predictability.share - min(1.0, lack_of(self.best)) ** 2)

    @property
    def zero(self) -> float:
        """By what its readings' zero is off, in the log's unit, where that is more than the noise; else 0."""
        off, noise = self.best.problem.zero(self.best.vector), self.segment.level_out * self.square**0.5
        return off if abs(off) > noise else 0.0

    @property
    def stage(self) -> str | None:
        """The one stage this segment is, None where stages are merged."""
        return self.segment.stages[0] if len(self.segment.stages) == 1 else None

    def of_logs(self, rig: Rig, first: str) -> Rig:
        """``rig`` with what its ``first`` input does between samples, where that is not as usual, and with as
        much as a command is ahead of its rows."""
        between, entry = self.segment.between, self.segment.entry
        if entry != first:
            return rig
        rig = rig if between == between_of(rig, first) else replace(rig, between=Between(between))
        return replace(rig, lead=lead_of(self.best) if between == Between.HELD else 0.0)

    def kept_by(self, given: Rig, refitted: Rig) -> bool:
        """Whether the refit of its nominal parameters is part of the rig ``refitted``."""
        stages = self.segment.stages
        return any(
            getattr(a, stage) != getattr(b, stage)
            for a, b in ((given, refitted), (given.delays, refitted.delays))
            for stage in stages
        )


def candidates_for(segment: Segment, rig: Rig) -> list[CandidateEffect]:
    """Every form that may act in this segment. In a rig of one stage every family may, but of those that
    share a formula and its place, or a linear one, only the one at home there; where the gain is bent, ahead
    of it is another place than behind. Where every experiment begins at rest, none that says where something
    lay before; where the input goes one way, none that asks for both."""
    every = [c for c in _placed_in(segment, rig) if segment.both_ways or not c.form.both_ways]
    return every if segment.run.begins else [c for c in every if not c.form.begun]


def _is_whole(segment: Segment, rig: Rig) -> bool:
    """Whether this is the one stage that a rig is given as. A gauge that is logged beside it has a segment of
    its own, which the rig takes for 1: what is there at fault is at home there."""
    return is_single(rig) and owner(rig) in segment.stages


def _placed_in(segment: Segment, rig: Rig) -> list[CandidateEffect]:
    if not _is_whole(segment, rig):
        return [
            CandidateEffect(e.name, form, stage)
            for e in library().values()
            if (stage := _place(e, segment))
            for form in e.forms
            if fits_in(form, stage, rig)
        ]
    stage, bent = present(owner(rig)), isinstance(rig.actuator, Actuator) and any(rig.actuator.gain[1:])
    found: dict[Hashable, CandidateEffect] = {}
    for effect in sorted(library().values(), key=lambda e: e.stage != stage):
        for form in effect.forms:
            if fits_in(form, stage, rig):
                anywhere = form.response and not (form.leads and bent)
                slot = None if anywhere else slot_in(form, stage)
                alike = (form.act, form.begun, form.rarer, slot)
                found.setdefault(alike, CandidateEffect(effect.name, form, stage))
    return list(found.values())


def _place(effect: Effect, segment: Segment) -> str | None:
    """Where a family is looked for: at home, or a dead time in the first stage, for logs of stages that are
    merged do not tell which has it."""
    if effect.stage in segment.stages:
        return effect.stage
    return segment.stages[0] if effect.delays else None


def guests_in(segment: Segment, rig: Rig) -> list[CandidateEffect]:
    """Forms that are at home in another stage and may sit in this one: tried where those at home leave
    much. What acts behind the dynamics of its own stage is not among them: it would be the gauge's."""
    if _is_whole(segment, rig):
        return []
    return [
        CandidateEffect(e.name, form, stage)
        for e in library().values()
        for stage in e.also
        if stage in segment.stages and e.stage not in segment.stages
        for form in e.forms
        if fits_in(form, stage, rig) and not form.rarer and (segment.both_ways or not form.both_ways)
    ]


def _much_left(base: Fit) -> bool:
    """Whether inputs predict most of what is left."""
    return base.predictable_share > NUMBERS.much


def explain(
    rig: Rig,
    segment: Segment,
    logs: Sequence[Experiment],
    threshold: float,
    only: Sequence[str] | None = None,
    unsure: Strays | None = None,
) -> Explanation:
    """Find the segment's effects; ``threshold``: nats of evidence that noise alone does not reach.

    ``only``: the effects to consider, of which each that finds anything to mend is taken; ``unsure``:
    what the input may be off by, where it is not as logged.
    """
    problem = uncertain(rig, segment, logs)
    found = _explained(rig, problem, threshold, only, unsure)
    for times in times_as_long(rig, problem.segment):
        path = replace(problem.segment, pace=times * problem.segment.pace)
        kept = replace(problem, segment=path, memory={})
        if not may_show_more(found.best, kept, only):
            continue
        other = _explained(rig, kept, threshold, only, unsure)
        if borne_out(other.best, found.best, found.nominal.problem, Weighing(found.ar)):
            problem, found = kept, other
            break
    if not found.strained or problem.nominals.far or found.amiss < NUMBERS.left:
        return found
    freed, asked = (
        replace(problem, nominals=replace(problem.nominals, far=True), memory={}),
        NUMBERS.unlikely * found.square,
    )
    beside = freed.with_candidates(found.best.problem.candidates)
    if beside.candidates and np.mean(fit(beside, found.best.vector, Weighing(found.ar)).weighed ** 2) > asked:
        return found
    other = _explained(rig, freed, threshold, only, unsure)
    return other if other.square < asked else found


def _explained(
    rig: Rig, problem: Problem, threshold: float, only: Sequence[str] | None, unsure: Strays | None
) -> Explanation:
    candidates, guests = candidates_for(problem.segment, rig), guests_in(problem.segment, rig)
    if only is not None:
        candidates, guests, threshold = [c for c in candidates if c.effect in only], [], 0.0
    given, converter = problem.nominal(), converter_of(problem, candidates)
    withheld, granted = problem.segment.withheld, only is not None
    asked = AcceptanceCriteria(threshold, unsure, converter, withheld, granted)
    rankings, candidates = _grown([], problem, given, candidates, guests, asked)
    rankings = _or_two(rankings, candidates, asked)
    known = [f for r in rankings for f in (r.base, *r.best.values())]
    best, weighing = _sifted(rankings[-1], asked, known)
    pairs = partial(two_others, best, rankings[0], candidates, weighing, asked)
    nominal = fit(problem, rankings[0].base.vector[: len(given)], weighing)
    errors, every = rankings[0].errors, rankings
    if remembers(best) and not asked.granted and (seen := unleft(best)) is not None:
        best, nominal = (moved_to(f, seen, weighing) for f in (best, nominal))
        best, rankings = _dropped(best, weighing, threshold, known), []
    beside = Beside(nominal, rankings, candidates, weighing, asked.surroundings, asked.granted, known)
    examined = reexamined(best, beside)
    best, causes = examined.best, examined.causes
    if converter is not None:
        best, causes = with_steps(converter, best, causes, beside, asked)
    found, (best, nominal) = best, map(settled, between_anew(rig, best, nominal, weighing))
    segment = best.problem.segment
    causes = tuple(replace(c, rivals=in_the_end(c.rivals, found, best, weighing)) for c in causes)
    response = problem.references.clocks["response"]
    made = Explanation(
        segment,
        given,
        nominal,
        best,
        weighing.ar,
        causes,
        predictability(segment, best.weighed, response),
        predictability(segment, nominal.weighed, response),
        errors,
        _beside(best, every),
        converter,
        pairs=tuple if granted else cache(pairs),
    )
    return _off_by_itself(made, examined.off)


def _beside(best: Fit, rankings: Sequence[Ranking]) -> dict[str, float]:
    """The error with one more effect beside those of ``best``, by family, as a share of what they leave."""
    families = best.problem.families
    alike = [r for r in rankings if set(r.base.problem.families) == set(families)]
    return {n: e for n, e in alike[-1].errors.items() if n not in families} if alike and families else {}


def _off_by_itself(e: Explanation, off: Examined | None) -> Explanation:
    """An explanation without effects, as the part of that with one more that is not in question: the nominal
    chain is off by what it changes, and what inputs predict of that is explained."""
    if off is None or e.causes:
        return e
    response = e.nominal.problem.references.clocks["response"]
    with_it = predictability(e.segment, off.best.weighed, response)
    return replace(e, whole=replace(e, best=off.best, causes=off.causes, predictability=with_it))


def begun_as(of: Explanation, fit: Fit, logs: Sequence[Experiment], known: Known | None = None) -> Fit:
    """A fit of an explained segment, made anew where its experiments begin as in ``logs``; ``known``: its
    Jacobian, taken as it was, for many sessions to be compared by."""
    segment = fit.problem.segment.anew(run=run_of(logs, of.segment.entry))
    return moved_to(fit, segment, Weighing(of.ar), known)


def gained(of: Explanation, logs: Sequence[Experiment], known: Known | None = None) -> float:
    """Nats that an explanation gains, its numbers fitted anew, where its experiments begin as in ``logs``;
    ``known``: as of :func:`begun_as`."""
    return evidence(begun_as(of, of.best, logs, known), of.best)


def as_it_was(of: Explanation) -> Known:
    """The Jacobian of what was found."""
    _, known = known_at(of.best.problem, of.best.vector, Weighing(of.ar))
    return known


def remembering(of: Explanation) -> Explanation | None:
    """An explanation with those of its effects alone that stay where the last experiment left them; None
    where there are none."""
    others = [c for c in of.best.problem.candidates if not (c.family and c.family.remembers)]
    if len(others) == len(of.best.problem.candidates):
        return None
    best = left_out(of.best, others, Weighing(of.ar)) if others else of.best
    return replace(of, best=best)


def _or_two(
    rankings: list[Ranking], candidates: list[CandidateEffect], asked: AcceptanceCriteria
) -> list[Ranking]:
    """The rankings of what was found one by one, or of two effects at once and what follows them."""
    if asked.granted or not _much_left(rankings[:2][-1].base):
        return rankings
    pair = two_at_once(rankings, candidates, asked)
    if pair is None:
        return rankings
    ahead, both = pair
    return _grown(ahead, both.problem, both.vector, candidates, [], asked)[0]


def _grown(
    rankings: list[Ranking],
    base: Problem,
    vector: np.ndarray,
    candidates: list[CandidateEffect],
    guests: list[CandidateEffect],
    asked: AcceptanceCriteria,
) -> tuple[list[Ranking], list[CandidateEffect]]:
    """The ``rankings`` that led to ``base``, and one more for each further effect that the data ask for, the
    last one being of what is left; and the candidate effects that were tried.
    """
    while len(rankings) < _DEPTH:
        ranking = rank(base, vector, _worth_trying(base, vector, base.untried(candidates)))
        first = rankings[0].base if rankings else ranking.base
        rankings.append(looked_anew(first, ranking, candidates, asked.surroundings))
        best = select(rankings, asked)
        if best is None and guests and _much_left(rankings[-1].base):
            candidates, guests = candidates + guests, []
            continue
        if best is None:
            break
        best = _widened_beside(in_their_order(best), asked.threshold)
        base, vector = best.problem, best.vector
    return rankings, candidates


def _widened_beside(best: Fit, threshold: float) -> Fit:
    """Where a number of a stage stands at its end beside the effects found, it may pass that, if evidence
    asks for it: what no effect stands for would be mended by one that imitates it."""
    problem = best.problem
    if problem.nominals.wide or not problem.nominals.beyond(best.vector):
        return best
    wide = replace(problem, nominals=replace(problem.nominals, wide=True))
    now, then = (fit(p, best.vector, WHITE, 8) for p in (problem, wide))
    known = problem.nominals.precision > 0.0
    moved = np.abs(then.vector[: len(known)] - problem.nominal_start)[known]
    away = moved * np.sqrt(problem.nominals.precision[known])
    return then if evidence(then, now) > threshold and np.max(away, initial=0.0) < _BELIEVED else best


def _worth_trying(
    base: Problem, vector: np.ndarray, candidates: list[CandidateEffect]
) -> list[CandidateEffect]:
    """All candidate effects where there seems to be more than noise; else none."""
    return candidates if may_be_more(base, vector) else []


def _sifted(last: Ranking, asked: AcceptanceCriteria, known: Sequence[Fit]) -> tuple[Fit, Weighing]:
    """What was found, without what turns out needless or vain, and how it is judged: in the colour of the
    noise, but not in that of what is left by an effect that is not there, where inputs predict much without
    it; and in none where they predict much of what all of them leave."""

    def sifted(weighing: Weighing) -> Fit:
        best = _dropped(last.base, weighing, asked.threshold, known)
        return realigned(best if asked.granted else foretelling(best, weighing, known), weighing)

    if _much_left(last.base):
        return sifted(WHITE), WHITE
    best, weighing = sifted(Weighing(last.ar)), Weighing(last.ar)
    fewer = len(best.problem.candidates) < len(last.base.problem.candidates)
    return (sifted(WHITE), WHITE) if fewer and _much_left(best) else (best, weighing)


def _dropped(best: Fit, weighing: Weighing, threshold: float, known: Sequence[Fit] = ()) -> Fit:
    """Without the effects that the later ones made needless."""
    while len(best.problem.candidates) > 1:
        found = []
        for candidate in best.problem.candidates:
            without = left_out(best, [candidate], weighing, known)
            found.append((evidence(best, without), without))
        least, without = min(found, key=lambda pair: pair[0])
        if least > threshold:
            break
        best = without
    return fit(best.problem, best.vector, weighing, 6)
