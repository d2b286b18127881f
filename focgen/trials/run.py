"""``focgen trial run``: every case diagnosed blind, in a process and a folder of its own; resumable.

Results go to DIR/runs/NNNN (the diagnosis and ``outcome.json``). A case whose process dies or takes too long
has failed.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from focgen.errors import InputError
from focgen.progress import say, track

_ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}


@dataclass(frozen=True)
class Ran:
    """What ``trial run`` did: the folder, how many cases were diagnosed now, before, and failed in all."""

    folder: str
    now: int
    before: int
    failed: int


def facts_of(folder: Path) -> dict:
    """The content of trial.json. Raises InputError where the folder holds no trial."""
    try:
        return json.loads((folder / "trial.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        raise InputError(str(folder), "holds no trial", "make one by `focgen trial make`") from None


def run(folder: str | Path, *, jobs: int | None = None, limit: float = 900.0) -> Ran:
    """Diagnose every case that has not been; ``jobs`` processes at a time (default: the cores), ``limit`` s
    for each.

    Raises InputError where the folder holds no trial.
    """
    folder = Path(folder)
    numbers = list(facts_of(folder)["commitments"])
    open_ones = [n for n in numbers if not (folder / "runs" / n / "outcome.json").exists()]
    with ThreadPoolExecutor(jobs or os.cpu_count() or 1) as pool:
        waiting = [
            pool.submit(diagnose_case, folder / "cases" / n, folder / "runs" / n, limit) for n in open_ones
        ]
        for _ in track(as_completed(waiting), "trial run", len(waiting)):
            pass
    failed = [n for n in numbers if outcome_of(folder / "runs" / n)["status"] != "done"]
    if failed:
        say(
            f"trial run: {len(failed)} failed, the first being case {failed[0]}: "
            f"{outcome_of(folder / 'runs' / failed[0])['fault']}"
        )
    return Ran(str(folder), len(open_ones), len(numbers) - len(open_ones), len(failed))


def outcome_of(folder: Path) -> dict:
    """What happened in a run; a run that left no word has failed."""
    try:
        return json.loads((folder / "outcome.json").read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return {"status": "failed", "seconds": None, "fault": "not run"}


def diagnose_case(case: Path, target: Path, limit: float, effects: tuple[str, ...] = ()) -> None:
    """Diagnose one case away from everything else, then bring the results to ``target``."""
    with tempfile.TemporaryDirectory(prefix="focgen-trial-") as scratch:
        blind, out = Path(scratch) / "case", Path(scratch) / "out"
        shutil.copytree(case, blind)
        fault = _process(blind, out, limit, effects)
        out.mkdir(exist_ok=True)
        if not (out / "outcome.json").exists():
            word = {"status": "failed", "seconds": None, "fault": fault}
            (out / "outcome.json").write_text(json.dumps(word) + "\n", encoding="utf-8")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.rmtree(target, ignore_errors=True)
        shutil.move(out, target)


def _process(blind: Path, out: Path, limit: float, effects: tuple[str, ...]) -> str:
    command = [sys.executable, "-m", "focgen.trials.worker", str(blind), str(out), *effects]
    try:
        done = subprocess.run(command, capture_output=True, timeout=limit, env={**os.environ, **_ONE_THREAD})
        return f"the process ended with status {done.returncode}"
    except subprocess.TimeoutExpired:
        return f"took longer than {limit:g} s"
