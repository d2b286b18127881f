"""Whatever a command raises as one line, and what nobody foresaw as a file to send in."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import platform
import re
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor

import focgen
from focgen.errors import FocgenError
from focgen.terminal import for_terminal

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_UNLOADED = "failed to map segment", "annot allocate memory"  # words of the system's loader
_ALIKE = str.maketrans({"−": "-", "–": "-", "→": "->", "…": "...", "≤": "<=", "≥": ">=", "±": "+-"})
_DIGITS = 11  # of seconds: up to the year 5138
_SCARCE = (errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.ENOMEM)


def as_one_line(error: BaseException, argv: Sequence[str]) -> str:
    """What is printed of an exception behind ``focgen: error:``; where nobody foresaw it, its trace is in a
    file, which the line names."""
    said = error if isinstance(error, FocgenError) else _foreseen(error, argv[0] if argv else "focgen")
    return for_terminal(" ".join(str(said or _unforeseen(error, argv)).split()))


def _foreseen(error: BaseException, command: str) -> FocgenError | None:
    """Of what a machine runs out of, whoever asks; None for anything else."""
    if isinstance(error, MemoryError):
        return FocgenError(command, "takes more memory than there is", "ask for less, or cut the logs")
    if isinstance(error, RecursionError):
        return FocgenError(command, "is given something nested too deeply", "write it flatter")
    if isinstance(error, UnicodeEncodeError):
        what = f"meets a file name that is no UTF-8 ({error.object[:60]!r})"
        return FocgenError(command, what, "rename that folder, or set TMPDIR to another one")
    if isinstance(error, (BrokenExecutor, BrokenPipeError, ConnectionResetError)):
        what = "has lost one of its processes, which was ended or had no memory"
        return FocgenError(command, what, "run it again, with fewer --jobs: what was kept is not done again")
    if isinstance(error, ImportError) and any(words in str(error) for words in _UNLOADED):
        return FocgenError(command, "has no memory for its libraries", "raise the limit (ulimit -v)")
    return _of_system(error, command) if isinstance(error, OSError) else None


def _of_system(error: OSError, command: str) -> FocgenError | None:
    where, why = str(error.filename or command), error.strerror or type(error).__name__
    if error.errno in _FULL:
        return FocgenError(where, f"cannot be written ({why})", "make room, or write to another disk")
    if error.errno in _SCARCE:
        return FocgenError(where, f"cannot be had ({why})", "end other programs, or raise the limit (ulimit)")
    if error.errno == errno.ENOENT and error.filename is None and not _stands_somewhere():
        return FocgenError("the folder one stands in", "is gone", "cd to another one")
    if error.filename is not None:
        return FocgenError(where, f"cannot be used ({why})", "check the path and its rights")
    return None


def _stands_somewhere() -> bool:
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def _unforeseen(error: BaseException, argv: Sequence[str]) -> FocgenError:
    what = f"has met a fault of its own ({type(error).__name__})"
    try:
        return FocgenError(_command(argv), what, f"send in {_written(error, argv)}, which tells where")
    except OSError:  # the disk may be what is at fault
        place = traceback.extract_tb(error.__traceback__)[-1]
        at = f"{os.path.basename(place.filename)}:{place.lineno}"
        return FocgenError(_command(argv), what, f"report it with these words: {at}, {str(error)[:100]}")


def _command(argv: Sequence[str]) -> str:
    return f"focgen {argv[0]}"[:60] if argv else "focgen"


def _written(error: BaseException, argv: Sequence[str]) -> str:
    """The path of a new file, for this user alone, with the trace and what it takes to meet it again."""
    text = "\n".join(
        (
            f"focgen {focgen.__version__}, Python {platform.python_version()}, {platform.platform()}",
            f"arguments: {list(argv)!r}",
            "",
            *traceback.format_exception(error),
        )
    )
    handle, path = tempfile.mkstemp(prefix="focgen-fault-", suffix=".txt")
    try:
        with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
    except OSError:
        os.unlink(path)
        raise
    return path


class Ended(BaseException):
    """A signal asks the process to end; what it has begun it clears away on the way out."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.status = 128 + number


@contextlib.contextmanager
def ending_in_order() -> Iterator[None]:
    """Raise Ended for what ends a process politely: scratch folders go, and processes that were begun end."""
    numbers = [number for name in ("SIGTERM", "SIGHUP") if (number := getattr(signal, name, None))]
    ours = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    if threading.current_thread() is not threading.main_thread():
        ours = []
    process = os.getpid()

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_DFL)  # a second one does not wait
        if os.getpid() != process:  # forked from it: there is nothing of its own to clear away
            os.kill(os.getpid(), number)
        raise Ended(number)

    for number in ours:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


def open_streams() -> None:
    """Give closed standard streams a place to go: else the next file that is opened would stand for one."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
    # those that were closed as the interpreter began; a closed stdout is a fault, for want of the result
    sys.stdin = sys.stdin or open(os.devnull, encoding="utf-8")  # noqa: SIM115 - as long as the process
    sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115


def check_epoch() -> None:
    """Raise FocgenError where SOURCE_DATE_EPOCH is no date: libraries read it as they are imported, and fail.

    Seconds of UTC, https://reproducible-builds.org/specs/source-date-epoch/.
    """
    given = os.environ.get("SOURCE_DATE_EPOCH", "0")
    if not (given.isascii() and given.isdigit() and len(given) <= _DIGITS):
        what = f"is {given[:60]!r}"
        raise FocgenError("SOURCE_DATE_EPOCH", what, f"unset it, or give seconds of at most {_DIGITS} digits")


def write_out(text: str, as_json: bool = False) -> None:
    """Write a result to stdout, whole. Where the reader of a pipe has gone, nothing is wrong. A character
    that the terminal's encoding lacks becomes one like it, or "?"; in JSON its number.

    Raises FocgenError where it cannot be written: nobody would have the result.
    """
    if sys.stdout is None:
        raise FocgenError("stdout", "is closed", "leave it open, or send it to a file")
    try:
        sys.stdout.write(_in_encoding(text, sys.stdout.encoding or "utf-8", as_json))
        sys.stdout.flush()
    except BrokenPipeError:
        _discard_rest()
    except (OSError, ValueError) as reason:  # a full disk; a name that is no UTF-8
        why = getattr(reason, "strerror", None) or " ".join(str(reason).split())
        _discard_rest()
        raise FocgenError("stdout", f"cannot be written ({why})", "send it to another place") from None


def _in_encoding(text: str, encoding: str, as_json: bool) -> str:
    """Text whose characters an encoding has; those of UTF-8 as they are."""
    if encoding.lower().replace("-", "") == "utf8":
        return text
    if as_json:  # only texts within it hold such characters
        return re.sub(r"[^\x00-\x7f]", lambda found: json.dumps(found[0])[1:-1], text)
    try:
        text.encode(encoding)
    except UnicodeEncodeError:
        return text.translate(_ALIKE).encode(encoding, "replace").decode(encoding)
    return text


def _discard_rest() -> None:
    """What is left in the buffer must not fail a second time when the interpreter ends."""
    with contextlib.suppress(OSError, ValueError):  # no file stands behind it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def say_error(line: str) -> None:
    """One line on stderr, if there is one."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        print(line, file=sys.stderr)
