"""The time of a log's rows in seconds, by its own column or clock, and what says that it is in seconds."""

from __future__ import annotations

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs import clock
from focgen.logs.roles import Roles, scaled, taken_columns
from focgen.logs.scales import Scale, unit_of_time
from focgen.logs.table import LogTable
from focgen.logs.units import in_unit, time_unit_named

_ONE_CLOCK = 0.02  # relative: so far apart are the steps of one clock


def time_of(table: LogTable, signals: Roles) -> tuple[Array, tuple[str, ...]]:
    """The time stamps (m,) in s, and a note where no column gives them."""
    if signals.time in table:
        said = _time_unit_note(table, signals)
        scale = signals.scales.get("time")
        found = table.seconds(signals.time, told=scale is not None)
        if scale is not None and _is_unscaled(table, signals.time, scale):
            return found + scale.offset, said  # a date is what it is, in whatever unit other logs count
        found = scaled(table, "time", found, signals)
        if scale is None:
            _check_one_clock(table, signals.time, found)
        return found, said
    if table.clock is None:
        raise table.missing("time", signals.time, taken_columns(signals) - {signals.time})
    step = float(np.median(np.diff(table.clock))) if len(table) > 1 else 0.0
    note = f"no column {signals.time!r}: time is the log's own, {step:.6g} s between samples"
    return table.clock, (note + _not_of_clock(table, signals),)


def _not_of_clock(table: LogTable, signals: Roles) -> str:
    """What the rig says of the column of time, and does not hold for a log's own clock, which is in s."""
    scale, given = signals.scales.get("time"), unit_of_time(table.unit(signals.time) or "")
    own = 1.0 if scale is None else scale.scale
    if scale is not None and scale.unit is not None:
        own = (unit_of_time(scale.unit) or ("", 1.0))[1]
    if own == 1.0 or (given is not None and abs(own / given[1] - 1.0) <= _ONE_CLOCK):
        return ""
    taken = f"not in {scale.unit}" if scale is not None and scale.unit else f"not multiplied by {own:g}"
    return f", {taken}, as the rig has it for its column"


def _is_unscaled(table: LogTable, name: str, scale: Scale) -> bool:
    """Whether a column of time is in s, whatever the rig has for other logs. Minutes, seconds and frames that
    are read as a time of day are scaled where the rig gives a scale, and not a unit."""
    if not table.is_in_seconds(name):
        return False
    of_day = table.is_dated(name) and table.has_zone(name) is None
    return scale.unit is not None or (scale.scale != 1.0 and not of_day)


def _check_one_clock(table: LogTable, name: str, time: Array) -> None:
    """Raise LogError where a column of time and the clocks that the file gives its channels contradict each
    other: the rows would be of the one or of the other."""
    differs = "holds a time beside channels whose clocks differ, so a row is not of one time"
    what = differs if table.differing else ""
    if table.clock is not None and len(time) > 1:
        step, own = (float(np.median(np.diff(t))) for t in (time, table.clock))
        if own > 0.0 and not abs(step / own - 1.0) <= _ONE_CLOCK:
            what = f"has {step:g} s between samples where the log's own clock has {own:g} s"
    if what:
        remedy = f"log all channels by one clock, or, where the column is right, {in_unit(name)}"
        raise LogError(f"{table.path} [{name}]", what, remedy)


def reading_of(table: LogTable, signals: Roles) -> clock.Reading:
    """What tells that the time is in seconds, or what else it may be."""
    name = signals.time
    if name not in table or signals.scales.get("time") is not None:
        return clock.Reading.TOLD
    if table.is_dated(name):
        return clock.Reading.STAMPS
    if table.is_unsure(name):
        return clock.Reading.UNSURE
    said = unit_of_time(table.unit(name) or time_unit_named(name) or "")
    return clock.Reading.TOLD if said is not None else clock.Reading.NUMBERS


def _time_unit_note(table: LogTable, signals: Roles) -> tuple[str, ...]:
    """What the file or the column's name says of the unit of time, where the rig names another. Raises
    LogError where the rig names none and it is no second: minutes pass for a log of another rate."""
    name, scale = signals.time, signals.scales.get("time")
    given = table.unit(name) or time_unit_named(name)
    assumed = (scale.unit if scale else None) or "s"
    if table.is_in_seconds(name):
        return _scale_note(table, name, scale)
    if given is not None and scale is not None and scale.unit is None:
        return _multiplied_note(name, given, scale.scale)
    if given is None or given == assumed:
        return ()
    own, other = unit_of_time(given), unit_of_time(assumed)
    if own is None or other is None or own[1] == other[1]:
        return ()
    if scale is not None:
        return (f"the log gives {name!r} in {given}, time is taken as {assumed}",)
    what = f"is in {given}, and the rig takes it for seconds"
    raise LogError(f"{table.path} [{name}]", what, in_unit(name, own[0]))


def _multiplied_note(name: str, given: str, scale: float) -> tuple[str, ...]:
    """A word where the rig multiplies a time by another number than the unit that the file gives."""
    own = unit_of_time(given)
    if own is None or abs(scale / own[1] - 1.0) <= _ONE_CLOCK:
        return ()
    return (f"the log gives {name!r} in {given}, and the rig multiplies it by {scale:g}, not {own[1]:g}",)


def _scale_note(table: LogTable, name: str, scale: Scale | None) -> tuple[str, ...]:
    """What becomes of dates and spans where the rig has another unit, or a scale, for the time of logs."""
    kind = "spans" if table.times.get(name, False) is None else "dates or times of day"
    if scale is None or (scale.unit in (None, "s") and scale.scale == 1.0):
        return ()
    if scale.unit is not None:
        return (f"{name!r} holds {kind}, which are not in {scale.unit}, as the rig has it",)
    not_so = "not " if _is_unscaled(table, name, scale) else ""
    return (f"{name!r} holds {kind}, which are {not_so}multiplied by {scale.scale:g}, as the rig has it",)
