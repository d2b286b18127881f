"""The experiments of a session as one run, and a signal of them as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment
from focgen.rig.effects import Run


def run_of(logs: Sequence[Experiment], entry: str) -> Run:
    """The run that the logs are, where the signal ``entry`` is its input."""
    lengths, starts = [len(log) for log in logs], [log.start for log in logs]
    begins, lasts = [log.before(entry) for log in logs], any(log.lasts for log in logs)
    stands = [0.0 if entry == "curvature" else log.stands for log in logs]
    return Run.of(lengths, starts, logs[0].sample_time, begins, lasts, stands)


def joined(logs: Sequence[Experiment], role: str) -> Array:
    """A signal (n,) of all experiments, one after the other."""
    return np.concatenate([np.asarray(log[role], float) for log in logs])
