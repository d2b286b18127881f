"""The process that reads one log: ``python -m focgen.logs.reader MODULE PATH``.

Answers on stdout: a line of JSON, ``{"columns": [[name, texts or null, count], …], "units": …, "aliases": …,
"runs": …, "differing": …, "clock": …}`` or ``{"fault": [kind, …]}``, and behind it the columns of numbers
and the clock as float64, one after the other.
"""

from __future__ import annotations

import json
import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from focgen.arrays import Array
from focgen.errors import LogError, MissingExtra
from focgen.logs.cells import Levels
from focgen.logs.table import FOREIGN, LogTable

MEMORY = 4 << 30  # bytes; a log of 10 million rows and 20 columns takes less than half


def main(module: str, path: Path) -> None:
    """Read and answer. What goes wrong is an answer, too."""
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints is no part of it
    _limit()
    try:
        head, columns = _columns(_read(module, path))
    except (LogError, MissingExtra) as error:
        head, columns = {"fault": [type(error).__name__, error.where, error.what, error.remedy]}, []
    except OSError as reason:
        head, columns = {"fault": ["OSError", reason.errno, reason.strerror or str(reason)]}, []
    except MemoryError:
        what = f"takes more than {MEMORY >> 30} GB to read"
        head, columns = {"fault": ["LogError", str(path), what, "split it into smaller files"]}, []
    except Exception as reason:  # noqa: BLE001 - readers raise whatever a damaged file leads them to
        what = f"is damaged: its reader stopped with {_kind(reason)}"
        head, columns = {"fault": ["LogError", str(path), what, "save it again, or as .csv"]}, []
    answer.write(json.dumps(head).encode("ascii") + b"\n")
    for column in columns:
        answer.write(column.data)
    answer.close()


def _kind(reason: Exception) -> str:
    kind = type(reason)
    return kind.__name__ if kind.__module__ == "builtins" else f"{kind.__module__}.{kind.__name__}"


def _read(module: str, path: Path) -> LogTable:
    if module not in FOREIGN.values():
        raise ValueError(module)
    made: LogTable = import_module(module).read(path)
    return made


def _limit() -> None:
    """Bound memory, where the system can; leave no core behind."""
    try:
        import resource
    except ImportError:
        return
    for what, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        try:
            resource.setrlimit(what, (most if hard < 0 else min(most, hard), hard))
        except (OSError, ValueError):  # a system that does not know this limit
            continue


def _columns(table: LogTable) -> tuple[dict[str, Any], list[Array]]:
    """The answer's first line, and the columns of numbers."""
    head: list[list[Any]] = []
    numbers: list[Array] = []
    for name, held in table.columns.items():
        whole = Levels.of_whole(held) if isinstance(held, np.ndarray) else None
        column = held if whole is None else whole
        if isinstance(column, np.ndarray) and column.dtype.kind in "fiub":
            numbers.append(np.ascontiguousarray(column, dtype=np.float64))
            head.append([str(name), None, len(column)])
        else:
            cells = column.tolist() if isinstance(column, np.ndarray) else column
            head.append([str(name), [_cell(cell) for cell in cells], len(cells)])
    if table.clock is not None:
        numbers.append(np.ascontiguousarray(table.clock, dtype=np.float64))
    known = {
        "units": dict(table.units),
        "aliases": dict(table.aliases),
        "runs": table.runs,
        "times": dict(table.times),
        "skipped": dict(table.skipped),
    }
    clocks = {"differing": table.differing, "clock_zone": table.clock_zone, "clock": table.clock is not None}
    return {"columns": head, **known, **clocks}, numbers


def _cell(cell: object) -> str:
    """As a file of text would have it: nothing where it is empty, 1 and 0 for truth values."""
    if cell is None:
        return ""
    return str(int(cell)) if isinstance(cell, bool) else str(cell)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
