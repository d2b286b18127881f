"""What is found of a session: its segments explained, anew where that tells how its logs begin, what lasts
from one to the next, or which signal hides another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice, pairwise

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.fitting.predictability import predicted
from focgen.diagnosis.hypotheses.bootstrap import threshold as bootstrapped
from focgen.diagnosis.hypotheses.explain import (
    Explanation,
    as_it_was,
    begun_as,
    candidates_for,
    explain,
    gained,
    remembering,
)
from focgen.diagnosis.hypotheses.initial import (
    begun_as_fitted,
    begun_with,
    held_as_fitted,
    loosened,
    rested_long,
)
from focgen.diagnosis.hypotheses.input_covariance import input_covariance
from focgen.diagnosis.hypotheses.longer_path import at_pace
from focgen.diagnosis.hypotheses.roughly import alone, families_in, leaves_less_beside, suits_what_is_slow
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.segments import cuts, make
from focgen.diagnosis.problem.smooth import freed, is_explained, slow_rest, strays
from focgen.diagnosis.problem.within import bent_within
from focgen.diagnosis.verdict import compose
from focgen.diagnosis.verdict.at_the_output import seen_at_the_output
from focgen.diagnosis.verdict.in_between import gives_up, hiding, leaves_far_less, tell_the_same, without
from focgen.diagnosis.verdict.unexplained import is_noise, is_unknown
from focgen.logs.experiment import Experiment
from focgen.progress import step
from focgen.rig.recalled import all_ahead
from focgen.rig.rig import Rig
from focgen.rig.session import entry_of

_RIVALS = 3  # of what was found that may tell how the logs begin
_CARRIED = 2  # times that findings are made anew with what they left in later experiments


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found of a ``session``: its ``explanations``, and the ``rigs`` that they amount to; the
    ``nominal`` rig with what its command does between samples."""

    nominal: Rig
    explanations: tuple[Explanation, ...]
    rigs: compose.Rigs
    session: tuple[Experiment, ...]


def found_in(
    nominal: Rig, session: tuple[Experiment, ...], only: Sequence[str] | None, bootstrap: int
) -> Findings:
    """What is found of a session, begun in whatever way the rig tells best. ``only``, ``bootstrap``: as
    :func:`~focgen.diagnosis.diagnose.diagnose` takes them."""
    explanations = explain_all(nominal, session, NUMBERS.nats, only, bootstrap)
    nominal = explanations[0].of_logs(nominal, entry_of(session))
    search = _Search(nominal, only, bootstrap)
    explanations, session = _rested(search, explanations, session)
    explanations, session = _slow(search, explanations, session)
    explanations, session = _told_by_another(search, explanations, session)
    explanations, session = _lasting(search, explanations, session)
    session = _as_fitted(nominal, explanations, session)
    rigs = compose.compose(nominal, explanations, held_as_fitted(explanations[0].best, session))
    return Findings(nominal, *_carried_on(search, explanations, rigs, session))


def _as_fitted(
    nominal: Rig, explanations: Sequence[Explanation], session: tuple[Experiment, ...]
) -> tuple[Experiment, ...]:
    """The session with its begins as the fits have them, where the whole chain comes closer so: a few levels,
    told by first samples, are the simplest past and no more."""
    fitted = session
    for e in explanations:
        fitted = begun_as_fitted(e.best, fitted)
    if all(a is b for a, b in zip(fitted, session)):
        return session

    def left(logs: tuple[Experiment, ...]) -> float:
        rigs = compose.compose(nominal, explanations, logs)
        return compose.gap(rigs.fitted, rigs.placed, logs)

    return fitted if left(fitted) < left(session) else session


