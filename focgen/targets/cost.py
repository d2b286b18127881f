"""What a controller costs on a core: time of a step, flash, RAM, stack."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from focgen.arrays import Numbers
from focgen.errors import BuildError, MissingExtra
from focgen.plan.plan import Plan
from focgen.present import present
from focgen.targets import avr
from focgen.targets.calls import CallCost, call_costs
from focgen.targets.cores import Core
from focgen.targets.library import TargetLibrary
from focgen.targets.stack import Stack
from focgen.targets.steps import StepCosts, exercise, step_costs
from focgen.targets.timing import HOW
from focgen.targets.toolchains import Toolchain, compile_object

COUNTED = "executed instructions, counted in the emulator"
_UNWINDING = (".ARM.", ".eh_frame", ".note", ".riscv")
_SAVING = re.compile(r"\w+_(save|restore)|foc_(put|get|crc32|crc_bit|bits_f\d\d|float_f\d\d)")
_FEW = 128  # steps, where floating point without a unit makes them long


@dataclass(frozen=True)
class PerStep:
    """The ``mean`` and the ``worst`` of ``steps`` steps; ``how`` they were counted."""

    mean: float
    worst: float
    steps: int
    how: str


@dataclass(frozen=True)
class RuntimeCost:
    """The mean step with one compiler and its own functions; ``skipped``: why it was not counted."""

    instructions_per_step: float | None = None
    cycles_per_step: float | None = None
    skipped: str | None = None


@dataclass(frozen=True)
class Cost:
    """What a controller costs on a core, built by ``compiler``.

    ``flash_bytes``: machine code and constants of the controller and of the compiler's own functions that it
    calls (``flash`` has the parts), without ``save_bytes``, the code of NAME_save and NAME_restore, which a
    linker leaves out where they are not called (-ffunction-sections, --gc-sections). ``ram_bytes``: one
    state, and what else the controller keeps. ``stack_bytes``: the most that a call of its interface uses,
    from machine code, ``stack_path``: the functions on that path, each with its bytes; ``stack_seen``: the
    most that the measured steps have used. ``cycles_per_step`` is None for a core whose timings are not
    published. ``calls``: what the calls beside the step cost, counted in the same way; None for an AVR.
    ``runtimes``: of a core whose wide products are functions of the compiler's, the step with each one's.
    ``skipped``: why nothing was counted; the rest is None then.
    """

    compiler: str | None = None
    instructions_per_step: PerStep | None = None
    cycles_per_step: PerStep | None = None
    flash_bytes: int | None = None
    flash: dict[str, int] | None = None
    ram_bytes: int | None = None
    stack_bytes: int | None = None
    stack_path: tuple[str, ...] | None = None
    stack_seen: int | None = None
    skipped: str | None = None
    save_bytes: int | None = None
    calls: dict[str, CallCost] | None = None
    runtimes: dict[str, RuntimeCost] | None = None


def cost_of(entry: dict[str, Any]) -> Cost:
    """The cost that an entry of :func:`focgen.targets.selection.entry_of` stands for.

    Raises TypeError and KeyError where it is none.
    """
    made = {key: entry[key] and PerStep(**entry[key]) for key in ("instructions_per_step", "cycles_per_step")}
    path = entry["stack_path"]
    for key, kind in (("calls", CallCost), ("runtimes", RuntimeCost)):
        parts = entry.get(key)
        made[key] = parts and {name: kind(**part) for name, part in parts.items()}
    return Cost(**{**entry, **made, "stack_path": None if path is None else tuple(path)})


def cost_on(core: Core, chain: Toolchain, plan: Plan, folder: Path) -> Cost:
    """Build a generated folder for a core and count.

    Raises BuildError where it does not compile, MissingExtra where the emulator is missing.
    """
    library = TargetLibrary(core, chain, [plan], [folder])
    costs = step_costs(library, plan, measured_steps(plan, core))
    stack = Stack(library.program)
    try:
        deepest = max(
            (stack.depth(f"{plan.name}_{part}") for part in _interface(plan)), key=lambda d: d.bytes
        )
    except ValueError as reason:
        raise BuildError(str(folder), f"the stack on {core.name} cannot be told: {reason}",
                         "generate the folder again") from None  # fmt: skip
    flash, kept, save = _sizes(core, chain, plan, folder, library, stack)
    return Cost(
        chain.title,
        _per_step(costs.instructions, COUNTED),
        None if costs.cycles is None else _per_step(costs.cycles, HOW),
        sum(flash.values()),
        flash,
        library.state_bytes(plan) + kept,
        deepest.bytes,
        deepest.path,
        _stack_seen(plan, stack, costs),
        save_bytes=save,
        calls=call_costs(library, plan),
    )


def with_runtimes(
    found: Cost, core: Core, others: Sequence[Toolchain], lacking: Sequence[str], plan: Plan, folder: Path
) -> Cost:
    """Beside what the compiler's own functions make of a step, what those of ``others`` do, and of the
    compilers that are ``lacking`` what installs them.
    """
    cycles = found.cycles_per_step
    runtimes = {
        present(found.compiler): RuntimeCost(
            present(found.instructions_per_step).mean, None if cycles is None else cycles.mean
        )
    }
    for chain in others:
        library = TargetLibrary(core, chain, [plan], [folder])
        costs = step_costs(library, plan, measured_steps(plan, core))
        mean = None if costs.cycles is None else float(costs.cycles.mean())
        runtimes[chain.title] = RuntimeCost(float(costs.instructions.mean()), mean)
    for line in lacking:
        runtimes[line.partition(":")[0]] = RuntimeCost(skipped=line)
    return replace(found, runtimes=runtimes)


def _symbols_of(file: Any) -> Iterator[Any]:
    """The symbols of an ELF file, which the compiler's linker never leaves out."""
    table: Any = file.get_section_by_name(".symtab")
    yield from table.iter_symbols()


