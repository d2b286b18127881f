"""Which branches of the project's code an input takes: what leads the mutations.

On Python 3.12 and later by ``sys.monitoring``, which costs nothing for a branch that is known both ways.
Before, by ``sys.settrace``, which is slow: there only one input in five is looked at.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import focgen

_HOME = str(Path(focgen.__file__).parent)
_READERS = ("nptdms",)  # readers in Python whose branches lead as well
_TOOL = 4  # a number that no debugger, profiler or coverage tool takes
_LOOKED_AT = 5  # one input in so many, where looking is slow


def _followed(file: str) -> bool:
    return file.startswith(_HOME) or any(f"/{name}/" in file for name in _READERS)


class Guidance:
    """The branches seen so far; ``new`` those that the input at hand has taken first."""

    def __init__(self) -> None:
        self.known: set[int] = set()
        self.new: set[int] = set()
        self._ways: dict[tuple, set[int]] = {}
        self._count = 0

    def begin(self) -> None:
        """Look from now on, in this process."""
        if hasattr(sys, "monitoring"):
            sys.monitoring.use_tool_id(_TOOL, "fuzz")
            sys.monitoring.register_callback(_TOOL, sys.monitoring.events.BRANCH, self._branch)
            sys.monitoring.set_events(_TOOL, sys.monitoring.events.BRANCH)

    def end(self) -> None:
        """Look no more."""
        if hasattr(sys, "monitoring"):
            sys.monitoring.set_events(_TOOL, 0)
            sys.monitoring.free_tool_id(_TOOL)

    @contextmanager
    def watched(self, always: bool = False) -> Iterator[None]:
        """One input. Afterwards ``new`` says what it has shown first."""
        self.new = set()
        self._count += 1
        traced = not hasattr(sys, "monitoring") and (always or self._count % _LOOKED_AT == 0)
        if traced:
            sys.settrace(self._call)
        try:
            yield
        finally:
            if traced:
                sys.settrace(None)
            self.known |= self.new

    def forget(self) -> None:
        """As if nothing had been seen."""
        self.known, self._ways = set(), {}
        if hasattr(sys, "monitoring"):
            sys.monitoring.restart_events()

    def _branch(self, code, at: int, to: int):
        if not _followed(code.co_filename):
            return sys.monitoring.DISABLE
        self._take(_number(code, at, to))
        ways = self._ways.setdefault((code, at), set())
        ways.add(to)
        return sys.monitoring.DISABLE if len(ways) > 1 else None

    def _call(self, frame, event, argument):
        if not _followed(frame.f_code.co_filename):
            return None
        before = frame.f_lineno

        def line(frame, event, argument):
            nonlocal before
            if event == "line":
                self._take(_number(frame.f_code, before, frame.f_lineno))
                before = frame.f_lineno
            return line

        return line

    def _take(self, branch: int) -> None:
        if branch not in self.known:
            self.new.add(branch)


def _number(code, at: int, to: int) -> int:
    """A branch as a number that is the same in every process of this run."""
    return hash((id(code), at, to))
