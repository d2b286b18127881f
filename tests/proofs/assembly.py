"""Unicorn, an emulator (pip: focgen[targets]), on the cores' assembly.

Each function is followed instruction by instruction, through calls from every slot of a ring. Every access
has to lie within what the arguments of the call grant to the C that it stands for, which Eva looks at. And no
address and no branch may depend on a sample, a weight or a sum: those are marked where they are loaded, and
the mark goes with every result made of them. So other data take the same path to the same addresses.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from focgen.codegen.kernels import Kernels
from focgen.plan.plan import Plan
from focgen.plan.scenario import Reset, Scenario
from focgen.targets.cores import core
from focgen.targets.emulator import Machine
from focgen.targets.legality import disassembler
from focgen.targets.library import TargetLibrary
from focgen.targets.toolchains import toolchains
from tests.proofs.verdict import Verdict

FUNCTIONS = {
    ("cortex-m0plus", "q15"): "foc_tiles_q15",
    ("cortex-m0plus", "q31"): "foc_line_q31",
    ("cortex-m3", "q15"): "foc_work_q15",
    ("cortex-m3", "q31"): "foc_work_q31",
    ("cortex-m4", "q15"): "foc_work_q15",
    ("cortex-m4", "f32"): "foc_tiles_f32",
}
"""The function that is assembly, by the core it was first written for and the arithmetic."""
_SAMPLE = {"q15": 2, "q31": 4, "f32": 4}  # bytes
_RUN = 8  # bytes of a foc_run
_COPIES = ("mov", "mvn", "uxt", "sxt", "vmov", "ldr")  # what they write was not read before
_COMPARE = ("cmp", "cmn", "tst", "teq")
_CARRY = ("adc", "sbc")
_STORES = ("str", "stm", "push", "vstm", "vpush")
_SEVERAL = ("smlal", "ldrd", "ldm", "vldm", "pop", "vpop")  # they write more than one register

Range = tuple[int, int]


def program() -> str | None:
    """The emulator's name where it is installed, with what compiles for it and reads machine code."""
    needed = ("unicorn", "ziglang", "capstone", "elftools")
    return needed[0] if all(map(find_spec, needed)) else None


@dataclass
class Grant:
    """What a call may touch: ``data`` (samples, weights, sums), whose values are marked, and ``control``."""

    data: list[Range]
    control: list[Range]

    def kind(self, address: int, size: int) -> str | None:
        """ "data", "control" or None, where it is neither."""
        for name, ranges in (("data", self.data), ("control", self.control)):
            if any(begin <= address and address + size <= end for begin, end in ranges):
                return name
        return None


