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
from focgen.logs.between import white_level
from focgen.logs.experiment import Experiment
from focgen.rig.carried import FIRST, raised
from focgen.rig.effects import Run
from focgen.rig.engine import Chain
from focgen.rig.initial import NOTE as ESTIMATED
from focgen.rig.initial import begun
from focgen.rig.placed import Placed
from focgen.rig.recalled import NOTE, begin_after, ended, memory, with_earlier
from focgen.rig.response import integrations
from focgen.rig.rig import Rig

_AGAIN = 2  # times that the rig is refitted and the begins told anew
_ROUNDS = 6  # of a refit
_LEVEL = 0.3  # of the input's level: a standard deviation of what it was in a window before
_LITTLE = 0.1  # of it: likewise, where earlier logs tell what it was
_LONGER = 2.0  # times as long ago each further window ends,
_SHOWN = 0.08  # of how long the rig remembers: what is longer ago is one window
_SURE = 0.1  # of what earlier logs left: by what it may be off where they are all that was
_REST = 0.3  # of a rest of unknown length: by what it may be longer, a standard deviation
_HELD = 0.1  # of the most that a pump holds: by so much more it held, to see what that does
_APART = 5.0  # standard errors that first samples are off from rest by, where that is not noise
_SEVERAL = 3  # experiments whose median is a zero
_QUIET = 2e-4  # of its span: a reading has so much noise at least
_RESOLVED = 1e-3  # of the largest singular value: what is smaller tells no levels apart
_EXACT = 1e-12  # of the output's level squared: less is no noise, but rounding
_SEEN = 2e-4  # of the output's largest magnitude, in root mean square: less does not show


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
    if not _away(found):
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
    """The segment with the ways in which the begins of its experiments may be off. One that is taken to
    begin at rest may not have, where its first samples are off from that by more than their noise.

    The rig forgets by its own times: as given first, then by those that the session asks for beside these
    ways.
    """
    found = _loosened(rig, segment, logs)
    for _ in range(_AGAIN if found.loose.shape[1] else 0):
        problem = problem_of(rig, found, logs)
        fitted = fit(problem, problem.nominal(), WHITE, _ROUNDS)
        found = _loosened(problem.rig(fitted.vector), segment, logs)
    return found


def _loosened(rig: Rig, segment: Segment, logs: Sequence[Experiment]) -> Segment:
    columns, fed = [], segment.fed
    past = memory(rig, logs)
    begins = fed.run.begins or (REST,) * len(fed.run.spans)
    astray = _astray(rig, fed, begins)
    for number, ((first, last), begin) in enumerate(zip(fed.run.spans, begins)):
        if begin.at_rest:
            ways = _away_from_rest(rig, fed, number, past) if astray[number] else ()
        else:
            ways = _ways(rig, fed, logs[: number + 1], past, astray[number])
        for way in ways:
            column = np.zeros(len(fed.x))
            column[first:last] = way
            columns.append(column)
    return segment.anew(loose=np.stack(columns, axis=1)) if columns else segment


def _ways(rig: Rig, segment: Segment, logs: Sequence[Experiment], past: float, astray: bool) -> np.ndarray:
    """Rows (k, n): what begins a little different would change of the last of the ``logs`` so far,
    uncorrelated; ``past``: s that the rig remembers; ``astray``: whether it begins elsewhere than as told."""
    *earlier, log = logs
    first, last = segment.run.spans[len(earlier)]
    start, h = float(segment.run.clock[first]), segment.run.h

    def made(begin: Begin, stands: float = 0.0, stage: str = segment.stages[-1]) -> np.ndarray:
        run = Run.of([last - first], [start], h, [begin], stands=[stands])
        return Chain(rig).run(segment.x[first:last], segment.stages[0], stage, run, segment.between)

    begin, changed = segment.run.begins[len(earlier)], list[np.ndarray]()
    if not begin.known or astray:
        step = (_LITTLE if begin.known else _LEVEL) * segment.level_in
        base = made(begin)
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
    return _uncorrelated(np.stack(changed), segment)


def _away_from_rest(rig: Rig, segment: Segment, number: int, past: float) -> np.ndarray:
    """Rows (k, n), likewise: what an input in windows before an experiment would change of it. By how much
    its first samples are off from rest says little: a zero may hide a part of it."""
    step, base = _LEVEL * segment.level_in, _made(rig, segment, number, REST)
    others = _beside(REST, step, segment.run.h, _SHOWN * past)
    return _uncorrelated(np.stack([_made(rig, segment, number, b) - base for b in others]), segment)


