"""Many jobs on all cores, or on a Dask cluster; what the store has is not done again."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from focgen.errors import InputError, MissingExtra
from focgen.progress import track
from focgen.studies.jobs import Job, answer
from focgen.studies.store import Store

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_PATIENCE = "10s"  # until a scheduler must have answered


def sweep(
    jobs: Sequence[Job], store: Store, processes: int | None, scheduler: str | None
) -> list[dict[str, Any]]:
    """Return the answers in the order of ``jobs``.

    ``processes`` at a time (default: the cores), in this process where it is 1; or on the cluster at
    ``scheduler``. Raises InputError where that does not answer, MissingExtra where Dask is not installed.
    """
    found = {i: store.find(job) for i, job in enumerate(jobs)}
    open_ones = [i for i, answered in found.items() if answered is None]
    with _answers([jobs[i] for i in open_ones], processes, scheduler) as answers:
        for place, answered in track(answers, "study", len(open_ones)):
            found[open_ones[place]] = store.keep(jobs[open_ones[place]], answered)
    return [found[i] for i in range(len(jobs))]


@contextmanager
def _answers(jobs: Sequence[Job], processes: int | None, scheduler: str | None):
    """Give an iterator of (place, answer) in the order in which they are ready."""
    count = min(processes or os.cpu_count() or 1, len(jobs))
    if scheduler is not None:
        with _cluster(scheduler) as client:
            yield _from_cluster(client, jobs)
    elif count <= 1:
        yield ((place, answer(job)) for place, job in enumerate(jobs))
    else:
        with _pool(count) as pool:
            yield _from_pool(pool, jobs)


@contextmanager
def _pool(count: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes of one thread each, which end with this one however it ends."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    pool = ProcessPoolExecutor(count, multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def _begin() -> None:
    """In a new process: leave interrupts to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent) -> None:
    parent.join()
    os._exit(1)


def _from_pool(pool: ProcessPoolExecutor, jobs: Sequence[Job]) -> Iterator[tuple[int, dict[str, Any]]]:
    places = {pool.submit(answer, job): place for place, job in enumerate(jobs)}
    for done in as_completed(places):
        yield places[done], done.result()


@contextmanager
def _cluster(address: str):
    """A client of the Dask scheduler at ``address``."""
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtra.of("distributed", "cluster", "--scheduler") from None
    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError, TimeoutError) as reason:
        said = str(reason).splitlines()[0] if str(reason) else "no answer"
        remedy = "give the address of a running Dask scheduler"
        raise InputError("--scheduler", f"{address}: {said}", remedy) from None
    try:
        yield client
    finally:
        client.close()


def _from_cluster(client, jobs: Sequence[Job]) -> Iterator[tuple[int, dict[str, Any]]]:
    from distributed import as_completed as as_answered

    futures = client.map(answer, jobs, pure=False)
    places = {future.key: place for place, future in enumerate(futures)}
    try:
        for done in as_answered(futures):
            yield places[done.key], done.result()
    finally:
        client.cancel(futures)
