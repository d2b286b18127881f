"""What is read of a disassembled instruction; capstone's own have no types."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class Memory(Protocol):
    """An address: registers by capstone's numbers, and a displacement in bytes."""

    base: int
    index: int
    disp: int


class Shift(Protocol):
    """By how many bits the index is shifted."""

    value: int


class Operand(Protocol):
    """One operand: of ``type`` register (``reg``), number (``imm``) or memory (``mem``)."""

    type: int
    reg: int
    imm: int
    mem: Memory
    shift: Shift


class Instruction(Protocol):
    """One instruction of a core: where, how long in bytes, which, and on what."""

    address: int
    size: int
    mnemonic: str
    op_str: str
    operands: Sequence[Operand]
    groups: Sequence[int]
    writeback: bool
    cc: int

    def group_name(self, group: int) -> str:
        """A group's name."""

    def reg_name(self, register: int) -> str:
        """A register's name."""
