"""Progress on stderr for work that takes longer than a breath."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sized
from typing import TypeVar

Item = TypeVar("Item")


def say(line: str) -> None:
    """Print one line of progress; results go to stdout, this does not."""
    print(line, file=sys.stderr, flush=True)


def track(items: Iterable[Item], label: str, total: int | None = None) -> Iterator[Item]:
    """Yield ``items`` while showing how far they are; silent where stderr is not a terminal."""
    total = len(items) if total is None and isinstance(items, Sized) else total
    shown = sys.stderr.isatty()
    for count, item in enumerate(items):
        if shown:
            print(f"\r{label} {count}/{total or '?'}", end="", file=sys.stderr, flush=True)
        yield item
    if shown:
        print("\r\033[K", end="", file=sys.stderr, flush=True)
