"""A table as read from a file, before any column has a role."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs import stamps
from focgen.logs.cells import Levels, parsed
from focgen.logs.dialect import grouped, is_stamp
from focgen.logs.units import in_unit
from focgen.textfile import check_regular

# The reader of each kind of file: a module of this room with ``read(path) -> LogTable``.
_TEXT = {
    ".csv": "focgen.logs.text_file",
    ".txt": "focgen.logs.text_file",
    ".tsv": "focgen.logs.text_file",
    ".lvm": "focgen.logs.lvm_file",
}
FOREIGN = {  # libraries of others, in C: each file in a process of its own
    ".parquet": "focgen.logs.parquet_file",
    ".mat": "focgen.logs.mat_file",
    ".tdms": "focgen.logs.tdms_file",
}
_READERS = {**_TEXT, **{f"{ending}.gz": module for ending, module in _TEXT.items()}, **FOREIGN}
LARGEST = 1e30
"""The size of a reading: powers and sums of larger ones have no number."""
Column = Sequence[str] | Array
"""Texts as they stand in a file, or numbers; (m,)."""
_UNGROUPED = "write numbers without a mark between thousands, and a decimal one as 1.2"
_ISO = "write it as 2026-01-31T12:00:00.000, or in seconds"
_DATE_OR_TIME = re.compile(r"\d:\d|\d{4}[-/_.T]\d{2}|\d[-/._]([a-zA-Z]{3}|\d{1,2})[-/._]\d{2}|^\d+ days?\b")
_LOOK = 100  # cells: by then a column of dates shows that it is one


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns of one length by name: texts as a file of text has them, or an array of shape (m,).

    ``line`` turns a row's index into the words that find it in the file ("line 17"). ``decimal``: the decimal
    mark of texts. ``units`` as the file gives them, by column. ``aliases``: further names of columns.
    ``clock`` (m,): the time in s that a file gives without a column for it. ``runs`` (m,): the name of the
    run of each row, where the file has them apart. ``notes``: how the file was read. ``differing``: its
    columns have clocks of their own that differ, so there is none. ``grouped``: columns whose points may
    stand between thousands; ``unsure``: those that show nothing else but numbers like "1.200". ``times``:
    columns that held instants or spans and are in s by nature, and whether they have a zone, None of spans.
    ``clock_zone``: the same of the ``clock``, None as well of one that does not count from 1970. ``skipped``:
    what the file holds besides and is no column, by name, and why. ``unnamed``: what the levels of an index
    hold (m,) that has no name, by words for it ("its index").
    """

    path: str
    columns: Mapping[str, Column]
    line: Callable[[int], str] = "row {}".format
    decimal: str = "."
    units: Mapping[str, str] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    clock: Array | None = None
    runs: Sequence[str] | None = None
    notes: tuple[str, ...] = ()
    differing: bool = False
    grouped: frozenset[str] = frozenset()
    unsure: frozenset[str] = frozenset()
    times: Mapping[str, bool | None] = field(default_factory=dict)
    clock_zone: bool | None = None
    skipped: Mapping[str, str] = field(default_factory=dict)
    unnamed: Mapping[str, Column] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __contains__(self, name: str) -> bool:
        return name in self.columns or name in self.aliases

    def column(self, name: str) -> Column:
        """A column (m,) by its name or another name of it."""
        return self.columns[name if name in self.columns else self.aliases[name]]

    def unit(self, name: str) -> str | None:
        """The unit that the file gives for a column."""
        return self.units.get(self.own(name))

    def closest(self, name: str, taken: Collection[str] = (), least: float = 0.6) -> str | None:
        """The column, not one of those ``taken``, whose name is nearest to ``name``, or None where none is
        near: has ``least`` of the letters of both in common.
        """
        names = [*self.columns, *self.aliases]
        lowered = {column.lower(): column for column in names if column not in taken}
        near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=least)
        return lowered[near[0]] if near else None

    def missing(self, role: str, name: str, taken: Collection[str] = ()) -> LogError:
        """The error for a column that is needed and not there; those ``taken`` have another role."""
        if role == "time" and self.differing:
            return self.without_clock()
        if name in self.skipped:
            what = f"has no column {name!r} ({role}) that can be read: it {self.skipped[name]}"
            return LogError(self.path, what.replace(";", ","), "save it as a vector, of one value a sample")
        near = self.closest(name, taken)
        there = ", ".join(self.columns)
        holder = next((n for n, c in self.columns.items() if n not in taken and _holds(c, name)), None)
        if holder is not None:
            what = f"has no column {name!r} ({role}), but rows that {holder!r} names so".replace(";", ",")
            remedy = "give each sensor a column of its own, and each time stamp one row"
            return LogError(self.path, what, remedy)
        hint = (
            f"write {role} = {near!r} in the rig's [signals]"
            if near
            else f"set {role} in the rig's [signals]"
        )
        return LogError(
            self.path, f"has no column {name!r} ({role}); there are: {there}".replace(";", ","), hint
        )

    def without_clock(self) -> LogError:
        """The error for a log whose rows have no time."""
        if self.differing:
            what = "gives its channels clocks that differ, so a row is not of one time"
            return LogError(self.path, what, "log all channels by one clock, or the time of each row")
        return LogError(self.path, "has no column that increases with time", "log the time of each sample")

    def texts(self, name: str) -> list[str]:
        """A column as text: numbers in the shortest form that tells them apart, "" where one is missing."""
        return [cell if isinstance(cell, str) else _shortest(cell) for cell in _plain(self.column(name))]

    def levels(self, name: str) -> Levels:
        """A column of names, each different one once."""
        column = self.column(name)
        return column if isinstance(column, Levels) else Levels.of(self.texts(name))

    def seconds(self, name: str, told: bool = False) -> Array:
        """A column of time (m,): numbers as they are, ISO dates and times of day in s. Raises LogError for a
        cell that is none of these, and where it may be read otherwise, unless the rig has ``told`` its unit.
        """
        column = self.column(name)
        dated = self.is_dated(name)
        if not isinstance(column, np.ndarray) and dated:
            try:
                found = stamps.seconds(column)
            except ValueError as reason:
                what = f"has a time that cannot be read ({reason})"
                raise LogError(f"{self.path} [{name}]", what, _ISO) from None
        else:
            found = self.numbers(name)
        other = None if told else stamps.other_reading(found, dated)
        if other is not None:
            remedy = f"{other[1]}, or, where it is no such thing, {in_unit(name)}"
            raise LogError(f"{self.path} [{name}]", other[0], remedy)
        return found

    def is_dated(self, name: str) -> bool:
        """Whether a column is one of dates or times of day, in text."""
        column = self.column(name)
        return not isinstance(column, np.ndarray) and _is_dated(column)

    def is_in_seconds(self, name: str) -> bool:
        """Whether a column of time is in s, whatever the rig has for other logs: of dates and spans."""
        return self.own(name) in self.times or self.is_dated(name)

    def has_zone(self, name: str) -> bool | None:
        """Whether the dates of a column have a zone; None of one that holds no dates. Where it is
        not there, the same of the log's own clock."""
        if self.own(name) in self.times:
            return self.times[self.own(name)]
        if name not in self:
            return self.clock_zone
        column = self.column(name)
        return None if isinstance(column, np.ndarray) or not _is_dated(column) else stamps.has_zone(column)

    def is_unsure(self, name: str) -> bool:
        """Whether nothing in the file tells 1.200 from 1200 in a column."""
        return self.own(name) in self.unsure

    def own(self, name: str) -> str:
        """The name of a column in :attr:`columns`, of whichever name of it."""
        return name if name in self.columns else self.aliases.get(name, name)

    def numbers(self, name: str) -> Array:
        """A column as float64; empty cells become NaN. Raises LogError for anything else that is no
        number.
        """
        column = self.column(name)
        if self.aliases.get(name, name) in self.grouped:
            what = "has whole numbers beside ones like 1.200, whose point may stand between thousands"
            raise LogError(f"{self.path} [{name}]", what, _UNGROUPED)
        try:
            plain = isinstance(column, np.ndarray) and column.dtype.kind in "fiu"
            values = column if plain else _values(column, self.decimal)
        except (ValueError, TypeError):
            raise self._not_a_number(name) from None
        values = np.asarray(values, dtype=float)
        beyond = np.abs(values) > LARGEST
        if beyond.any():
            row = int(np.argmax(beyond))
            what = "is infinite" if np.isinf(values[row]) else f"is {values[row]:g}"
            raise LogError(f"{self.path} [{name}]", f"{what} in {self.line(row)}", "remove or correct it")
        return values

    def _not_a_number(self, name: str) -> LogError:
        cells = enumerate(_plain(self.column(name)))
        row, cell = next((i, c) for i, c in cells if not _is_number(c, self.decimal))
        mark = next((mark for mark in ",." if grouped(str(cell), mark)), None)
        if mark is not None:
            whole = str(cell).replace(mark, "")
            what = f"holds {cell!r} in {self.line(row)}, which may be {whole} or have a decimal {mark!r}"
            return LogError(f"{self.path} [{name}]", what, _UNGROUPED)
        if _DATE_OR_TIME.search(str(cell)):
            what = f"holds {cell!r} in {self.line(row)}, which is no time that can be read"
            return LogError(f"{self.path} [{name}]", what, _ISO)
        remedy = (
            "write decimals with a point" if "," in str(cell) else "leave the cell empty or give a number"
        )
        return LogError(
            f"{self.path} [{name}]", f"holds {cell!r} in {self.line(row)}, which is no number", remedy
        )


