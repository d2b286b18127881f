"""Writing results so that a failure leaves nothing half-written behind, and no input is written over."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from focgen.errors import InputError
from focgen.scratch import scratch_file, scratch_folder, synced

_CONTENTS = "manifest.json"


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
def new_folder(target: str | Path, inputs: Iterable[Any] = ()) -> Iterator[Path]:
    """Yield a temporary folder whose files move into ``target`` when the block ends well.

    Files of the same name in ``target`` are replaced, others stay; on any error nothing is written.
    Raises InputError where ``target`` cannot be written, and where a file would replace one of ``inputs`` by
    other bytes.
    """
    target = Path(target)
    with ExitStack() as stack:
        stack.callback(_remove_empty, target)
        try:
            target.mkdir(parents=True, exist_ok=True)
            scratch = stack.enter_context(scratch_folder(target))
        except OSError as reason:
            raise InputError(
                str(target), f"cannot be written ({reason.strerror})", "choose another --out"
            ) from None
        yield scratch
        _move(scratch, target, tuple(inputs))


def _remove_empty(folder: Path) -> None:
    with suppress(OSError):  # it holds something, or was never made
        folder.rmdir()


def _move(scratch: Path, target: Path, inputs: tuple) -> None:
    """Every file to its place, once it is sure that nothing else stands there."""
    files = sorted(p.relative_to(scratch) for p in scratch.rglob("*") if p.is_file())
    check_apart((target / name for name in files if not _equal(scratch / name, target / name)), inputs)
    for name in files:
        if (target / name).is_dir():
            raise InputError(str(target / name), "is a folder where a file belongs", "move it away")
        for parent in list(name.parents)[:-1]:
            if (target / parent).exists() and not (target / parent).is_dir():
                raise InputError(str(target / parent), "is a file where a folder belongs", "move it away")
    for name in files:  # all of them are on the disk before the first takes its place
        synced(scratch / name)
    for name in sorted(files, key=lambda name: name.name == _CONTENTS):  # what tells of the others comes last
        try:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(scratch / name, target / name)
        except OSError as reason:
            what = f"cannot be written ({reason.strerror})"
            raise InputError(str(target / name), what, "choose another --out") from None
    for folder in {(target / name).parent for name in files}:
        synced(folder)


def _equal(one: Path, other: Path) -> bool:
    """Whether both are files of the same bytes: then nothing is lost."""
    return other.is_file() and one.read_bytes() == other.read_bytes()


def write_files(target: str | Path, files: Mapping[str, str | bytes], inputs: Iterable[Any] = ()) -> None:
    """Write all of ``files`` (relative path → content) into a folder, or none of them.

    Raises InputError as :func:`new_folder` does, and for a name that leads out of the folder.
    """
    for name in files:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise InputError(str(target), f"{name!r} would be written outside of it", "choose another name")
    with new_folder(target, inputs) as folder:
        for name, content in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))


def remove(files: Iterable[Path]) -> None:
    """Remove files, and each one's folder where that is empty then."""
    for path in files:
        path.unlink(missing_ok=True)
        with suppress(OSError):
            path.parent.rmdir()


def write_file(path: str | Path, text: str, inputs: Iterable[Any] = ()) -> None:
    """Write one file whole or not at all. Raises InputError where it cannot be written, or is one of
    ``inputs``.
    """
    check_apart([path], inputs)
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with scratch_file(path.parent) as (scratch, handle):
            with open(handle, "w", encoding="utf-8", closefd=False) as file:
                file.write(text)
            os.fsync(handle)
            os.replace(scratch, path)
        synced(path.parent)
    except OSError as reason:
        raise InputError(str(path), f"cannot be written ({reason.strerror})", "choose another path") from None


def replace_folder(made: Path, target: Path, within: Path) -> None:
    """Put the folder ``made`` where ``target`` stands, which goes.

    ``target`` must lie in ``within`` as the file system has it, not by its name only: raises InputError
    where links lead out, or where it cannot be written. Nothing outside ``within`` is ever removed.
    """
    root, place = within.resolve(), target.parent.resolve()
    if target.is_symlink() or not place.is_relative_to(root) or target.name in ("", ".", ".."):
        raise InputError(str(target), f"leads out of {within}", "put a folder in the place of the link")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with scratch_folder(target.parent) as scratch:
            shutil.copytree(
                made, scratch / "new"
            )  # from another disk, maybe: slow, so it is not the last step
            for file in (scratch / "new").rglob("*"):
                synced(file)
            if target.exists():
                os.rename(target, scratch / "old")
            os.rename(scratch / "new", target)
        shutil.rmtree(made, ignore_errors=True)
    except (OSError, shutil.Error) as reason:
        raise InputError(
            str(target), f"cannot be written ({reason.strerror or reason})", "move it away"
        ) from None
