"""One blind diagnosis in a process of its own: ``python -m focgen.trials.worker CASE OUT [EFFECT]``.

CASE holds the rig and the logs and nothing else. With EFFECT the diagnosis is told what to look for (the
oracle). What happened goes to OUT/outcome.json: ``status`` (done or failed), ``seconds`` and ``fault``.
"""

from __future__ import annotations

import errno
import inspect
import json
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import focgen
from focgen.trials.belongs import logs_of_case

NO_ROOM = 75
"""The status of a process that the machine had no room or no files for: that is no fault of its case."""
ENDED = 76
"""The status of a process that was asked to end: that is no fault of its case either."""
BEGUN_BY = "FOCGEN_BEGUN_BY"
"""The variable with the number of the process that waits: asked for by the worker itself, once it has
imported what it needs, it would be another's where that one is gone by then."""
_GRACE = 5.0  # s to end in order
_LACKING = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EMFILE, errno.ENFILE)


def oracle_possible() -> bool:
    """Whether the diagnosis can be told which effects to consider."""
    return "only" in inspect.signature(focgen.diagnose).parameters


def main(case: Path, out: Path, effects: tuple[str, ...]) -> None:
    """Diagnose and note what happened. Raises only where there was no room for it (:func:`lacks_room`)."""
    started = time.perf_counter()
    fault = None
    try:
        extra: dict[str, Any] = {"pictures": False} | ({"only": effects} if effects else {})
        if (case / "controller.toml").exists():
            extra["controller"] = case / "controller.toml"
        focgen.diagnose(case / "rig.toml", logs_of_case(case), out=out, **extra)
    except Exception as error:
        if lacks_room(error):
            raise
        fault = f"{type(error).__name__}: {error}"
    outcome = {
        "status": "failed" if fault else "done",
        "seconds": time.perf_counter() - started,
        "fault": fault,
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / "outcome.json").write_text(json.dumps(outcome) + "\n", encoding="utf-8")


def lacks_room(error: BaseException | None) -> bool:
    """Whether an error comes of a full disk, of memory that there is none of, or of files that cannot be
    opened any more."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        if isinstance(error, OSError) and error.errno in _LACKING:
            return True
        error = error.__cause__ or error.__context__
    return False


def _status_of(case: Path, out: Path, effects: tuple[str, ...]) -> int:
    try:
        main(case, out, effects)
    except Exception as error:  # noqa: BLE001 - the status is all that is heard of it
        return NO_ROOM if lacks_room(error) else 1
    return 0


def _waiting() -> int:
    """The number of the process that waits for this one."""
    said = os.environ.get(BEGUN_BY, "")
    return int(said) if said.isdecimal() else os.getppid()


def _end_with(parent: int) -> None:
    """Not to go on when nobody waits any more."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(_GRACE)
    os._exit(1)


def _end(number: int, _: object) -> None:
    """In order: a compiler that has been begun ends, scratch goes."""
    signal.signal(number, signal.SIG_IGN)
    sys.exit(ENDED)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_end_with, args=(_waiting(),), daemon=True).start()
    sys.exit(_status_of(Path(sys.argv[1]), Path(sys.argv[2]), tuple(sys.argv[3:])))
