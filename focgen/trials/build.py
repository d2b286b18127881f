"""The generator's C, compiled once a machine and loaded through cffi."""

from __future__ import annotations

import functools
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import cffi

from focgen.errors import BuildError

_SOURCES = Path(__file__).parent / "c"
_FLAGS = ("-O2", "-std=c11", "-D_GNU_SOURCE", "-ffp-contract=off", "-shared", "-fPIC")


def _compiler() -> list[str]:
    """The command of a C compiler: $CC, the system's, or the pip-installable one. Raises BuildError."""
    if os.environ.get("CC"):
        return shlex.split(os.environ["CC"])
    for name in ("cc", "gcc", "clang"):
        if shutil.which(name):
            return [name]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    raise BuildError("trial", "finds no C compiler", "install gcc, or pip install 'focgen[targets]'")


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(base) / "focgen"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return folder
    except OSError:
        return Path(tempfile.gettempdir())


def _compile(target: Path) -> None:
    sources = [str(p) for p in sorted(_SOURCES.glob("*.c"))]
    part = target.with_suffix(f".{os.getpid()}.part")
    command = [*_compiler(), *_FLAGS, *sources, "-o", str(part), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        fault = (done.stderr.strip().splitlines() or ["no message"])[0]
        raise BuildError(
            "trial", f"the compiler refused the generator: {fault}", "try another compiler through CC"
        )
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
