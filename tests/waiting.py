"""Waiting for a process that may never end."""

from __future__ import annotations

import os
import signal
import time


def waited(child: int, seconds: float) -> int | None:
    """The exit status of a process that leads a group of its own, as of ``subprocess``.

    None where it has not ended after so many ``seconds``: then it is killed, and what it has started with it.
    """
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None
