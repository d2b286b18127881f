"""Instructions that a core does not have, found in the program's text.

The emulator takes some of them: DSP instructions on a Cortex-M3, for one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

from focgen.errors import MissingExtra
from focgen.targets.cores import Core
from focgen.targets.instruction import Instruction
from focgen.targets.program import Program

_RISCV = {"lw": 3, "sw": 3, "lh": 1, "lhu": 1, "sh": 1}
_WIDE_M0 = ("bl", "dmb", "dsb", "isb", "mrs", "msr", "udf")
_ALIGNED = ("ldm", "stm", "ldrd", "strd", "push", "pop", "vldr", "vstr", "vldm", "vstm", "vpush", "vpop")


def _capstone() -> ModuleType:
    try:
        import capstone
    except ImportError:
        raise MissingExtra.of("capstone", "targets", "reading machine code") from None
    found: ModuleType = capstone
    return found


@cache
def disassembler(core: Core) -> Any:
    """Capstone for a core, with details. Raises MissingExtra without it."""
    cs = _capstone()
    if core.arm:
        made = cs.Cs(cs.CS_ARCH_ARM, cs.CS_MODE_THUMB | cs.CS_MODE_MCLASS)
    else:
        made = cs.Cs(cs.CS_ARCH_RISCV, cs.CS_MODE_RISCV32 | cs.CS_MODE_RISCVC)
    made.detail = True
    return made


def instructions(program: Program) -> list[Any]:
    """Every instruction of a program by rising address, literal pools left out.

    What cannot be read as an instruction is passed over.
    """
    if not program.read_code:
        program.read_code.extend(_instructions(program))
    return program.read_code


def _instructions(program: Program) -> Iterator[Any]:
    reader = disassembler(program.core)
    for begin, end in program.code_ranges:
        while begin < end:
            found = list(reader.disasm(program.read(begin, end - begin), begin))
            yield from found
            begin = found[-1].address + found[-1].size if found else begin + 2


def forbidden(program: Program) -> tuple[str, ...]:
    """Instructions that the program's core does not have: "smlad (DSP extension) at NAME+0xOFFSET", each
    mnemonic once.
    """
    if not program.core.arm:
        return ()  # the emulated core has no more extensions than it was given
    seen: dict[str, str] = {}
    for one in instructions(program):
        why = _why_not(program.core, one)
        if why:
            seen.setdefault(one.mnemonic, f"{one.mnemonic} ({why}) at {program.place(one.address)}")
    return tuple(seen.values())


def _why_not(core: Core, one: Instruction) -> str | None:
    groups = {one.group_name(g) for g in one.groups}
    name = one.mnemonic
    if name.startswith("v"):
        if not core.single:
            return "floating-point unit"
        return "double-precision unit" if not core.double and _double(one) else None
    if not core.dsp and ("THUMB2DSP" in groups or _extends_and_adds(name, groups)):
        return "DSP extension"
    if name.startswith(("sdiv", "udiv")) and not core.divide:
        return "hardware division"
    if not core.wide and one.size == 4 and name.split(".")[0] not in _WIDE_M0:
        return "32-bit instruction"
    if not core.wide and (name.startswith(("it", "cbz", "cbnz"))):
        return "not in ARMv6-M"
    return None


def _extends_and_adds(name: str, groups: set[str]) -> bool:
    return "T2EXTRACTPACK" in groups and name.split(".", maxsplit=1)[0] not in (
        "sxtb",
        "sxth",
        "uxtb",
        "uxth",
    )


def _double(one: Instruction) -> bool:
    """Whether it computes with 64-bit floating values; moving them about is not computing."""
    return ".f64" in one.mnemonic


@dataclass(frozen=True)
class Access:
    """Where an instruction accesses memory: base + (index << shift) + offset, which must have no bit of
    ``mask``. Registers by unicorn's numbers, 0 for none; ``condition`` as ARM encodes it.
    """

    base: int
    index: int
    offset: int
    shift: int
    mask: int
    condition: int
    negative: int


def memory_accesses(program: Program) -> Iterator[tuple[int, Access]]:
    """(address, access) of every instruction whose access has to be aligned on the program's core.

    Left out: what is relative to the program counter, and to the stack pointer, which is always aligned.
    """
    for one in instructions(program):
        mask = _mask(program.core, one)
        operand = _memory_operand(program.core, one) if mask else None
        if operand is not None:
            yield one.address, Access(*operand, mask, one.cc - 1 if program.core.arm else 14, 0)


def _mask(core: Core, one: Instruction) -> int:
    name = one.mnemonic.split(".")[0]
    if not core.arm:
        name = name.removeprefix("c.")
        return _RISCV.get(name, 0)
    if name.startswith(_ALIGNED):
        return 3
    if core.unaligned or not name.startswith(("ldr", "str")):
        return 0
    return 1 if name[3:].startswith(("h", "sh")) else 0 if name[3:].startswith(("b", "sb")) else 3


def _memory_operand(core: Core, one: Instruction) -> tuple[int, int, int, int] | None:
    """Base, index (unicorn's numbers), offset and shift of an access; None for one that is always aligned."""
    cs = _capstone()
    kind = cs.arm.ARM_OP_MEM if core.arm else cs.riscv.RISCV_OP_MEM
    found = [o for o in one.operands if o.type == kind]
    if not found:  # several registers at once: the first operand is the base
        multiple = core.arm and "push" not in one.mnemonic and "pop" not in one.mnemonic
        return (_number(core, one, one.operands[0].reg), 0, 0, 0) if multiple else None
    memory = found[0].mem
    if one.reg_name(memory.base) in ("pc", "sp"):
        return None
    base = _number(core, one, memory.base)
    if not core.arm:
        return base, 0, memory.disp, 0
    return base, _number(core, one, memory.index), memory.disp, found[0].shift.value


def _number(core: Core, one: Instruction, register: int) -> int:
    """Unicorn's number of capstone's register."""
    if not register:
        return 0
    from unicorn import arm_const, riscv_const

    prefix, numbers = ("UC_ARM_REG_", arm_const) if core.arm else ("UC_RISCV_REG_", riscv_const)
    made: int = getattr(numbers, prefix + one.reg_name(register).upper())
    return made
