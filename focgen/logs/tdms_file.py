"""Logs in .tdms (LabVIEW): one channel a column, named by the channel, or "group/channel" where names
repeat.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from focgen.errors import LogError, MissingExtra
from focgen.logs.table import LogTable


def read(path: Path) -> LogTable:
    """Read a file. Raises LogError where it is damaged or its channels differ in length, MissingExtra without
    nptdms.
    """
    try:
        import nptdms
        from nptdms.log import log_manager
    except ImportError:
        raise MissingExtra.of("nptdms", "tdms", str(path)) from None
    log_manager.set_level(logging.ERROR)  # what it warns of is refused below, in one line
    path.open("rb").close()
    try:
        groups = nptdms.TdmsFile.read(path).groups()
        channels = [
            (group.name, channel.name, np.asarray(channel[:]))
            for group in groups
            for channel in group.channels()
        ]
    except MemoryError:
        raise
    except Exception:  # nptdms has no error of its own for damaged files
        raise LogError(str(path), "is not a whole TDMS file", "write it again") from None
    names = [channel for _, channel, _ in channels]
    columns = {
        channel if names.count(channel) == 1 else f"{group}/{channel}": _seconds(values)
        for group, channel, values in channels
        if len(values)
    }
    if len({len(values) for values in columns.values()}) > 1:
        sizes = ", ".join(f"{name} {len(values)}" for name, values in columns.items())
        raise LogError(str(path), f"holds channels of different lengths ({sizes})", "log them at one rate")
    return LogTable(str(path), columns)


def _seconds(values: np.ndarray) -> np.ndarray:
    if values.dtype.kind == "M":
        return values.astype("datetime64[ns]").astype(np.int64) * 1e-9
    return values
