"""The ranges that a rig leaves open, as its logs show them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focgen.arrays import Array
from focgen.logs.experiment import Experiment
from focgen.logs.strays import astray
from focgen.rig.rig import Ranges

_ROOM = 1.25  # beyond what was seen: a controller may have to go a little further than the logs did
_DIGITS = 2


def seen_ranges(given: Ranges, experiments: Sequence[Experiment]) -> tuple[Ranges, tuple[str, ...]]:
    """Return ``given`` with pressure and output, where absent, from the logs, and a sentence for each.

    A range from logs spans zero and what was seen with a quarter of room, rounded outwards to two digits.
    Readings that are told of as astray are left out. The command's is no matter of logs: whoever designs
    takes the regulator's 0–10 V.
    """
    notes = []
    for role in ("pressure", "output"):
        seen = [_usable(e, role) for e in experiments if role in e.signals]
        if getattr(given, role) is None and seen:
            span = _with_room(float(min(map(np.min, seen))), float(max(map(np.max, seen))))
            given = replace(given, **{role: span})
            notes.append(
                f"[ranges] {role} is not given: {span[0]:g} … {span[1]:g}, "
                "from the logs with a quarter of room"
            )
    return given, tuple(notes)


def _usable(experiment: Experiment, role: str) -> Array:
    """The signal (n,) of a role without the readings that are astray."""
    y = experiment.signals[role]
    drive = experiment.signals.get("command", experiment.signals.get("pressure"))
    if drive is None or drive is y:
        return y
    kept: Array = y[~astray(y, drive)]
    return kept if len(kept) else y


def _with_room(low: float, high: float) -> tuple[float, float]:
    """The span of zero and both ends, widened; an end that only noise moves off zero (2 %) stays zero."""
    reach = max(high, -low, 0.0)
    low, high = (end if abs(end) > 0.02 * reach else 0.0 for end in (min(low, 0.0), max(high, 0.0)))
    return 0.0 - _outwards(-_ROOM * low), _outwards(_ROOM * high)


def _outwards(value: float) -> float:
    """``value`` ≥ 0 rounded up to two digits."""
    if value <= 0.0:
        return 0.0
    digits = _DIGITS - 1 - math.floor(math.log10(value))
    return round(math.ceil(round(value * 10.0**digits, 6)) / 10.0**digits, max(digits, 0))