def unhidden(found: Findings, session: tuple[Experiment, ...], bootstrap: int) -> Findings:
    """What is found, made anew without a signal in between whose noise hides what the output shows, where
    that leaves far less of the output, and gives up nothing that the signal itself shows."""
    for role in hiding(found.rigs, found.session, found.explanations):
        step(f"without the {role}")
        bare = found_in(found.nominal, without(session, role), None, bootstrap)
        closer = leaves_far_less(bare.rigs, bare.session, found.rigs, found.session)
        each = bare.explanations, found.explanations
        more = not (tell_the_same(*each) or gives_up(*each, role))
        if closer and more and not any(map(is_unknown, bare.explanations)):
            return bare
    return found


def where_it_is_seen(
    nominal: Rig,
    explanations: tuple[Explanation, ...],
    rigs: compose.Rigs,
    session: tuple[Experiment, ...],
) -> tuple[tuple[Explanation, ...], compose.Rigs]:
    """The findings with what they change where it is seen best, and the rigs with those that are back."""
    seen = seen_at_the_output(nominal, session, explanations)
    back = any(a.best is not b.best for a, b in zip(seen, explanations, strict=True))
    return seen, compose.compose(nominal, seen, session) if back else rigs


@dataclass(frozen=True)
class _Search:
    """What every search of a session has in common: the rig, the effects to consider, and how many sessions
    are simulated for a threshold."""

    nominal: Rig
    only: Sequence[str] | None
    bootstrap: int

    def better(
        self, explanations: Sequence[Explanation], session: Sequence[Experiment]
    ) -> tuple[Explanation, ...] | None:
        """The findings of the session as it is now, where they leave less than those so far."""
        again = explain_all(self.nominal, session, NUMBERS.nats, self.only, self.bootstrap)
        return again if _left_by(again, explanations) < _left_by(explanations, again) else None


def _rested(
    search: _Search, explanations: tuple[Explanation, ...], session: tuple[Experiment, ...]
) -> tuple[tuple[Explanation, ...], tuple[Experiment, ...]]:
    """The findings and the session, made anew as if the rig had rested for long ahead of every log, where no
    clock says for how long and that suits what was found better: without an effect, a zero that drifts looks
    like a rest that was too short."""
    rested, found = rested_long(session), search.only is None and any(e.causes for e in explanations)
    if not (found and _begin_elsewise(rested, session)) or _nats_gained(explanations, rested) < NUMBERS.nats:
        return explanations, session
    step("a long rest ahead of every log")
    again = search.better(explanations, rested)
    return (again, rested) if again else (explanations, session)


def _slow(
    search: _Search, explanations: tuple[Explanation, ...], session: tuple[Experiment, ...]
) -> tuple[tuple[Explanation, ...], tuple[Experiment, ...]]:
    """The findings and the session, made anew with all earlier logs ahead where what is slow leaves far less
    by these than what was found: where every log is taken to begin at rest it is lost to a drift."""
    ahead = [logs for logs in all_ahead(search.nominal, session) if _begin_elsewise(logs, session)]
    if search.only is not None or not ahead:
        return explanations, session
    for e in explanations:
        if not e.causes and e.amiss <= NUMBERS.left:
            continue
        if (logs := suits_what_is_slow(search.nominal, e, ahead)) is not None:
            step("what is slow, from log to log")
            again = search.better(explanations, logs)
            return (again, logs) if again else (explanations, session)
    return explanations, session


def _told_by_another(
    search: _Search, explanations: tuple[Explanation, ...], session: tuple[Experiment, ...]
) -> tuple[tuple[Explanation, ...], tuple[Experiment, ...]]:
    """The findings and the session, made anew with the begins that a rival tells, or with what carries on in
    it from one log to the next, where it leaves far less by these than what was found does by its own. The
    pasts were told without any effect, and such a past misleads one that remembers. Where it leaves but a
    little less, its begins are those that suit it."""
    estimated = any(not b.known for log in session for b in log.begins.values())
    if search.only is not None or not (estimated or len(session) > 1):
        return explanations, session
    for number in range(len(explanations)):
        e = explanations[number]
        others = list(_others(search.nominal, e, session))
        own = next(_told_by(search.nominal, explanations, number, e.best, session)) if others else ()
        told = [(e.best, own)] if others else []
        for fit in others:
            told += [(fit, logs) for logs in _told_by(search.nominal, explanations, number, fit, session)]
        left = [np.mean(begun_as(e, fit, logs).weighed ** 2) for fit, logs in told]
        if left and min(left) < NUMBERS.unlikely * left[0]:
            step("how the logs begin")
            logs = told[int(np.argmin(left))][1]
            again = search.better(explanations, logs)
            explanations, session = (again, logs) if again else (explanations, session)
    return explanations, session


