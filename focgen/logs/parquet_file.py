"""Logs in .parquet."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.stamps import is_time, of_numpy
from focgen.logs.table import LogTable


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is damaged, MissingExtra without pyarrow."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra.of("pyarrow", "parquet", str(path)) from None
    path.open("rb").close()  # a missing file is reported as one
    try:
        _check_names(path, pyarrow.parquet.read_schema(path).names)
        # checksums of pages are not asked after by default, where a file has them
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
    except MemoryError:  # Arrow's, too
        raise
    except (pyarrow.ArrowException, OSError):
        raise LogError(str(path), "is not a whole Parquet file", "write it again") from None
    columns = {name: _numpy(pyarrow, table.column(name)) for name in table.column_names}
    units = {name: "s" for name, values in columns.items() if is_time(values)}
    times = {name: _zone(table.schema.field(name).type) for name in units}
    read = {name: _column(values) for name, values in columns.items()}
    return LogTable(str(path), read, units=units, times=times)


def _check_names(path: Path, names: list[str]) -> None:
    """Raise LogError for a name that two columns have: Arrow takes the file for a damaged one."""
    doubled = next((name for name, count in Counter(names).items() if count > 1), None)
    if doubled is not None:
        raise LogError(str(path), f"has the column {doubled!r} twice", "give each column a name of its own")


def _numpy(pyarrow: Any, column: Any) -> Array:
    """A column as numpy has it: decimals as the numbers that they are."""
    made: Array = (column.cast("float64") if pyarrow.types.is_decimal(column.type) else column).to_numpy()
    return made


def _zone(kind: Any) -> bool | None:
    """Whether a type of instants has a zone; None of a type of spans."""
    return None if "duration" in str(kind) else getattr(kind, "tz", None) is not None


def _column(column: Array) -> Array | list[Any]:
    """Numbers as an array with NaN for nulls, time stamps in s, everything else as a list."""
    values = of_numpy(column)
    return values if values.dtype.kind in "fiu" else values.tolist()
