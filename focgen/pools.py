"""Pools of processes that end with the block that uses them, however it ends.

Each process holds one end of a pipe. When the other one is let go, or its holder is killed, a process leaves
what it does in order, so that what it has begun ends and its scratch goes.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any, NoReturn

from focgen.children import have_children, workers
from focgen.present import present

_GRACE = 5.0  # s that a process may take to leave in order


class _Left(BaseException):
    """Nobody waits for the answer any more."""


class _Pool(ProcessPoolExecutor):
    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As every executor does; the function can be left in order."""
        return super().submit(_in_order, function, *args, **kwargs)


@contextmanager
def pool(
    count: int, more: Mapping[str, str] | None = None, start: str | None = None
) -> Iterator[ProcessPoolExecutor]:
    """``count`` processes with ``more`` in their environment; ``start`` says how they begin, by the system's
    way where it is None.

    Where the block ends by an exception, an interrupt also, none of them goes on. An interrupt of the
    terminal is left to this process.
    """
    have_children()
    watched, held = multiprocessing.Pipe(duplex=False)
    with workers(more), watched, held:
        made = _Pool(count, multiprocessing.get_context(start), _begin, (watched, held))
        try:
            yield made
        except BaseException:
            held.close()
            raise
        finally:
            made.shutdown(cancel_futures=True)


def _begin(watched: Connection, held: Connection) -> None:
    """In a new process, which may have the holder's end of the pipe, too."""
    held.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(watched,), daemon=True).start()


def _end_with(watched: Connection) -> None:
    """Nothing is ever sent: what comes is the end."""
    with suppress(EOFError, OSError):
        watched.recv_bytes()
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(present(threading.main_thread().ident), signal.SIGTERM)
        time.sleep(_GRACE)
    os._exit(1)


def _in_order(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    signal.signal(signal.SIGTERM, _leave)
    try:
        return function(*args, **kwargs)
    except _Left:
        os._exit(1)
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _leave(number: int, _: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)  # the way out is taken once
    raise _Left
