"""Many jobs on all cores, or on a Dask cluster; what the store has is not done again.

Every worker has one thread, so that the last digit does not depend on how many there are.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import Any

from focgen.errors import InputError, MissingExtra
from focgen.pools import pool
from focgen.progress import track
from focgen.studies.jobs import Job, answer
from focgen.studies.store import Store

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_PATIENCE = "10s"  # until a scheduler must have answered


class Workers:
    """Whoever does the jobs: ``processes`` of this machine, or the Dask cluster at ``scheduler``.

    They are called when there is first something to do, and leave at the end of the ``with`` block. Raises
    InputError for less than one process; calling them does where the scheduler does not answer, and
    MissingExtra where Dask is not installed.
    """

    def __init__(self, processes: int | None = None, scheduler: str | None = None) -> None:
        if processes is not None and processes < 1:
            raise InputError("--jobs", f"is {processes}", "give at least 1 process")
        self._processes, self._scheduler = processes or os.cpu_count() or 1, scheduler
        self._stack = ExitStack()
        self._called: Any = None  # a pool of processes, or a client of Dask

    def __enter__(self) -> Workers:
        if self._scheduler is not None:  # a wrong address is a fault even where all answers are known
            self._called = self._stack.enter_context(_cluster(self._scheduler))
        return self

    def __exit__(self, *reason: object) -> None:
        self._stack.close()

    def answers(self, jobs: Sequence[Job]) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yield (place, answer) in the order in which they are ready."""
        if jobs and self._called is None:
            self._called = self._stack.enter_context(_pool(self._processes))
        if jobs:
            yield from (_from_pool if self._scheduler is None else _from_cluster)(self._called, jobs)


def sweep(jobs: Sequence[Job], store: Store, workers: Workers) -> list[dict[str, Any]]:
    """Return the answers in the order of ``jobs``; what the store has is not asked for."""
    found: list[Any] = [store.find(job) for job in jobs]
    missing = [place for place, answered in enumerate(found) if answered is None]
    for place, answered in track(workers.answers([jobs[i] for i in missing]), "study", len(missing)):
        found[missing[place]] = store.keep(jobs[missing[place]], answered)
    return found


def _pool(count: int) -> AbstractContextManager[ProcessPoolExecutor]:
    """Fresh processes of one thread each."""
    return pool(count, dict.fromkeys(_ONE_THREAD, "1"), "spawn")


@contextmanager
def _no_script() -> Iterator[None]:
    """New processes do not import the script that called: they need none of it, and it would run again."""
    script = sys.modules["__main__"]
    before = {name: getattr(script, name) for name in ("__file__", "__spec__") if hasattr(script, name)}
    try:
        script.__spec__ = None
        vars(script).pop("__file__", None)
        yield
    finally:
        vars(script).update(before)


def _from_pool(called: ProcessPoolExecutor, jobs: Sequence[Job]) -> Iterator[tuple[int, dict[str, Any]]]:
    with _no_script():  # processes start as jobs are handed over
        places = {called.submit(answer, job): place for place, job in enumerate(jobs)}
    for done in as_completed(places):
        yield places[done], done.result()


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
    """A client of the Dask scheduler at ``address``."""
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtra.of("distributed", "cluster", "--scheduler") from None
    try:
        called: Any = Client  # Dask has no types
        client = called(address, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as reason:
        said = str(reason).splitlines()[0] if str(reason) else "no answer"
        remedy = "give the address of a running Dask scheduler"
        raise InputError("--scheduler", f"{address}: {said}", remedy) from None
    try:
        yield client
    finally:
        client.close()


def _from_cluster(client: Any, jobs: Sequence[Job]) -> Iterator[tuple[int, dict[str, Any]]]:
    import distributed  # which has no types

    as_answered: Any = distributed.as_completed

    futures = client.map(answer, jobs, pure=False)
    places = {future.key: place for place, future in enumerate(futures)}
    try:
        for done in as_answered(futures):
            yield places[done.key], done.result()
    finally:
        client.cancel(futures)
