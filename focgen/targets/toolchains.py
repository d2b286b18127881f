"""Cross compilers: Zig's, which pip installs, and GCC's where the machine has it."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from focgen.cache import cache_folder
from focgen.children import python
from focgen.compiler import first_complaint
from focgen.errors import BuildError, MissingExtra
from focgen.programs import ran
from focgen.scratch import temporary_folder
from focgen.targets.cores import Core

EXACT = ("-O2", "-std=c99", "-ffp-contract=off")
"""As a user is told to compile; only so do floating results repeat."""

_ZIG = ("-ffreestanding", "-fno-sanitize=undefined", "-fno-unwind-tables", "-fno-asynchronous-unwind-tables")
_GCC = ("-fno-tree-loop-distribute-patterns", "-nostdlib")
_ARM_GCC = "arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"  # command and package
_RISCV_GCC = "riscv64-unknown-elf-gcc", "gcc-riscv64-unknown-elf"
_SLOW = 300.0  # s; Zig's first build also builds its runtime


@dataclass(frozen=True)
class Toolchain:
    """One cross compiler: ``name`` and version for people, the ``command`` that compiles and links."""

    name: str
    version: str
    command: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name and version."""
        return f"{self.name} {self.version}"


def toolchains(core: Core) -> tuple[Toolchain, ...]:
    """Every cross compiler for a core that is there, Zig's first. Raises MissingExtra where there is none."""
    found = tuple(chain for chain in (_zig(), _gcc(core)) if chain)
    if not found:
        raise MissingExtra.of("ziglang", "targets", "a cross compiler")
    return found


def absent(core: Core) -> tuple[str, ...]:
    """The compilers that are not there, each with the line that installs it."""
    lines = []
    if _zig() is None:
        lines.append("zig: not installed (pip install 'focgen[targets]')")
    if _gcc(core) is None:
        name, package = _gcc_named(core)
        lines.append(f"{name}: not installed (apt-get install {package})")
    return tuple(lines)


@cache
def _zig() -> Toolchain | None:
    if find_spec("ziglang") is None:
        return None
    command = tuple(python("-m", "ziglang"))
    return Toolchain("zig cc", _said(*command, "version"), (*command, "cc"))


def _gcc(core: Core) -> Toolchain | None:
    command, _ = _gcc_named(core)
    return _gcc_of(command)


def _gcc_named(core: Core) -> tuple[str, str]:
    """Command and package of the GCC for a core."""
    return _ARM_GCC if core.arm else _RISCV_GCC


@cache
def _gcc_of(name: str) -> Toolchain | None:
    return Toolchain(name, _said(name, "-dumpfullversion"), (name,)) if shutil.which(name) else None


def _said(*command: str) -> str:
    return ran(command, 60.0).stdout.strip()


def link(chain: Toolchain, core: Core, sources: Sequence[Path], script: Path, target: Path, entry: str,
         include: Sequence[Path] = (), flags: Sequence[str] = EXACT) -> None:  # fmt: skip
    """Compile C files for a core and link them into the ELF file ``target``.

    Raises BuildError with the compiler's first complaint.
    """
    zig = chain.command[-1] == "cc"
    own = (*core.zig, *_ZIG) if zig else (*core.gcc, *_GCC)
    folders = [f"-I{folder}" for folder in dict.fromkeys(include)]
    last = ["-Wl,--gc-sections", f"-Wl,-e,{entry}"] if zig else [f"-Wl,--entry={entry}", "-lgcc"]
    named = ["-T", str(script), "-o", str(target), *map(str, sources)]
    parts = [*chain.command, *own, *flags, *folders, *named, *last]
    _run(chain, core, sources[0], parts)


def compile_object(chain: Toolchain, core: Core, source: Path, include: Sequence[Path],
                   flags: Sequence[str] = EXACT) -> bytes:  # fmt: skip
    """One C file as an object file for a core. Raises BuildError with the compiler's first complaint."""
    own = (*core.zig, *_ZIG) if chain.command[-1] == "cc" else (*core.gcc, *_GCC)
    folders = [f"-I{folder}" for folder in include]
    with temporary_folder() as scratch:
        target = scratch / "object.o"
        parts = [*chain.command, *own, *flags, *folders, "-c", str(source), "-o", str(target)]
        _run(chain, core, source, parts)
        return target.read_bytes()


def _run(chain: Toolchain, core: Core, source: Path, parts: list[str]) -> None:
    try:
        done = ran(parts, _SLOW, env=_environment())
    except subprocess.TimeoutExpired:
        raise BuildError(str(source), f"{chain.name} did not end within {_SLOW:g} s",
                         "try again; the first build also makes Zig's runtime") from None  # fmt: skip
    if done.returncode:
        raise BuildError(str(source), f"{chain.title} for {core.name}: {first_complaint(done.stderr)}",
                         "generate the folder again")  # fmt: skip


def _environment() -> dict[str, str]:
    zig = cache_folder() / "zig"
    return {**os.environ, "ZIG_GLOBAL_CACHE_DIR": str(zig), "ZIG_LOCAL_CACHE_DIR": str(zig)}