def cost_on_avr(plan: Plan, folder: Path) -> Cost:
    """Build a generated folder for an ATmega2560 and count: cycles by simavr, stack as the steps used it.

    Raises BuildError where it does not compile; see :func:`focgen.targets.avr.missing` ahead of it.
    """
    why = avr.missing(plan)
    if why:
        return Cost(skipped=why)
    library = avr.AvrLibrary(plan, folder)
    around = max(plan.error_lags, plan.filtered_lags) + 65
    run = library.run(exercise(plan, min(around, _FEW) + 1, 0))
    sizes, _ = object_sizes(library.object)
    own = {key: sizes[key] for key in ("code", "constants")}
    flash = {**own, "compiler": library.flash - sizes["save"] - sum(own.values())}
    return Cost(
        compiler=avr.tools(),
        cycles_per_step=_per_step(run.cycles[0, 1:], avr.HOW),
        flash_bytes=sum(flash.values()),
        flash=flash,
        ram_bytes=len(run.answers.states[0]) + sizes["data"],
        stack_bytes=run.stack,
        stack_path=(f"as used by the measured steps {run.stack}",),
        stack_seen=run.stack,
        save_bytes=sizes["save"],
    )


def _interface(plan: Plan) -> tuple[str, ...]:
    """The calls whose code, stack and helpers count; what saves a state is told by itself."""
    return ("init", "reset", "step", "track", "flags", *["tune"] * (plan.tuning is not None))


def measured_steps(plan: Plan, core: Core) -> int:
    """Once around the memory, so that no place of the ring's end is left out; fewer where steps are long."""
    has = {"f64": core.double, "f32": core.single}.get(plan.arithmetic, True)
    around = max(plan.error_lags, plan.filtered_lags) + 65
    return around if has else min(around, _FEW)


def _per_step(values: Numbers, how: str) -> PerStep:
    return PerStep(float(values.mean()), float(values.max()), int(values.size), how)


def _stack_seen(plan: Plan, stack: Stack, costs: StepCosts) -> int:
    """What the steps have used, without what fed them."""
    run, step = f"{plan.name}_run", f"{plan.name}_step"
    return costs.stack - stack.at_call("focgen_run", run) - stack.at_call(run, step)


def _sizes(core: Core, chain: Toolchain, plan: Plan, folder: Path, library: TargetLibrary,
           stack: Stack) -> tuple[dict[str, int], int, int]:  # fmt: skip
    """Bytes of flash by part, of memory besides the state, and of what saves it."""
    sizes, own = object_sizes(compile_object(chain, core, folder / f"{plan.name}.c", [folder]))
    reached = stack.reached([f"{plan.name}_{part}" for part in _interface(plan)])
    helpers = sum(library.program[name].size for name in reached - own)
    flash = {"code": sizes["code"], "constants": sizes["constants"], "compiler": helpers}
    return flash, sizes["data"], sizes["save"]


def object_sizes(elf: bytes) -> tuple[dict[str, int], set[str]]:
    """Bytes of code, constants, data and of the code that saves states, in an object file; and the names of
    its functions.

    Raises MissingExtra without pyelftools.
    """
    try:
        from elftools.elf.elffile import ELFFile
    except ImportError:
        raise MissingExtra.of("pyelftools", "targets", "reading what was compiled") from None
    file, sizes = ELFFile(io.BytesIO(elf)), {"code": 0, "constants": 0, "data": 0}
    for section in file.iter_sections():
        flags = section["sh_flags"]
        if flags & 2 and not section.name.startswith(_UNWINDING):
            sizes["code" if flags & 4 else "data" if flags & 1 else "constants"] += section["sh_size"]
    functions = [s for s in _symbols_of(file)
                 if s["st_info"]["type"] == "STT_FUNC" and s["st_shndx"] != "SHN_UNDEF"]  # fmt: skip
    sizes["save"] = sum(s["st_size"] for s in functions if _SAVING.fullmatch(s.name))
    sizes["code"] -= sizes["save"]
    return sizes, {s.name for s in functions}
