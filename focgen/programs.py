"""Compilers and emulators: each has a temporary folder of its own, and ends with the call that began it.

The driver of a compiler starts further programs and keeps files between them. Whoever ends the driver alone
leaves both: they go on, and what they write stays.
"""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from focgen.scratch import temporary_folder

_PLACES = ("TMPDIR", "TEMP", "TMP")  # where programs look for the temporary folder
_LISTS = (  # of folders, in which an empty one stands for the current folder, and a relative one lies in it
    "CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "LD_LIBRARY_PATH", "LD_RUN_PATH",
)  # fmt: skip
_GRACE = 2.0  # s until all of a group that was ended are gone


def ran(
    command: Sequence[str],
    seconds: float | None = None,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run a program to its end, without input; its exit status and what it said.

    Raises OSError where it cannot be started or finds the disk full, and subprocess.TimeoutExpired where it
    takes longer than ``seconds``. On that and any other exception, an interrupt also, it has ended with all
    that it began.
    """
    with temporary_folder() as place:
        given = os.environ if env is None else env
        own = {**_elsewhere(given), **dict.fromkeys(_PLACES, str(place))}
        with subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            errors="replace",
            cwd=cwd,
            env=own,
            process_group=0,  # what it begins belongs to it; an interrupt of the terminal is ours to pass on
        ) as begun:
            try:
                said = begun.communicate(timeout=seconds)
            except BaseException:
                _end(begun)
                raise
        if begun.returncode and os.strerror(errno.ENOSPC) in said[1]:  # no fault of what it was given
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), tempfile.gettempdir())
        return subprocess.CompletedProcess(list(command), begun.returncode, *said)


def _elsewhere(given: Mapping[str, str]) -> dict[str, str]:
    """An environment in which no list of folders names the current one: it may be a stranger's, and
    ``export CPATH=$CPATH:/opt/include`` names it where CPATH was empty."""
    lists = {name: given[name].split(os.pathsep) for name in _LISTS if name in given}
    kept = {name: os.pathsep.join(filter(os.path.isabs, folders)) for name, folders in lists.items()}
    return {name: text for name, text in {**given, **kept}.items() if text or name not in lists}


def _end(begun: subprocess.Popen[str]) -> None:
    """End a program and all that it has begun, and wait until nobody holds its streams any more."""
    with suppress(OSError):
        os.killpg(begun.pid, signal.SIGKILL) if hasattr(os, "killpg") else begun.kill()
    with suppress(subprocess.TimeoutExpired, ValueError):
        begun.communicate(timeout=_GRACE)
