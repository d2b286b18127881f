"""Logs that have the readings of one moment in several rows, one sensor under the other: refused."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from itertools import combinations

import numpy as np

from focgen.arrays import Array, Ints
from focgen.errors import LogError
from focgen.logs.clock import HELD, sittings
from focgen.logs.dialect import MISSING, is_number, is_stamp
from focgen.logs.parts import Raw
from focgen.logs.table import Column, LogTable

_HEAD = 2000  # rows of a run: by then a table shows how it is made
_MOST = 0.95  # of the rows have to show it: some are lost
_SENSORS = 32  # at most, one under the other
_OFTEN = 0.3  # of the rows name another one than the last
_NEARER = 0.1  # times nearer to its like than to its neighbour: readings of several sensors in turn
_WORDS = frozenset("sensor channel signal variable tag parameter quantity kanal".split())
_WIDE = "give each sensor a column of its own, and each time stamp one row"


def check_one_row_a_moment(table: LogTable, run: Raw, rows: slice | Ints, taken: Collection[str]) -> None:
    """Raise LogError where each row of a ``run``, which is ``rows`` of the table, holds one sensor: they pass
    for samples of a faster clock, or of two experiments. Columns that are ``taken`` have a role.
    """
    count = _of_one_stamp(run.time[:_HEAD])
    at = range(len(table))[rows] if isinstance(rows, slice) else rows
    names = {n: c for n, c in table.columns.items() if n not in taken and not isinstance(c, np.ndarray)}
    for name, column in names.items():
        words = [column[row] for row in at[:_HEAD]]
        if (count and _turns(words) == count) or _by_name(run, words):
            raise _stacked(run, f"has rows of several sensors, as {name!r} says", name)
        if _in_blocks(name, column, at, run.time):
            raise _stacked(run, f"has the same time stamps for each {name!r}, one under the other", name)
    if count and (_in_turn(run, count) or _in_pieces(run, count)):
        raise _stacked(run, f"has {count} rows of each time stamp, with readings of different sensors", None)


def _stacked(run: Raw, what: str, name: str | None) -> LogError:
    or_else = "log finer time stamps" if name is None else f"name {name!r} as run in [signals]"
    return LogError(run.where, what, f"{_WIDE}, or, where it is no such thing, {or_else}")


def _of_one_stamp(time: Array) -> int:
    """How many rows each time stamp (m,) has; 0 where that differs, or is one."""
    begins = np.flatnonzero(np.diff(time) != 0.0)
    counts = np.diff(begins)
    usual = int(np.median(counts)) if len(counts) > 1 else 1
    return usual if usual > 1 and np.mean(counts == usual) >= _MOST else 0


def _turns(words: Sequence[str]) -> int:
    """After how many rows a column of words comes round, each row another one; 0 where it does not.

    >>> _turns(["p", "y"] * 9), _turns(["p", "p", "y"] * 9), _turns(["1", "2"] * 9)
    (2, 0, 0)
    """
    count = next((k for k, word in enumerate(words[: _SENSORS + 1]) if k and word == words[0]), 0)
    first = words[:count]
    if len(set(first)) < 2 or len(set(first)) < count or not all(map(_is_word, first)):
        return 0
    return count if np.mean([a == b for a, b in zip(words, words[count:])]) >= _MOST else 0


def _is_word(cell: str) -> bool:
    return cell.lower() not in MISSING and not is_number(cell) and not is_stamp(cell)


def _by_name(run: Raw, words: Sequence[str]) -> bool:
    """Whether a measured signal is far nearer to the last row of the same word than to the last row, where
    the word is another one; and it often is."""
    before: dict[str, int] = {}
    pairs = []
    for row, word in enumerate(words):
        if row and word != words[row - 1] and word in before:
            pairs.append((row, before[word]))
        before[word] = row
        if len(before) > _SENSORS:
            return False
    if len(pairs) < _OFTEN * len(words) or not all(map(_is_word, before)):
        return False
    rows, like = np.array(pairs).T
    return any(_nearer(y[rows] - y[like], y[rows] - y[rows - 1]) for y in _measured(run))


def _measured(run: Raw) -> list[Array]:
    return [y[:_HEAD] for role, y in run.values.items() if role not in HELD]


def _nearer(like: Array, last: Array) -> bool:
    return float(np.median(np.abs(like))) < _NEARER * float(np.median(np.abs(last)))  # never of NaN


def _in_turn(run: Raw, count: int) -> bool:
    """Whether a measured signal is far nearer to what it was ``count`` rows before than to its last row."""
    return any(_nearer(y[count:] - y[:-count], np.diff(y)) for y in _measured(run))


def _in_pieces(run: Raw, count: int) -> bool:
    """Whether two signals have one reading each in ``count`` rows, never in the same one."""
    there = [~np.isnan(y[:_HEAD]) for y in run.values.values()]
    once = [each for each in there if abs(count * np.mean(each) - 1.0) <= 1.0 - _MOST]
    return any(np.mean(a & b) <= 1.0 - _MOST for a, b in combinations(once, 2))


def _in_blocks(name: str, column: Column, at: range | Ints, time: Array) -> bool:
    """Whether a column that is named for sensors names another one wherever the same stamps begin anew."""
    if _WORDS.isdisjoint(re.split(r"[^a-z]+", name.lower())):
        return False
    parts = sittings(time)
    first = time[parts[0]]
    if len(parts) < 2 or any(not np.array_equal(time[part], first) for part in parts):
        return False
    ends = [(column[at[part.start]], column[at[part.stop - 1]]) for part in parts]
    return all(a == b for a, b in ends) and len({a for a, _ in ends}) == len(ends)