def _others(nominal: Rig, e: Explanation, session: Sequence[Experiment]) -> Iterator[Fit]:
    """The first rivals of what was found, and where inputs predict much of what that leaves the families that
    leave least by themselves, however far behind."""
    known = {rival.effect: rival.fit for cause in e.causes[:1] for rival in cause.rivals[:_RIVALS]}
    yield from list(known.values())[1:]
    if e.amiss > NUMBERS.left:
        others = sorted((name for name in e.errors if name not in known), key=lambda name: e.errors[name])
        fits = (alone(nominal, e.segment, session, name) for name in others)
        yield from islice((fit for fit in fits if fit is not None), _RIVALS)


def _told_by(
    nominal: Rig,
    explanations: Sequence[Explanation],
    number: int,
    of: Fit,
    session: Sequence[Experiment],
) -> Iterator[tuple[Experiment, ...]]:
    """The session as the rig tells it that is explained, but for one segment by another fit: with its begins,
    and with what carries on in it."""
    others = [replace(e, best=of) if k == number else e for k, e in enumerate(explanations)]
    rigs = compose.compose(nominal, others, session)
    yield begun_with(rigs.fitted, rigs.placed, session)
    yield _carried(rigs, others, session)


def _lasting(
    search: _Search, explanations: tuple[Explanation, ...], session: tuple[Experiment, ...]
) -> tuple[tuple[Explanation, ...], tuple[Experiment, ...]]:
    """The findings and the session, made anew where a loop or a play lies, as a log begins, where the one
    before left it. A refit of what remembers, without what it was found beside, shows first whether that is
    worth a search: a drift makes up for it. So does what remembers beside what was found instead."""
    if len(session) < 2:
        return explanations, session
    lasting = tuple(replace(log, lasts=True) for log in session)
    gain = sum(gained(bare, lasting) for e in explanations if (bare := remembering(e)))
    if gain < NUMBERS.nats and not any(_remembers(search, e, lasting) for e in explanations):
        return explanations, session
    step("what is left where the last log ended")
    again = search.better(explanations, lasting)
    return (again, lasting) if again else (explanations, session)


def _remembers(search: _Search, e: Explanation, lasting: Sequence[Experiment]) -> bool:
    """Whether what was found leaves far more than it does with a family beside it that lies where the log
    before left it. Where every loop is taken to begin anew, a drift or a curve stands in its place."""
    wanders = any(candidate.form.wanders for candidate in e.best.problem.candidates)
    if search.only is not None or not (wanders or e.amiss > NUMBERS.left):
        return False
    others = families_in(e, lambda f: f.remembers)
    return any(leaves_less_beside(search.nominal, e, lasting, name) for name in others)


def _carried_on(
    search: _Search,
    explanations: tuple[Explanation, ...],
    rigs: compose.Rigs,
    session: tuple[Experiment, ...],
) -> tuple[tuple[Explanation, ...], compose.Rigs, tuple[Experiment, ...]]:
    """The findings and the session, made anew where an effect carries on from one experiment to the next and
    less is left for it: what it left looked like another effect, or like a fault at a begin. A refit of what
    was found shows first whether that is worth a search."""
    for _ in range(_CARRIED):
        carried = _carried(rigs, explanations, session)
        if not _begin_elsewise(carried, session) or _nats_gained(explanations, carried) < NUMBERS.nats:
            break
        step("what carries on from one log to the next")
        again = search.better(explanations, carried)
        if again is None:
            break
        explanations, rigs, session = again, compose.compose(search.nominal, again, carried), carried
    return explanations, rigs, session


