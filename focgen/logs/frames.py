"""Logs that are in memory: a pandas or polars frame, or a dictionary of arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import Any, Protocol

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError
from focgen.logs.cells import EXACT, Levels, marks
from focgen.logs.stamps import is_time, of_numpy
from focgen.logs.table import Column, LogTable


class Frame(Protocol):
    """What pandas and polars frames have in common: columns, by name."""

    @property
    def columns(self) -> Iterable[Any]:
        """The columns' names."""

    def __getitem__(self, key: Any, /) -> Any: ...


def is_frame(log: object) -> bool:
    """Whether a log is in memory: a dictionary, or what has columns."""
    return isinstance(log, Mapping) or hasattr(type(log), "columns") or hasattr(log, "columns")


def table_of(frame: Frame | Mapping[Any, Any], name: str) -> LogTable:
    """A frame, or a dictionary name → values (m,), as the table of a log that is called ``name``.

    An index that has a name, or holds times, is a column, too. Raises LogError where columns are no vectors
    of one length.
    """
    if callable(getattr(frame, "collect", None)):
        raise LogError(name, "is a query of polars that has not been run", "give what its collect() returns")
    _check_keys(frame, name)
    given = _levels_of_index(frame) | {str(key): frame[key] for key in _keys(frame)}
    columns: dict[str, Column] = {key: _column(values, name, key) for key, values in given.items()}
    units = {key: unit for key, values in given.items() if (unit := _unit(values))}
    times = {key: _zone(values) for key, values in given.items() if _holds_times(values)}
    index = getattr(frame, "index", None)
    clock: Array | None = None
    zone: bool | None = None
    if index is not None and not callable(index) and str(index.name) not in columns:
        values = _column(index, name, "index")
        named: dict[str, Column] = {} if index.name is None else {str(index.name): values}
        columns = named | columns
        if isinstance(values, np.ndarray) and is_time(np.asarray(index)):
            clock, zone = values, _zone(index)
            units |= dict.fromkeys(named, "s")
            times |= dict.fromkeys(named, zone)
    if len({len(values) for values in columns.values()}) > 1:
        sizes = ", ".join(f"{key} {len(values)}" for key, values in columns.items())
        raise LogError(name, f"holds columns of different lengths ({sizes})", "give one value a sample")
    if not columns or not len(next(iter(columns.values()))):
        raise LogError(name, "holds no samples", "give one row a sample")
    grouped, unsure = marks(columns)
    return LogTable(
        name,
        columns,
        units=units,
        clock=clock,
        grouped=grouped,
        unsure=unsure,
        times=times,
        clock_zone=zone,
        unnamed=_unnamed_levels(frame, name) if clock is None else {},
    )


def _levels_of_index(frame: Frame | Mapping[Any, Any]) -> dict[str, Any]:
    """What the levels of an index hold (m,), by their names: ``pandas.concat`` names runs so."""
    index: Any = getattr(frame, "index", None)
    names = getattr(index, "names", None)
    if names is None or len(names) < 2:
        return {}
    return {str(key): index.get_level_values(k) for k, key in enumerate(names) if key is not None}


def _unnamed_levels(frame: Frame | Mapping[Any, Any], name: str) -> dict[str, Column]:
    """What the levels of an index hold (m,) that has no name, by words: ``pandas.concat`` leaves runs so,
    where it is not told ``names``. One that only counts the rows holds nothing."""
    index: Any = getattr(frame, "index", None)
    names = getattr(index, "names", None)
    if names is None or hasattr(index, "step"):
        return {}
    whose = ["its index"] if len(names) < 2 else [f"level {k} of its index" for k in range(len(names))]
    held = {whose[k]: index.get_level_values(k) for k, key in enumerate(names) if key is None}
    return {words: _column(values, name, "index") for words, values in held.items()}


