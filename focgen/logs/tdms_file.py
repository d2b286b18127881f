"""Logs in .tdms (LabVIEW): one channel a column, by its name alone and by "group/channel".

Groups with the same channels are runs, each with the group's name; the channels of other groups belong
together. Channels without a column of time are waveforms, whose properties give it.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.columns import is_time_named
from focgen.logs.scales import unit_of_time
from focgen.logs.stamps import is_time, of_numpy
from focgen.logs.table import LARGEST, LogTable, check_units
from focgen.logs.units import TIME_WORDS


@dataclass(frozen=True, eq=False)
class _Group:
    """``channels`` (m,) by name, their ``units``, and the time in s that their waveforms have, or None;
    ``differing``: it is another one of each. ``times``: the channels of instants. ``dated``: True where the
    waveforms begin at an instant, of UTC as all are, else None."""

    name: str
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    clock: Array | None
    differing: bool
    times: frozenset[str]
    dated: bool | None

    def __len__(self) -> int:
        return len(next(iter(self.channels.values())))


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is damaged or its channels differ in length, MissingExtra without
    nptdms.
    """
    try:
        import nptdms
        from nptdms.log import log_manager
    except ImportError:
        raise MissingExtra.of("nptdms", "tdms", str(path)) from None
    log_manager.set_level(logging.ERROR)  # what it warns of is refused below, in one line
    path.open("rb").close()
    try:
        groups = [_group(path, group) for group in nptdms.TdmsFile.read(path).groups()]
    except (LogError, MemoryError):
        raise
    except Exception:  # noqa: BLE001 - nptdms has no error of its own for damaged files
        raise LogError(str(path), "is not a whole TDMS file", "write it again") from None
    groups = [group for group in groups if group.channels]
    if not groups:
        return LogTable(str(path), {})
    for group in groups:
        _check_lengths(path, group.channels)
    runs = len(groups) > 1 and all(set(g.channels) == set(groups[0].channels) for g in groups)
    return _one_after_the_other(path, groups) if runs else _side_by_side(path, groups)


def _group(path: Path, group: Any) -> _Group:
    for channel in group.channels():
        _check_over_time(path, channel.properties)
    raw = {c.name: (c, np.asarray(c[:])) for c in group.channels()}
    found = {name: (c, of_numpy(values)) for name, (c, values) in raw.items()}
    times = frozenset(name for name, (_, values) in raw.items() if is_time(values))
    channels = {name: values for name, (_, values) in found.items() if len(values)}
    units = {name: str(c.properties.get("unit_string", "")) for name, (c, _) in found.items()}
    clocks = [_clock(c.properties, len(values)) for c, values in found.values() if len(values)]
    clock = _common(clocks)
    differing = clock is None and any(c is not None for c in clocks)
    dated = True if any("wf_start_time" in c.properties for c, _ in found.values()) else None
    units = {name: unit for name, unit in units.items() if unit}
    return _Group(group.name, channels, units, clock, differing, times, dated)


def _common(clocks: Sequence[Array | None]) -> Array | None:
    """The time (m,) of all that have one; None where they differ, or none has one."""
    known = [clock for clock in clocks if clock is not None]
    return known[0] if known and all(np.array_equal(clock, known[0]) for clock in known) else None


def _check_over_time(path: Path, properties: Mapping[str, Any]) -> None:
    """Raise LogError for a waveform over something else than time, as the frequencies of a spectrum."""
    name, unit = (str(properties.get(f"wf_x{key}", "")).strip() for key in ("name", "unit_string"))
    named = not name or not {word.lower() for word in name.split()}.isdisjoint(TIME_WORDS)
    if not named or (unit and unit_of_time(unit) is None):
        what = f"goes over {' in '.join(filter(None, (name, unit)))}, not over time"
        raise LogError(str(path), what, "save what was measured over time, or name it Time, in s")


def _clock(properties: Mapping[str, Any], count: int) -> Array | None:
    """The time (m,) in s that a waveform's properties give: from its start, where that is known."""
    unit = unit_of_time(str(properties.get("wf_xunit_string", "")).strip() or "s")
    scale = unit[1] if unit is not None else 1.0
    step = scale * float(properties.get("wf_increment", 0.0))
    if not 0.0 < step <= LARGEST:
        return None
    start = properties.get("wf_start_time")
    begin = of_numpy(np.array([start], "datetime64[us]"))[0] if start is not None else 0.0
    return begin + scale * float(properties.get("wf_start_offset", 0.0)) + step * np.arange(count)


def _check_lengths(path: Path, columns: Mapping[str, Array]) -> None:
    if len({len(values) for values in columns.values()}) > 1:
        sizes = ", ".join(f"{name} {len(values)}" for name, values in columns.items())
        raise LogError(str(path), f"holds channels of different lengths ({sizes})", "log them at one rate")


def _one_after_the_other(path: Path, groups: Sequence[_Group]) -> LogTable:
    columns = {name: np.concatenate([g.channels[name] for g in groups]) for name in groups[0].channels}
    clocks = [g.clock for g in groups if g.clock is not None]
    check_units(path, [g.units for g in groups])
    return LogTable(
        str(path),
        columns,
        units=groups[0].units,
        clock=np.concatenate(clocks) if len(clocks) == len(groups) else None,
        runs=[g.name for g in groups for _ in range(len(g))],
        differing=any(g.differing for g in groups),
        times=dict.fromkeys(groups[0].times, True),  # the format's are of UTC
        clock_zone=groups[0].dated,
    )


def _check_one_time(path: Path, groups: Sequence[_Group]) -> None:
    """Raise LogError where groups have channels of time that differ: a row is not of one time then."""
    named = [values for g in groups for name, values in g.channels.items() if is_time_named(name)]
    times = [values for values in named if values.dtype.kind in "fiu" and np.all(np.diff(values) >= 0)]
    if any(not np.array_equal(values, times[0]) for values in times[1:]):
        what = "has groups with channels of time that differ, so a row is not of one time"
        raise LogError(str(path), what, "log all channels by one clock, or each group as a file of its own")


def _side_by_side(path: Path, groups: Sequence[_Group]) -> LogTable:
    """Channels by their own name where that is told from all others, and by "group/channel" always."""
    names = [name for g in groups for name in g.channels]
    columns: dict[str, Array] = {}
    units: dict[str, str] = {}
    aliases: dict[str, str] = {}
    times: dict[str, bool | None] = {}
    for g in groups:
        for channel, values in g.channels.items():
            whole = f"{g.name}/{channel}"
            name = channel if names.count(channel) == 1 else whole
            columns[name] = values
            units |= {name: g.units[channel]} if channel in g.units else {}
            aliases |= {whole: name} if name != whole else {}
            times |= {name: True} if channel in g.times else {}
    _check_lengths(path, columns)
    clocks = [g.clock for g in groups if g.clock is not None]
    clock = _common(clocks)
    differing = any(g.differing for g in groups) or (bool(clocks) and clock is None)
    _check_one_time(path, groups)
    return LogTable(
        str(path),
        columns,
        units=units,
        aliases=aliases,
        clock=clock,
        differing=differing,
        times=times,
        clock_zone=next((g.dated for g in groups if g.clock is not None), None),
    )
