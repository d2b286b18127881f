"""The state in which each experiment of a session begins, before anything is said of the rig.

What the past left is told by the rig as given, then once more by the refitted one: parameters a little off
would make it a little wrong, and a begin a little wrong would draw the parameters. What is still wrong with
it is left to the fits, as ways in which the begin of an experiment may be off: no effect is to be named for
that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from focgen.diagnosis.fitting.fit import WHITE, Fit, fit
from focgen.diagnosis.hypotheses.nuisances import problem_of
from focgen.diagnosis.problem.held import may_have_held, tells_what_is_held
from focgen.diagnosis.problem.segments import Segment, cuts, make
from focgen.logs.begin import REST, Begin
from focgen.logs.experiment import Experiment
from focgen.rig.carried import raised
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.initial import begun
from focgen.rig.placed import Placed
from focgen.rig.recalled import NOTE, begin_after, ended, memory, with_earlier
from focgen.rig.rig import Rig

_AGAIN = 2  # times that the rig is refitted and the begins told anew
_ROUNDS = 6  # of a refit
_LEVEL = 0.3  # of the input's level: a standard deviation of what it was in a window before
_LONGER = 2.0  # times as long ago each further window ends,
_SHOWN = 0.08  # of how long the rig remembers: what is longer ago is one window
_SURE = 0.1  # of what earlier logs left: by what it may be off where they are all that was
_REST = 0.3  # of a rest of unknown length: by what it may be longer, a standard deviation
_HELD = 0.1  # of the most that a pump holds: by so much more it held, to see what that does
_EXACT = 1e-12  # of the output's level squared: less is no noise, but rounding
_SEEN = 1e-3  # of the output's largest magnitude, in root mean square: less does not show


def begun_session(rig: Rig, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with what their signals were before, where the data ask for it; a session at rest as it
    is.

    Begins that leave the refitted rig no better than a rest does are none; and what earlier experiments left
    has to bring the refitted rig closer. Where logs begin elsewhere than at 0 they are asked for it, too: a
    fractional actuator remembers more than a few steps tell.
    """
    return with_earlier(rig, _told(rig, logs), lambda found: _refitted(rig, found)[1])


