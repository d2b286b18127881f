"""Logs of different sample rates in one session: brought to the slowest of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment

_SAME = 1e-6  # relative


def at_one_rate(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments at the sample time (s) of the slowest, each faster one with a note.

    A command counts as held between samples, so that what it is on average until the next one moves the rig
    as much. All else is what it is at the slower samples.
    """
    slowest = max(log.sample_time for log in logs)
    return tuple(log if log.sample_time > (1 - _SAME) * slowest else _slower(log, slowest) for log in logs)


def _slower(log: Experiment, step: float) -> Experiment:
    count = int((len(log) - 1) * log.sample_time / step * (1.0 + _SAME)) + 1
    at = step * np.arange(count)
    signals = {
        role: _held(log.sample_time, y, at, step) if role == "command" else np.interp(at, log.time, y)
        for role, y in log.signals.items()
    }
    note = f"sampled every {log.sample_time:g} s, taken every {step:g} s as the slowest log"
    return replace(log, sample_time=step, signals=signals, raw_time=None, rows=None, notes=(*log.notes, note))


def _held(fast: float, y: Array, at: Array, step: float) -> Array:
    """The mean (n,) of a held signal (m,) from each of the times ``at`` to ``step`` s later, as far as it
    goes."""
    ends = np.minimum(at + step, fast * len(y))
    edges, area = fast * np.arange(len(y) + 1), np.concatenate([[0.0], np.cumsum(fast * y)])
    made: Array = (np.interp(ends, edges, area) - np.interp(at, edges, area)) / (ends - at)
    return made
