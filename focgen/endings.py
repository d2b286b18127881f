"""A process that is asked to end while it does what must not be left half done: it ends right behind that."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_POLITE = ("SIGINT", "SIGTERM", "SIGHUP")


@contextmanager
def undisturbed() -> Iterator[None]:
    """What asks to end is heard when the block has ended; asked a second time, at once.

    Only the main thread is ever interrupted. In others, and of what is ignored, nothing changes.
    """
    numbers = [number for name in _POLITE if (number := getattr(signal, name, None))]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    before = {number: signal.getsignal(number) for number in numbers}
    before = {number: end for number, end in before.items() if end not in (None, signal.SIG_IGN)}
    heard: list[int] = []

    def later(number: int, _: Any) -> None:
        heard.append(number)
        _restore(before)

    for number in before:
        signal.signal(number, later)
    try:
        yield
    finally:
        _restore(before)
        if heard:
            signal.raise_signal(heard[0])


def _restore(before: dict[int, Any]) -> None:
    for number, end in before.items():
        signal.signal(number, end)
