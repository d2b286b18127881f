"""How many cycles executed instructions take, by the tables that Arm publishes: a model, no measurement.

Sources: instruction timings in the Technical Reference Manuals of the Cortex-M0+ (DDI 0484, table 3-1), the
Cortex-M3 (DDI 0337, table 3-1 and "Load/store timings") and the Cortex-M4 (DDI 0439, table 3-1, "Load/store
timings" and, for its floating-point unit, table 7-1). They hold for memory without wait states. For the
Cortex-M7 and for RISC-V nothing of the kind is published; no cycles are given for them.

Where a table gives a range, this is taken: a refilled pipeline is 2 cycles of 1 … 3; a multiplication or
division whose time depends on its operands, the middle of the range. The Cortex-M0+ has the fast multiplier.
A conditional instruction counts as if its condition held.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from focgen.arrays import Numbers
from focgen.present import present
from focgen.targets.cores import Core
from focgen.targets.emulator import Executed
from focgen.targets.instruction import Instruction, Operand
from focgen.targets.legality import instructions
from focgen.targets.program import Program

MODELLED = ("cortex-m0plus", "cortex-m3", "cortex-m4")
HOW = "model: Arm's published instruction timings, memory without wait states"

_REFILL = 2
_DATA_DEPENDENT = {  # cycles on the Cortex-M3; on the M4 all but division take one
    "smull": (3, 5), "umull": (3, 5), "smlal": (4, 7), "umlal": (4, 7), "sdiv": (2, 12), "udiv": (2, 12),
}  # fmt: skip
_FLOAT = {"vdiv": 14, "vsqrt": 14, "vmla": 3, "vmls": 3, "vnmla": 3, "vnmls": 3, "vfma": 3, "vfms": 3,
          "vfnma": 3, "vfnms": 3}  # fmt: skip
_ARITHMETIC = ("vadd", "vsub", "vmul", "vnmul", "vcvt", *_FLOAT)
_CONDITIONS = re.compile(r"(eq|ne|hs|lo|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le)$")


@dataclass(frozen=True, eq=False)
class Timing:
    """Cycles by halfword of code: ``each`` time an instruction runs, ``jump`` in addition where something
    else than the instruction behind it follows, ``next`` in addition where that one does.
    """

    each: Numbers
    jump: Numbers
    next: Numbers

    def cycles(self, ran: Executed) -> float:
        """Estimate the cycles of what ran."""
        at = ran.address // 2
        straight = ran.ran - ran.jumped
        return float(ran.ran @ self.each[at] + ran.jumped @ self.jump[at] + straight @ self.next[at])


def timing(program: Program) -> Timing | None:
    """The timing of a program's instructions; None for a core that nothing is published for."""
    if program.core.name not in MODELLED:
        return None
    size = max(end for _, end in program.code_ranges) // 2 + 2
    table = Timing(np.ones(size), np.zeros(size), np.zeros(size))
    before = None
    for one in instructions(program):
        at = one.address // 2
        table.each[at], table.jump[at] = _cycles(program.core, one)
        if before is not None and before.address + before.size == one.address:
            table.next[before.address // 2] = _together(program.core, before, one)
        before = one
    return table


def stem(one: Instruction) -> str:
    """An instruction's name without width and condition."""
    name = one.mnemonic.split(".")[0]
    if not _sure(name):
        return name
    return _CONDITIONS.sub("", name)


def _sure(name: str) -> bool:
    """Whether an ending that looks like a condition is one: not so in muls, bls, movs and the like."""
    return name not in ("teq", "mls", "smmls", "vmls", "vnmls", "vfms", "movs", "muls", "bics", "lsls")


def _cycles(core: Core, one: Instruction) -> tuple[float, float]:
    """Cycles of one instruction, and what a jump adds."""
    name = stem(one)
    if core.name == "cortex-m0plus":
        return _m0plus(name, one)
    refill = _REFILL
    if name.startswith("v"):
        return _floating(name, one), refill
    if name.startswith(("ldm", "stm", "push", "pop", "ldrd", "strd")):
        return 1 + _registers(name, one), refill
    if name.startswith("ldr"):
        return 2, refill + 1
    if name.startswith("str"):
        return (2 if _indexed(one) else 1), 0
    if name.startswith(("tbb", "tbh")):
        return 2, refill
    return _multiplied(core, name), refill


def _m0plus(name: str, one: Instruction) -> tuple[float, float]:
    if name.startswith(("ldm", "stm", "push", "pop")):
        return 1 + _registers(name, one), 2
    if name.startswith(("ldr", "str")):
        return 2, 0
    if name in ("mrs", "msr", "dmb", "dsb", "isb"):
        return 3, 0
    return 1, 2 if name == "bl" else 1


def _multiplied(core: Core, name: str) -> float:
    """Cycles of integer arithmetic."""
    if name in _DATA_DEPENDENT and (core.name == "cortex-m3" or name.endswith("div")):
        return sum(_DATA_DEPENDENT[name]) / 2
    return 2 if name in ("mla", "mls") and core.name == "cortex-m3" else 1


def _floating(name: str, one: Instruction) -> float:
    if name.startswith(("vldm", "vstm", "vpush", "vpop")):
        return 1 + _words(one, 0 if name in ("vpush", "vpop") else 1)
    if name.startswith(("vldr", "vstr")):
        return 1 + _words(one, 0)
    if name == "vmov":
        return 2 if sum(_is_core_register(one, o) for o in one.operands) == 2 else 1
    return _FLOAT.get(name, 1)


def _together(core: Core, before: Instruction | None, one: Instruction) -> float:
    """What two neighbours add to, or take from, their cycles."""
    if core.name == "cortex-m0plus":
        return 0
    first, second = stem(present(before)), stem(one)
    if first in _ARITHMETIC:  # a result that the next instruction reads comes a cycle later
        return 1 if present(before).operands and _reads(one, present(before).operands[0].reg) else 0
    overlaps = first.startswith("ldr") and not first.startswith("ldrd") and not present(before).writeback
    if not overlaps or second.startswith(("ldrd", "strd")):
        return 0
    if (second.startswith("ldr") and not one.writeback) or (second.startswith("str") and _indexed(one)):
        return 0 if _addressed_by(one, present(before).operands[0].reg) else -1
    return 0


def _reads(one: Instruction, register: int) -> bool:
    operands = [o for o in one.operands if o.type == 1]  # registers
    sources = operands if stem(one) in ("vcmp", "vcmpe", "vstr", *_FLOAT) else operands[1:]
    return any(o.reg == register for o in sources)


def _addressed_by(one: Instruction, register: int) -> bool:
    """Whether a register is part of the address of a load or store."""
    return any(register in (o.mem.base, o.mem.index) for o in one.operands if o.type == 3)


def _indexed(one: Instruction) -> bool:
    """Whether a register is added to the address."""
    return any(o.type == 3 and o.mem.index for o in one.operands)


def _registers(name: str, one: Instruction) -> int:
    """Words that are loaded or stored by several at once."""
    if name.startswith(("ldrd", "strd")):
        return 2
    return len(one.operands) - (0 if name.startswith(("push", "pop")) else 1)


def _words(one: Instruction, skip: int) -> int:
    """Words of the floating registers among the operands."""
    names = [one.reg_name(o.reg) for o in one.operands[skip:] if o.type == 1]
    return sum(2 if name.startswith("d") else 1 for name in names if name[0] in "ds" and name != "sp")


def _is_core_register(one: Instruction, operand: Operand) -> bool:
    return operand.type == 1 and one.reg_name(operand.reg)[0] not in "ds"
