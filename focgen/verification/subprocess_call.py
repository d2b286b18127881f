"""A computation in a process of its own: C that crashes takes nothing with it."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from focgen.children import have_children
from focgen.present import present


class Crashed(Exception):
    """The process ended without an answer; the message says how."""


class TimedOut(Exception):
    """The process gave no answer in time and was ended; the message says in what time."""


def in_subprocess(function: Callable[..., Any], *arguments: Any, seconds: float | None = None) -> Any:
    """``function(*arguments)``, computed in a forked process; in this one where the system cannot fork.

    Raises what the function raises, Crashed where its process dies, and TimedOut where it has not answered
    after ``seconds``.
    """
    if not hasattr(os, "fork"):
        return function(*arguments)
    have_children()
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(sender, function, arguments), daemon=True)
    with warnings.catch_warnings():  # of threads, such as BLAS's, which know how to fork
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        if not receiver.poll(seconds):
            process.kill()
            process.join()
            raise TimedOut(f"{seconds:.3g} s")
        result, error = receiver.recv()
    except EOFError:
        process.join()
        raise Crashed(_ending(present(process.exitcode))) from None
    process.join()
    if error is not None:
        raise error
    return result


def _answer(sender: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    faulthandler.disable()  # the parent tells of it, in one line
    answer: tuple[Any, Exception | None]
    try:
        answer = function(*arguments), None
    except Exception as error:  # noqa: BLE001 - raised again in the parent
        answer = None, error
    try:
        sender.send(answer)
    except Exception as unsent:  # noqa: BLE001 - pickling calls what the answer defines
        said = answer[1] or unsent
        sender.send((None, RuntimeError(f"{type(said).__name__}: {said}")))
    sender.close()


def _ending(exitcode: int) -> str:
    return signal.Signals(-exitcode).name if exitcode < 0 else f"exit status {exitcode}"
