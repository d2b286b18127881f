"""Logs in .parquet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.stamps import of_numpy
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
        table = pyarrow.parquet.read_table(path)
    except MemoryError:  # Arrow's, too
        raise
    except (pyarrow.ArrowException, OSError):
        raise LogError(str(path), "is not a whole Parquet file", "write it again") from None
    return LogTable(str(path), {name: _column(table.column(name)) for name in table.column_names})


def _column(column: Any) -> Array | list[Any]:
    """Numbers as an array with NaN for nulls, time stamps in s, everything else as a list."""
    values = of_numpy(column.to_numpy())
    return values if values.dtype.kind in "fiu" else values.tolist()
