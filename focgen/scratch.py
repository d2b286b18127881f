"""Places to write to before a result is whole: of names that are new, and gone after a kill.

A scratch is locked as long as its process lives. What the lock does not hold was left by one that was killed,
and the next that writes to the same folder removes it.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: nothing can be told of who lives, so nothing is cleared
    fcntl = None  # type: ignore[assignment]

PATIENCE = 60.0
"""Seconds that one process waits for others to move their files into the same folder."""
_OURS = re.compile(r"\.focgen-[0-9a-f]{16}(\.part)?")
_swept: set[tuple[int, str]] = set()  # by process: looking once is enough


@contextmanager
def scratch_folder(place: Path) -> Iterator[Path]:
    """Yield a new folder in ``place``, which goes at the end. Raises OSError where none can be made."""
    clear(place)
    path, held = _new_folder(place)
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        unlock(held)


def _new_folder(place: Path) -> tuple[Path, int | None]:
    """A new folder and what holds its lock. Until that is had, another process may take it for one that was
    left: then there is a further one."""
    while True:
        path = place / _name()
        path.mkdir(mode=0o700)
        held = lock(path)
        if fcntl is None or (held is not None and path.is_dir()):
            return path, held
        unlock(held)


@contextmanager
def scratch_file(place: Path) -> Iterator[tuple[Path, int]]:
    """Yield path and descriptor of a new file in ``place``, which goes at the end if it still stands there.

    Raises OSError where none can be made.
    """
    clear(place)
    path = place / f"{_name()}.part"
    # never a file, or a link, that is there
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        if fcntl:
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield path, handle
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def clear(place: Path) -> None:
    """Remove what killed processes have left in ``place``; what another one still writes to stays."""
    key = os.getpid(), str(place)
    if fcntl is None or key in _swept:
        return
    _swept.add(key)
    with suppress(OSError):
        for entry in os.scandir(place):
            if _OURS.fullmatch(entry.name) and not entry.is_symlink():
                _clear_one(Path(entry.path))


def _clear_one(path: Path) -> None:
    held = lock(path)
    if held is None:
        return
    with suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink()
    unlock(held)


def synced(path: Path) -> None:
    """Have the disk hold what was written to a file, or the names of a folder."""
    with suppress(OSError):  # of folders some systems cannot
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _name() -> str:
    return f".focgen-{secrets.token_hex(8)}"


def lock(path: Path) -> int | None:
    """A descriptor that holds the lock of ``path``; None where another process has it."""
    if fcntl is None:
        return None
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def waited_for(folder: Path) -> int | None:
    """A descriptor that holds the lock of a folder, once other processes have let it go; None where they do
    not within :data:`PATIENCE`, or where there are no locks."""
    until = time.monotonic() + PATIENCE
    while (held := lock(folder)) is None and fcntl is not None and time.monotonic() < until:
        time.sleep(0.02)
    return held


def own(path: Path) -> bool:
    """Whether this user made a folder, and nobody else may write in it."""
    found = path.lstat()
    return not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o022)


def unlock(handle: int | None) -> None:
    """Let a lock go."""
    if handle is not None:
        os.close(handle)
