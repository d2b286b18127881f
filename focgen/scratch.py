"""Places to write to before a result is whole: of names that are new, and gone after a kill.

A scratch is locked as long as its process lives. What the lock does not hold was left by one that was killed,
and the next that writes to the same folder removes it. The same holds of what is put into the system's
temporary folder.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import stat
import tempfile
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
_TRIES = 100  # at a new folder, until nobody else takes it away
_HELD = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)  # what a lock of another process answers
_OURS = re.compile(r"\.focgen-[0-9a-f]{16}(\.part)?")
_TEMPORARY = re.compile(r"focgen-([a-z]+-)?[0-9a-f]{16}")
_INNER = "own"  # in the locked one: whoever writes into a folder locks it for himself
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


@contextmanager
def temporary_folder(kind: str = "") -> Iterator[Path]:
    """Yield a new folder of this user's alone in the system's temporary folder, which goes at the end;
    ``kind`` stands in its name. Raises OSError where none can be made.
    """
    path, held = new_temporary(kind)
    try:
        yield path
    finally:
        remove_temporary(path, held)


def new_temporary(kind: str = "") -> tuple[Path, int | None]:
    """The folder of :func:`temporary_folder` and what holds its lock, until :func:`remove_temporary`."""
    place = Path(tempfile.gettempdir())
    clear(place, _TEMPORARY)
    locked, held = _new_folder(place, f"focgen-{kind}-" if kind else "focgen-")
    inner = locked / _INNER
    try:
        inner.mkdir(mode=0o700)
    except OSError:
        remove_temporary(inner, held)
        raise
    return inner, held


def remove_temporary(inner: Path, held: int | None) -> None:
    """Remove what :func:`new_temporary` has made."""
    shutil.rmtree(inner.parent, ignore_errors=True)
    unlock(held)


def _new_folder(place: Path, begins: str = ".focgen-") -> tuple[Path, int | None]:
    """A new folder and what holds its lock. Until that is had, another process may take it for one that was
    left: then there is a further one. Where the file system has no locks, nothing is taken for left."""
    for _ in range(_TRIES):
        path = place / _name(begins)
        path.mkdir(mode=0o700)
        with suppress(FileNotFoundError):  # taken away already: there is nothing to lock either
            os.chmod(path, 0o700)  # whatever the umask takes away: what cannot be opened cannot be locked
        held, reason = _locked(path)
        if reason not in (*_HELD, errno.ENOENT) and path.is_dir():
            return path, held
        unlock(held)
        with suppress(OSError):
            path.rmdir()
    raise _taken_away(place)


def _taken_away(place: Path) -> OSError:
    return OSError(errno.EBUSY, "others take away what is written", str(place))


@contextmanager
def scratch_file(place: Path) -> Iterator[tuple[Path, int]]:
    """Yield path and descriptor of a new file in ``place``, which goes at the end if it still stands there.

    Raises OSError where none can be made.
    """
    clear(place)
    path, handle = _new_file(place)
    try:
        yield path, handle
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _new_file(place: Path) -> tuple[Path, int]:
    """A new file and its descriptor, which holds its lock where there are locks; a further one where another
    process has taken it for one that was left."""
    for _ in range(_TRIES):
        path = place / f"{_name()}.part"
        # never a file, or a link, that is there
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        if _flocked(handle) not in _HELD and os.fstat(handle).st_nlink:
            return path, handle
        os.close(handle)
    raise _taken_away(place)


def clear(place: Path, ours: re.Pattern[str] = _OURS) -> None:
    """Remove what killed processes have left in ``place``, by its names; what another one still writes to
    stays, and in a temporary folder what is another user's."""
    key = os.getpid(), f"{ours.pattern} {place}"
    if fcntl is None or key in _swept:
        return
    _swept.add(key)
    with suppress(OSError):
        for entry in os.scandir(place):
            found = ours.fullmatch(entry.name) and not entry.is_symlink()
            if found and (ours is _OURS or own(Path(entry.path))):
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


def as_before(new: Path, place: Path) -> None:
    """Give a file the rights of the one whose place it takes: what was private stays so."""
    with suppress(OSError):  # there is none
        mode = place.lstat().st_mode
        if stat.S_ISREG(mode):
            os.chmod(new, stat.S_IMODE(mode))


def _name(begins: str = ".focgen-") -> str:
    return begins + secrets.token_hex(8)


def lock(path: Path) -> int | None:
    """A descriptor that holds the lock of a file or folder; None where another process has it, or where there
    are no locks."""
    return _locked(path)[0]


def lockable(path: Path) -> bool:
    """Whether ``path`` can be locked at all: some file systems of clusters have no locks."""
    held, reason = _locked(path)
    unlock(held)
    return held is not None or reason in _HELD


def _locked(path: Path) -> tuple[int | None, int]:
    """A descriptor that holds the lock, or why there is none."""
    if fcntl is None:
        return None, errno.ENOSYS
    # a pipe of such a name must not be waited for
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        handle = os.open(path, flags)
    except FileNotFoundError:
        return None, errno.ENOENT
    except OSError:
        return None, errno.ENOSYS
    if reason := _flocked(handle):
        os.close(handle)
        return None, reason
    return handle, 0


def _flocked(handle: int) -> int:
    """Lock what a descriptor leads to, at once or not at all: 0, or why not."""
    if fcntl is None:
        return errno.ENOSYS
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as reason:
        return reason.errno or errno.ENOSYS
    return 0


def waited_for(folder: Path) -> int | None:
    """A descriptor that holds the lock of a folder, once other processes have let it go; None where there are
    no locks. Raises OSError where they do not within :data:`PATIENCE`."""
    until = time.monotonic() + PATIENCE
    while (held := lock(folder)) is None and lockable(folder):
        if time.monotonic() > until:
            raise OSError(errno.EBUSY, "another process writes there", str(folder))
        time.sleep(0.02)
    return held


def own(path: Path) -> bool:
    """Whether this user made a folder, and nobody else may write in it."""
    found = path.lstat()
    return not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o022)


def real(path: str | Path) -> Path:
    """Where a path leads, as far as its links lead anywhere. Where they lead round in a circle it is the path
    itself, and whoever opens that is told."""
    return Path(os.path.realpath(path))


def unlock(handle: int | None) -> None:
    """Let a lock go."""
    if handle is not None:
        os.close(handle)
