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
from focgen.logs.dialect import is_number, lines_of
from focgen.logs.scales import unit_of_time
from focgen.logs.table import LARGEST, LogTable, check_units
from focgen.logs.text_file import decoded, table_of
from focgen.logs.units import TIME_WORDS
from focgen.textfile import read_log_bytes

_END = "***End_of_Header***"
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";"}
_TIME, _COMMENT = "X_Value", "Comment"
_WORDS = {_COMMENT: "holds LabVIEW's words beside its rows"}
_DIGITS = 12  # of a count: more are none
_Line = tuple[int, Sequence[str]]


@dataclass(frozen=True, eq=False)
class _Segment:
    """``lines``: their cells and their number in the file, to the last one that holds anything; ``after``:
    how many empty ones follow. ``names`` of the cells, in order."""

    settings: Mapping[str, Sequence[str]]
    names: Sequence[str]
    lines: Sequence[_Line]
    after: int
    commented: bool

    @property
    def samples(self) -> int:
        """How many its header says that it has; 0 where it does not say."""
        given = self.settings.get("Samples", ())
        return max((int(cell) for cell in given if cell.isdecimal() and len(cell) < _DIGITS), default=0)


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is not whole; text without the format's first line is read as a
    table."""
    text, encoding = decoded(read_log_bytes(path), path)
    lines = text.splitlines()
    if not lines or not lines[0].startswith("LabVIEW Measurement"):
        return table_of(path, lambda: lines_of(text), encoding)
    settings, separator = _settings(lines)
    if not text.endswith(("\n", "\r")):
        lines[-1] = lines[-1].rstrip(separator)  # cut within a row, which then is not whole
    segments = [s for s in _segments(lines, separator) if s.lines]
    if not segments:
        raise LogError(str(path), "holds no segment with data", "write it again")
    return _table(path, segments, settings)


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
    cells = [[cell.strip() for cell in line.split(separator)] for line in lines]
    begins = [i for i, row in enumerate(cells) if row[0] == _TIME]
    heads = [_head(cells, begin) for begin in begins]
    for begin, head, end in zip(begins, heads, [*heads[1:], len(lines)]):
        width = max(j for j, name in enumerate(cells[begin], start=1) if name)
        commented = cells[begin][width - 1] == _COMMENT
        names = cells[begin][: width - commented]
        last = max((i for i in range(begin + 1, end) if any(cells[i])), default=begin)
        body = [(i, cells[i]) for i in range(begin + 1, last + 1)]
        yield _Segment(_keys(lines[head:begin], separator), names, body, end - last - 1, commented)


def _head(cells: Sequence[Sequence[str]], begin: int) -> int:
    """Where the header of the segment whose names are in row ``begin`` starts."""
    return next((i for i in range(begin, -1, -1) if cells[i][0] == "Channels"), begin)


def _table(path: Path, segments: Sequence[_Segment], settings: Mapping[str, Sequence[str]]) -> LogTable:
    """The segments one after the other. Raises LogError where they have different channels."""
    first, time = segments[0].names, settings.get("X_Columns", ["One"])[0]
    if any(s.names != first for s in segments):
        raise LogError(str(path), "holds segments with different channels", "save each as a file of its own")
    if time == "Multi":
        raise LogError(str(path), "holds a time for each channel", "save it with one column of X values")
    clocked = time == "No" or not any(row[0] for s in segments for _, row in s.lines)
    parts = [_rows(s, clocked) for s in segments]
    rows = [_whole(path, line, s) for s, part in zip(segments, parts) for line in part]
    _check_shifted(path, rows, len(first), begin=int(clocked))
    columns = {name: [row[j] for _, row in rows] for j, name in enumerate(first)}
    if len(columns) != len(first):
        raise LogError(str(path), "has a channel's name twice", "give each channel a name of its own")
    notes = (*_lost(segments, parts, clocked), *_blank(segments, parts, clocked))
    clock = None
    if clocked:
        clock = np.concatenate([_clock(path, s, len(part)) for s, part in zip(segments, parts)])
        columns = {name: column for name, column in columns.items() if name != _TIME}
        notes = (*_unknown_unit(segments), *notes)
    runs = [str(k) for k, part in enumerate(parts, start=1) for _ in part] if len(segments) > 1 else None
    return LogTable(
        str(path),
        columns,
        lambda row: f"line {rows[row][0] + 1}",
        decimal=settings.get("Decimal_Separator", ["."])[0],
        units=_units(path, segments),
        clock=clock,
        runs=runs,
        notes=notes,
        skipped=_WORDS if any(s.commented for s in segments) else {},
    )


def _rows(segment: _Segment, clocked: bool) -> list[_Line]:
    """Its lines that are rows. Where rows are counted for the time, one of separators alone is a row of
    missing readings. A line without these is none, unless its header counts it."""
    if not clocked:
        return [line for line in segment.lines if any(line[1])]
    if 0 <= segment.samples - len(segment.lines) <= segment.after:
        return list(segment.lines)
    return [line for line in segment.lines if not _is_bare(line[1])]


def _is_bare(row: Sequence[str]) -> bool:
    """Whether a line has neither cells nor separators."""
    return len(row) == 1 and not row[0]


def _whole(path: Path, line: _Line, segment: _Segment) -> _Line:
    """A row with a cell for each column at least, behind which a comment may stand. Raises LogError where it
    has fewer cells or more."""
    number, row = line
    width = len(segment.names)
    count = max((j for j, cell in enumerate(row, start=1) if cell), default=0)
    if not count:
        return number, [""] * width
    if width <= len(row) and count <= width + segment.commented:
        return line
    held = max(count, min(len(row), width))
    what = f"line {number + 1} has {held} values for {width} columns"
    remedy = "complete the line" if held < width else "take out the cell that is too many"
    raise LogError(str(path), what, remedy)


def _check_shifted(path: Path, rows: Sequence[_Line], width: int, begin: int) -> None:
    """Raise LogError where numbers stand in place of comments beside empty cells alone: so they do behind a
    cell too many. ``begin``: the first column that is to be filled."""
    ends = [line for line in rows if len(line[1]) > width and is_number(line[1][width].replace(",", "."))]
    if not ends or not all(_lacks_one(row[begin:width]) for _, row in ends):
        return
    what = f"has a number as comment of line {ends[0][0] + 1}, and an empty cell ahead of it"
    raise LogError(str(path), what, "take out the empty cell, or write the comment in words")


def _lacks_one(cells: Sequence[str]) -> bool:
    """Whether one is empty and another is not."""
    return any(cells) and not all(cells)


def _lost(segments: Sequence[_Segment], parts: Sequence[Sequence[_Line]], clocked: bool) -> tuple[str, ...]:
    """A note where a header counts other samples than there are rows. LabVIEW appends rows under one header,
    which counts the first of them: where each has its time, more of them mean nothing."""
    found = []
    for segment, part in zip(segments, parts):
        least, most = len(part), len(part if clocked else segment.lines) + segment.after
        appended = not clocked and segment.samples < least and len(segments) == 1
        if segment.samples and not least <= segment.samples <= most and not appended:
            found.append(f"{len(part)} rows from line {part[0][0] + 1} on, and {segment.samples} Samples")
    if not found:
        return ()
    after = "; its clock counts the rows" if clocked else ""
    more = f", and {len(found) - 1} more segments" if len(found) > 1 else ""
    return (f"its header counts other samples than there are rows: {found[0]}{more}{after}",)


def _blank(segments: Sequence[_Segment], parts: Sequence[Sequence[_Line]], clocked: bool) -> tuple[str, ...]:
    """A note where lines without separators stand among rows that are counted, and the header does not say
    that they are none."""
    if not clocked:
        return ()
    unsure = [s for s, part in zip(segments, parts) if s.samples != len(part)]
    found = [number for s in unsure for number, row in s.lines if _is_bare(row)]
    if not found:
        return ()
    return (f"{len(found)} blank lines among its rows are counted as none, the first is line {found[0] + 1}",)


def _units(path: Path, segments: Sequence[_Segment]) -> dict[str, str]:
    """The units by column. Raises LogError where segments differ in them, or go over no time."""
    names = segments[0].names[1:]
    units, *others = (dict(zip(names, s.settings.get("Y_Unit_Label", ()))) for s in segments)
    check_units(path, [units, *others])
    units |= _unit_of_time(path, segments)
    return {name: unit for name, unit in units.items() if unit}


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


def _clock(path: Path, segment: _Segment, rows: int) -> Array:
    """The time (m,) in s of its ``rows``, from the unit that the file gives for it.

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
    return seconds * (begin + step * np.arange(rows))
