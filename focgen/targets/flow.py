"""What an instruction does to the stack pointer and where it leads: calls, jumps, returns."""

from __future__ import annotations

from dataclasses import dataclass

from focgen.present import present
from focgen.targets.cores import Core
from focgen.targets.instruction import Instruction
from focgen.targets.timing import stem

_REGISTER, _IMMEDIATE, _MEMORY = 1, 2, 3  # kinds of operands


@dataclass(frozen=True)
class Flow:
    """One instruction: by how many bytes it deepens the stack (``pushed``, negative where it frees some),
    which address it ``calls`` or ``jumps`` to, and whether it ``goes_on`` behind itself. ``table``: it jumps
    through a table that stands behind it.
    """

    pushed: int = 0
    calls: int | None = None
    jumps: int | None = None
    goes_on: bool = True
    table: bool = False


def flow(core: Core, one: Instruction, before: Instruction | None) -> Flow:
    """The flow of an instruction; ``before`` is the one ahead of it, or None. Raises ValueError for a call
    through a pointer.
    """
    return _arm(one) if core.arm else _riscv(one, before)


def _arm(one: Instruction) -> Flow:
    name, registers = stem(one), _registers(one)
    conditional = name != one.mnemonic.split(".")[0]
    if name == "blx" and registers:
        raise ValueError(f"a call through a pointer at {one.address:#x}")
    if name in ("bl", "blx"):
        return Flow(calls=one.operands[-1].imm)
    if name in ("b", "cbz", "cbnz"):
        return Flow(jumps=one.operands[-1].imm, goes_on=conditional or name != "b")
    if name in ("tbb", "tbh"):
        return Flow(goes_on=False, table=True)
    leaves = name == "bx" or (name in ("pop", "ldm", "ldr") and "pc" in registers) or (
        name == "mov" and registers[:1] == ["pc"])  # fmt: skip
    return Flow(pushed=_pushed(one, name, registers), goes_on=conditional or (not leaves and name != "udf"))


def _pushed(one: Instruction, name: str, registers: list[str]) -> int:
    if name in ("push", "vpush"):
        return _bytes(registers)
    if name in ("pop", "vpop"):
        return -_bytes(registers)
    if name in ("stmdb", "ldm") and registers[0] == "sp" and one.writeback:
        return _bytes(registers[1:]) * (1 if name == "stmdb" else -1)
    if name in ("str", "strd", "ldr", "ldrd") and one.writeback:
        return _stored(one)
    last = one.operands[-1] if one.operands else None
    if (
        registers[:1] == ["sp"]
        and present(last).type == _IMMEDIATE
        and name in ("add", "addw", "sub", "subw")
    ):
        return present(last).imm if name.startswith("sub") else -present(last).imm
    return 0


def _bytes(registers: list[str]) -> int:
    return sum(8 if name[0] == "d" else 4 for name in registers)


def _stored(one: Instruction) -> int:
    """What a store or load that moves the stack pointer moves it by."""
    memory = next(o for o in one.operands if o.type == _MEMORY)
    if one.reg_name(memory.mem.base) != "sp":
        return 0
    last = one.operands[-1]
    return -(last.imm if last.type == _IMMEDIATE else memory.mem.disp)


def _riscv(one: Instruction, before: Instruction | None) -> Flow:
    name, registers = one.mnemonic.removeprefix("c."), _registers(one)
    if name in ("jalr", "jr"):
        return _far(one, before, registers)
    if name in ("jal", "call"):
        return Flow(calls=one.address + one.operands[-1].imm)
    if name == "j":
        return Flow(jumps=one.address + one.operands[-1].imm, goes_on=False)
    if name in ("ret", "unimp", "ebreak", "mret"):
        return Flow(goes_on=False)
    if name.startswith("b") and one.operands and one.operands[-1].type == _IMMEDIATE:
        return Flow(jumps=one.address + one.operands[-1].imm)
    if name in ("addi", "addi16sp") and registers and registers[0] == registers[-1] == "sp":
        return Flow(pushed=-one.operands[-1].imm)
    return Flow()


def _far(one: Instruction, before: Instruction | None, registers: list[str]) -> Flow:
    """A return, or a call or jump in two instructions: the upper bits of the target, then the rest."""
    if registers and registers[-1] == "ra" and (len(registers) == 1 or registers[0] == "zero"):
        return Flow(goes_on=False)
    if before is None or before.mnemonic != "auipc":
        raise ValueError(f"a call through a pointer at {one.address:#x}")
    low = one.operands[-1].imm if one.operands[-1].type == _IMMEDIATE else 0
    target = (before.address + (before.operands[-1].imm << 12) + low) & 0xFFFF_FFFF
    if len(registers) > 1 and registers[0] == "ra":
        return Flow(calls=target)
    return Flow(jumps=target, goes_on=False)


def _registers(one: Instruction) -> list[str]:
    return [one.reg_name(o.reg) for o in one.operands if o.type == _REGISTER]
