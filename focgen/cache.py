"""Programs that are compiled once a machine and kept: only where nobody else could have put them.

What stands in the cache is loaded and run. So the cache is the user's own folder, or there is none: then a
private temporary folder stands in for it, as long as the process lives.
"""

from __future__ import annotations

import atexit
import functools
import os
import stat
from collections.abc import Callable
from pathlib import Path

from focgen.custody import sha256_of
from focgen.progress import say
from focgen.scratch import new_temporary, remove_temporary, scratch_folder, synced
from focgen.textfile import holds

_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path:
    """$XDG_CACHE_HOME/focgen or ~/.cache/focgen where it is this user's alone, else a private temporary
    folder.

    Alone: the folder belongs to the user and nobody else may write there, nor rename it from above.
    """
    try:
        return _folder(_wanted())
    except RuntimeError:  # there is no home
        return _temporary()


def kept(name: str, build: Callable[[Path], None]) -> Path:
    """The file ``name`` of the cache; ``build(path)`` writes it where it is absent, could be another's, or is
    not as it was built: what a full disk or a fall of power has cut would end the process that loads it.

    Raises what ``build`` raises; then nothing is left behind.
    """
    target = cache_folder() / name
    digest = target.with_name(f"{name}.sha256")
    if _is_own(target, stat.S_ISREG) and _is_own(digest, stat.S_ISREG) and holds(digest, _digest(target)):
        return target
    with scratch_folder(target.parent) as scratch:
        part = scratch / name
        build(part)
        os.chmod(part, 0o700)
        (scratch / digest.name).write_bytes(_digest(part))
        os.chmod(scratch / digest.name, 0o600)
        for made in (target, digest):
            synced(scratch / made.name)
            os.replace(scratch / made.name, made)
    return target


def _digest(path: Path) -> bytes:
    """As it stands beside a file, for ``sha256sum -c``."""
    return f"{sha256_of(path)}  {path.name}\n".encode()


def _wanted() -> Path:
    """Where the user's caches are. A relative $XDG_CACHE_HOME is void, as its specification has it, and a
    relative $HOME is none: whatever folder one stands in could hold what is loaded.

    Raises RuntimeError where there is no home.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME") or "")
    if not base.is_absolute():
        base = Path.home() / ".cache"
    if not base.is_absolute():
        raise RuntimeError("the home is relative")
    return base / "focgen"


@functools.cache
def _folder(wanted: Path) -> Path:
    try:
        wanted.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return _temporary()
    if not is_private(wanted):
        say(f"{wanted}: others can write there, so it is not used; `chmod 700 {wanted}` if it is yours")
        return _temporary()
    return wanted if os.access(wanted, os.W_OK | os.X_OK) else _temporary()


def is_private(folder: Path) -> bool:
    """Whether a folder belongs to this user, and nobody but the administrator may write in it or rename it.

    True where the system has no owners to ask for (Windows, whose user folders are private).
    """
    if not hasattr(os, "getuid"):
        return True
    place = folder.resolve()
    return _is_own(place, stat.S_ISDIR) and all(_holds(parent) for parent in place.parents)


def _holds(folder: Path) -> bool:
    """Whether what stands in a folder can be renamed or removed by its owner and the administrator alone."""
    found = folder.stat()
    safe = not found.st_mode & _OTHERS or found.st_mode & stat.S_ISVTX
    return found.st_uid in (0, os.getuid()) and bool(safe)


def _is_own(path: Path, kind: Callable[[int], bool]) -> bool:
    """Whether ``path`` is of this kind, itself and no link to one, this user's, and no other may write it."""
    try:
        found = path.lstat()
    except OSError:
        return False
    if not hasattr(os, "getuid"):
        return kind(found.st_mode)
    return kind(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & _OTHERS


@functools.cache
def _temporary() -> Path:
    """A new folder of a name that nobody could foresee; it goes with the process that made it."""
    (folder, held), maker = new_temporary(), os.getpid()
    atexit.register(_remove, folder, held, maker)
    return folder


def _remove(folder: Path, held: int | None, maker: int) -> None:
    """Not by a process that was forked from the one that made it."""
    if os.getpid() == maker:
        remove_temporary(folder, held)