def _told(rig: Rig, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with the begins that their own first samples tell."""
    found = begun(rig, logs)
    if not _away(found) and not _away(found := begun(_refitted(rig, logs)[0], logs)):
        return found
    at_rest = tuple(replace(log, begins={}, stands=0.0) for log in logs)
    for _ in range(_AGAIN):
        found = begun(_refitted(rig, found)[0], found)
    better = _refitted(rig, found)[1] < _refitted(rig, at_rest)[1]
    return found if better else tuple(logs)


def _away(logs: Sequence[Experiment]) -> bool:
    """Whether some begin away from rest."""
    return any(log.begins or log.stands for log in logs)


def begun_with(rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments with their begins told anew by the rig with the effects ``placed`` in it; a session at
    rest as it is."""
    return begun(rig, logs, placed) if _away(logs) else tuple(logs)


def rested_long(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments, each whose past is told by earlier ones at rest instead, where no clock says how long
    ago those were."""

    def rested(log: Experiment) -> Experiment:
        if not log.paused or all(begin.after is None for begin in log.begins.values()):
            return log
        return replace(log, begins={}, notes=tuple(n for n in log.notes if n != NOTE))

    return tuple(map(rested, logs))


def held_as_fitted(of: Fit, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments, each with what a pump held as it began, where that was fitted: its first samples alone
    tell it less well, and what it is off by stays in all that follows."""
    held = of.problem.held(of.vector)
    return tuple(replace(log, stands=at) for log, at in zip(logs, held)) if held else tuple(logs)


def begun_as_found(
    of: Fit, rig: Rig, placed: Sequence[Placed], logs: Sequence[Experiment]
) -> tuple[Experiment, ...]:
    """The experiments with their begins told by what was found, or, of a pump's, as the first segment's fit
    has them."""
    return held_as_fitted(of, logs) if of.problem.stood else begun_with(rig, placed, logs)


def _refitted(rig: Rig, logs: Sequence[Experiment]) -> tuple[Rig, float]:
    """The rig with its nominal parameters fitted to the logs, and the product of the mean squares that its
    segments leave, as their likelihood has it: a sum would be that of the segment that fits worst."""
    roles, left = cuts(logs), 1.0
    for entry, exit in pairwise(roles):
        problem = problem_of(rig, make(logs, entry, exit), logs)
        found = fit(problem, problem.nominal(), WHITE, _ROUNDS)
        left *= max(found.sse / len(found.innovations), _EXACT)
        rig = problem.rig(found.vector) if len(problem.nominal_start) else rig
    return rig, left


def loosened(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Segment:
    """The segment with the ways in which the begins of its experiments may be off."""
    if not segment.run.begins:
        return segment
    columns, fed = [], segment.fed
    past = memory(rig, logs)
    for number, ((first, last), begin) in enumerate(zip(fed.run.spans, fed.run.begins)):
        for way in () if begin.at_rest else _ways(rig, fed, logs[: number + 1], past):
            column = np.zeros(len(fed.x))
            column[first:last] = way
            columns.append(column)
    return segment.anew(loose=np.stack(columns, axis=1)) if columns else segment


def _ways(rig: Rig, segment: Segment, logs: Sequence[Experiment], past: float) -> np.ndarray:
    """Rows (k, n): what begins a little different would change of the last of the ``logs`` so far,
    uncorrelated; ``past``: s that the rig remembers."""
    *earlier, log = logs
    first, last = segment.run.spans[len(earlier)]
    start, h = float(segment.run.clock[first]), segment.run.h

    def made(begin: Begin, stands: float = 0.0, stage: str = segment.stages[-1]) -> np.ndarray:
        run = Run.of([last - first], [start], h, [begin], stands=[stands])
        return Chain(rig).run(segment.x[first:last], segment.stages[0], stage, run, segment.between)

    begin, changed = segment.run.begins[len(earlier)], []
    if not begin.known:
        base, step = made(begin), _LEVEL * segment.level_in
        changed += [made(other) - base for other in _beside(begin, step, h, _SHOWN * past)]
    if earlier and log.paused:
        now, *longer = (made(b) for b in _rested(log, earlier, segment.entry, past))
        changed += [(now - made(REST)) * (_SURE if begin.known else 1.0), *(left - now for left in longer)]
    if not changed:
        return np.zeros((0, last - first))
    if tells_what_is_held(rig, segment.stages) and may_have_held(segment.run)[len(earlier)]:
        stood = segment.run.stands[len(earlier)] if segment.run.stands else 0.0
        more = stood + _HELD * float(np.max(np.abs(made(begin, stood, "regulator"))))
        changed = _beside_the_volume(changed, made(begin, more) - made(begin, stood))
    _, sizes, axes = np.linalg.svd(np.stack(changed), full_matrices=False)
    found: np.ndarray = (sizes[:, None] * axes)[sizes > _SEEN * segment.level_out * np.sqrt(last - first)]
    return found


def _beside_the_volume(changed: Sequence[np.ndarray], shift: np.ndarray) -> list[np.ndarray]:
    """Rows (n,) without what another volume of a pump, which makes the ``shift`` (n,), does as well: it has a
    number of its own, and what begins shift for good would be in no rig."""
    return [row - (row @ shift) / max(shift @ shift, 1e-300) * shift for row in changed]


def _rested(log: Experiment, earlier: Sequence[Experiment], role: str, past: float) -> Iterator[Begin]:
    """What earlier experiments left of a signal, where no clock says how long the rig rested after them: by
    the rest that is taken, and by longer ones."""
    pause = log.start - max(map(ended, earlier))
    for longer in (0.0, _REST, 1.0):
        yield begin_after(replace(log, start=log.start + longer * pause), earlier, role, past)


def _beside(begin: Begin, step: float, h: float, shown: float) -> Iterator[Begin]:
    """The begin with its signal a ``step`` higher in each of several windows before the log, the longer the
    longer they are ago, up to ``shown`` s, and ahead of that: a few levels are the simplest past that suits
    the data, not what was."""
    late, early = 0.0, h
    while late < shown:
        yield raised(begin, step, early, late)
        late, early = early, _LONGER * early
    yield raised(begin, step, np.inf, late)
