"""Single values as the reference computes with them: types, limits, the gain of a schedule.

Everything is of any shape, and in the values' own type.
"""

from __future__ import annotations

import numpy as np

from focgen.arrays import Kind, Numbers
from focgen.plan.counts import values_of
from focgen.plan.plan import Format, Plan, Schedule
from focgen.present import present


def kind_of(format_: Format) -> Kind:
    """The numpy type that values of a format are computed in."""
    return {"float": np.float32, "double": np.float64}.get(format_.ctype, np.int64)


def clamp(values: Numbers, format_: Format) -> Numbers:
    """Within the limits of a format, in the values' own type."""
    kind = np.asarray(values).dtype.type
    made: Numbers = np.minimum(np.maximum(values, kind(format_.low)), kind(format_.high))
    return made


def saturate(values: Numbers, bits: int) -> Numbers:
    """Within the two's complement of so many bits."""
    return np.minimum(np.maximum(values, -(1 << (bits - 1))), (1 << (bits - 1)) - 1)


def output_of(plan: Plan, integral: Numbers) -> Numbers:
    """u of a floating plan's integral, any shape; an end that is no whole number of counts counts still."""
    state = present(plan.integrator).state
    return integral if state.floating else clamp(values_of(integral, state), plan.output)


def scheduled_gain(plan: Plan, s: Numbers) -> Numbers:
    """g in counts at raw values of the scheduling signal, any shape; ``plan`` has a schedule."""
    kind, schedule = kind_of(plan.error), present(plan.schedule)
    s = np.asarray(s, dtype=kind)
    return interpolated(schedule, s if plan.floating else clamp(s, schedule.signal), kind)


def interpolated(schedule: Schedule, s: Numbers, kind: Kind) -> Numbers:
    """The same with a schedule's own gains, as tuned parameters change them; ``s`` within its format."""
    points: Numbers = np.array(schedule.breakpoints, dtype=kind)
    gains, slopes = np.array(schedule.gains, dtype=kind), np.array(schedule.slopes, dtype=kind)
    segment = np.searchsorted(points, s, side="right") - 1
    inside = np.clip(segment, 0, len(slopes) - 1)
    run = slopes[inside] * (s - points[inside])
    if kind is np.int64:
        by = np.array(schedule.slope_shifts, dtype=kind)[inside]
        run = np.where(by > 0, (run + ((1 << by) >> 1)) >> by, run)
    made: Numbers = np.where(
        segment < 0, gains[0], np.where(segment >= len(slopes), gains[-1], gains[inside] + run)
    )
    return made
