"""What is uncertain of every log: what the command does between samples, the zero and the gain of a gauge,
numbers farther from those given than their uncertainty.

Each is let go only where that is all there is: an effect is looked for in the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, Weighing, fit
from focgen.diagnosis.fitting.integrating import pace
from focgen.diagnosis.fitting.predictability import even_share
from focgen.diagnosis.hypotheses.disturbance import disturbance
from focgen.diagnosis.hypotheses.level_pace import level_pace
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.nominal_parameters import NominalParameters
from focgen.diagnosis.problem.problem import ZERO, Problem
from focgen.diagnosis.problem.scales import references
from focgen.diagnosis.problem.segments import Segment, owner
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.ahead import told_lead
from focgen.rig.rig import Rig
from focgen.rig.session import entry_of

# of the rig's response: what columns may be out of step by; more is a delay. A whole sample is the most, and
# half of one where an input jumps, for a loop may read before it writes, the least. A row may have a command
# and what was read later: no rig does that, so by two samples the output of a staircase may be early
_OUT_OF_STEP, _HALF, _AHEAD = 0.05, 0.5, 2
_STEP = 0.05  # samples: less out of step is what a fit may take up of anything
_GAUGE = 0.01  # of its reading: by what a gauge may be off without being a fault
_WAYS = (Between.HELD, Between.STRAIGHT, Between.SMOOTH)  # of a command between its samples
_SMOOTHER = 0.95  # of the mean square that lines leave: a smooth curve, which takes longer, has to leave less
_RESTS = 0.5  # of an input's samples at which it rests: then it is no smooth curve


def uncertain(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The segment's problem without effects, with all that explains a log without one let go."""
    return _widened(_gauged(_zeroed(_paced(_about_zero(_held(rig, segment, logs))))))


