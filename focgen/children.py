"""Other Python processes: they run this package, and nothing of the folder one stands in.

``python -c`` and ``python -m`` look for every module in the current folder first, the standard library's
among them. That folder may be a stranger's.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import focgen

_SAFE = {"PYTHONSAFEPATH": "1"}


def python(*arguments: str) -> list[str]:
    """The command of another Python with these arguments."""
    return [sys.executable, "-P", *arguments]


def environment(**more: str) -> dict[str, str]:
    """For :func:`python`: the packages of this process, whatever their paths were, and ``more``."""
    home = str(Path(focgen.__file__).resolve().parent.parent)
    paths = [path for path in sys.path if path]
    return {**os.environ, **_SAFE, "PYTHONPATH": os.pathsep.join(dict.fromkeys([home, *paths])), **more}


def have_children() -> None:
    """Let this process start others, also where it is a worker of :class:`multiprocessing.pool.Pool`.

    Such a one is daemonic, which forbids just that, lest children be left behind. Ours end with the block
    that uses them, or with its holder. The mark says nothing else of a process that runs.
    """
    this = multiprocessing.current_process()
    if this.daemon:
        this.daemon = False


@contextmanager
def workers(more: Mapping[str, str] | None = None) -> Iterator[None]:
    """For a pool of processes as long as it stands: whichever way they start, they are safe, and have
    ``more`` in their environment."""
    given = {**_SAFE, **(more or {})}
    before = {name: os.environ.get(name) for name in given}
    os.environ.update(given)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None) if value is None else os.environ.update({name: value})
