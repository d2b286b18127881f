"""Experiments that do not begin at rest: their input's past is put ahead of them, and the run begins there.

A rig's state is what its input's past left. So a past that every stage and effect passes gives all of them
the state that goes with it, whatever they are. Where it begins, the input was held for ever, and every loop
starts in equilibrium.
"""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from focgen.arrays import Array
from focgen.logs.begin import REST
from focgen.rig.effects import Run
from focgen.rig.kernels import BALANCED

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
    rest[starts] = [1 if begin == REST else BALANCED for begin in run.begins]
    clock = [
        part
        for past, t in zip(pasts, _parts(run.clock, run))
        for part in (t[0] - h * np.arange(len(past), 0, -1), t)
    ]
    kept = [s + len(past) + np.arange(n) for s, past, n in zip(starts, pasts, lengths)]
    duration = max(run.duration, max(whole) * h)
    long = replace(run, rest=rest, clock=np.concatenate(clock), duration=duration, begins=())
    return long, np.concatenate(kept)


def _pasts(run: Run) -> list[Array]:
    return [np.zeros(0) if begin == REST else begin.samples(run.h) for begin in run.begins]


def _parts(signal: Array, run: Run) -> list[Array]:
    return [signal[a:b] for a, b in run.spans]