@dataclass
class Follower:
    """Follows a function of a machine; ``found`` has what it must not do."""

    machine: Machine
    function: str
    arithmetic: str
    found: list[str] = field(default_factory=list)
    calls: int = 0
    grant: Grant | None = None
    marked: set = field(default_factory=set)  # names of registers, "flags", addresses on the stack
    pending: object = None
    touched: list = field(default_factory=list)

    def __post_init__(self):
        import unicorn

        whole = self.machine.program
        symbol = whole[self.function]
        self.begin, size = symbol.address, symbol.size
        code = disassembler(whole.core).disasm(whole.read(self.begin, size), self.begin)
        self.text = {one.address: one for one in code}
        self.emulator = self.machine._machine
        ends = dict(begin=symbol.address, end=symbol.address + size - 1)
        self.emulator.hook_add(unicorn.UC_HOOK_CODE, self._on_code, **ends)
        self.emulator.hook_add(unicorn.UC_HOOK_MEM_READ | unicorn.UC_HOOK_MEM_WRITE, self._on_memory)
        self.emulator.ctl_flush_tb()

    def _on_code(self, emulator, address: int, size: int, _) -> None:
        self.finish()
        if address == self.begin:
            self.calls, self.marked, self.grant = self.calls + 1, set(), self._granted()
        self.pending = self.text[address]

    def _on_memory(self, emulator, access, address: int, size: int, value, _) -> None:
        if self.pending is not None and self._pc() == self.pending.address:
            self.touched.append((address, size))

    def _pc(self) -> int:
        import unicorn.arm_const as arm

        return self.emulator.reg_read(arm.UC_ARM_REG_PC) & ~1

    def _registers(self, count: int) -> list[int]:
        import unicorn.arm_const as arm

        return [self.emulator.reg_read(arm.UC_ARM_REG_R0 + i) for i in range(count)]

    def _granted(self) -> Grant:
        """What the arguments grant to the C that the function stands for."""
        import unicorn.arm_const as arm

        first, weights, x, count = self._registers(4)
        sample, sp = _SAMPLE[self.arithmetic], self.emulator.reg_read(arm.UC_ARM_REG_SP)
        stack = [(sp - 256, sp)]
        if self.function.startswith("foc_line"):
            return Grant([(first, first + 8), *_of(sample, (weights, count), (x, count))], stack)
        if self.function.startswith("foc_tiles"):
            ranges = [(first, first + 16), *_of(sample, (weights, 4 * count + 4), (x, 4 * count))]
            return Grant(ranges, stack)
        ahead, weights, run, end, ring, tiles, _ = struct.unpack("<7I", self.machine.read(first, 28))
        runs = [struct.unpack("<HHHBB", self.machine.read(at, _RUN)) for at in range(run, end, _RUN)]
        taken = [(weights + sample * one[0], 4 * one[1] + 4) for one in runs]
        sums = (ahead, ahead + 12 * 2 * sample)
        return Grant(
            [sums, *_of(sample, *taken, (ring, 4 * tiles))], [(first, first + 28), (run, end), *stack]
        )

    def finish(self) -> None:
        """Account for the instruction that has just run."""
        one, touched, self.pending, self.touched = self.pending, self.touched, None, []
        if one is None:
            return
        kinds = [self.grant.kind(*place) for place in touched]
        if None in kinds:
            self._object(one, f"accesses {touched[kinds.index(None)][0]:#x}, which the call does not grant")
        if self._decides(one) and "flags" in self.marked:
            self._object(one, "depends on data")
        if self._address_of(one) & self.marked:
            self._object(one, "takes its address from data")
        self._mark(one, touched, kinds)

    def _object(self, one, what: str) -> None:
        self.found.append(
            f"{self.function}+{one.address - self.begin:#x}: {one.mnemonic} {one.op_str} {what}"
        )

    def _mark(self, one, touched: list, kinds: list) -> None:
        """Carry the marks from what an instruction reads to what it writes."""
        reads, writes = self._flow(one)
        if touched and one.mnemonic.startswith(("ldr", "ldm", "pop", "vldm", "vpop")):
            base = self._address_of(one)
            from_data = "data" in kinds or any(place in self.marked for place, _ in touched)
            self._set(set(writes) - base, from_data)
        elif touched:
            self._set({place for place, _ in touched}, bool(reads - self._address_of(one) & self.marked))
        else:
            self._set(writes, bool(reads & self.marked), keeps=self._decides(one))

    def _set(self, places, marked: bool, keeps: bool = False) -> None:
        if marked:
            self.marked |= set(places)
        elif not keeps:
            self.marked -= set(places)

    def _decides(self, one) -> bool:
        """Whether flags decide on it."""
        from capstone import arm

        return one.cc not in (arm.ARM_CC_AL, arm.ARM_CC_INVALID)

    def _address_of(self, one) -> set[str]:
        """Registers that an access takes its address from."""
        from capstone import arm

        found = set()
        for operand in one.operands:
            if operand.type == arm.ARM_OP_MEM:
                found |= {one.reg_name(r) for r in (operand.mem.base, operand.mem.index) if r}
        if one.mnemonic.startswith(("ldm", "stm", "vldm", "vstm")):
            found.add(one.reg_name(one.operands[0].reg))
        return found

    def _flow(self, one) -> tuple[set[str], set[str]]:
        """Registers and flags that an instruction reads, and that it writes."""
        from capstone import arm

        names = [one.reg_name(o.reg) for o in one.operands if o.type == arm.ARM_OP_REG]
        mnemonic, reads = one.mnemonic, set(names)
        if mnemonic.startswith((*_COMPARE, *_STORES, "b", "it")):
            written = set()
        elif mnemonic.startswith(_SEVERAL):
            written = set(names[:2] if mnemonic.startswith("smlal") else names)
        else:
            written = set(names[:1])
            if mnemonic.startswith(_COPIES) or len(one.operands) > 2:
                reads = set(names[1:])
        if mnemonic.startswith(_CARRY):
            reads.add("flags")
        if one.update_flags or mnemonic.startswith(_COMPARE):
            written.add("flags")
        return reads, written


def _of(sample: int, *arrays: tuple[int, int]) -> list[Range]:
    """The bytes of arrays, each an address and a number of samples."""
    return [(place, place + sample * count) for place, count in arrays]


def follow(plan: Plan, folder: Path, target: str) -> Verdict:
    """Run a plan's C for a core through every slot of its ring, and through a reset."""
    began, function = time.perf_counter(), FUNCTIONS[target, plan.arithmetic]
    library = TargetLibrary(core(target), toolchains(core(target))[0], [plan], [folder])
    library.machine = Machine(library.program)  # not watched: these hooks are enough
    follower = Follower(library.machine, function, plan.arithmetic)
    size = Kernels(target).slots(plan, "error")
    library.run(plan, _scenario(plan, size + 8))
    follower.finish()
    what = f"{function}, {follower.calls} calls, {size} slots"
    found = tuple(dict.fromkeys(follower.found)) or (() if follower.calls else ("it is not called",))
    return Verdict("unicorn", what, time.perf_counter() - began, found)


def _scenario(plan: Plan, samples: int) -> Scenario:
    """One lane of any inputs, with a reset."""
    kind = np.float32 if plan.floating else np.int64
    ends = float(plan.reference.low), float(plan.reference.high)
    ref, meas, sched = np.random.default_rng(5).uniform(*ends, (3, 1, samples)).astype(kind)
    return Scenario(ref, meas, sched if plan.schedule else None, (Reset(0, 3, 0, 0, 0),))
