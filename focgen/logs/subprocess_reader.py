"""A log read in a process of its own, so that a damaged file ends the reader there and not the caller.

Readers of binary formats are large and written in C; some can be made to crash. The process has a limit on
time and on memory, and answers with a line of JSON and plain float64 behind it, which can carry numbers and
texts and nothing that is executed.
"""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from focgen.children import environment, python
from focgen.errors import FocgenError, LogError, MissingExtra
from focgen.logs.cells import marks
from focgen.logs.table import LogTable

SECONDS = 300.0  # until a reader must have answered
_ERRORS = {"LogError": LogError, "MissingExtra": MissingExtra}
_LEAN = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",  # address space, which the limit counts
}


def read_in_subprocess(module: str, path: Path) -> LogTable:
    """``read(path)`` of the reader ``module``, in a process of its own.

    Raises what it raises (LogError, MissingExtra, OSError), and LogError where it crashes, takes too long or
    needs too much memory.
    """
    command = python("-m", "focgen.logs.reader", module, str(path))
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, env=environment(**_LEAN))
    except subprocess.TimeoutExpired:
        what = f"was not read within {SECONDS:g} s"
        raise LogError(str(path), what, "give a regular file, or split it into smaller ones") from None
    except ValueError:  # a null character
        raise LogError(str(path), "is no path", "check the path") from None
    if done.returncode:
        what = f"is damaged: its reader ended with {_ending(done.returncode)}"
        raise LogError(str(path), what, "save it again, or as .csv")
    head, _, body = done.stdout.partition(b"\n")
    return _table(path, json.loads(head), body)


def _ending(status: int) -> str:
    try:
        return signal.Signals(-status).name if status < 0 else f"status {status}"
    except ValueError:
        return f"signal {-status}"


def _table(path: Path, head: dict[str, Any], body: bytes) -> LogTable:
    """The answer as a table, or as the error that it tells of."""
    if "fault" in head:
        raise _fault(*head["fault"])
    columns, numbers, at = {}, np.frombuffer(body), 0
    for name, texts, count in head["columns"]:
        columns[name] = numbers[at : at + count].copy() if texts is None else texts
        at += count if texts is None else 0
    clock = numbers[at:].copy() if head["clock"] else None
    kept = ("units", "aliases", "runs", "differing", "times", "clock_zone", "skipped")
    known = {key: head[key] for key in kept}
    grouped, unsure = marks(columns)
    return LogTable(str(path), columns, clock=clock, grouped=grouped, unsure=unsure, **known)


def _fault(kind: str, *parts: Any) -> FocgenError | OSError:
    return OSError(*parts) if kind == "OSError" else _ERRORS[kind](*parts)
