"""One blind diagnosis in a process of its own: ``python -m focgen.trials.worker CASE OUT [EFFECT]``.

CASE holds the rig and the logs and nothing else. With EFFECT the diagnosis is told what to look for (the
oracle). What happened goes to OUT/outcome.json: ``status`` (done or failed), ``seconds`` and ``fault``.
"""

from __future__ import annotations

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

_GRACE = 5.0  # s to end in order


def oracle_possible() -> bool:
    """Whether the diagnosis can be told which effects to consider."""
    return "only" in inspect.signature(focgen.diagnose).parameters


def main(case: Path, out: Path, effects: tuple[str, ...]) -> None:
    """Diagnose and note what happened; never raises."""
    started = time.perf_counter()
    fault = None
    try:
        extra: dict[str, Any] = {"pictures": False} | ({"only": effects} if effects else {})
        if (case / "controller.toml").exists():
            extra["controller"] = case / "controller.toml"
        focgen.diagnose(case / "rig.toml", sorted((case / "logs").iterdir()), out=out, **extra)
    except Exception as error:  # noqa: BLE001 - every failure is a miss, whatever it is
        fault = f"{type(error).__name__}: {error}"
    outcome = {
        "status": "failed" if fault else "done",
        "seconds": time.perf_counter() - started,
        "fault": fault,
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / "outcome.json").write_text(json.dumps(outcome) + "\n", encoding="utf-8")


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
    sys.exit(1)


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    main(Path(sys.argv[1]), Path(sys.argv[2]), tuple(sys.argv[3:]))
