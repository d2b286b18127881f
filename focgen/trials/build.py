"""The generator's C, compiled once a machine and loaded through cffi."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from typing import Any

import cffi

from focgen.cache import kept
from focgen.compiler import compile_shared

_SOURCES = Path(__file__).parent / "c"
_FLAGS = ("-O2", "-std=c11", "-D_GNU_SOURCE", "-ffp-contract=off")


def _compile(target: Path) -> None:
    compile_shared(sorted(_SOURCES.glob("*.c")), target, _FLAGS)


@functools.cache
def library() -> tuple[Any, Any]:
    """Return ``(ffi, lib)``. Raises BuildError where there is no compiler or it fails."""
    digest = hashlib.sha256(" ".join(_FLAGS).encode())
    for path in sorted(_SOURCES.iterdir()):
        digest.update(path.read_bytes())
    target = kept(f"trials-{digest.hexdigest()[:16]}.so", _compile)
    ffi = cffi.FFI()
    ffi.cdef((_SOURCES / "interface.h").read_text(encoding="utf-8"))
    return ffi, ffi.dlopen(str(target))
