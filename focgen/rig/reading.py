"""The logs of a rig, read by what its file says of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar, cast

from focgen.arguments import checked
from focgen.logs import read
from focgen.logs.experiment import Experiment
from focgen.logs.read import Logs
from focgen.rig.arguments import RigLike, rig_of, rig_then_logs
from focgen.rig.rig import Signals

P = ParamSpec("P")
R = TypeVar("R")


def _once_by_signals(function: Callable[P, R]) -> Callable[P, R]:
    """Also ``read_logs(logs, signals, sample_time, first, last, limits)``, with a warning."""

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if not ("signals" in kwargs or (len(args) > 1 and isinstance(args[1], Signals))):
            return function(*args, **kwargs)
        warnings.warn("the order is now read_logs(rig, logs, from_, to)", DeprecationWarning, 2)
        return cast(R, cast(Callable[..., Any], read.read_logs)(*args, **kwargs))

    return call


@_once_by_signals
@rig_then_logs
@checked
def read_logs(
    rig: RigLike, logs: Logs, from_: float | None = None, to: float | None = None
) -> tuple[Experiment, ...]:
    """Read the experiments of one session, in the order of their time stamps, or as given where those
    overlap.

    ``rig`` says which column is what, and the sample time (s) that uneven logs are resampled to. ``logs`` are
    files, pandas or polars frames, dictionaries of arrays (m,) by column, or a list of these. ``from_`` and
    ``to`` cut each experiment (s since its first sample). Signals are in the rig's units, (n,) by role.
    Raises RigError, and LogError naming file, column, line and remedy.
    """
    given = rig_of(rig)
    ranged = given.ranges.stated()
    return read.read_logs(logs, given.signals, given.sample_time, from_, to, ranged=ranged)
