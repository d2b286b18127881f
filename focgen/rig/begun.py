"""Experiments that do not begin at rest: their input's past is put ahead of them, and the run begins there.

A rig's state is what its input's past left. So a past that every stage and effect passes gives all of them
the state that goes with it, whatever they are. Where it begins, the input was held for ever, and every loop
starts in equilibrium. An experiment that goes on from the one ahead of it in the run needs no past but the
pause between them: what that one leaves is there already.
"""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import REST, Begin
from focgen.rig.effects import Run
from focgen.rig.kernels import BALANCED

_ALIKE = 2.0  # samples: a log in means of several ends and begins within one of its own
_EXTENDED: WeakKeyDictionary[Run, tuple[Run, Array]] = WeakKeyDictionary()


def with_past(x: Array, run: Run) -> Array:
    """The input (n,) of a run with what was before each experiment ahead of it."""
    return np.concatenate([part for a, b in zip(_pasts(run), _parts(x, run)) for part in (a, b)])


def past_of(run: Run) -> tuple[Run, Array]:
    """The run with the pasts of its experiments, and where (n,) the samples of the experiments are in it."""
    found = _EXTENDED.get(run)
    if found is None:
        found = _EXTENDED[run] = _extended(run)
    return found


def _extended(run: Run) -> tuple[Run, Array]:
    pasts, h = _pasts(run), run.h
    lengths = [b - a for a, b in run.spans]
    whole = [len(past) + length for past, length in zip(pasts, lengths)]
    starts = np.cumsum([0, *whole[:-1]])
    rest = np.zeros(sum(whole), np.uint8)
    rest[starts] = [_rests(begin, gap, h) for begin, gap in zip(run.begins, _gaps(run))]
    clock = [
        part
        for past, t in zip(pasts, _parts(run.clock, run))
        for part in (t[0] - h * np.arange(len(past), 0, -1), t)
    ]
    kept = [s + len(past) + np.arange(n) for s, past, n in zip(starts, pasts, lengths)]
    long = replace(run, rest=rest, clock=np.concatenate(clock), begins=())
    duration = max(run.duration, h * max(b - a for a, b in long.spans))
    return replace(long, duration=duration), np.concatenate(kept)


def _gaps(run: Run) -> list[float]:
    """By experiment: how long, s, its first sample is after the last one of that ahead of it in the run."""
    return [np.inf, *(float(run.clock[a] - run.clock[a - 1]) for a, _ in run.spans[1:])]


def _goes_on(begin: Begin, gap: float, h: float) -> bool:
    """Whether what is ahead of an experiment in the run is what came before it."""
    return begin.after is not None and abs(gap - begin.after) < _ALIKE * h


def _rests(begin: Begin, gap: float, h: float) -> int:
    """How an experiment's past begins, as in :class:`Run`."""
    if _goes_on(begin, gap, h):
        return 0
    return 1 if begin == REST else BALANCED


def _pasts(run: Run) -> list[Array]:
    return [_past(begin, gap, run.h) for begin, gap in zip(run.begins, _gaps(run))]


def _past(begin: Begin, gap: float, h: float) -> Array:
    if _goes_on(begin, gap, h):
        return np.full(max(round(gap / h) - 1, 0), begin.levels[-1])
    return np.zeros(0) if begin == REST else begin.samples(h)


def _parts(signal: Array, run: Run) -> list[Array]:
    return [signal[a:b] for a, b in run.spans]
