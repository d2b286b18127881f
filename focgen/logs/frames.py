"""Logs that are in memory: a pandas or polars frame, or a dictionary of arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs.stamps import of_numpy
from focgen.logs.table import LogTable


class Frame(Protocol):
    """What pandas and polars frames have in common: columns, by name."""

    @property
    def columns(self) -> Iterable[Any]:
        """The columns' names."""

    def __getitem__(self, key: Any, /) -> Any: ...


def is_frame(log: object) -> bool:
    """Whether a log is in memory: a dictionary, or what has columns."""
    return isinstance(log, Mapping) or hasattr(log, "columns")


def table_of(frame: Frame | Mapping[Any, Any], name: str) -> LogTable:
    """A frame, or a dictionary name → values (m,), as the table of a log that is called ``name``.

    An index that has a name, or holds times, is a column, too. Raises LogError where columns are no vectors
    of one length.
    """
    columns = {str(key): _column(frame[key], name, str(key)) for key in _keys(frame)}
    index = getattr(frame, "index", None)
    clock: Array | None = None
    if index is not None and not callable(index) and str(index.name) not in columns:
        values = _column(index, name, "index")
        named = {} if index.name is None else {str(index.name): values}
        columns = named | columns
        if isinstance(values, np.ndarray) and np.asarray(index).dtype.kind in "mM":
            clock = values
    if len({len(values) for values in columns.values()}) > 1:
        sizes = ", ".join(f"{key} {len(values)}" for key, values in columns.items())
        raise LogError(name, f"holds columns of different lengths ({sizes})", "give one value a sample")
    if not columns or not len(next(iter(columns.values()))):
        raise LogError(name, "holds no samples", "give one row a sample")
    return LogTable(name, columns, clock=clock)


def _keys(frame: Frame | Mapping[Any, Any]) -> list[Any]:
    return list(frame) if isinstance(frame, Mapping) else list(frame.columns)


def _column(values: Any, name: str, key: str) -> Array | list[Any]:
    """Numbers as float64, times in s, everything else as a list."""
    try:
        array = np.asarray(values)
    except (ValueError, TypeError):
        raise LogError(f"{name} [{key}]", "is no vector", "give one number a sample") from None
    if array.ndim != 1:
        raise LogError(f"{name} [{key}]", f"has the shape {array.shape}", "give one number a sample")
    array = of_numpy(array)
    return array.astype(float) if array.dtype.kind in "fiub" else [_cell(cell) for cell in array.tolist()]


def _cell(cell: Any) -> Any:
    return None if cell is None or cell != cell else cell if isinstance(cell, float | int) else str(cell)