def _check_keys(frame: Frame | Mapping[Any, Any], name: str) -> None:
    """Raise LogError for a frame of another kind, and for two columns of one name, such as 1 and "1"."""
    if hasattr(frame, "column_names"):
        raise LogError(name, "is a table of pyarrow", "give what its to_pandas() returns")
    twice = [key for key, count in Counter(map(str, dict.fromkeys(_keys(frame)))).items() if count > 1]
    if twice:
        what = f"has two columns called {twice[0]}, one by a text and one by a number"
        raise LogError(name, what.replace(";", ","), "give each column a name of its own")


def _zone(values: Any) -> bool | None:
    """Whether a column of instants has a zone, None of spans. Pandas and polars say so by their types, each
    in its way; arrays of numpy never have one."""
    if np.asarray(values).dtype.kind == "m":
        return None
    kind = getattr(values, "dtype", None)
    return any(getattr(kind, way, None) is not None for way in ("tz", "time_zone"))


def _keys(frame: Frame | Mapping[Any, Any]) -> list[Any]:
    return list(frame) if isinstance(frame, Mapping) else list(frame.columns)


def _column(values: Any, name: str, key: str) -> Column:
    """Numbers as float64, times in s, everything else as texts."""
    try:
        array = _vector(values)
    except (ValueError, TypeError, ArithmeticError):
        raise LogError(f"{name} [{key}]", "is no vector", "give one number a sample") from None
    if array.ndim != 1:
        raise LogError(f"{name} [{key}]", f"has the shape {array.shape}", "give one number a sample")
    array = of_numpy(array)
    whole = Levels.of_whole(array)
    if whole is not None:
        return whole
    return array.astype(float) if array.dtype.kind in "fiub" else _cells(array.tolist())


def _vector(values: Any) -> Array:
    """As an array of numpy: NaN where a mask is, without the unit that a quantity has."""
    values = getattr(values, "magnitude", values)
    array = _array(values)
    if not np.ma.isMaskedArray(values):
        return array
    kind: Any = float if array.dtype.kind in "fiub" else object
    made: Array = np.where(np.ma.getmaskarray(values), np.nan, array.astype(kind))
    return made


def _array(values: Any) -> Array:
    """As numpy has it; whole numbers of 128 bits, which it has not, one by one."""
    try:
        return np.asarray(values)
    except Exception:  # polars has errors of its own
        if not callable(getattr(values, "to_list", None)):
            raise
        return np.array(values.to_list(), dtype=object)


def _unit(values: Any) -> str | None:
    """The unit of a column that has one of its own: of times, and of quantities."""
    if hasattr(values, "magnitude") and hasattr(values, "units"):
        return f"{values.units:~}" or None
    return "s" if _holds_times(values) else None


def _holds_times(values: Any) -> bool:
    """Whether a column holds instants or spans of numpy; of a quantity its unit tells."""
    return not hasattr(values, "magnitude") and is_time(_array(values))


def _cells(cells: list[Any]) -> Array | list[str]:
    """Numbers as float64, NaN where one is missing; else all as texts, "" where one is missing."""
    missing = [_is_missing(cell) for cell in cells]
    known = [cell for cell, none in zip(cells, missing) if not none]
    numeric = bool(known) and all(isinstance(cell, float | int | Decimal) for cell in known)
    if numeric and not _fall_together(known):
        return np.array([np.nan if none else _number(cell) for cell, none in zip(cells, missing)])
    return ["" if none else str(cell) for cell, none in zip(cells, missing)]


def _fall_together(cells: list[Any]) -> bool:
    """Whether some of these are whole numbers that floats would not tell apart."""
    whole = {cell for cell in cells if isinstance(cell, int) and abs(cell) >= EXACT}
    known = [number for number in map(_number, whole) if np.isfinite(number)]
    return len(set(known)) < len(known)


def _number(cell: float | Decimal) -> float:
    """As a float: infinite where it is beyond all of them, which is refused by its row."""
    try:
        return float(cell)
    except OverflowError:
        return np.inf if cell > 0 else -np.inf


def _is_missing(cell: Any) -> bool:
    """Whether it is None, NaN, NaT or what pandas has for them, which cannot be compared, as the signalling
    NaN of decimals cannot."""
    try:
        return cell is None or bool(cell != cell)
    except (TypeError, ValueError, ArithmeticError):
        return True
