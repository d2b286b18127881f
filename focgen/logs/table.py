"""A table as read from a file, before any column has a role."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np

from focgen.errors import LogError

# The reader of each kind of file: a module of this room with ``read(path) -> LogTable``.
_READERS = {
    ".csv": "focgen.logs.csv_file",
    ".csv.gz": "focgen.logs.csv_file",
    ".parquet": "focgen.logs.parquet_file",
    ".mat": "focgen.logs.mat_file",
    ".tdms": "focgen.logs.tdms_file",
}
_BINARY = (".parquet", ".mat", ".tdms")  # foreign readers, each in a process of its own


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns of one length by name: texts as a file of text has them, or an array of shape (m,).

    ``line`` turns a row's index into the words that find it in the file ("line 17").
    """

    path: str
    columns: Mapping[str, Sequence[str] | np.ndarray]
    line: Callable[[int], str] = "row {}".format

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def closest(self, name: str, taken: Collection[str] = ()) -> str | None:
        """The column, not one of those ``taken``, whose name is nearest to ``name``, or None where none is
        near.
        """
        lowered = {column.lower(): column for column in self.columns if column not in taken}
        near = difflib.get_close_matches(name.lower(), lowered, n=1, cutoff=0.6)
        return lowered[near[0]] if near else None

    def missing(self, role: str, name: str, taken: Collection[str] = ()) -> LogError:
        """The error for a column that is needed and not there; those ``taken`` have another role."""
        near = self.closest(name, taken)
        there = ", ".join(self.columns)
        hint = (
            f"write {role} = {near!r} in the rig's [signals]"
            if near
            else f"set {role} in the rig's [signals]"
        )
        return LogError(
            self.path, f"has no column {name!r} ({role}); there are: {there}".replace(";", ","), hint
        )

    def texts(self, name: str) -> list[str]:
        """A column as text, numbers in their shortest form."""
        return [cell if isinstance(cell, str) else f"{cell:g}" for cell in _plain(self.columns[name])]

    def numbers(self, name: str) -> np.ndarray:
        """A column as float64; empty cells become NaN. Raises LogError for anything else that is no
        number.
        """
        column = self.columns[name]
        try:
            values = (
                column if isinstance(column, np.ndarray) and column.dtype.kind in "fiu" else _parsed(column)
            )
        except (ValueError, TypeError):
            raise self._not_a_number(name) from None
        values = np.asarray(values, dtype=float)
        if np.isinf(values).any():
            row = int(np.argmax(np.isinf(values)))
            raise LogError(
                f"{self.path} [{name}]", f"is infinite in {self.line(row)}", "remove or correct it"
            )
        return values

    def _not_a_number(self, name: str) -> LogError:
        row, cell = next((i, c) for i, c in enumerate(_plain(self.columns[name])) if not _is_number(c))
        remedy = (
            "write decimals with a point" if "," in str(cell) else "leave the cell empty or give a number"
        )
        return LogError(
            f"{self.path} [{name}]", f"holds {cell!r} in {self.line(row)}, which is no number", remedy
        )


def read_table(path: str | Path) -> LogTable:
    """Read a log by its ending. Raises LogError where it is missing, empty or of an unknown kind."""
    name = Path(path).name.lower()
    kind = next((ending for ending in sorted(_READERS, key=len, reverse=True) if name.endswith(ending)), None)
    if kind is None:
        raise LogError(
            str(path), "is not a kind of log that can be read", f"give one of {', '.join(_READERS)}"
        )
    try:
        table = _reader(kind)(Path(path))
    except OSError as reason:
        why = reason.strerror or " ".join(str(reason).split())
        raise LogError(str(path), f"cannot be read ({why})", "check the path") from None
    if not len(table):
        raise LogError(str(path), "holds no samples", "give a log with a header and one row a sample")
    return table


def _reader(kind: str) -> Callable[[Path], LogTable]:
    if kind in _BINARY:
        from focgen.logs.apart import read_apart  # which makes tables itself

        return partial(read_apart, _READERS[kind])
    return import_module(_READERS[kind]).read


def stem(path: str | Path) -> str:
    """The file's name without folder and ending."""
    name = Path(path).name
    return name[: -len(".csv.gz")] if name.lower().endswith(".csv.gz") else Path(name).stem


def _plain(column) -> list:
    return column.tolist() if isinstance(column, np.ndarray) else list(column)


def _parsed(column) -> list[float]:
    cells = _plain(column)
    if any(isinstance(cell, str) and "_" in cell for cell in cells):
        raise ValueError  # Python reads 1_000 as a number, nobody else does
    return [float(cell) if cell not in ("", None) else math.nan for cell in cells]


def _is_number(cell) -> bool:
    try:
        return bool(_parsed([cell]))
    except (ValueError, TypeError):
        return False
