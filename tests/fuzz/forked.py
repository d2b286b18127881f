"""Binary logs through their readers in processes of their own, so that a hundred thousand take minutes.

The process is the one that a log is read in (:mod:`focgen.logs.reader`) with its limits on memory. It is
forked, so that no interpreter has to start, and reads some logs before the next one does.
"""

from __future__ import annotations

import json
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
_EACH = 50  # logs that a process reads: what a reader loses in memory ends with it


class Forked:
    """Stands in for ``subprocess`` where a log is read apart; branches that a child sees first are learnt."""

    TimeoutExpired = subprocess.TimeoutExpired

    def __init__(self, guidance: Guidance):
        self.guidance = guidance
        self.out, self.seen = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # noqa: SIM115 -- shared with each child
        self.child = self.read = 0
        self.ask = self.told = -1

    def run(self, command, capture_output, timeout, env) -> SimpleNamespace:
        """Read as the command would, in a forked process."""
        import_module(command[-2])
        if not self.child or self.read == _EACH:
            self._begin()
        for file in (self.out, self.seen):
            file.seek(0)
            file.truncate()
        self.read += 1
        os.write(self.ask, json.dumps([command[-2], command[-1]]).encode() + b"\n")
        status = 0 if os.read(self.told, 1) else self._ended()
        if status == -signal.SIGALRM:
            raise subprocess.TimeoutExpired("reader", timeout)
        self.out.seek(0)
        self.seen.seek(0)
        learnt = self.seen.read()
        if learnt and not status:
            self.guidance.new |= pickle.loads(learnt)  # our own child's
        return SimpleNamespace(returncode=status, stdout=self.out.read(), stderr=b"")

    def _begin(self) -> None:
        """A new process, and the end of the one before."""
        if self.child:
            self._ended()
        asked, self.ask = os.pipe()
        self.told, tell = os.pipe()
        self.child, self.read = os.fork(), 0
        if self.child == 0:
            os.close(self.ask)
            self._serve(asked, tell)
        os.close(asked)
        os.close(tell)

    def _ended(self) -> int:
        """The status of the process, which has ended or is told that nobody asks any more."""
        os.close(self.ask)
        status = os.waitstatus_to_exitcode(os.waitpid(self.child, 0)[1])
        os.close(self.told)
        self.child = 0
        return status

    def _serve(self, asked: int, tell: int) -> None:
        """Read log after log until nobody asks; whatever else happens ends the process."""
        status = 1
        try:
            signal.setitimer(signal.ITIMER_PROF, 0)
            for line in os.fdopen(asked):
                module, path = json.loads(line)
                self.guidance.known |= self.guidance.new
                self.guidance.new = set()
                signal.alarm(SECONDS)
                os.dup2(self.out.fileno(), 1)
                reader.main(module, Path(path))
                signal.alarm(0)
                self.seen.write(pickle.dumps(self.guidance.new))
                self.seen.flush()
                os.write(tell, b".")
            status = 0
        finally:
            os._exit(status)


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