def _astray(rig: Rig, segment: Segment, begins: Sequence[Begin]) -> list[bool]:
    """Which experiments' first samples are off from what their begins make of them by more than noise, and
    than half a sample makes that columns may be out of step. Only those count that no input of the log can
    have moved yet. What most of three or more are off by, alike, is a zero."""
    if integrations(rig) or rig.integrator:
        return [False] * len(begins)
    off, least = np.zeros(len(begins)), np.full(len(begins), np.inf)
    for number, ((first, last), begin) in enumerate(zip(segment.run.spans, begins)):
        y = segment.y[first:last]
        if len(y) < 2 * FIRST:
            continue
        made, count = _made(rig, segment, number, begin), _unmoved(segment.x[first:last], begin)
        noise = max(white_level(y), _QUIET * float(np.ptp(y)))
        off[number] = float(np.mean((y - made)[:count]))
        least[number] = _APART * noise / np.sqrt(count) + 0.5 * abs(float(made[count] - made[count - 1]))
    seen = np.isfinite(least)
    if np.count_nonzero(seen) >= _SEVERAL:
        beside = np.abs(off - np.median(off[seen])) > least
        if np.count_nonzero(beside[seen]) <= 0.5 * np.count_nonzero(seen):
            return [bool(each) for each in beside]
    return [bool(each) for each in np.abs(off) > least]


def _unmoved(x: np.ndarray, begin: Begin) -> int:
    """How many first samples of an input (n,) are what it was before, and the next one; 1 at least, and as
    many as are looked at at most."""
    still = max(_APART * white_level(x), _QUIET * float(np.ptp(x)))
    moved = np.abs(x[:FIRST] - begin.levels[-1]) > still
    return int(np.argmax(moved)) + 1 if moved.any() else FIRST


def _made(rig: Rig, segment: Segment, number: int, begin: Begin, placed: Sequence[Placed] = ()) -> np.ndarray:
    """What an experiment (n,) of a segment would be, had it begun so."""
    first, last = segment.run.spans[number]
    run = Run.of([last - first], [float(segment.run.clock[first])], segment.run.h, [begin])
    stages = segment.stages[0], segment.stages[-1]
    return Chain(rig, tuple(placed)).run(segment.x[first:last], *stages, run, segment.between)


def _uncorrelated(changed: np.ndarray, segment: Segment) -> np.ndarray:
    """Rows (k, n) that are uncorrelated, but for those that do not show."""
    _, sizes, axes = np.linalg.svd(changed, full_matrices=False)
    least = _SEEN * segment.level_out * np.sqrt(changed.shape[1])
    found: np.ndarray = (sizes[:, None] * axes)[sizes > least]
    return found


def begun_as_fitted(of: Fit, logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments, each with what entered a segment before it as its fit has it: in windows that make of
    it what the ways in which its begin may be off do."""
    by, segment = of.problem.begun(of.vector), of.problem.segment.fed
    if not len(by) or not by.any() or segment.paced or of.problem.segment.whole is not None:
        return tuple(logs)
    rig, placed = of.problem.rig(of.vector), of.problem.placed(of.vector)
    off, past = segment.loose @ by, memory(rig, logs)
    begins = segment.run.begins or (REST,) * len(segment.run.spans)
    found = []
    for number, (log, begin, (first, last)) in enumerate(zip(logs, begins, segment.run.spans)):
        if not begin.known and np.any(off[first:last]):
            begin = _suited(rig, placed, segment, number, begin, off[first:last], past)
            notes = (n for n in log.notes if n not in (NOTE, ESTIMATED))
            log = replace(log, begins={**log.begins, segment.entry: begin}, notes=(*notes, ESTIMATED))
        found.append(log)
    return tuple(found)


def _suited(
    rig: Rig,
    placed: Sequence[Placed],
    segment: Segment,
    number: int,
    begin: Begin,
    off: np.ndarray,
    past: float,
) -> Begin:
    """The begin with other levels in windows, by which an experiment is so much ``off`` (n,) from what it
    makes of it as it is."""
    step, h = _LEVEL * segment.level_in, segment.run.h
    base = _made(rig, segment, number, begin, placed)
    windows = list(_windows(h, _SHOWN * past))
    rows = [_made(rig, segment, number, raised(begin, step, *w), placed) - base for w in windows]
    by = np.linalg.lstsq(np.stack(rows, axis=1), off, rcond=_RESOLVED)[0]
    for window, share in zip(windows, by):
        begin = raised(begin, step * float(share), *window)
    return begin


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
    for early, late in _windows(h, shown):
        yield raised(begin, step, early, late)


def _windows(h: float, shown: float) -> Iterator[tuple[float, float]]:
    """From how long ago to how long ago, s, each of the windows lasts."""
    late, early = 0.0, h
    while late < shown:
        yield early, late
        late, early = early, _LONGER * early
    yield np.inf, late
