"""The C compiler of this machine, or the pip-installable one where there is none."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from focgen.children import python
from focgen.errors import BuildError
from focgen.programs import ran

_USUAL = ("cc", "gcc", "clang")
_LOAD = """import ctypes, sys
try:
    ctypes.CDLL(sys.argv[1])
except OSError:
    pass
print("loaded")"""
_PATIENCE = 60.0  # s
ANEW = "generate the folder again, or set CC to another compiler"
_REMEDY = "install gcc or clang, or pip install 'focgen[targets]'"


def find_compiler() -> list[str]:
    """The command of a C compiler: $CC, cc, gcc, clang, or Zig's. Raises BuildError where there is none."""
    chosen = _chosen()
    if chosen:
        if shutil.which(chosen[0]) is None:
            raise BuildError(
                "the compiler",
                f"$CC names {chosen[0]!r}, which is no program that can be run",
                "unset CC or correct it",
            )
        return chosen
    for name in _USUAL:
        if shutil.which(name):
            return [name]
    if find_spec("ziglang"):
        return python("-m", "ziglang", "cc")
    raise BuildError("the compiler", "no C compiler was found", _REMEDY)


def _chosen() -> list[str]:
    """The words of $CC; none where it is not set."""
    words = os.environ.get("CC", "")
    try:
        return shlex.split(words)
    except ValueError as reason:
        what = f"$CC is {words!r}, which is no command ({reason})"
        raise BuildError("the compiler", what, "unset CC or correct it") from None


def compile_shared(
    sources: Sequence[str | Path],
    target: str | Path,
    flags: Sequence[str] = (),
    include: Sequence[str | Path] = (),
) -> None:
    """Compile C files into the shared library ``target``. Raises BuildError with the compiler's first
    complaint.
    """
    folders = [part for folder in include for part in ("-I", str(folder))]
    command = [
        *find_compiler(),
        *flags,
        "-shared",
        "-fPIC",
        *folders,
        *map(str, sources),
        "-o",
        str(target),
        "-lm",
    ]
    done = ran(command)
    if done.returncode:
        raise BuildError(
            str(sources[0]),
            f"does not compile: {first_complaint(done.stderr)}",
            ANEW,
        )
    if not Path(target).is_file():
        what = f"{command[0]!r} ends well and writes nothing: it is no compiler"
        raise BuildError("the compiler", what, "unset CC or correct it")
    if _chosen():
        _check_loading(Path(target), sources[0])


def _check_loading(library: Path, source: str | Path) -> None:
    """Raise BuildError where loading what the user's own compiler has made ends the process that does it, as
    -fsanitize=address has it: it would be this one. What cannot be loaded is its caller's to tell of."""
    try:
        done = ran(python("-c", _LOAD, str(library)), _PATIENCE)
        said, loaded = done.stderr.strip().splitlines()[-1:], "loaded" in done.stdout
    except subprocess.TimeoutExpired:
        said, loaded = [f"it takes more than {_PATIENCE:g} s"], False
    if not loaded:
        what = f"compiled by $CC ends the process that loads it: {(said or ['it says nothing'])[0]}"
        raise BuildError(str(source), what, "unset CC, or leave out flags such as -fsanitize")


def first_complaint(text: str) -> str:
    """The first line of a compiler's output that speaks of an error."""
    lines = [line.strip() for line in text.splitlines() if "error" in line.lower()]
    return (lines or text.splitlines() or ["it says nothing"])[0]
