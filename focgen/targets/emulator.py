"""A core emulated by unicorn: runs functions of a program, watches what they execute and how they access
memory.

The emulator is more lenient than silicon in two things: accesses that are not aligned, which are looked for
here in every instruction that runs, and instructions the core does not have (:mod:`focgen.targets.legality`).
"""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from focgen.arrays import Numbers
from focgen.cache import kept
from focgen.compiler import compile_shared
from focgen.errors import FocgenError, MissingExtra
from focgen.present import present
from focgen.targets.cores import Core
from focgen.targets.legality import memory_accesses
from focgen.targets.program import FLASH, FLASH_SIZE, RAM, RAM_SIZE, STACK, WORK_SIZE, Program

PAINT = 0xA5
"""What unused stack is filled with."""


class TargetFault(Exception):
    """The program did what the core cannot do, or did not return; the message says what and where."""


class _Access(ctypes.Structure):
    """As in watch.c."""

    _fields_ = [
        ("base", ctypes.c_int32),
        ("index", ctypes.c_int32),
        ("offset", ctypes.c_int32),
        ("shift", ctypes.c_uint8),
        ("mask", ctypes.c_uint8),
        ("condition", ctypes.c_uint8),
        ("negative", ctypes.c_uint8),
    ]


class _Watch(ctypes.Structure):
    """As in watch.c."""

    _fields_ = [
        ("halfwords", ctypes.c_uint64),
        ("runs", ctypes.c_void_p),
        ("jumps", ctypes.c_void_p),
        ("accesses", ctypes.c_void_p),
        ("register_of", ctypes.c_void_p),
        ("flags", ctypes.c_int32),
        ("checking", ctypes.c_uint32),
        ("last", ctypes.c_uint64),
        ("next", ctypes.c_uint64),
        ("strays", ctypes.c_uint64),
        ("unaligned", ctypes.c_uint64),
        ("first", ctypes.c_uint64),
        ("first_pc", ctypes.c_uint64),
    ]


@dataclass(frozen=True, eq=False)
class Executed:
    """What ran, by rising ``address``: how often each instruction ``ran``, and how often it ``jumped``, that
    is, was not followed by the one right behind it.
    """

    address: Numbers
    ran: Numbers
    jumped: Numbers

    def without(self, ranges: Sequence[tuple[int, int]]) -> Executed:
        """All but the instructions in ranges (begin, end) of addresses."""
        keep = np.ones(self.address.size, bool)
        for begin, end in ranges:
            keep &= (self.address < begin) | (self.address >= end)
        return Executed(self.address[keep], self.ran[keep], self.jumped[keep])


@cache
def _unicorn() -> ModuleType:
    try:
        import unicorn
        import unicorn.arm_const
        import unicorn.riscv_const
    except ImportError:
        raise MissingExtra.of("unicorn", "targets", "emulating a microcontroller") from None
    return unicorn


def _library() -> ctypes.CDLL:
    """Unicorn itself, for hooks that are not Python functions."""
    from unicorn.unicorn_py3.unicorn import uclib

    return uclib


def emulator_title() -> str:
    """Name and version. Raises MissingExtra without unicorn."""
    return f"unicorn {_unicorn().__version__}"


@cache
def _watcher() -> ctypes.CDLL:
    """watch.c, compiled for this computer and kept."""
    source = Path(__file__).with_name("watch.c")
    name = f"watch-{hashlib.sha256(source.read_bytes()).hexdigest()[:16]}.so"
    target = kept(name, lambda part: compile_shared([source], part, ["-std=c99", "-O2"]))
    return ctypes.CDLL(str(target))


