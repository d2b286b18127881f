"""The deepest use of the stack, from machine code: every path through every function, and who calls whom."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

from focgen.targets.flow import Flow, flow
from focgen.targets.instruction import Instruction
from focgen.targets.legality import instructions
from focgen.targets.program import Program


@dataclass(frozen=True)
class Depth:
    """``bytes`` of stack that a function uses at most, with all it calls; ``path`` of those calls, each name
    with the bytes that it has in use there.
    """

    bytes: int
    path: tuple[str, ...]


@dataclass(frozen=True)
class Frame:
    """One function by itself: its deepest ``bytes``, the ``calls`` (address, bytes at that moment), and the
    functions that it ``visits`` by jumps, which return for it.
    """

    bytes: int
    calls: tuple[tuple[int, int], ...]
    visits: tuple[int, ...]


class Stack:
    """The stack of a program's functions.

    A call through a pointer cannot be followed and is an error, as is recursion; generated C has neither.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._functions = {f.address: f for f in program.functions()}
        self._begins = sorted(self._functions)
        self._code = {one.address: (one, before) for before, one in pairwise([None, *instructions(program)])}
        self._frames: dict[int, Frame] = {}
        self._depths: dict[int, Depth] = {}

    def depth(self, name: str) -> Depth:
        """The deepest use of a function. Raises ValueError for recursion and calls through pointers."""
        return self._depth(self._program[name].address, ())

    def at_call(self, caller: str, callee: str) -> int:
        """Bytes that a function has in use where it calls another, or jumps to it."""
        target = self._program[callee].address
        frame = self._frame(self._program[caller].address)
        return max((depth for address, depth in frame.calls if address == target), default=0)

    def reached(self, names: list[str]) -> set[str]:
        """The functions that those named call, directly or not, and they themselves."""
        waiting, seen = [self._program[name].address for name in names], set()
        while waiting:
            address = waiting.pop()
            if address not in seen:
                frame = self._frame(address)
                seen |= {address, *frame.visits}
                waiting += [target for target, _ in frame.calls]
        return {self._functions[address].name for address in seen if address in self._functions}

    def _depth(self, address: int, callers: tuple[int, ...]) -> Depth:
        name = self._functions[self._owner(address)].name
        if address in callers:
            raise ValueError(f"{name} calls itself")
        if address not in self._depths:
            frame = self._frame(address)
            below = [(at, self._depth(target, (*callers, address))) for target, at in frame.calls]
            alone = frame.bytes, (), frame.bytes
            used, path, at = max([alone, *((at + d.bytes, d.path, at) for at, d in below)])
            self._depths[address] = Depth(used, (f"{name} {at}", *path))
        return self._depths[address]

    def _frame(self, address: int) -> Frame:
        if address not in self._frames:
            self._frames[address] = self._walked(address)
        return self._frames[address]

    def _walked(self, entry: int) -> Frame:
        """Follow every path from an entry to its returns, into other functions where it jumps there."""
        seen: dict[int, int] = {}
        calls: dict[int, int] = {}
        waiting, deepest = [(entry, 0)], 0
        while waiting:
            address, depth = waiting.pop()
            if address in seen or address not in self._code:
                continue
            one, before = self._code[address]
            does = flow(self._program.core, one, before)
            seen[address] = depth = depth + does.pushed
            deepest = max(deepest, depth)
            if does.calls is not None:
                calls[does.calls] = max(depth, calls.get(does.calls, 0))
            waiting += [(place, depth) for place in self._onward(one, does)]
        visits = {self._owner(address) for address in seen}
        return Frame(deepest, tuple(sorted(calls.items())), tuple(sorted(visits)))

    def _onward(self, one: Instruction, does: Flow) -> list[int]:
        found = [does.jumps] if does.jumps is not None else []
        found += [one.address + one.size] if does.goes_on else []
        if does.table:  # any piece of code behind the table, up to the function's end
            end = self._begins[bisect_right(self._begins, one.address) :][:1] or [1 << 32]
            found += [begin for begin, _ in self._program.code_ranges if one.address < begin < end[0]]
        return found

    def _owner(self, address: int) -> int:
        """The function that an address is in."""
        return self._begins[bisect_right(self._begins, address) - 1]
