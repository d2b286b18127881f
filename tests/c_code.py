"""Compilers to test generated C with; whatever a test needs of them is asked for before it is used."""

from __future__ import annotations

import functools
import platform
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import pytest

STRICT = """-std=c99 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Wundef
    -Wstrict-prototypes -Wmissing-prototypes -Wcast-qual -Werror""".split()
EXACT = ["-std=c99", "-O2", "-ffp-contract=off"]
SANITISERS = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]

HEADERS = "#include <stdint.h>\n#include <string.h>\n"
TRIVIAL = HEADERS + '#include <stdio.h>\nint main(void) { return puts("") < 0; }\n'
FUSED = "int main(void) { volatile double a = 3.0, b = 2.0, c = 1.0; return a * b + c != 7.0; }\n"
"""A program that a processor without fused multiply-add cannot run where the flags ask for one."""


def compiler(name: str, *flags: str, source: str = TRIVIAL) -> list[str]:
    """The command of gcc or clang, of which Zig's stands in for clang. Skips the test where there is none, or
    where the program that it makes of ``source`` with ``flags`` does not run."""
    command = (name,)
    if not shutil.which(name):
        if name != "clang" or not find_spec("ziglang"):
            pytest.skip(f"{name} is not on this machine")
        command = (sys.executable, "-m", "ziglang", "cc")
    missing = lacking(command, flags, source)
    if missing:
        pytest.skip(f"{name} {' '.join(flags)} makes nothing here that runs: {missing}")
    return list(command)


def cross_compiler(name: str, *flags: str) -> list[str]:
    """The command of a compiler for another machine. Skips where there is none, or where it makes no object
    with ``flags`` of a source that includes stdint.h and string.h."""
    if not shutil.which(name):
        pytest.skip(f"{name} is not on this machine")
    missing = lacking((name,), (*flags, "-c"), HEADERS + "int32_t one(void) { return 1; }\n")
    if missing:
        pytest.skip(f"{name} {' '.join(flags)} makes no object here: {missing}")
    return [name]


def tool(name: str) -> str:
    """The name of a program. Skips where it is not on this machine."""
    if not shutil.which(name):
        pytest.skip(f"{name} is not on this machine")
    return name


@functools.cache
def lacking(command: tuple[str, ...], flags: tuple[str, ...], source: str, *arguments: str) -> str:
    """Why ``command`` with ``flags`` makes no program of ``source`` that ends well when it is run with
    ``arguments`` (no object, where a flag is -c); empty where it does."""
    with tempfile.TemporaryDirectory() as folder:
        text, made = Path(folder) / "asked.c", Path(folder) / "asked.exe"
        text.write_text(source)
        done = _done([*command, *flags, text, "-o", made], folder)
        if done.returncode == 0 and "-c" not in flags:
            done = _done([made, *arguments], folder)
        return _reason(done)


def _done(command: list, folder: str) -> subprocess.CompletedProcess:
    return subprocess.run(command, capture_output=True, text=True, cwd=folder)


def _reason(done: subprocess.CompletedProcess) -> str:
    if done.returncode == 0:
        return ""
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    return lines[-1][:200] if lines else f"exit status {done.returncode}"


def fusing() -> list[str]:
    """The flags with which this machine's compilers fuse products and sums; ask the compiler with FUSED
    whether what it makes runs. Skips on processors of which this is not known."""
    flags = {"x86_64": ["-mfma"], "AMD64": ["-mfma"], "aarch64": [], "arm64": []}.get(platform.machine())
    if flags is None:
        pytest.skip(f"nothing is known here of fused multiply-adds on {platform.machine()}")
    return flags


def run(*command: str | Path, cwd: Path | None = None) -> str:
    """Run a command; its stdout. Fails with its stderr."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, f"{command[0]}: {done.stderr[:3000]}"
    return done.stdout


def program(name: str, folder: Path) -> Path:
    """Where a linked test program goes."""
    return folder / f"{name}.exe"
