"""Logs of far more samples than the rig's response needs, in fewer.

A search runs the rig some ten thousand times over. What is a hundred times quicker than the response tells
the diagnosis nothing, but takes as long as the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from focgen.diagnosis.problem.scales import clocks
from focgen.logs.between import Between
from focgen.logs.experiment import Experiment
from focgen.rig.rig import Rig

_ENOUGH = 20000  # samples of a session that tell as much as more do; a fit to fewer is not the fit to all
_WITHIN = 100.0  # samples of a response that are kept


def decimated(rig: Rig, logs: Sequence[Experiment]) -> tuple[Rig, tuple[Experiment, ...]]:
    """The logs with every so manieth sample, where they have more than enough of them, and the rig as it sees
    these; else both as they are.

    The input is the mean about each sample that is kept, for what it does in between moves the rig as well,
    and runs in lines from there to the next; what is measured behind it keeps its noise.
    """
    every = _every(rig, logs)
    if every == 1:
        return rig, tuple(logs)
    return replace(rig, between=Between.STRAIGHT), tuple(_thinned(log, every) for log in logs)


def _every(rig: Rig, logs: Sequence[Experiment]) -> int:
    """An odd number of samples, so that means stand in the middle."""
    h = logs[0].sample_time
    factor = min(sum(map(len, logs)) / _ENOUGH, clocks(rig, logs)["response"] / h / _WITHIN)
    return 1 if factor < 3.0 else int(factor - 1.0) // 2 * 2 + 1


def _thinned(log: Experiment, every: int) -> Experiment:
    entry = "command" if "command" in log else "pressure"
    signals = {role: np.asarray(values, float)[::every] for role, values in log.signals.items()}
    signals[entry] = uniform_filter1d(np.asarray(log[entry], float), every, mode="nearest")[::every]
    note = (
        f"has a sample every {log.sample_time:g} s, more than the response needs: one in {every} is looked at"
    )
    return replace(log, signals=signals, sample_time=log.sample_time * every, notes=(*log.notes, note))
