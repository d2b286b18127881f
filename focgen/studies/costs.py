"""What a variant costs: multiplications, bytes, and cycles where a target is named."""

from __future__ import annotations

import platform
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import Kernels
from focgen.codegen.manifest import sizes
from focgen.compiler import find_compiler
from focgen.control.files import controller_text
from focgen.errors import BuildError, FocgenError
from focgen.output import write_files
from focgen.plan.plan import Plan
from focgen.present import present
from focgen.programs import ran
from focgen.scratch import temporary_folder
from focgen.targets.cost import object_sizes
from focgen.verification.costs import cost

_FLAGS = ("-std=c99", "-Os", "-ffunction-sections", "-fdata-sections")
_NAME = "controller"


@dataclass(frozen=True)
class Costs:
    """See :class:`focgen.studies.results.Row`; ``note`` says why a number is missing."""

    multiplies: int
    ram_bytes: int
    table_bytes: int
    flash_bytes: int | None = None
    stack_bytes: int | None = None
    compiled_for: str | None = None
    instructions: float | None = None
    cycles: float | None = None
    note: str | None = None


def costs(plan: Plan, target: str | None) -> Costs:
    """Count what ``plan`` costs: its C is compiled and run for ``target`` with that core's own kernels, or
    only compiled for this machine.
    """
    plan = replace(plan, name=_NAME)  # of the C: what the controller is called may be no name there
    kernels = Kernels(target)
    size = sizes(plan, kernels)
    counted = multiplies(plan), size["state_bytes"], size["table_bytes"]
    try:
        files = folder_files(plan, controller_text(plan.controller).encode("utf-8"), kernels=kernels)
        with temporary_folder("study") as folder:
            write_files(folder, files)
            compiled = _on_host(folder, plan.name) if target is None else _on_target(str(folder), target)
        return replace(Costs(*counted), **compiled)
    except FocgenError as reason:
        return Costs(*counted, note=f"not compiled: {reason}")


def multiplies(plan: Plan) -> int:
    """Multiplications of the memory in one step: a tap one, a mode two; gain and schedule not counted."""
    return sum(s.taps + 2 * s.modes for s in plan.sums)


def _on_target(folder: str, target: str) -> dict[str, Any]:
    found = cost(folder, target).controllers[0].targets[target]
    if found.skipped is not None:
        return {"note": f"no cycles on {target}: {found.skipped}"}
    cycles = found.cycles_per_step
    return {
        "ram_bytes": found.ram_bytes,
        "flash_bytes": found.flash_bytes,
        "stack_bytes": found.stack_bytes,
        "compiled_for": f"{target}, {found.compiler}",
        "instructions": present(found.instructions_per_step).mean,
        "cycles": None if cycles is None else cycles.mean,
    }


def _on_host(folder: Path, name: str) -> dict[str, Any]:
    """Code, constants and data of the compiled C."""
    made, source = folder / f"{name}.o", folder / f"{name}.c"
    command = [*find_compiler(), *_FLAGS, "-c", str(source), "-o", str(made)]
    if ran(command).returncode:
        raise BuildError("flash", "the C does not compile here", "set CC to another compiler")
    found, _ = object_sizes(made.read_bytes())
    return {"flash_bytes": sum(found.values()) - found["save"], "compiled_for": f"{platform.machine()}, -Os"}