def check_units(path: Path, units: Sequence[Mapping[str, str]]) -> None:
    """Raise LogError where the runs of a file give a column in different ``units`` (by column, one each)."""
    for name in dict.fromkeys(name for of_run in units for name in of_run):
        given = list(dict.fromkeys(of_run.get(name, "") for of_run in units))
        if len(given) > 1:
            what = f"gives {name!r} in {' and in '.join(unit or 'no unit' for unit in given)}, by the run"
            raise LogError(str(path), what, "save all runs in one unit, or each as a file of its own")


def read_table(path: str | Path) -> LogTable:
    """Read a log by its ending. Raises LogError where it is missing, empty or of an unknown kind."""
    name = Path(path).name.lower()
    kind = next((ending for ending in sorted(_READERS, key=len, reverse=True) if name.endswith(ending)), None)
    if kind is None:
        raise LogError(
            str(path), "is not a kind of log that can be read", f"give one of {', '.join(_READERS)}"
        )
    try:
        check_regular(path, LogError)
        table = _reader(kind)(Path(path))
    except OSError as reason:
        why = reason.strerror or " ".join(str(reason).split())
        raise LogError(str(path), f"cannot be read ({why})", "check the path") from None
    except ValueError as reason:
        if "\0" not in str(path):
            raise
        raise LogError(str(path), f"is no path ({reason})", "check the path") from None
    if table.clock is not None and not (np.abs(table.clock) <= LARGEST).all():
        raise LogError(str(path), "gives a time that is no number", "log the time of each sample")
    if not len(table):
        raise LogError(str(path), "holds no samples", "give a log with a header and one row a sample")
    return table