def _carried(
    rigs: compose.Rigs, explanations: Sequence[Explanation], session: Sequence[Experiment]
) -> tuple[Experiment, ...]:
    """The session with what earlier logs left in what was found, at whatever level the rig rests."""
    carried = compose.carried_on(rigs, session)
    if _begin_elsewise(carried, session):
        return carried
    known = cache(lambda: [as_it_was(e) for e in explanations])

    def left(logs: Sequence[Experiment]) -> float:
        """The mean square that a refit leaves, of what was left before, as if of all samples alike."""
        nats = sum(gained(e, logs, of) for e, of in zip(explanations, known()))
        return float(np.exp(-2.0 * nats / sum(map(len, logs))))

    return compose.held_on(rigs, session, left)


def _nats_gained(explanations: Sequence[Explanation], logs: Sequence[Experiment]) -> float:
    """What explanations gain by a refit where their experiments begin as in ``logs``, nats."""
    return sum(gained(e, logs) for e in explanations)


def _begin_elsewise(logs: Sequence[Experiment], session: Sequence[Experiment]) -> bool:
    """Whether any experiment begins in another way."""
    return [log.begins for log in logs] != [log.begins for log in session]


def _left_by(explanations: Sequence[Explanation], others: Sequence[Explanation]) -> float:
    """What explanations leave, in nats, and what their numbers cost (Schwarz's approximation). Where those of
    the ``others`` have a path of another length, either is fitted to the shorter one."""
    spent = 0.0
    for e, other in zip(explanations, others, strict=True):
        best, paces = e.best, [of.best.problem.segment.pace for of in (e, other)]
        left = (at_pace(best, min(paces)) if paces[0] != paces[1] else best).weighed
        count = len(left)
        spent += 0.5 * count * float(np.log(np.mean(left**2))) + 0.5 * best.size * float(np.log(count))
    return spent


def explain_all(
    rig: Rig, logs: Sequence[Experiment], threshold: float, only: Sequence[str] | None = None, draws: int = 0
) -> tuple[Explanation, ...]:
    """Explain segment after segment, each on what the one before it gives freed of noise. ``draws``:
    sessions simulated for the threshold of each; where it comes out higher than ``threshold``, the segment
    is explained anew."""
    found: list[Explanation] = []
    roles, x, ways, unsure = cuts(logs), None, None, None
    for entry, exit in pairwise(roles):
        segment = loosened(rig, make(logs, entry, exit, x, ways), logs)
        step(f"{entry} to {exit}")
        e = explain(rig, segment, logs, threshold, only, unsure)
        if draws > 1 and e.causes and only is None:
            candidates = [c for c in candidates_for(e.segment, rig) if c.form.seen is None]
            asked = bootstrapped(e, candidates, draws, threshold)
            if min(c.gain for c in e.causes) < asked:
                e = explain(rig, segment, logs, asked, only, unsure)
        found.append(e)
        if exit == roles[-1]:
            break
        problem, noise = e.best.problem.at_every_row, is_noise(e)
        segment = problem.segment
        made, response = problem.simulate(e.best.vector), problem.references.clocks["response"]
        left = e.predictability.share
        foretold = predicted(segment, segment.y - made, response, left)
        x = freed(segment, made, foretold, left, noise)
        ways = None
        if is_explained(left, noise):
            rest = slow_rest(segment, x, response)
            ways = np.column_stack([input_covariance(e), rest])
        unsure = strays(segment, made, response, left, noise)
        x = x + problem.simulate(problem.level(e.best.vector, is_explained(left, noise))) - made
        x = bent_within(problem, e.best.vector, x)
    return tuple(found)
