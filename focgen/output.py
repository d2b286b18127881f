"""Writing results so that a failure leaves nothing half-written behind, and no input is written over."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from focgen import journal
from focgen.errors import InputError
from focgen.scratch import as_before, real, scratch_file, scratch_folder, synced
from focgen.textfile import LARGEST_JSON, holds

Old = Callable[[], Iterable[Path]]
"""What goes from a folder as a result takes its place there."""


def former(folder: str | Path, told: str, names: Iterable[str], files: Iterable[str]) -> Old:
    """What goes of an earlier result of the same kind, which the file ``told`` tells of: those of its
    ``names`` that are not among the new ``files``. They would look like parts of the new one."""
    place, new = Path(folder), set(files)

    def old() -> Iterator[Path]:
        if (place / told).is_file():
            yield from (place / name for name in names if name not in new and (place / name).is_file())

    return old


def check_apart(outputs: Iterable[str | Path], inputs: Iterable[Any]) -> None:
    """Raise InputError where an output is the same file as one of the inputs, whatever name or link leads
    there.

    Inputs that are no paths (a rig, an experiment) are passed over.
    """
    known = {identity: one for one in inputs if (identity := _identity(one))}
    for output in outputs:
        if (identity := _identity(output)) in known:
            what = f"is the input {known[identity]}, which would be lost"
            raise InputError(str(output), what, "write to another place")


def _identity(path: Any) -> tuple[int, int] | None:
    """Which file a path leads to: its device and number there; None where it leads to none."""
    if not isinstance(path, (str, os.PathLike)):
        return None
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


@contextmanager
def new_folder(target: str | Path, inputs: Iterable[Any] = (), old: Old = tuple) -> Iterator[Path]:
    """Yield a temporary folder whose files move into ``target`` when the block ends well; ``old``, asked
    then, while no other process moves files there, says which files of ``target`` go.

    Files of the same name in ``target`` are replaced, others stay; on any error nothing is written. A kill
    leaves what was there, or what the next run makes whole (:mod:`focgen.journal`).
    Raises InputError where ``target`` cannot be written, and where a file would replace one of ``inputs`` by
    other bytes.
    """
    target = Path(target)
    with ExitStack() as stack:
        if not target.exists():  # a folder that somebody has made stays, empty as it is
            stack.callback(_remove_empty, target)
        try:
            target.mkdir(parents=True, exist_ok=True)
            journal.finish(target)
            scratch = stack.enter_context(scratch_folder(target))
            _own_folder(scratch / journal.FILES)
        except OSError as reason:
            raise _unwritable(target, reason) from None
        yield scratch / journal.FILES
        _move(scratch, target, tuple(inputs), old)


def _own_folder(path: Path) -> None:
    """Make a folder that can be read. Else what is put into it would not be found: nothing would be written,
    and nobody would say so."""
    path.mkdir()
    if not os.access(path, os.R_OK | os.W_OK | os.X_OK):
        path.rmdir()
        raise PermissionError(errno.EACCES, "the umask takes your own rights away", None)


def _unwritable(target: Path, reason: OSError) -> InputError:
    """Names the file at whose place it failed, where it was at one."""
    found = Path(str(reason.filename2 or reason.filename or target))
    place = found if found.is_relative_to(target) and ".focgen-" not in str(found) else target
    return InputError(str(place), f"cannot be written ({reason.strerror})", "choose another --out")


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # it holds something, or was never made
        folder.rmdir()


def _move(scratch: Path, target: Path, inputs: tuple[Any, ...], old: Old) -> None:
    """Every file to its place, once it is sure that nothing else stands there, and all of them are on the
    disk."""
    made = scratch / journal.FILES
    files = sorted(p.relative_to(made) for p in made.rglob("*") if p.is_file())
    try:
        for name in files:
            synced(made / name)
        with journal.alone(target):
            _check_places(made, target, files, inputs)
            going = tuple(old())
            check_within(target, [*(target / name for name in files), *going])
            for path in (*(target / name for name in files), *going):
                _check_size(path)
            journal.put(scratch, target, files, going)
    except OSError as reason:
        raise _unwritable(target, reason) from None


def _check_places(made: Path, target: Path, files: list[Path], inputs: tuple[Any, ...]) -> None:
    """Raise InputError where an input, a folder or a device stands at the place of a file, or a file at a
    folder's."""
    check_apart((target / name for name in files if not _equal(made / name, target / name)), inputs)
    for name in files:
        if (target / name).is_dir():
            raise InputError(str(target / name), "is a folder where a file belongs", "move it away")
        _check_no_device(target / name)
        for parent in list(name.parents)[:-1]:
            if (target / parent).exists() and not (target / parent).is_dir():
                raise InputError(str(target / parent), "is a file where a folder belongs", "move it away")


def check_within(target: Path, places: Iterable[Path]) -> None:
    """Raise InputError where a link among a folder's own subfolders leads out of it: no file is written or
    removed elsewhere, and none is left out without a word."""
    for parent in dict.fromkeys(path.parent for path in places):
        if not real(parent).is_relative_to(real(target)):
            what = f"leads out of {target}, where its files would be missing"
            raise InputError(
                str(parent), what, "put a folder in the place of the link, or choose another --out"
            )


