"""Time stamps written as dates or times of day (ISO 8601), as seconds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, time

import numpy as np

from focgen.arrays import Array

_DAY = 86400.0


def seconds(cells: Sequence[str]) -> Array:
    """Seconds (m,): since 1970 of dates (without a zone: UTC), since midnight of times of day.

    A time of day that falls back by more than half a day has passed midnight. Empty cells become NaN. Raises
    ValueError for anything else.
    """
    filled = [cell for cell in cells if cell]
    of = _since_1970 if filled and _has_date(filled[0]) else _since_midnight
    found = np.array([of(cell) if cell else np.nan for cell in cells])
    return found if of is _since_1970 else _past_midnight(found)


def of_numpy(values: Array) -> Array:
    """Times of numpy (m,), instants or spans, in s; others as they are."""
    kinds = {"M": "datetime64[ns]", "m": "timedelta64[ns]"}
    kind = kinds.get(values.dtype.kind)
    return values if kind is None else values.astype(kind).astype(np.int64) * 1e-9


def _has_date(cell: str) -> bool:
    return "-" in cell or len(cell) > len("23:59:59.999999999")


def _since_1970(cell: str) -> float:
    stamp = datetime.fromisoformat(cell)
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()


def _since_midnight(cell: str) -> float:
    hours = cell if cell[1:2] != ":" else f"0{cell}"
    of_day = time.fromisoformat(hours)
    return of_day.hour * 3600.0 + of_day.minute * 60.0 + of_day.second + of_day.microsecond * 1e-6


def _past_midnight(found: Array) -> Array:
    known = np.flatnonzero(~np.isnan(found))
    found[known] += _DAY * np.cumsum(np.diff(found[known], prepend=found[known[:1]]) < -0.5 * _DAY)
    return found
