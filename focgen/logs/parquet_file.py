"""Logs in .parquet."""

from __future__ import annotations

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
        # checksums of pages are not asked after by default, where a file has them
        table = pyarrow.parquet.read_table(path, page_checksum_verification=True)
    except MemoryError:  # Arrow's, too
        raise
    except (pyarrow.ArrowException, OSError):
        raise LogError(str(path), "is not a whole Parquet file", "write it again") from None
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    units = {name: "s" for name, values in columns.items() if is_time(values)}
    times = {name: _zone(table.schema.field(name).type) for name in units}
    read = {name: _column(values) for name, values in columns.items()}
    return LogTable(str(path), read, units=units, times=times)


def _zone(kind: Any) -> bool | None:
    """Whether a type of instants has a zone; None of a type of spans."""
    return None if "duration" in str(kind) else getattr(kind, "tz", None) is not None


def _column(column: Array) -> Array | list[Any]:
    """Numbers as an array with NaN for nulls, time stamps in s, everything else as a list."""
    values = of_numpy(column)
    return values if values.dtype.kind in "fiu" else values.tolist()