def _check_size(path: Path) -> None:
    """Raise InputError where what stands at a place is larger than any result: it would be read for hours,
    to know it again after a kill."""
    if path.is_file() and path.stat().st_size > LARGEST_JSON:
        what = f"has more than {LARGEST_JSON >> 20} MiB, which no result has"
        raise InputError(str(path), what, "move it away")


def check_writable(path: Path, folder: bool = False) -> None:
    """Raise InputError, before work begins, where a file, or files of a ``folder``, could not be written."""
    place = path if folder else path.parent
    nearest = next(one for one in (place, *place.absolute().parents) if one.exists())
    if not folder:
        _check_no_device(path)
    if not nearest.is_dir() or (path.is_dir() and not folder):
        what = "is a folder where a file belongs" if nearest.is_dir() else "is a file where a folder belongs"
        raise InputError(str(path if nearest.is_dir() else nearest), what, "name another place")
    try:
        with scratch_file(nearest):
            pass
    except OSError as reason:
        raise InputError(str(path), f"cannot be written ({reason.strerror})", "name another place") from None


def _check_no_device(path: Path) -> None:
    """Raise InputError where a pipe, a socket or a device stands at a place, or a link to what a process has
    open: a file would replace it, and ``/dev/null`` or ``/dev/stdout`` were no more."""
    try:
        mode, link = os.stat(path).st_mode, path.is_symlink() and os.readlink(path)
    except (OSError, ValueError):
        return
    plain = stat.S_ISREG(mode) or stat.S_ISDIR(mode)  # of a folder the system has its own words
    if not plain or (link and link.startswith("/proc/")):
        raise InputError(str(path), "is no regular file, and would be replaced by one", "name another file")


def _bytes(text: str, path: Path) -> bytes:
    """Text as UTF-8. Raises InputError where a name in it, of a log for instance, has no characters."""
    try:
        return text.encode("utf-8")
    except UnicodeEncodeError as reason:
        near = reason.object[max(0, reason.start - 8) : reason.end]
        what = f"would hold a name that is no UTF-8 ({near!r})"
        raise InputError(str(path), what, "rename that file or folder") from None


def _equal(one: Path, other: Path) -> bool:
    """Whether both are files of the same bytes: then nothing is lost."""
    return holds(other, one.read_bytes())


def write_files(
    target: str | Path,
    files: Mapping[str, str | bytes],
    inputs: Iterable[Any] = (),
    old: Old = tuple,
) -> None:
    """Write all of ``files`` (relative path → content) into a folder and remove ``old`` ones, or nothing.

    Raises InputError as :func:`new_folder` does, and for a name that leads out of the folder.
    """
    for name in files:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise InputError(str(target), f"{name!r} would be written outside of it", "choose another name")
    with new_folder(target, inputs, old) as folder:
        for name, content in files.items():
            _write_one(folder / name, content, Path(target) / name)


def _write_one(path: Path, content: str | bytes, place: Path) -> None:
    """A file that will stand at ``place``. Raises InputError where there is no room for it."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else _bytes(content, place))
    except OSError as reason:
        raise InputError(
            str(place), f"cannot be written ({reason.strerror})", "choose another --out"
        ) from None


def write_file(path: str | Path, text: str, inputs: Iterable[Any] = ()) -> None:
    """Write one file whole or not at all. Raises InputError where it cannot be written, is one of ``inputs``,
    a folder, a pipe or a device, or where ``text`` holds what UTF-8 has no bytes for.
    """
    check_apart([path], inputs)
    path = Path(path)
    _check_no_device(path)
    if path.is_dir():
        raise InputError(str(path), "is a folder where a file belongs", "name another place")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch_file(path.parent) as (scratch, handle):
            with open(handle, "wb", closefd=False) as file:
                file.write(_bytes(text, path))
            os.fsync(handle)
            as_before(scratch, path)
            os.replace(scratch, path)
        synced(path.parent)
    except OSError as reason:
        raise InputError(str(path), f"cannot be written ({reason.strerror})", "choose another path") from None


def replace_folder(made: Path, target: Path, within: Path) -> None:
    """Put the folder ``made`` where ``target`` stands, which goes.

    ``target`` must lie in ``within`` as the file system has it, not by its name only: raises InputError
    where links lead out, or where it cannot be written. Nothing outside ``within`` is ever removed.
    """
    root, place = real(within), real(target.parent)
    if target.is_symlink() or not place.is_relative_to(root) or target.name in ("", ".", ".."):
        raise InputError(str(target), f"leads out of {within}", "put a folder in the place of the link")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        journal.finish(target.parent)
        with scratch_folder(target.parent) as scratch:
            # from another disk, maybe: slow, so it is not the last step
            shutil.copytree(made, scratch / journal.NEW)
            for file in (scratch / journal.NEW).rglob("*"):
                synced(file)
            with journal.alone(target.parent):
                journal.put_folder(scratch, target)
        shutil.rmtree(made, ignore_errors=True)
    except (OSError, shutil.Error) as reason:
        what, remedy = f"cannot be written ({first_of(reason)})", "make room, or move it away"
        raise InputError(str(target), what, remedy) from None


def first_of(reason: OSError) -> str:
    """Why it failed, in a few words: what copies a folder collects a list of what failed."""
    failed = reason.args[0] if isinstance(reason, shutil.Error) and reason.args else None
    if isinstance(failed, list) and failed:
        return str(failed[0][-1]).partition(": ")[0]
    return reason.strerror or str(reason)
