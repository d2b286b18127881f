"""Compilers to test generated C with."""

from __future__ import annotations

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

STRICT = """-std=c99 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Wundef
    -Wstrict-prototypes -Wmissing-prototypes -Wcast-qual -Werror""".split()
EXACT = ["-std=c99", "-O2", "-ffp-contract=off"]


def compiler(name: str) -> list[str]:
    """The command of gcc or clang; Zig's stands in for clang. Skips the test where there is none."""
    if shutil.which(name):
        return [name]
    if name == "clang" and find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    pytest.skip(f"{name} is not on this machine")


def run(*command: str | Path, cwd: Path | None = None) -> str:
    """Run a command; its stdout. Fails with its stderr."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, cwd=cwd)
    assert done.returncode == 0, f"{command[0]}: {done.stderr[:3000]}"
    return done.stdout


def program(name: str, folder: Path) -> Path:
    """Where a linked test program goes."""
    return folder / f"{name}.exe"
