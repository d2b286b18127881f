"""Whether a family leaves far less than what was found, where the logs begin in another way: one that is slow
with all earlier logs ahead, or one that stays where the log before left it. Where every log is taken to begin
at rest, these are lost to a drift. A search in earnest takes seconds, so that the numbers of each are fitted
to means of samples first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.hypotheses.explain import Explanation, begun_as, candidates_for, explain
from focgen.diagnosis.hypotheses.longer_path import at_pace
from focgen.diagnosis.hypotheses.nuisances import uncertain
from focgen.diagnosis.hypotheses.search import likeliest_on_all
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import Segment
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Effect, library
from focgen.rig.rig import Rig
from focgen.rig.session import run_of

_NEAR = 1.1  # times what is asked: where numbers of means leave so much, a search may leave less

Ahead = Sequence[tuple[Experiment, ...]]
"""A session with all earlier logs ahead of every log, by one pause between them or another."""


def families_in(e: Explanation, are: Callable[[Effect], bool]) -> list[str]:
    """The families that ``are`` of a kind, and may act in an explained segment."""
    return [n for n, family in library().items() if are(family) and family.stage in e.segment.stages]


def suits_what_is_slow(nominal: Rig, e: Explanation, ahead: Ahead) -> tuple[Experiment, ...] | None:
    """Of the sessions ``ahead``, the one by which the first slow family that leaves far less than what was
    found leaves least; None where none does. A family is searched in earnest where its likeliest form by
    itself leaves little more than what was found."""
    least: float = NUMBERS.unlikely * e.square
    for name in families_in(e, lambda f: f.slow):
        if e.best.problem.families == (name,):  # what it left in later logs is asked of what was found
            continue
        segment = e.segment.anew(run=run_of(ahead[0], e.segment.entry))
        roughly = alone(nominal, segment, ahead[0], name)
        if roughly is None or min(_left(e, roughly, ahead)) > e.square / NUMBERS.unlikely:
            continue
        found = explain(nominal, segment, ahead[0], NUMBERS.nats, [name])
        left = _left(found, _kept_as(e.segment, found.best), ahead)
        if min(left) < least:
            return ahead[int(np.argmin(left))]
    return None


def alone(nominal: Rig, segment: Segment, logs: Sequence[Experiment], name: str) -> Fit | None:
    """A family's likeliest form by itself, its numbers fitted to means of samples, on a path that is as long
    as the segment's; None where it has none here."""
    problem = uncertain(nominal, segment, logs)
    forms = [c for c in candidates_for(problem.segment, nominal) if c.effect == name]
    found = likeliest_on_all(problem, problem.nominal(), forms)
    return found and _kept_as(segment, found)


def leaves_less_beside(nominal: Rig, e: Explanation, logs: Sequence[Experiment], name: str) -> bool:
    """Whether what was found and the family ``name`` beside it, and no others, leave far less than what was
    found, where the experiments begin as in ``logs``."""
    segment, asked = e.segment.anew(run=run_of(logs, e.segment.entry)), NUMBERS.unlikely * e.square
    roughly = begun_as(e, e.best, logs)
    if name not in roughly.problem.families:
        forms = roughly.problem.untried([c for c in candidates_for(segment, nominal) if c.effect == name])
        roughly = likeliest_on_all(roughly.problem, roughly.vector, forms) or roughly
    if np.mean(roughly.weighed**2) > _NEAR * asked:
        return False
    families = sorted({*e.best.problem.families, name})
    found = explain(nominal, segment, logs, NUMBERS.nats, families)
    return bool(np.mean(_kept_as(e.segment, found.best).weighed ** 2) < asked)


def _kept_as(segment: Segment, of: Fit) -> Fit:
    """A fit on a path as long as the segment's."""
    return of if of.problem.segment.pace == segment.pace else at_pace(of, segment.pace)


def _left(e: Explanation, fit: Fit, ahead: Ahead) -> list[float]:
    """The mean squares that a fit for the first of the sessions ``ahead`` leaves, made anew for each."""
    fits = (fit if logs is ahead[0] else begun_as(e, fit, logs) for logs in ahead)
    squares = (float(np.mean(of.weighed**2)) for of in fits)
    return [square if np.isfinite(square) else np.inf for square in squares]