def problem_of(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The segment's problem without effects."""
    scales = references(rig, segment, logs)
    freely = owner(rig) if owner(rig) in segment.stages else None
    load, response = (scales.levels["load"], scales.levels["response"])
    segment = replace(segment, pace=pace(rig, segment.stages, scales.clocks["response"]))
    least = _HALF if any(map(_jumps, segment.fed.parts(segment.fed.x))) else 0.0
    slack = float(np.clip(_OUT_OF_STEP * scales.clocks["response"] / segment.fed.run.h, least, 1.0))
    stair = least and segment.entry == "command" and segment.between == Between.HELD
    lead = float(_AHEAD) if stair and slack < 1.0 else slack
    own = NominalParameters(rig, segment.stages, freely, load, response)
    return Problem(segment, own, scales, slack=slack, lead=lead)


def _held(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Problem:
    """The problem with the input as a staircase, as a polygon or as a smooth curve, whichever the log was,
    where the rig does not say it: loggers differ."""
    given = rig.between if segment.entry == entry_of(logs) else None
    tried = ways(segment) if given is None else [given]
    problems = [problem_of(rig, segment.anew(between=way), logs) for way in tried]
    if len(problems) == 1:
        return problems[0]
    fits = [fit(p, p.nominal(), WHITE, 6) for p in problems]
    stair = any(p.is_staircase for p in problems)
    if (segment.answers or stair) and (held := _kept_held(fits)):
        return held.problem
    *plain, last = fits
    closest = min(plain, key=lambda f: f.sse)
    enough = _SMOOTHER if tried[-1] == Between.SMOOTH else _by_chance(segment)
    if tried[-1] != Between.STRAIGHT and last.sse > enough * closest.sse:
        return closest.problem
    return min(closest, last, key=lambda f: f.sse).problem


def _kept_held(fits: Sequence[Fit]) -> Fit | None:
    """The fit to a held input, unless another leaves far less: what a controller makes of a reading cannot
    have moved there ahead of it, nor does what rests between jumps run in lines, whatever is at fault."""
    held = next((f for f in fits if f.problem.segment.between == Between.HELD), None)
    if held is None or min(f.sse for f in fits) < NUMBERS.unlikely * held.sse:
        return None
    return held


def _by_chance(segment: Segment) -> float:
    """Of its mean square what a way of as many numbers leaves at least, where another one is right."""
    return float(np.exp(-2.0 * NUMBERS.nats / len(segment.y)))


def _about_zero(problem: Problem) -> Problem:
    """The problem with the zero of its readings free where that leaves far less; beside effects no further
    than it is without any, and a little: a curve behind a zero of its own would be any transient. What adds
    up stood somewhere, which no zero tells it from."""
    if problem.nominals.has_offset or problem.segment.pace:
        return problem
    free = replace(problem, zero_within=(-1.0, 1.0))
    found, little = (_ground(p, p.nominal()) for p in (free, problem))
    if found.sse > NUMBERS.unlikely * little.sse:
        return problem
    zero = found.vector[len(problem.nominal_start) + 1]
    return replace(problem, zero_within=(min(zero, 0.0) - ZERO, max(zero, 0.0) + ZERO))


def lead_of(best: Fit) -> float:
    """By how many s the command is ahead of its rows: as the rig says, unless a fit has clearly another lead
    that is none of the ends of where it is looked for."""
    problem, place, step = best.problem, len(best.problem.nominal_start), best.problem.segment.fed.run.h
    given, found = problem.nominals.rig.lead, problem.rig_of_logs(best.vector).lead
    inside = all(abs(best.vector[place] - end[place]) > _STEP for end in problem.bounds())
    return told_lead(found) if inside and abs(found - given) > _STEP * step else given


def ways(segment: Segment) -> list[Between]:
    """What an input may do between its samples. What is measured runs in lines, but that it may be held where
    it only jumps and rests, if that leaves less."""
    if segment.entry != "command":
        return [Between.STRAIGHT, Between.HELD][: 1 + any(map(_jumps, segment.fed.parts(segment.fed.x)))]
    rests = np.mean(np.diff(segment.fed.x) == 0.0) > _RESTS
    return [way for way in _WAYS if not (rests and way == Between.SMOOTH)]


def _jumps(x: np.ndarray) -> bool:
    """Whether an input (n,) rests but for jumps."""
    return bool(np.mean(np.diff(x) == 0.0) > _RESTS and np.ptp(x) > 0.0)


def _zeroed(problem: Problem) -> Problem:
    """The problem with a zero of the readings for each experiment, where that is all there is: a gauge is
    zeroed anew, or its room is warmer. Where errors add up, a zero is lost among them."""
    if problem.segment.pace or len(problem.segment.run.spans) < 2:
        return problem
    return _where_all(problem, replace(problem, uneven=True, memory={}))


def _paced(problem: Problem) -> Problem:
    """The problem with a pace that depends on the level, as much as the pace itself may be off, where that is
    all there is. Where errors add up there is no pace."""
    column = None if problem.segment.pace else level_pace(problem.nominals.rig, problem.segment.fed)
    if column is None:
        return problem
    segment = problem.segment
    segment = segment.anew(loose=np.column_stack([segment.fed.loose, column]), paced=True)
    return _where_all(problem, replace(problem, segment=segment, memory={}))


def _gauged(problem: Problem) -> Problem:
    """The problem with a gauge that is a little off, where that is all there is: no two agree for sure. Where
    a stage has a gain of its own, that is part of it."""
    return problem if problem.nominals.has_gain else _where_all(problem, replace(problem, gauge=_GAUGE))


def _where_all(problem: Problem, more: Problem) -> Problem:
    """``problem``, or ``more``, which has further nuisances, where these explain all that there is."""
    if not seems_more(problem, problem.nominal()):
        return problem
    return problem if seems_more(more, more.nominal()) else more


def _widened(problem: Problem) -> Problem:
    """The problem with a stage faster, or of another gain, than three times the uncertainty of what was given
    allows, and an actuator of any numbers, where that is all there is: then no effect stands for it."""
    ground = _ground(problem, problem.nominal())
    if not problem.nominals.beyond(ground.vector) or not _shows_more(ground):
        return problem
    wide = replace(problem, nominals=replace(problem.nominals, wide=True, far=True))
    return problem if seems_more(wide, wide.nominal()) else wide


def seems_more(base: Problem, vector: np.ndarray) -> bool:
    """Whether inputs predict something of the residual, or it is slower or less steady than noise is."""
    return _shows_more(_ground(base, vector))


def may_be_more(base: Problem, vector: np.ndarray) -> bool:
    """The same, or they predict something of most stretches: then effects are tried."""
    ground = _ground(base, vector)
    response = base.references.clocks["response"]
    return _shows_more(ground) or even_share(base.segment, ground.weighed, response) > NUMBERS.chance


def _ground(base: Problem, vector: np.ndarray) -> Fit:
    return _fitted(base, vector.tobytes())


@lru_cache(maxsize=4)
def _fitted(base: Problem, start: bytes) -> Fit:
    """Every nuisance asks for the same fit first."""
    weighing = Weighing(np.ones(1), max(1, len(base.segment.y) // 5000))
    return fit(base, np.frombuffer(start), weighing, 6)


@lru_cache(maxsize=4)
def _shows_more(ground: Fit) -> bool:
    base = ground.problem
    left, response = ground.residual(), base.references.clocks["response"]
    found = disturbance(left, base.segment.run.h, response)
    kept = base.segment.pace > 0.0 and found.pushed  # an integral of what inputs do shows little of them
    return (
        found.low_frequency
        or found.tonal
        or found.bursts
        or kept
        or ground.predictable_share > NUMBERS.chance
    )
