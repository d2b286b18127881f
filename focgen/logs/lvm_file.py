"""Logs in .lvm (LabVIEW measurement): settings, then segments, each with channels of its own.

Every segment is a run. Where the file has no column of time, its rows are X0 + i Delta_X apart. Format:
National Instruments, "Specification for the LabVIEW Measurement File (.lvm)".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs.dialect import lines_of
from focgen.logs.scales import unit_of_time
from focgen.logs.table import LARGEST, LogTable, check_units
from focgen.logs.text_file import decoded, table_of
from focgen.logs.units import TIME_WORDS
from focgen.textfile import read_log_bytes

_END = "***End_of_Header***"
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
_TIME, _COMMENT = "X_Value", "Comment"
_WORDS = {_COMMENT: "holds LabVIEW's words beside its rows"}


@dataclass(frozen=True, eq=False)
class _Segment:
    """``lines``: its rows of cells and their number in the file; ``names`` of the cells, in order."""

    settings: Mapping[str, Sequence[str]]
    names: Sequence[str]
    lines: Sequence[tuple[int, Sequence[str]]]
    commented: bool


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is not whole; text without the format's first line is read as a
    table."""
    text, encoding = decoded(read_log_bytes(path), path)
    lines = text.splitlines()
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        return table_of(path, lambda: lines_of(text), encoding)
    settings, separator = _settings(lines)
    segments = [s for s in _segments(lines, separator) if s.lines]
    if not segments:
        raise LogError(str(path), "holds no segment with data", "write it again")
    decimal = settings.get("Decimal_Separator", ["."])[0]
    return _table(path, segments, decimal, settings.get("X_Columns", ["One"])[0])


def _settings(lines: Sequence[str]) -> tuple[dict[str, list[str]], str]:
    """The keys of the first header, and what separates columns."""
    named = next(
        (line[len("Separator") :].strip(" ") for line in lines if line.startswith("Separator")), "\t"
    )
    separator = next((mark for name, mark in _SEPARATORS.items() if name in named), named[:1] or "\t")
    return _keys(lines[: lines.index(_END)] if _END in lines else lines, separator), separator


def _keys(lines: Sequence[str], separator: str) -> dict[str, list[str]]:
    cells = [line.split(separator) for line in lines]
    return {row[0].strip(): [cell.strip() for cell in row[1:]] for row in cells if len(row) > 1}


def _segments(lines: Sequence[str], separator: str) -> Iterator[_Segment]:
    """Yield each: the lines behind the end of its header begin with the names of its columns."""
    cells = [[cell.strip() for cell in line.rstrip(separator).split(separator)] for line in lines]
    begins = [i for i, row in enumerate(cells) if row[0] == _TIME]
    heads = [_head(cells, begin) for begin in begins]
    for begin, head, end in zip(begins, heads, [*heads[1:], len(lines)]):
        names = [name for name in cells[begin] if name != _COMMENT]
        body = [(i, cells[i]) for i in range(begin + 1, end) if any(cells[i])]
        commented = _COMMENT in cells[begin]
        yield _Segment(_keys(lines[head:begin], separator), names, body, commented)


def _head(cells: Sequence[Sequence[str]], begin: int) -> int:
    """Where the header of the segment whose names are in row ``begin`` starts."""
    return next((i for i in range(begin, -1, -1) if cells[i][0] == "Channels"), begin)


def _table(path: Path, segments: Sequence[_Segment], decimal: str, time: str) -> LogTable:
    """The segments one after the other. Raises LogError where they have different channels."""
    first = segments[0].names
    if any(s.names != first for s in segments):
        raise LogError(str(path), "holds segments with different channels", "save each as a file of its own")
    if time == "Multi":
        raise LogError(str(path), "holds a time for each channel", "save it with one column of X values")
    rows = [row for s in segments for row in s.lines]
    for number, row in rows:
        if len(row) > len(first) + 1 or len(row) < len(first):
            what = f"line {number + 1} has {len(row)} values for {len(first)} columns"
            raise LogError(str(path), what, "complete the line")
    columns = {name: [row[j] for _, row in rows] for j, name in enumerate(first)}
    if len(columns) != len(first):
        raise LogError(str(path), "has a channel's name twice", "give each channel a name of its own")
    clock = None
    if time == "No" or not any(columns[_TIME]):
        clock = np.concatenate([_clock(path, s) for s in segments])
        columns = {name: column for name, column in columns.items() if name != _TIME}
    runs = [str(k) for k, s in enumerate(segments, start=1) for _ in s.lines] if len(segments) > 1 else None
    notes = _unknown_unit(segments) if clock is not None else ()
    units, *others = (dict(zip(first[1:], s.settings.get("Y_Unit_Label", ()))) for s in segments)
    check_units(path, [units, *others])
    units |= _unit_of_time(path, segments)
    return LogTable(
        str(path),
        columns,
        lambda row: f"line {rows[row][0] + 1}",
        decimal=decimal,
        units={name: unit for name, unit in units.items() if unit},
        clock=clock,
        runs=runs,
        notes=notes,
        skipped=_WORDS if any(s.commented for s in segments) else {},
    )


def _unit_of_time(path: Path, segments: Sequence[_Segment]) -> dict[str, str]:
    """The unit of the column of X values, where the file gives one. Raises LogError where these are no time:
    the frequencies of a spectrum."""
    said = [s.settings.get("X_Dimension", [""])[0].strip() for s in segments]
    other = next((what for what in said if what and what.lower() not in TIME_WORDS), None)
    if other:
        what = f"goes over {other.lower()}, not over time"
        raise LogError(str(path), what, "save what was measured over time, or write Time as X_Dimension")
    given = [{_TIME: _label(s)} for s in segments]
    check_units(path, given)
    return {name: unit for name, unit in given[0].items() if unit}


def _unknown_unit(segments: Sequence[_Segment]) -> tuple[str, ...]:
    """A note where the steps of a clock are in what is no unit of time that is known."""
    unit = _label(segments[0])
    known = not unit or unit_of_time(unit) is not None
    return () if known else (f"{unit!r} is no unit of time that is known: Delta_X is taken as in s",)


def _label(segment: _Segment) -> str:
    """The unit of the X values, "" where the file gives none."""
    return (segment.settings.get("X_Unit_Label") or [""])[0].strip()


def _clock(path: Path, segment: _Segment) -> Array:
    """The time (m,) in s, from the unit that the file gives for it.

    Raises LogError where the file does not say the time, or says another of each channel."""
    count = len(segment.names) - 1
    try:
        given = [
            {float(cell.replace(",", ".")) for cell in segment.settings[key][:count]}
            for key in ("X0", "Delta_X")
        ]
        (begin, *others), (step, *more) = given
        if not max(abs(begin), abs(step)) <= LARGEST:
            raise ValueError(step)
    except (KeyError, ValueError):
        raise LogError(str(path), "has neither a column of time nor Delta_X", "log the time") from None
    if others or more:
        what = "gives its channels different X0 or Delta_X, so a row is not of one time"
        raise LogError(str(path), what, "save it with one column of X values")
    _, seconds = unit_of_time(_label(segment) or "s") or ("", 1.0)
    return seconds * (begin + step * np.arange(len(segment.lines)))