class Machine:
    """A core with a program in its flash. Raises MissingExtra without unicorn."""

    def __init__(self, program: Program) -> None:
        uc = _unicorn()
        self.program, self.core = program, program.core
        self._uc, self._names = uc, _registers(uc, program.core)
        self._machine = self._make()
        self._seen: _Watch | None = None
        for section in program.sections:
            if section.content:
                self._machine.mem_write(section.address, section.content)

    def _make(self) -> Any:
        uc = self._uc
        if self.core.arm:  # UC_MODE_MCLASS would put a Cortex-M33 in its place
            machine = uc.Uc(uc.UC_ARCH_ARM, uc.UC_MODE_THUMB)
            machine.ctl_set_cpu_model(getattr(uc.arm_const, self.core.model))
        else:
            machine = uc.Uc(uc.UC_ARCH_RISCV, uc.UC_MODE_RISCV32)
            machine.ctl_set_cpu_model(getattr(uc.riscv_const, self.core.model))
        machine.mem_map(FLASH, FLASH_SIZE, uc.UC_PROT_READ | uc.UC_PROT_EXEC)
        machine.mem_map(RAM, RAM_SIZE, uc.UC_PROT_READ | uc.UC_PROT_WRITE)
        machine.mem_map(self.core.work, WORK_SIZE, uc.UC_PROT_READ | uc.UC_PROT_WRITE)
        return machine

    def write(self, address: int, content: bytes) -> None:
        """Put bytes into memory."""
        self._machine.mem_write(address, content)

    def read(self, address: int, size: int) -> bytes:
        """Bytes of memory."""
        return bytes(self._machine.mem_read(address, size))

    def call(self, function: str, *arguments: int, seconds: float = 60.0) -> int:
        """Call a function with integers; what it returns in the first register.

        Raises TargetFault where it faults, accesses memory unaligned, or has not returned after ``seconds``.
        """
        self._set(arguments)
        halt = self.program["focgen_halt"].address
        begin = self.program[function].address | (1 if self.core.arm else 0)
        try:
            self._machine.emu_start(begin, halt, timeout=int(seconds * 1e6))
        except self._uc.UcError as reason:
            self._check()
            raise TargetFault(f"failed: {reason} at {self.program.place(self._pc())}") from None
        if self._pc() != halt:
            raise TargetFault(f"did not return within {seconds:g} s, at {self.program.place(self._pc())}")
        self._check()
        made: int = self._machine.reg_read(self._names["first"])
        return made

    def _set(self, arguments: tuple[int, ...]) -> None:
        names, machine = self._names, self._machine
        halt = self.program["focgen_halt"].address
        machine.reg_write(names["sp"], STACK)
        machine.reg_write(names["lr"], halt | (1 if self.core.arm else 0))
        for i, value in enumerate(arguments):
            machine.reg_write(names["first"] + i, value)

    def _pc(self) -> int:
        made: int = self._machine.reg_read(self._names["pc"]) & (~1 if self.core.arm else ~0)
        return made

    def paint_stack(self) -> None:
        """Fill the stack's memory, to see later how much of it was used."""
        self._machine.mem_write(STACK - (64 << 10), bytes([PAINT]) * (64 << 10))

    def stack_used(self) -> int:
        """Bytes of the painted stack that were written, the deepest first."""
        painted = np.frombuffer(self.read(STACK - (64 << 10), 64 << 10), np.uint8)
        changed = np.flatnonzero(painted != PAINT)
        return int(painted.size - changed[0]) if changed.size else 0

    def watch(self, accesses: bool = True) -> None:
        """Watch every instruction: how often it runs, and whether what it ``accesses`` is aligned."""
        code = max(s.address + s.size for s in self.program.sections if s.kind == "code") // 2 + 2
        self._arrays = np.zeros(code, np.uint32), np.zeros(code, np.uint32)
        self._accesses = (_Access * code)()
        register_of = ctypes.cast(_library().uc_reg_read, ctypes.c_void_p)
        self._seen = _Watch(code, *(a.ctypes.data for a in self._arrays), ctypes.addressof(self._accesses),
                            register_of, self._names["flags"], accesses)  # fmt: skip
        if accesses:
            for address, access in memory_accesses(self.program):
                self._accesses[address // 2] = _Access(*vars(access).values())
        self._hook(self._uc.UC_HOOK_CODE, _watcher().focgen_on_code)
        self._machine.ctl_flush_tb()  # a hook does nothing to what has been translated before

    def _hook(self, kind: int, function: Any) -> None:
        """Not through Python: a call of it for every instruction would take hours. And no memory hooks: one
        that is called within an IT block loses the block's condition.
        """
        handle, seen = ctypes.c_size_t(), present(self._seen)
        status = _library().uc_hook_add(self._machine._uch, ctypes.byref(handle), kind,
                                        ctypes.cast(function, ctypes.c_void_p), ctypes.byref(seen),
                                        ctypes.c_uint64(1), ctypes.c_uint64(0))  # fmt: skip
        if status:
            raise FocgenError("unicorn", f"refused a hook ({status})", "pip install --upgrade unicorn")

    def forget(self) -> None:
        """Count from 0 again."""
        for array in self._arrays:
            array[:] = 0
        present(self._seen).next = 0

    def executed(self) -> Executed:
        """What ran since watching began, or was forgotten."""
        runs, jumps = self._arrays
        at = np.flatnonzero(runs)
        return Executed(2 * at, runs[at].astype(np.int64), jumps[at].astype(np.int64))

    def _check(self) -> None:
        """Raise TargetFault for what silicon would not have done."""
        seen = self._seen
        if seen is None:
            return
        if seen.strays:
            raise TargetFault("ran code outside of flash")
        if seen.unaligned:
            raise TargetFault(f"accessed {seen.first:#010x}, which is not aligned, "
                              f"at {self.program.place(seen.first_pc)}")  # fmt: skip


def _registers(uc: ModuleType, core: Core) -> dict[str, int]:
    if core.arm:
        a = uc.arm_const
        return {
            "sp": a.UC_ARM_REG_SP,
            "lr": a.UC_ARM_REG_LR,
            "pc": a.UC_ARM_REG_PC,
            "flags": a.UC_ARM_REG_CPSR,
            "first": a.UC_ARM_REG_R0,
        }
    r = uc.riscv_const
    return {"sp": r.UC_RISCV_REG_SP, "lr": r.UC_RISCV_REG_RA, "pc": r.UC_RISCV_REG_PC, "flags": 0,
            "first": r.UC_RISCV_REG_A0}  # fmt: skip
