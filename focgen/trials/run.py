"""``focgen trial run``: every case diagnosed blind, in a process and a folder of its own; resumable.

Results go to DIR/runs/NNNN (the diagnosis and ``outcome.json``). A case whose process dies or takes too long
has failed.
"""

from __future__ import annotations

import json
import os
import signal
import stat
import subprocess
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focgen.children import environment, python
from focgen.errors import InputError
from focgen.output import first_of, replace_folder
from focgen.progress import say, track
from focgen.scratch import real, temporary_folder
from focgen.textfile import LARGEST_LOG
from focgen.trials.belongs import case_digest, check_only_results, copy_case, files_of_case, is_of, mark
from focgen.trials.facts import facts_of, outcome_in
from focgen.trials.worker import BEGUN_BY, ENDED, NO_ROOM

_ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
_LOOK = 0.2  # s between looks whether the run is to end
_GRACE = 5.0  # s that a diagnosis may take to end in order
_OUTSIDE = ("SIGTERM", "SIGINT", "SIGHUP", "SIGKILL")  # a system that has no memory left sends the last one
_ended = threading.Event()


@dataclass(frozen=True)
class Ran:
    """What ``trial run`` did: the folders, how many cases were diagnosed now and before, failed in all, and
    were left ``waiting`` when the time was up.
    """

    folders: tuple[str, ...]
    now: int
    before: int
    failed: int
    waiting: int


def processes(jobs: int | None) -> int:
    """How many to run at a time: ``jobs``, or as many as there are cores. Raises InputError below one."""
    if jobs is not None and jobs < 1:
        raise InputError("--jobs", f"is {jobs}", "give at least 1")
    return jobs or os.cpu_count() or 1


def run(
    *folders: str | Path, jobs: int | None = None, limit: float = 900.0, minutes: float | None = None
) -> Ran:
    """Diagnose every case that has not been, of several trials in turn; ``jobs`` at a time (default:
    the cores), ``limit`` s for each; after ``minutes`` none is begun any more.

    Raises InputError where a folder holds no trial, where something else lies in the place of a result, and
    for less than one process.
    """
    at_once = processes(jobs)
    places = [Path(folder) for folder in folders]
    cases = _in_turn([[(place, n) for n in facts_of(place).commitments] for place in places])
    for place, n in cases:
        if not (place / "cases" / n).is_dir():
            raise InputError(str(place), f"lacks case {n}", "make the cases anew")
    waiting = [(place, n) for place, n in cases if not _stands(place, n)]
    for place, n in waiting:
        check_only_results(place, "runs", n)
    begun = time.monotonic()

    def one(place: Path, number: str) -> bool:
        if minutes is not None and time.monotonic() - begun > 60.0 * minutes:
            return False
        diagnose_case(place, "runs", number, limit)
        return True

    with threads(at_once) as pool:
        asked = [pool.submit(one, *case) for case in waiting]
        now = sum(job.result() for job in track(as_completed(asked), "trial run", len(asked)))
    failed = [
        place / "runs" / n for place, n in cases if ran(place / "runs" / n) and not _done(place / "runs" / n)
    ]
    if failed:
        say(f"trial run: {len(failed)} failed, the first being {failed[0]}: {outcome_of(failed[0])['fault']}")
    return Ran(tuple(map(str, places)), now, len(cases) - len(waiting), len(failed), len(waiting) - now)


class Ended(Exception):
    """The whole run was ended before a case was done: there is no result, and the next run begins it anew."""


