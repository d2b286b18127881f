"""What a variant costs: multiplications, bytes, and cycles where a target is named."""

from __future__ import annotations

import platform
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from focgen.codegen.generate import folder_files
from focgen.codegen.manifest import sizes
from focgen.compiler import find_compiler
from focgen.control.files import controller_text
from focgen.errors import FocgenError
from focgen.plan.model import Plan

_FLAGS = ("-std=c99", "-Os", "-ffunction-sections", "-fdata-sections")


@dataclass(frozen=True)
class Costs:
    """See :class:`focgen.studies.model.Row`; ``note`` says why a number is missing."""

    multiplies: int
    ram_bytes: int
    table_bytes: int
    flash_bytes: int | None
    compiled_for: str | None
    cycles: float | None
    note: str | None


def costs(plan: Plan, target: str | None) -> Costs:
    """Count what ``plan`` costs; flash and cycles by compiling its C, for ``target`` or for this machine."""
    size = sizes(plan)
    try:
        flash, compiled_for, cycles = _compiled(plan, target)
        note = None
    except FocgenError as reason:
        flash = compiled_for = cycles = None
        note = f"not compiled: {reason}"
    return Costs(
        multiplies(plan), size["state_bytes"], size["table_bytes"], flash, compiled_for, cycles, note
    )


def multiplies(plan: Plan) -> int:
    """Multiplications of the memory in one step: a tap one, a mode two; gain and schedule not counted."""
    return sum(s.taps + 2 * s.modes for s in plan.sums)


def _compiled(plan: Plan, target: str | None) -> tuple[int | None, str | None, float | None]:
    files = folder_files(plan, controller_text(plan.controller).encode("utf-8"))
    with tempfile.TemporaryDirectory(prefix="focgen-study-") as scratch:
        folder = Path(scratch)
        for name, content in files.items():
            place = folder / name
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return _on_host(folder, plan.name)


def _on_host(folder: Path, name: str) -> tuple[int | None, str | None, float | None]:
    """Code and constants of the compiled C, as ``size`` counts them."""
    if shutil.which("size") is None:
        raise FocgenError("flash", "the tool `size` is not installed", "install binutils")
    made = folder / f"{name}.o"
    done = subprocess.run(
        [*find_compiler(), *_FLAGS, "-c", str(folder / f"{name}.c"), "-o", str(made)],
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise FocgenError("flash", "the C does not compile here", "look at the compiler named by CC")
    counted = subprocess.run(["size", str(made)], capture_output=True, text=True, check=True).stdout
    text, data = counted.splitlines()[1].split()[:2]
    return int(text) + int(data), f"{platform.machine()}, -Os", None
