"""Work on all cores at a time, by threads: worth while where it is done in compiled code, which lets the
others run."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import numpy as np

Item = TypeVar("Item")
Found = TypeVar("Found")


def abreast(act: Callable[[Item], Found], items: Sequence[Item]) -> list[Found]:
    """What ``act`` makes of each of the items, in their order; it changes nothing that another call sees.
    What one raises is raised, and what has not begun by then never does."""
    count = min(cores(), len(items))
    if count < 2:
        return [act(item) for item in items]
    settings = np.geterr()  # each thread has its own

    def alike(item: Item) -> Found:
        with np.errstate(**settings):
            return act(item)

    pool = ThreadPoolExecutor(count)
    try:
        return list(pool.map(alike, items))
    finally:
        pool.shutdown(cancel_futures=True)


def cores() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