@contextmanager
def threads(count: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that wait for diagnoses. Where the block ends by an exception, an interrupt also, none is begun
    any more, and those that run are ended without a result."""
    _ended.clear()
    try:
        with ThreadPoolExecutor(count) as pool:
            try:
                yield pool
            except BaseException:
                _ended.set()
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    finally:
        _ended.clear()  # what is diagnosed alone, afterwards, is not to end


def _in_turn(rows: Sequence[Sequence[Any]]) -> list[Any]:
    """The first of each row, then the second of each …"""
    return [row[i] for i in range(max(map(len, rows), default=0)) for row in rows if i < len(row)]


def _stands(trial: Path, number: str) -> bool:
    """Whether a case has been diagnosed as it is; what stands in the place of that result is said to go."""
    if not ran(trial / "runs" / number):
        return False
    if stands := is_its_own(trial, "runs", number):
        return stands
    say(f"trial run: {trial / 'runs' / number} is not the result of the case as it is, so it is made anew")
    return False


def is_its_own(trial: Path, kind: str, number: str, *told: str) -> bool:
    """Whether the result in TRIAL/KIND/NUMBER is of the case of that number as it is, and as it was kept."""
    return is_of(trial / kind / number, case_digest(trial / "cases" / number, *told))


def ran(folder: Path) -> bool:
    """Whether a case has been diagnosed, successfully or not."""
    return (folder / "outcome.json").exists()


def _done(folder: Path) -> bool:
    return bool(outcome_of(folder)["status"] == "done")


def outcome_of(folder: Path) -> dict[str, Any]:
    """What happened in a run; a run that left no word has failed."""
    return outcome_in(folder) or {"status": "failed", "seconds": None, "fault": "not run"}


def diagnose_case(trial: Path, kind: str, number: str, limit: float, effects: tuple[str, ...] = ()) -> None:
    """Diagnose a case of a trial away from everything else, then bring the results to TRIAL/KIND/NUMBER.

    Raises InputError where the case cannot be read, or the results' place lies outside the trial or holds
    what is no result.
    """
    case, target = trial / "cases" / number, trial / kind / number
    check_only_results(trial, kind, number)
    with temporary_folder("trial") as scratch:
        blind, out = scratch / "case", scratch / "out"
        _check_plain(case, trial)
        try:
            copy_case(case, blind)
        except OSError as reason:
            what = f"cannot be copied ({first_of(reason)})"
            remedy = "make room in the temporary folder (TMPDIR), or make the cases anew"
            raise InputError(str(case), what, remedy) from None
        given = case_digest(blind, *effects)
        blind_diagnosis(blind, out, limit, effects)
        mark(out, given)
        replace_folder(out, target, trial)


def _check_plain(case: Path, trial: Path) -> None:
    """Raise InputError where copying a case would lead out of its trial, or would never end."""
    left = LARGEST_LOG
    for path in (case, case / "logs", *files_of_case(case)):
        mode, left = path.lstat().st_mode, left - path.lstat().st_size
        if left < 0:  # on the disk it may be nothing: a copy of it is not
            what = f"makes the case larger than {LARGEST_LOG >> 20} MiB"
            raise InputError(str(path), what, "make the cases anew")
        folder = path in (case, case / "logs")
        if not (stat.S_ISDIR(mode) if folder else stat.S_ISREG(mode)) or not _is_in(path, trial):
            raise InputError(str(path), "is neither a file nor a folder of the trial", "make the cases anew")


def _is_in(path: Path, trial: Path) -> bool:
    return real(path).is_relative_to(real(trial))


def blind_diagnosis(blind: Path, out: Path, limit: float, effects: tuple[str, ...] = ()) -> None:
    """Diagnose the case in the folder ``blind`` in a process of its own; ``out`` holds what came of it, even
    where the process died or took longer than ``limit`` s. Raises InputError where the disk was full, and
    where the process was ended from outside."""
    fault = _process(blind, out, limit, effects)
    out.mkdir(parents=True, exist_ok=True)
    if not (out / "outcome.json").exists():
        word = {"status": "failed", "seconds": None, "fault": fault}
        (out / "outcome.json").write_text(json.dumps(word) + "\n", encoding="utf-8")


def _process(blind: Path, out: Path, limit: float, effects: tuple[str, ...]) -> str:
    command = python("-m", "focgen.trials.worker", str(blind), str(out), *effects)
    until = time.monotonic() + limit
    null, own = subprocess.DEVNULL, environment(**_ONE_THREAD, **{BEGUN_BY: str(os.getpid())})
    # a session of its own: an interrupt is this process's to tell of, not a fault of the case
    with subprocess.Popen(
        command, stdin=null, stdout=null, stderr=null, env=own, start_new_session=True
    ) as child:
        while child.poll() is None and not _ended.is_set() and (left := until - time.monotonic()) > 0:
            with suppress(subprocess.TimeoutExpired):
                child.wait(min(_LOOK, left))
        in_time = child.poll() is not None
        child.terminate()  # so that what it has begun ends, too
        with suppress(subprocess.TimeoutExpired):
            child.wait(_GRACE)
        child.kill()
    if _ended.is_set():
        raise Ended
    if in_time and child.returncode == NO_ROOM:
        what = "had no room for a diagnosis, which says nothing of its case"
        raise InputError(str(out.parent), what, "make room there (TMPDIR says where), and run it again")
    if in_time and _from_outside(child.returncode):
        what = "a diagnosis was ended from outside, or for want of memory, which says nothing of its case"
        raise InputError("trial", what, "run it again, with fewer --jobs where memory is short")
    return f"the process ended with status {child.returncode}" if in_time else f"took longer than {limit:g} s"


def _from_outside(status: int) -> bool:
    """Whether it was not the diagnosis that ended its process."""
    return status == ENDED or -status in (getattr(signal, name, None) for name in _OUTSIDE)
