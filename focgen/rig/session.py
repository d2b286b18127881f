"""The experiments of a session as one run, and a signal of them as one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment
from focgen.logs.staircase import staircase_of
from focgen.rig.effects import Run


def entry_of(logs: Sequence[Experiment]) -> str:
    """The first input that every log has: the command, else the pressure."""
    return "command" if all("command" in log for log in logs) else "pressure"


def run_of(logs: Sequence[Experiment], entry: str) -> Run:
    """The run that the logs are, where the signal ``entry`` is its input."""
    lengths, starts = [len(log) for log in logs], [log.start for log in logs]
    begins, lasts = [log.before(entry) for log in logs], any(log.lasts for log in logs)
    stands = [0.0 if entry == "curvature" else log.stands for log in logs]
    return Run.of(lengths, starts, logs[0].sample_time, begins, lasts, stands)


def joined(logs: Sequence[Experiment], role: str) -> Array:
    """A signal (n,) of all experiments, one after the other."""
    return np.concatenate([np.asarray(log[role], float) for log in logs])


def entering(logs: Sequence[Experiment], role: str) -> Array:
    """The input (n,) of all experiments. One that is measured, and only jumps and rests, is what its readings
    are on average from jump to jump: what they scatter is the gauge's."""
    if role == "command":
        return joined(logs, role)
    parts = [(np.asarray(log[role], float), _steps(log, role)) for log in logs]
    return np.concatenate([read if steps is None else steps for read, steps in parts])


def jumps_and_rests(logs: Sequence[Experiment], role: str) -> bool:
    """Whether a measured signal does nothing else in one of the experiments, and jumps there."""
    return any(steps is not None and np.ptp(steps) > 0.0 for steps in (_steps(log, role) for log in logs))


def _steps(log: Experiment, role: str) -> Array | None:
    return _staircase(np.asarray(log[role], float).tobytes()) if len(log) else None


@lru_cache(maxsize=32)
def _staircase(readings: bytes) -> Array | None:
    """A log is asked for its steps with every rig that it is compared with."""
    return staircase_of(np.frombuffer(readings))
