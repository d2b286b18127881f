"""Where experiments begin as the last one left the rig: what remembers keeps a real one off 0, where a
simulated one begins.

Friction holds a rig off its rest, and a loop lies where its last turn was. Until the rig has moved, the
simulation is wrong for that alone, and a form that holds it at 0 for longer mends it: a dead zone.
"""

from __future__ import annotations

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.problem.segments import Segment
from focgen.logs.between import white_level
from focgen.rig.effects import library

_STILL = 0.01  # of its range: the input waits
_OFF, _ERRORS = 0.01, 5.0  # of the output's range, and standard errors, that a reading is off at first
_FEWEST = 5  # samples of a wait
_AWAY = 2.0  # times what it was off: from there on the rig has moved


def remembers(of: Fit) -> bool:
    """Whether an effect of a fit, beside others, stays where the last experiment left it."""
    families = of.problem.families
    return len(families) > 1 and any(library()[name].remembers for name in families)


def unleft(of: Fit) -> Segment | None:
    """The segment of a fit without the samples of an experiment that began off its rest until it has moved;
    None where none did."""
    segment = of.problem.segment
    left = of.problem.residual(of.vector)
    wait = max(int(of.problem.references.clocks["response"] / segment.run.h), 1)
    seen = np.ones(len(left))
    for first, last in segment.run.spans:
        if segment.run.rest[first] == 1:
            begun = _begun(segment, left, first, last)
            seen[first : min(begun + wait, last) if begun > first else first] = 0.0
    return None if np.all(seen) or not np.any(seen) else segment.seen_at(seen)


def _begun(segment: Segment, left: np.ndarray, first: int, last: int) -> int:
    """The sample at which an experiment that began off its rest has moved; its first where it began there."""
    x, y = segment.x[first:last], segment.y[first:last]
    waits = np.abs(x - x[0]) < _STILL * np.ptp(segment.x)
    count = len(x) if np.all(waits) else int(np.argmin(waits))
    if count < _FEWEST:
        return first
    off = abs(float(np.mean(left[first : first + count])))
    error = white_level(y[:count]) / np.sqrt(count)
    if off < max(_OFF * np.ptp(segment.y), _ERRORS * error):
        return first
    away = np.abs(y - np.mean(y[:count])) > _AWAY * off
    return first + int(np.argmax(away)) if np.any(away) else last
