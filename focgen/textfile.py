"""Files from outside as bytes and text: regular ones, of a bounded size."""

from __future__ import annotations

import gzip
import os
import stat
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

from focgen.errors import InputError, LogError

LARGEST_LOG = 512 << 20
"""Bytes of a log in text, unpacked: ten million rows of five columns."""
LARGEST_SETTING = 16 << 20
"""Bytes of a file of TOML."""
LARGEST_CODE = 64 << 20
"""Bytes of a file of generated C."""
LARGEST_JSON = 512 << 20
"""Bytes of a file of JSON: what has been drawn of a diagnosis is the largest."""
_PART = 1 << 20  # bytes that are read at a time
_KERNEL = ("/proc", "/sys", "/sys/kernel/debug", "/sys/kernel/tracing")


def read_regular(path: str | Path, most: int, error: type[InputError] = InputError) -> bytes:
    """The bytes of a regular file; a ``.gz`` is not unpacked.

    Raises OSError where it cannot be opened, and ``error`` where it is no regular file or has more than
    ``most`` bytes.
    """
    path = Path(path)
    check_regular(path, error)
    with path.open("rb") as file:
        return _at_most(file, most, path, error)


def holds(path: str | Path, content: bytes) -> bool:
    """Whether a path leads to a regular file of these bytes. No more of it is read than they are."""
    try:
        check_regular(path)
        with open(path, "rb") as file:
            return file.read(len(content) + 1) == content
    except (OSError, InputError):
        return False


def check_regular(path: str | Path, error: type[InputError] = InputError) -> None:
    """Raise ``error`` for a pipe or a device, which may never end; OSError where there is nothing."""
    found = Path(path).stat()
    regular = stat.S_ISREG(found.st_mode) and not (found.st_size == 0 and _is_of_kernel(found.st_dev))
    if not regular and not stat.S_ISDIR(found.st_mode):  # of a folder the system has its own words
        raise error(str(path), "is no regular file", "save its content to a file first")


def _is_of_kernel(device: int) -> bool:
    """Whether files of a file system are made by the kernel as they are read: some never end, or wait."""
    for place in _KERNEL:
        try:
            if os.stat(place).st_dev == device:
                return os.stat("/").st_dev != device
        except OSError:
            continue
    return False


def open_log(path: Path) -> BinaryIO:
    """A log in text to read from, unpacked where its name ends in .gz. Raises OSError, and LogError for what
    is no regular file."""
    check_regular(path, LogError)
    return cast(BinaryIO, gzip.open(path, "rb")) if path.name.lower().endswith(".gz") else path.open("rb")


def log_parts(path: Path) -> Iterator[bytes]:
    """Yield the bytes of a log in text, in parts.

    Raises OSError, and LogError for more than ``LARGEST_LOG`` bytes unpacked, however few they are packed.
    """
    size = 0
    try:
        with open_log(path) as file:
            while part := file.read(_PART):
                size += len(part)
                if size > LARGEST_LOG:
                    raise _too_large(path, LARGEST_LOG, LogError)
                yield part
    except (gzip.BadGzipFile, EOFError, zlib.error):
        raise LogError(str(path), "is not a whole gzip file", "pack it again") from None


def read_log_bytes(path: Path) -> bytes:
    """All of :func:`log_parts`."""
    return b"".join(log_parts(path))


def _at_most(file: BinaryIO, most: int, path: Path, error: type[InputError]) -> bytes:
    content = file.read(most + 1)
    if len(content) > most:
        raise _too_large(path, most, error)
    return content


def _too_large(path: Path, most: int, error: type[InputError]) -> InputError:
    return error(str(path), f"has more than {most >> 20} MiB", "split it into smaller files")
