"""Columns of cells as they are read, row by row, in little memory: few texts as codes, numbers as numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, overload

import numpy as np

from focgen.arrays import Array, Ints, Numbers
from focgen.logs.dialect import MISSING, grouped

PART = 400_000
"""Cells that are held as texts before they are put away: of fewer, all stay as they stand in the file."""
_NUMBER = re.compile(r"\s*[-+]?\d*\.\d+(?:[eEdD][-+]?\d+)?\s*")
_LEVELS = 4096  # different texts that a column is kept as: names of runs, levels of a command
EXACT = 2**53
"""The largest size up to which floats tell all whole numbers apart."""


class Levels(Sequence[str]):
    """A column of few different ``texts``; ``codes`` (m,) says which of them each row has."""

    def __init__(self, texts: Sequence[str], codes: Ints) -> None:
        self.texts, self.codes = tuple(texts), codes

    @classmethod
    def of(cls, cells: Sequence[str]) -> Levels:
        """A column of ``cells`` (m,)."""
        known: dict[str, int] = {}
        codes = [known.setdefault(cell, len(known)) for cell in cells]
        return cls(tuple(known), np.array(codes, dtype=int))

    @classmethod
    def of_whole(cls, numbers: Numbers) -> Levels | None:
        """A column of whole numbers (m,) that floats would not tell apart, as names of runs may be; None
        where floats do, or the numbers are many."""
        if not numbers.size or numbers.dtype.kind not in "iu":
            return None
        if -EXACT <= int(numbers.min()) and int(numbers.max()) <= EXACT:
            return None
        different, codes = np.unique(numbers, return_inverse=True)
        if len(different) > _LEVELS or len(np.unique(different.astype(float))) == len(different):
            return None
        return cls([str(number) for number in different.tolist()], codes.reshape(-1))

    def __len__(self) -> int:
        return len(self.codes)

    @overload
    def __getitem__(self, at: int) -> str: ...

    @overload
    def __getitem__(self, at: slice) -> list[str]: ...

    def __getitem__(self, at: int | slice) -> str | list[str]:
        return (
            [self.texts[code] for code in self.codes[at]]
            if isinstance(at, slice)
            else self.texts[self.codes[at]]
        )

    def numbers(self, decimal: str) -> Array:
        """The column (m,) as float64. Raises ValueError where a text is none."""
        return np.array(parsed(self.texts, decimal))[self.codes]


class Gathered:
    """Rows put together to columns: ``add`` them one after the other, then take the ``columns``.

    ``pointed``: of each column, which texts its points stand in.
    """

    def __init__(self, width: int, decimal: str) -> None:
        self._columns = [_Growing(decimal) for _ in range(width)]
        self.pointed = [Points() for _ in range(width)]
        self._rows: list[Sequence[str]] = []
        self._most = max(1, PART // max(width, 1))

    def add(self, row: Sequence[str]) -> None:
        """One row of as many cells as there are columns."""
        self._rows.append(row)
        if len(self._rows) >= self._most:
            self._put_away()

    def columns(self) -> list[Sequence[str] | Array]:
        """Each column (m,): texts as they stand; of a long table few texts as :class:`Levels`, others as
        numbers."""
        self._look()
        if not any(column.begun for column in self._columns):
            return [list(cells) for cells in zip(*self._rows)] or [[] for _ in self._columns]
        self._put_away()
        return [column.taken() for column in self._columns]

    def _look(self) -> None:
        for pointed, cells in zip(self.pointed, zip(*self._rows)):
            pointed.see(cells)

    def _put_away(self) -> None:
        self._look()
        for column, cells in zip(self._columns, zip(*self._rows)):
            column.add(cells)
        self._rows = []


class Points:
    """Whether the points of a column stand between thousands, for all that its texts tell."""

    def __init__(self) -> None:
        self._whole = self._grouped = self._decimal = False

    def see(self, cells: Iterable[str]) -> None:
        """More of its texts. A point that is a decimal one for sure ends the matter; the point of a date says
        nothing of numbers."""
        if self._decimal:
            return
        for cell in cells:
            if "." not in cell:
                self._whole = self._whole or cell.isdigit()
            elif grouped(cell, "."):
                self._grouped = True
            elif _NUMBER.fullmatch(cell):
                self._decimal = True
                return

    @property
    def doubtful(self) -> bool:
        """Whether numbers like "1.200" stand beside whole ones like "999", and none like "0.5"."""
        return self._whole and self._grouped and not self._decimal

    @property
    def open(self) -> bool:
        """Whether all its points stand in numbers like "1.200", none of them beside a whole number."""
        return self._grouped and not self._whole and not self._decimal

    @property
    def decimal(self) -> bool:
        """Whether a point is a decimal one for sure."""
        return self._decimal


def marks(columns: Mapping[str, Sequence[str] | Array]) -> tuple[frozenset[str], frozenset[str]]:
    """Those columns of texts whose points may stand between thousands, where no text says otherwise: a
    table's ``grouped`` and ``unsure``."""
    seen = {name: Points() for name, cells in columns.items() if not _of_numbers(cells)}
    for name, points in seen.items():
        points.see(cell for cell in columns[name] if isinstance(cell, str))
    return marks_of(seen, told=False)


