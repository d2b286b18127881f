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
        for source in sorted(p for p in scratch.rglob("*") if p.is_file()):
            place = target / source.relative_to(scratch)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, place)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        if not any(target.iterdir()):
            target.rmdir()


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
