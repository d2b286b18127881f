"""What a worker of the standard library's pool can do: whatever any process can.

Red when it is refused processes of its own, or leaves some behind.
"""

import multiprocessing
from pathlib import Path

import pytest

import focgen
from focgen.pools import pool
from focgen.verification.subprocess_call import Crashed, in_subprocess
from tests.conftest import paper_controller

STARTS = [start for start in ("fork", "spawn") if start in multiprocessing.get_all_start_methods()]


def doubled(number: int) -> int:
    return 2 * number


def dies() -> None:
    raise SystemExit(3)


def job(folder: Path) -> tuple[bool, list[int], str, int]:
    """Whether it verifies, what processes of its own answer, and how many of them are left."""
    with pool(2) as made:
        answers = list(made.map(doubled, range(3)))
    try:
        in_subprocess(dies)
    except Crashed as reason:
        said = str(reason)
    found = focgen.verify(folder, samples=300).holds
    return found, answers, said, len(multiprocessing.active_children())


@pytest.mark.parametrize("start", STARTS)
def test_a_worker_of_another_pool_does_what_any_process_does(tmp_path, start):
    focgen.generate(paper_controller(), tmp_path, "q31", length=20)
    with multiprocessing.get_context(start).Pool(1) as workers:
        found, answers, said, left = workers.apply(job, (tmp_path,))
    assert found and answers == [0, 2, 4] and said == "exit status 3" and left == 0
