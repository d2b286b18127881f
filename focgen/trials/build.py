"""The generator's C, compiled once a machine and loaded through cffi."""

from __future__ import annotations

import functools
import hashlib
import os
import tempfile
from pathlib import Path

import cffi

from focgen.compiler import compile_shared

_SOURCES = Path(__file__).parent / "c"
_FLAGS = ("-O2", "-std=c11", "-D_GNU_SOURCE", "-ffp-contract=off")


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(base) / "focgen"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    except OSError:
        return Path(tempfile.gettempdir())


def _compile(target: Path) -> None:
    part = target.with_suffix(f".{os.getpid()}.part")
    compile_shared(sorted(_SOURCES.glob("*.c")), part, _FLAGS)
    os.replace(part, target)


@functools.cache
def library():
    """Return ``(ffi, lib)``. Raises BuildError where there is no compiler or it fails."""
    digest = hashlib.sha256(" ".join(_FLAGS).encode())
    for path in sorted(_SOURCES.iterdir()):
        digest.update(path.read_bytes())
    target = _cache() / f"trials-{digest.hexdigest()[:16]}.so"
    if not target.exists():
        _compile(target)
    ffi = cffi.FFI()
    ffi.cdef((_SOURCES / "interface.h").read_text(encoding="utf-8"))
    return ffi, ffi.dlopen(str(target))
