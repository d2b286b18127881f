"""The chain of custody: what a file says that it came from, and whether that is still so.

A rig that was identified carries ``[identified_from]``, a controller ``[designed_from]``: relative names of
files, their SHA-256, and options. Nothing of such a file is shown but that its hash is another.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import tomlkit

from focgen.errors import InputError
from focgen.scratch import real
from focgen.textfile import LARGEST_SETTING, check_regular, read_regular
from focgen.tomlfile import parsed

TABLE = "identified_from"
_MOST = 1000  # files of one link that are followed
_LARGEST = 4 << 30  # bytes of them all: a log as large takes more memory to read than there is for it
_PART = 1 << 20  # bytes that are read at a time


def sha256_of(path: str | Path) -> str:
    """Of a file's bytes, in hexadecimal digits. Raises OSError where it cannot be read."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_within(path: str | Path, most: int) -> str | None:
    """The same of a regular file of at most ``most`` bytes, for a name that is a stranger's; None for any
    other.

    No more is read than the system says that there is: of ``/proc``, whose files may never end, nothing.
    """
    try:
        check_regular(path)
        with open(path, "rb") as file:
            left = os.fstat(file.fileno()).st_size
            if left > most:
                return None
            digest = hashlib.sha256()
            while left > 0 and (part := file.read(min(left, _PART))):
                digest.update(part)
                left -= len(part)
        return digest.hexdigest()
    except (OSError, InputError):
        return None


def identified_from(inputs: Iterable[Any], out: str | Path, options: Mapping[str, Any]) -> str:
    """The table of a rig written to ``out``, as TOML: every input that is a file, and the options that were
    given. Inputs in memory leave no mark."""
    base = real(out).parent
    files = [one for one in inputs if isinstance(one, (str, Path)) and Path(one).is_file()]
    named = [{"file": _beside(Path(one), base), "sha256": sha256_of(one)} for one in files]
    given = {key: value for key, value in options.items() if value is not None}
    table = {TABLE: {"options": given, "files": named}}
    return "\n" + tomlkit.dumps(table)


def _beside(path: Path, base: Path) -> str:
    try:
        return Path(os.path.relpath(real(path), base)).as_posix()
    except ValueError:  # another drive
        return path.name


def followed(controller: Path, near: Path) -> Iterator[str]:
    """Yield what does not fit, from a controller.toml back to the logs, as far as the files are there; names
    are looked up beside the folder ``near`` and in the two above, since ``generate`` has often put several
    folders into one."""
    source = _table(controller).get("designed_from")
    if not isinstance(source, dict):
        return
    rigs = _found(source.get("file"), (near, *_above(near)))
    if not rigs:
        return
    wanted = source.get("sha256")
    rig = next((path for path in rigs if sha256_within(path, LARGEST_SETTING) == wanted), None)
    if rig is None:
        yield f"{rigs[0]}: is not the rig that the controller was designed from"
        return
    made = _table(rig).get(TABLE)
    files = made.get("files") if isinstance(made, dict) else None
    yield from _inputs(rig, files if isinstance(files, list) else [])


def _above(folder: Path) -> tuple[Path, ...]:
    """The two folders above one, of whatever name: ``.`` has some, too."""
    return tuple((folder if folder.is_absolute() and ".." not in folder.parts else real(folder)).parents[:2])


def _inputs(rig: Path, files: list[Any]) -> Iterator[str]:
    """Yield which of the files that a rig was identified from are others, or were not looked at."""
    left = _LARGEST
    for entry in files[:_MOST]:
        for path in _found(entry.get("file"), (rig.parent,)) if isinstance(entry, dict) else ():
            size = path.stat().st_size
            if size > left:
                yield f"{path}: was not looked at, since it and those ahead of it are too large"
            elif sha256_within(path, size) != entry.get("sha256"):
                yield f"{path}: is not what {rig.name} was identified from"
            left -= min(left, size)
    if len(files) > _MOST:
        yield f"{rig}: names {len(files)} files, of which only the first {_MOST} were looked at"


def _found(name: Any, places: Iterable[Path]) -> list[Path]:
    """The regular files of a relative name that may be read."""
    if not isinstance(name, str) or "\0" in name or os.path.isabs(name):
        return []
    found = (place / name for place in places)
    return [path for path in found if path.is_file() and os.access(path, os.R_OK)]


def _table(path: Path) -> dict[str, Any]:
    """A file of TOML; empty where it is none."""
    try:
        return parsed(read_regular(path, LARGEST_SETTING).decode("utf-8"))
    except (OSError, ValueError, RecursionError, InputError):
        return {}
