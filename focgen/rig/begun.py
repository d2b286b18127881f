"""Experiments that do not begin at rest: their input's past is put ahead of them, and the run begins there.

A rig's state is what its input's past left. So a past that every stage and effect passes gives all of them
the state that goes with it, whatever they are. Where it begins, the input was held for ever, and every loop
starts in equilibrium. An experiment that goes on from the one ahead of it in the run needs no past but the
pause between them: what that one leaves is there already.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import REST, Begin
from focgen.rig.effects import Run
from focgen.rig.kernels import BALANCED

_ALIKE = 2.0  # samples: a log in means of several ends and begins within one of its own
_SLACK = 1e-6  # samples, or of a signal: rounding of a clock, and of means
_WIDER = 1.1  # times as long ago as it is, the earliest window of a past may begin


def with_past(x: Array, run: Run) -> Array:
    """The input (n,) of a run with what was before each experiment ahead of it."""
    made, before = [], 0.0
    for (past, sooner), (first, last) in zip(_told(run).pasts, run.spans):
        # a pause that is no whole number of samples ends so much of one sooner
        if sooner > _SLACK and len(past):
            past = past.copy()
            past[0] += sooner * (before - past[0])
        made += [past, x[first:last]]
        before = x[last - 1]
    return np.concatenate(made)


def from_there(x: Array, run: Run) -> Array:
    """What leaves a stage that integrates (n,), ``x`` had it stood at 0 as each experiment began."""
    made: Array = x + np.repeat(run.stands, [b - a for a, b in run.spans])
    return made


def alone(run: Run) -> tuple[bool, ...]:
    """Which experiments of a run do not go on from the one ahead of them."""
    return _told(run).alone if run.begins else (True,) * len(run.spans)


def past_of(run: Run) -> tuple[Run, Array]:
    """The run with the pasts of its experiments, and where (n,) the samples of the experiments are in it."""
    told = _told(run)
    return told.whole, told.kept


def with_stands(run: Run, stands: tuple[float, ...]) -> Run:
    """The run whose stage that integrates stood at ``stands`` as each experiment began. Its pasts are
    those of ``run``, and are not told anew."""
    made = run.with_stands(stands)
    if run.begins:
        told = _told(run)
        kept = tuple(place for place, own in zip(stands, told.alone) if own)
        _TOLD[made] = replace(told, whole=told.whole.with_stands(kept))
    return made


@dataclass(frozen=True, eq=False)
class _Told:
    """A run's pasts: each with by how much of a sample its pause ends sooner, 0 where it is none. ``alone``:
    which experiments have one of their own. ``whole``: the run with the pasts. ``kept`` (n,): where in that
    the samples of the experiments are."""

    pasts: tuple[tuple[Array, float], ...]
    alone: tuple[bool, ...]
    whole: Run
    kept: Array


_TOLD: WeakKeyDictionary[Run, _Told] = WeakKeyDictionary()


def _told(run: Run) -> _Told:
    """Told once for each run: fits simulate it again and again."""
    found = _TOLD.get(run)
    if found is None:
        found = _TOLD[run] = _tell(run)
    return found


def _tell(run: Run) -> _Told:
    gaps, h = _gaps(run), run.h
    pasts = [_past(begin, gap, h) for begin, gap in zip(run.begins, gaps)]
    sooner = [0.0 if gap is None else len(past) + 1 - gap / h for past, gap in zip(pasts, gaps)]
    lengths = [b - a for a, b in run.spans]
    whole = [len(past) + length for past, length in zip(pasts, lengths)]
    starts = np.cumsum([0, *whole[:-1]])
    rest = np.zeros(sum(whole), np.uint8)
    rest[starts] = [_rests(begin, gap) for begin, gap in zip(run.begins, gaps)]
    clock = [
        part
        for past, (a, b) in zip(pasts, run.spans)
        for part in (run.clock[a] - h * np.arange(len(past), 0, -1), run.clock[a:b])
    ]
    kept = [s + len(past) + np.arange(n) for s, past, n in zip(starts, pasts, lengths)]
    by_itself = tuple(gap is None for gap in gaps)
    stands = tuple(place for place, own in zip(run.stands, by_itself) if own)
    guessed = _guessed(run, starts, pasts)
    long = replace(run, rest=rest, clock=np.concatenate(clock), begins=(), stands=stands, guessed=guessed)
    duration = max(run.duration, h * max(b - a for a, b in long.spans))
    return _Told(tuple(zip(pasts, sooner)), by_itself, replace(long, duration=duration), np.concatenate(kept))


def _guessed(run: Run, starts: Array, pasts: Sequence[Array]) -> tuple[tuple[int, int], ...]:
    """The pasts of which no log shows anything, put ahead at ``starts``; with what a run begins with that is
    one as well."""
    ahead, found = dict(run.guessed), []
    for begin, (a, _), start, past in zip(run.begins, run.spans, starts, pasts):
        if begin.guessed:
            found.append((int(start), int(start) + len(past) + ahead.get(a, a) - a))
    return tuple(found)


def _gaps(run: Run) -> list[float | None]:
    """By experiment: how long, s, its first sample is after the last one of that ahead of it in the run,
    where it goes on from there; None where it has a past of its own."""
    spans, clock = run.spans, run.clock
    found: list[float | None] = [None]
    for (a, _), begin, (ahead, _), earlier in zip(spans[1:], run.begins[1:], spans, run.begins):
        gap, since = float(clock[a] - clock[a - 1]), float(clock[a] - clock[ahead])
        followed = begin.after is not None and abs(gap - begin.after) < _ALIKE * run.h
        followed = followed and _is_still(begin, gap - 0.5 * run.h)
        # all that was before is in the one ahead, or has been put ahead of that
        told = earlier.known or earlier.after is not None
        whole = told or max(begin.ago, default=0.0) <= _WIDER * since + _ALIKE * run.h
        found.append(gap if followed and whole else None)
    return found


def _is_still(begin: Begin, since: float) -> bool:
    """Whether a signal was since so many s ago what it was last."""
    later = [level for level, t in zip(begin.levels[1:], begin.ago) if t < since]
    return not later or bool(np.ptp([*later, begin.levels[-1]]) <= _SLACK * np.max(np.abs(begin.levels)))


def _rests(begin: Begin, gap: float | None) -> int:
    """How an experiment's past begins, as in :class:`Run`."""
    if gap is not None:
        return 0
    return 1 if begin == REST else BALANCED


def _past(begin: Begin, gap: float | None, h: float) -> Array:
    if gap is not None:
        return np.full(max(int(np.ceil(gap / h - _SLACK)) - 1, 0), begin.levels[-1])
    return np.zeros(0) if begin == REST else begin.samples(h)