def marks_of(seen: Mapping[str, Points], told: bool) -> tuple[frozenset[str], frozenset[str]]:
    """The same of columns that have been seen; ``told``: the file says in another way what its points are."""
    if told or any(points.decimal for points in seen.values()):
        return frozenset(), frozenset()
    grouped = frozenset(name for name, points in seen.items() if points.doubtful)
    return grouped, frozenset(name for name, points in seen.items() if points.open)


def _of_numbers(cells: Sequence[str] | Array) -> bool:
    return isinstance(cells, np.ndarray) and cells.dtype.kind in "fiub"


class _Growing:
    """One column: levels while its texts are few, then numbers, and texts where it holds no numbers."""

    def __init__(self, decimal: str) -> None:
        self._decimal = decimal
        self._parts: list[Any] = []  # codes, numbers or texts, as far as the column has come
        self._codes: dict[str, int] | None = {}
        self._numeric = True

    @property
    def begun(self) -> bool:
        return bool(self._parts)

    def add(self, cells: Sequence[str]) -> None:
        if self._codes is not None and len(self._codes.keys() | set(cells)) > _LEVELS:
            self._leave_levels()
        part = self._part(cells)  # which may put the earlier ones in another form
        self._parts.append(part)

    def taken(self) -> Sequence[str] | Array:
        parts, self._parts = self._parts, []
        if not self._numeric and self._codes is None:
            return [cell for part in parts for cell in part]
        whole = np.concatenate(parts)
        return whole if self._codes is None else Levels(tuple(self._codes), whole)

    def _part(self, cells: Sequence[str]) -> Array | Ints | list[str]:
        if self._codes is not None:
            for cell in cells:
                self._codes.setdefault(cell, len(self._codes))
            return np.fromiter(map(self._codes.__getitem__, cells), np.int16, len(cells))
        if self._numeric:
            try:
                return np.array(parsed(cells, self._decimal))
            except ValueError:
                self._leave_numbers()
        return list(cells)

    def _leave_levels(self) -> None:
        levels, self._codes = tuple(self._codes or ()), None
        try:
            values = np.array(parsed(levels, self._decimal))
            self._parts = [values[part] for part in self._parts]
        except ValueError:
            self._numeric = False
            self._parts = [[levels[code] for code in part] for part in self._parts]

    def _leave_numbers(self) -> None:
        self._numeric = False
        self._parts = [[f"{value:g}" for value in part] for part in self._parts]


class Lines:
    """The line of the file that each row comes from; rows that follow one another are not counted one by
    one."""

    def __init__(self) -> None:
        self._rows, self._lines, self._count = list[int](), list[int](), 0

    def add(self, line: int) -> None:
        """The next row's, counted from 0."""
        if not self._rows or line != self._lines[-1] + self._count - self._rows[-1]:
            self._rows.append(self._count)
            self._lines.append(line)
        self._count += 1

    def __len__(self) -> int:
        return self._count

    def of(self, row: int) -> str:
        """The words that find a row in the file."""
        at = int(np.searchsorted(self._rows, row, side="right")) - 1
        return f"line {self._lines[at] + row - self._rows[at] + 1}"


def parsed(cells: Iterable[Any], decimal: str = ".") -> list[float]:
    """Numbers of cells, NaN for those that are missing. Raises ValueError and TypeError for anything else."""
    cells = list(cells)
    if any(isinstance(cell, str) and "_" in cell for cell in cells):
        raise ValueError  # Python reads 1_000 as a number, nobody else does
    if decimal == ",":
        if any(isinstance(cell, str) and grouped(cell, ".") for cell in cells):
            raise ValueError  # a point between thousands, or a decimal point after all: a factor of 1000
        cells = [cell.replace(",", ".") if isinstance(cell, str) else cell for cell in cells]
    try:
        return list(map(float, cells))  # most columns miss nothing
    except (ValueError, TypeError):
        return [math.nan if _is_missing(cell) else float(cell) for cell in cells]


def _is_missing(cell: object) -> bool:
    return cell is None or (isinstance(cell, str) and cell.lower() in MISSING)
