"""Writing results so that a failure leaves nothing half-written behind."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from focgen.errors import InputError


@contextmanager
def new_folder(target: str | Path) -> Iterator[Path]:
    """Yield a temporary folder whose files move into ``target`` when the block ends well.

    Files of the same name in ``target`` are replaced, others stay; on any error nothing is written.
    Raises InputError where ``target`` cannot be written.
    """
    target = Path(target)
    try:
        target.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=".focgen-", dir=target))
    except OSError as reason:
        raise InputError(
            str(target), f"cannot be written ({reason.strerror})", "choose another --out"
        ) from None
    try:
        yield scratch
        _move(scratch, target)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        if not any(target.iterdir()):
            target.rmdir()


def _move(scratch: Path, target: Path) -> None:
    """Every file to its place, once it is sure that nothing else stands there."""
    files = sorted(p.relative_to(scratch) for p in scratch.rglob("*") if p.is_file())
    for name in files:
        if (target / name).is_dir():
            raise InputError(str(target / name), "is a folder where a file belongs", "move it away")
        for parent in list(name.parents)[:-1]:
            if (target / parent).exists() and not (target / parent).is_dir():
                raise InputError(str(target / parent), "is a file where a folder belongs", "move it away")
    for name in files:
        try:
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(scratch / name, target / name)
        except OSError as reason:
            what = f"cannot be written ({reason.strerror})"
            raise InputError(str(target / name), what, "choose another --out") from None


def write_files(target: str | Path, files: Mapping[str, str | bytes]) -> None:
    """Write all of ``files`` (relative path → content) into a folder, or none of them."""
    with new_folder(target) as folder:
        for name, content in files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))


def write_file(path: str | Path, text: str) -> None:
    """Write one file whole or not at all. Raises InputError where it cannot be written."""
    path = Path(path)
    scratch = path.with_name(f".{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        scratch.write_text(text, encoding="utf-8")
        os.replace(scratch, path)
    except OSError as reason:
        with suppress(OSError):
            scratch.unlink()
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
        if target.exists():
            shutil.rmtree(target)
        shutil.move(made, target)
    except OSError as reason:
        raise InputError(str(target), f"cannot be written ({reason.strerror})", "move it away") from None
