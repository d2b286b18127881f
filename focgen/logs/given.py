"""Experiments that a program made by itself, which no file was read for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Literal

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs.experiment import ROLES, Experiment
from focgen.logs.table import LARGEST

_CASTS: dict[bool, Literal["unsafe", "same_kind"]] = {True: "unsafe", False: "same_kind"}
_MAY_LACK = "reference"  # the role that may have gaps
_REMEDY = "give Experiment(name, sample_time, {role: array of shape (n,)})"


def checked_in_memory(log: Experiment) -> Experiment:
    """The experiment with its signals (n,) as floats. Raises LogError naming it where its sample time is no
    time, or where its signals are none, of an unknown role, of another shape or length, or have gaps."""
    where, h = str(log.name), log.sample_time
    if isinstance(h, bool) or not isinstance(h, Real) or not math.isfinite(h) or h <= 0.0:
        raise LogError(where, f"has the sample time {h!r}", "give seconds above 0")
    if not isinstance(log.start, Real) or not abs(log.start) <= LARGEST:
        raise LogError(where, f"has the start {log.start!r}", "give seconds on the session's clock")
    if not isinstance(log.signals, Mapping) or not log.signals:
        raise LogError(where, "has no signals", _REMEDY)
    signals = {role: _signal(where, role, values) for role, values in log.signals.items()}
    lengths = {role: len(values) for role, values in signals.items()}
    first, count = next(iter(lengths.items()))
    other = next((role for role, n in lengths.items() if n != count), None)
    if other is not None:
        what = f"has {count} samples of {first} and {lengths[other]} of {other}"
        raise LogError(where, what, "give as many of each")
    if not count:
        raise LogError(where, "has no samples", _REMEDY)
    same = isinstance(log.name, str) and all(signals[role] is log.signals[role] for role in signals)
    return log if same else replace(log, name=where, signals=signals)


def with_names_apart(logs: Sequence[Experiment]) -> tuple[Experiment, ...]:
    """The experiments, those of one name numbered: results are told by it."""
    names = [log.name for log in logs]
    taken, found = set(names), []
    for log in logs:
        name = log.name
        if names.count(name) > 1:
            name = next(other for k in itertools.count(1) if (other := f"{log.name} ({k})") not in taken)
            taken.add(name)
        found.append(log if name == log.name else replace(log, name=name))
    return tuple(found)


def _signal(where: str, role: str, values: object) -> Array:
    """One signal (n,) as floats."""
    if role not in ROLES:
        raise LogError(where, f"has a signal {role!r}", f"roles are {', '.join(ROLES)}")
    try:
        real = np.asarray(values)
        plain = real.dtype == object and all(isinstance(x, Real) for x in real.flat)
        made: Array = real if real.dtype == float else real.astype(float, casting=_CASTS[plain])
        made = np.where(np.ma.getmaskarray(values), np.nan, made) if np.ma.isMaskedArray(values) else made
    except (TypeError, ValueError):
        raise LogError(f"{where} {role}", "is not a series of real numbers", _REMEDY) from None
    if made.ndim != 1:
        raise LogError(f"{where} {role}", f"has the shape {made.shape}", _REMEDY)
    told = np.abs(made) <= LARGEST
    if not np.all(told | np.isnan(made)):
        at = int(np.argmin(told | np.isnan(made)))
        raise LogError(f"{where} {role}", f"is {made[at]:g} at sample {at}", "remove or correct it")
    if role != _MAY_LACK and not np.all(told):
        at = int(np.argmin(told))
        remedy = "cut that part out, or give a table: its gaps are mended as it is read"
        raise LogError(f"{where} {role}", f"has gaps, the first at sample {at}", remedy)
    return made
