"""Binary logs through their readers in processes of their own: forked, so that a hundred thousand take an
hour.

The process is the one that a log is read in (:mod:`focgen.logs.reader`) with its limits on memory; only
the start of the interpreter is saved.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from focgen.logs import reader, subprocess_reader
from focgen.logs.table import FOREIGN, read_table
from tests.fuzz import seeds
from tests.fuzz.guidance import Guidance
from tests.fuzz.targets import Target, check

SECONDS = 30
"""Until a reader must have answered, however loaded the machine is."""


class Forked:
    """Stands in for ``subprocess`` where a log is read apart; branches that the child sees first are
    learnt."""

    TimeoutExpired = subprocess.TimeoutExpired

    def __init__(self, guidance: Guidance):
        self.guidance = guidance

    def run(self, command, capture_output, timeout, env) -> SimpleNamespace:
        """Read as the command would, in a forked process."""
        module, path = command[-2], Path(command[-1])
        import_module(module)
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as seen:
            child = os.fork()
            if child == 0:
                self._child(module, path, out.fileno(), seen)
            status = _waited(child, timeout)
            out.seek(0)
            seen.seek(0)
            learnt = seen.read()
            if learnt:
                self.guidance.new |= pickle.loads(learnt)  # our own child's
            return SimpleNamespace(returncode=status, stdout=out.read(), stderr=b"")

    def _child(self, module: str, path: Path, out: int, seen) -> None:
        status = 1
        try:
            signal.alarm(SECONDS)
            signal.setitimer(signal.ITIMER_PROF, 0)
            os.dup2(out, 1)
            reader.main(module, path)
            seen.write(pickle.dumps(self.guidance.new))
            seen.flush()
            status = 0
        finally:
            os._exit(status)


def _waited(child: int, timeout: float) -> int:
    """The status as ``subprocess`` tells it."""
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status == -signal.SIGALRM:
        raise subprocess.TimeoutExpired("reader", timeout)
    return status


def _read(name: str) -> Callable[[bytes, Path], None]:
    def run(data: bytes, place: Path) -> None:
        table = read_table(seeds.path_of(place, name, data))
        for column in list(table.columns)[:50]:
            check(len(table.column(column)) == len(table), "columns of different lengths")
            values = table.column(column)
            check(not isinstance(values, np.ndarray) or values.ndim == 1, "a column of columns")

    return run


TARGETS = (
    Target(
        "mat", _read("log.mat"), seeds.mat, 0.4, "", (b"\x0e\x00\x00\x00", b"\x09\x00\x00\x00", b"MATLAB")
    ),
    Target("parquet", _read("log.parquet"), seeds.parquet, 0.3, "", (b"PAR1", b"\x15\x00", b"\x19\x1c")),
    Target(
        "tdms",
        _read("log.tdms"),
        seeds.tdms,
        0.3,
        "",
        (b"TDSm", b"/'g'/'u'", b"\x0a\x00\x00\x00", b"wf_increment"),
    ),
)


def preloaded(guidance: Guidance) -> None:
    """Load every reader once, and fork for each log from now on."""
    for module in FOREIGN.values():
        import_module(module)
    for module in ("h5py", "pyarrow.parquet", "pyarrow.dataset", "nptdms", "nptdms.log"):
        import_module(module)
    subprocess_reader.subprocess = Forked(guidance)