def _reader(kind: str) -> Callable[[Path], LogTable]:
    if kind in FOREIGN:
        from focgen.logs.subprocess_reader import read_in_subprocess  # which makes tables itself

        return partial(read_in_subprocess, _READERS[kind])
    made: Callable[[Path], LogTable] = import_module(_READERS[kind]).read
    return made


def stem(path: str | Path) -> str:
    """The file's name without folder and ending."""
    name = Path(path).name
    return Path(name[: -len(".gz")] if name.lower().endswith(".gz") else name).stem


def _holds(column: Column, word: str) -> bool:
    return not isinstance(column, np.ndarray) and word in column[:_LOOK]


def _plain(column: Column) -> list[Any]:
    return column.tolist() if isinstance(column, np.ndarray) else list(column)


def _shortest(number: float) -> str:
    if number != number:
        return ""
    short = f"{number:g}"
    return short if float(short) == number else f"{int(number)}" if number == int(number) else repr(number)


def _values(column: Column, decimal: str) -> Array | list[float]:
    return column.numbers(decimal) if isinstance(column, Levels) else parsed(_plain(column), decimal)


def _is_number(cell: object, decimal: str) -> bool:
    try:
        return bool(parsed([cell], decimal))
    except (ValueError, TypeError):
        return False


def _is_dated(column: Sequence[str]) -> bool:
    """Whether a text column begins with dates or times of day."""
    return any(is_stamp(str(cell)) for cell in column[:_LOOK])
