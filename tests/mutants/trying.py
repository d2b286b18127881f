"""One change tried: a process of its own runs the tests that could tell of it, in a scratch copy."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import resource
import shutil
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.change import Change, read
from tests.waiting import waited

_MEMORY = 6 << 30  # bytes a try may take beside what the warm process has mapped
_WAIT = 40.0
_WARM = ("numpy", "scipy.signal", "scipy.optimize", "scipy.linalg", "scipy.special", "cffi", "jinja2",
         "tomlkit", "pint", "hypothesis", "mpmath")  # fmt: skip
_CHANGED = "changed.json"
_STILLBORN = "does not compile"
_NOT_RUN = 4  # of pytest: a test asked for is not there


@dataclass(frozen=True)
class Tried:
    """``outcome``: "killed", "timed out" (killed, too), "survived", "no test" where none runs it, or, counted
    by nobody, "stillborn", which no compiler takes, and "not run", as tests that were measured are no longer
    there. ``by``: the test that told."""

    outcome: str
    seconds: float
    by: str = ""


def warm() -> None:
    """Load what every try needs and no change touches; ``focgen`` itself is left to the try."""
    for name in _WARM:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    assert not any(name.split(".")[0] == "focgen" for name in sys.modules)


def tried(place: Path, change: Change, tests: list[str], patience: float) -> Tried:
    """Apply a change in the copy ``place``, run tests until one fails, and take it back.

    ``patience``: seconds of the processor that the tests may take, each process by itself; on a busy machine
    ``_WAIT`` times as long by the clock.
    """
    if not tests:
        return Tried("no test", 0.0)
    path, text, begin = place / change.file, read(place, change.file), time.monotonic()
    log = place / "tried.log"
    try:
        _remember(place, change.file, text)
        _write(path, change.applied(text))
        status = waited(_forked(place, tests, log, patience), _WAIT * patience)
    finally:
        restored(place)
    return _told(status, log.read_text(errors="replace"), time.monotonic() - begin)


def _remember(place: Path, file: str, text: str) -> None:
    """What a killed run has to put back."""
    (place / _CHANGED).write_text(json.dumps({"file": file, "text": text}), encoding="utf-8")


def restored(place: Path) -> None:
    """Take back the change that is in the copy, if there is one."""
    kept = place / _CHANGED
    if kept.exists():
        told = json.loads(kept.read_text(encoding="utf-8"))
        _write(place / told["file"], told["text"])
        kept.unlink()


def _write(path: Path, text: str) -> None:
    """A file, and nothing left of what was compiled from it before."""
    path.write_text(text, encoding="utf-8")
    for kept in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        kept.unlink()


def _forked(place: Path, tests: list[str], log: Path, patience: float) -> int:
    """The process that runs the tests; it begins with what :func:`warm` has loaded."""
    child = os.fork()
    if child:
        return child
    try:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (int(patience) + 1, int(patience) + 30))
        out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1), os.dup2(out, 2)
        sys.stdout = sys.stderr = open(1, "w", encoding="utf-8", buffering=1, closefd=False)  # noqa: SIM115 -- lives as long as the process
        os._exit(_pytest(place, tests))
    finally:
        os._exit(99)


def _pytest(place: Path, tests: list[str]) -> int:
    import pytest

    most = _mapped() + _MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    os.chdir(place)
    for name in [n for n in sys.modules if n.split(".")[0] in ("focgen", "tests")]:
        del sys.modules[name]
    sys.path[:] = [str(place), *(p for p in sys.path if p and Path(p).resolve() != _own())]
    os.environ["PYTHONPATH"] = os.pathsep.join([str(place), *_further()])
    sys.dont_write_bytecode = True
    scratch = place / "scratch"
    shutil.rmtree(scratch, ignore_errors=True)
    options = [
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "--tb=short",
        f"--basetemp={scratch}",
        "-p",
        "no:randomly",
    ]
    return int(pytest.main([*options, *tests]))


def _mapped() -> int:
    """Bytes of address space that the process takes already; a worker of a long suite takes gigabytes."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _own() -> Path:
    return Path(__file__).resolve().parents[2]


def _further() -> list[str]:
    return [
        p for p in os.environ.get("PYTHONPATH", "").split(os.pathsep) if p and Path(p).resolve() != _own()
    ]


def _told(status: int | None, log: str, seconds: float) -> Tried:
    failed = [
        line.split(" - ")[0].split(" ")[1]
        for line in log.splitlines()
        if line.startswith(("FAILED", "ERROR "))
    ]
    by = failed[0] if failed else ""
    if status is None or status == -signal.SIGXCPU:
        return Tried("timed out", seconds)
    if status == 0:
        return Tried("survived", seconds)
    if _STILLBORN in log:
        return Tried("stillborn", seconds, by)
    if status == _NOT_RUN:
        return Tried("not run", seconds, by)
    return Tried("killed", seconds, by or f"exit status {status}")
