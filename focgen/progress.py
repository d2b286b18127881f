"""Progress on stderr for work that takes longer than a breath."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from focgen.terminal import for_terminal

Item = TypeVar("Item")

_WIDTH = 24  # characters of the bar


_lead: ContextVar[str] = ContextVar("lead", default="")  # what stands before every line


def say(line: str) -> None:
    """Print one line that everyone has to see; results go to stdout, this does not."""
    print(for_terminal(f"{_lead.get()}{line}"), file=sys.stderr, flush=True)


def step(line: str) -> None:
    """Say what is being done now; silent where stderr is not a terminal."""
    if sys.stderr.isatty():
        say(line)


@contextmanager
def led_by(words: str) -> Iterator[None]:
    """Put ``words`` before every line that is said meanwhile: a step says what its parts are about."""
    kept = _lead.set(words)
    try:
        yield
    finally:
        _lead.reset(kept)


def track(items: Iterable[Item], label: str, total: int | None = None) -> Iterator[Item]:
    """Yield ``items`` while a bar shows how far they are; silent where stderr is not a terminal."""
    total = len(items) if total is None and isinstance(items, Sized) else total
    shown, begin = sys.stderr.isatty(), time.monotonic()
    for count, item in enumerate(items):
        if shown:
            print(
                f"\r\033[K{bar(label, count, total, time.monotonic() - begin)}",
                end="",
                file=sys.stderr,
                flush=True,
            )
        yield item
    if shown:
        print("\r\033[K", end="", file=sys.stderr, flush=True)


def bar(label: str, count: int, total: int | None, seconds: float) -> str:
    """One line: how many of ``total`` are done after so many ``seconds``, and how long the rest will take."""
    if not total:
        return f"{label} {count}"
    full = _WIDTH * count // total
    left = f", {seconds / count * (total - count):.0f} s left" if count and seconds > 1.0 else ""
    return f"{label} {'█' * full}{'░' * (_WIDTH - full)} {count}/{total}{left}"
