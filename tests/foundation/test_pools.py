"""A pool of processes ends with the block that uses it, in order.

Red when an interrupt, two of them, or a kill leaves a process that goes on, a program that one of them began,
or scratch; or when it takes a hang to notice.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from focgen import pools
from focgen.children import environment, python

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="the system has no groups of processes")

#: Of this worker alone: another may run these tests at the same time, and ends what it finds.
SLEEP = f"7337.{os.getpid()}"
STARTS = [start for start in ("spawn", "fork") if start in multiprocessing.get_all_start_methods()]
SCRIPT = """
import sys
from focgen.cli.faults import ending_in_order
from focgen.pools import pool
from focgen.programs import ran
from focgen.scratch import temporary_folder

def job(seconds):
    with temporary_folder("job"):
        ran(["sleep", seconds])

if __name__ == "__main__":
    with ending_in_order(), pool(2, start=sys.argv[1]) as called:
        list(called.map(job, [sys.argv[2]] * 3))
"""


@pytest.fixture(params=STARTS)
def begun(request, tmp_path):
    """A process whose pool has begun two jobs, each of which runs a program."""
    (tmp_path / "script.py").write_text(SCRIPT)
    (tmp_path / "temp").mkdir()
    process = subprocess.Popen(
        python(str(tmp_path / "script.py"), request.param, SLEEP),
        env=environment(TMPDIR=str(tmp_path / "temp")),
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    end = time.monotonic() + 60.0
    try:
        while len(sleeping()) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        assert len(sleeping()) == 2, "they had not begun"
        yield process
    finally:
        process.kill()
        process.communicate()
        for number in sleeping():
            os.kill(number, signal.SIGKILL)


def sleeping() -> list[int]:
    said = subprocess.run(["ps", "-eo", "pid,stat,args"], capture_output=True, text=True).stdout.splitlines()
    rows = [line.split(None, 2) for line in said]
    return [int(pid) for pid, stat, args in rows if args == f"sleep {SLEEP}" and not stat.startswith("Z")]


def check_gone(place: Path) -> None:
    end = time.monotonic() + 10.0
    while (sleeping() or list((place / "temp").iterdir())) and time.monotonic() < end:
        time.sleep(0.05)
    assert not sleeping() and not list((place / "temp").iterdir())


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_an_interrupt_ends_what_its_processes_do(begun, tmp_path, name):
    begun.send_signal(getattr(signal, name))
    begun.communicate(timeout=20.0)
    check_gone(tmp_path)


def test_an_interrupt_of_the_terminal_is_told_once(begun, tmp_path):
    """It goes to every process of the group."""
    os.killpg(begun.pid, signal.SIGINT)
    said = begun.communicate(timeout=20.0)[1]
    assert said.count("KeyboardInterrupt") == 1 and "Process" not in said, said
    check_gone(tmp_path)


def test_a_second_interrupt_does_not_hang(begun, tmp_path):
    begun.send_signal(signal.SIGINT)
    time.sleep(0.02)
    begun.send_signal(signal.SIGINT)
    begun.communicate(timeout=20.0)
    check_gone(tmp_path)


@pytest.mark.skipif(sys.platform == "win32", reason="a kill cannot be told from an end")
def test_a_kill_ends_what_its_processes_do(begun, tmp_path):
    begun.kill()
    begun.communicate(timeout=20.0)
    check_gone(tmp_path)


@pytest.mark.parametrize("start", STARTS)
def test_answers_and_errors_arrive_as_ever(start):
    with pools.pool(2, start=start) as called:
        assert list(called.map(abs, [-1, 2, -3])) == [1, 2, 3]
        assert called.submit(int, "11", base=2).result() == 3
        with pytest.raises(ValueError, match="invalid literal"):
            called.submit(int, "x").result()
