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
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from focgen.scratch import temporary_folder

_PLACES = ("TMPDIR", "TEMP", "TMP")  # where programs look for the temporary folder
_LISTS = (  # of folders, in which an empty one stands for the current folder, and a relative one lies in it
    "CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH", "COMPILER_PATH", "LD_LIBRARY_PATH", "LD_RUN_PATH",
)  # fmt: skip
_ASKS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
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
    with _held_back() as let_go, temporary_folder() as place:
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
                let_go()
                said = begun.communicate(timeout=seconds)
            except BaseException:
                _end(begun)
                raise
        if begun.returncode and os.strerror(errno.ENOSPC) in said[1]:  # no fault of what it was given
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), tempfile.gettempdir())
        return subprocess.CompletedProcess(list(command), begun.returncode, *said)


@contextmanager
def _held_back() -> Iterator[Callable[[], None]]:
    """Signals whose handlers may raise wait until the function that is given lets them go.

    A program runs before :class:`subprocess.Popen` returns it: what raises between leaves nobody to end it.
    """
    came: list[int] = []
    kept = {number: signal.getsignal(number) for number in _ASKS} if _takes_signals() else {}
    kept = {number: handler for number, handler in kept.items() if callable(handler)}

    def let_go() -> None:
        for number, handler in kept.items():
            signal.signal(number, handler)
        kept.clear()
        while came:
            signal.raise_signal(came.pop())

    for number in kept:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield let_go
    finally:
        let_go()


def _takes_signals() -> bool:
    """Handlers run in the main thread alone."""
    return threading.current_thread() is threading.main_thread()


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
