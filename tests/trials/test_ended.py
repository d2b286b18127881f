"""A trial that is interrupted: no case is taken for failed, nothing goes on behind its back.

Red when an interrupt is held against a case, the cases that wait are begun all the same, or a process or a
scratch folder is left.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import focgen
from focgen.children import environment, python
from focgen.trials.worker import BEGUN_BY, ENDED

posix = pytest.mark.skipif(not hasattr(os, "killpg"), reason="the system has no groups of processes")


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("trial") / "t"
    focgen.trial("make", folder, cases=4, seed=11, suite="short", kinds=("none",))
    return folder


@pytest.fixture
def made(whole, tmp_path) -> Path:
    shutil.copytree(whole, tmp_path / "t")
    (tmp_path / "scratch").mkdir()
    return tmp_path


def heeding() -> None:
    """A shell that runs the tests in the background has them ignore interrupts, and their children, too."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def begun(folder: Path) -> subprocess.Popen:
    """``trial run``, as soon as it diagnoses its first case."""
    words = ("-m", "focgen", "trial", "run", str(folder / "t"), "--jobs", "1")
    scratch = folder / "scratch"
    process = subprocess.Popen(
        python(*words),
        env=environment(TMPDIR=str(scratch)),
        start_new_session=True,
        preexec_fn=heeding,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + 60.0
    while not list(scratch.glob("focgen-trial-*/own/case/rig.toml")) and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(0.5)  # until its own process has begun
    return process


def of_the_trial(folder: Path) -> list[str]:
    """The processes that work in its scratch folder."""
    said = subprocess.run(["ps", "-ewwo", "args"], capture_output=True, text=True).stdout.splitlines()
    return [line for line in said if str(folder / "scratch") in line]


@posix
@pytest.mark.parametrize(
    ("name", "status", "to_all"),
    [pytest.param("SIGINT", 130, True, marks=pytest.mark.long), ("SIGTERM", 143, False)],
)
def test_an_interrupt_ends_it_and_is_no_fault_of_a_case(made, name, status, to_all):
    """Ctrl-C goes to all processes of a terminal, a batch system's signal to the first."""
    process = begun(made)
    number = getattr(signal, name)
    os.killpg(process.pid, number) if to_all else os.kill(process.pid, number)
    said = process.communicate(timeout=15.0)[1]  # four cases take longer
    assert process.returncode == status and said.count("\n") == 1, said
    assert not list(made.glob("t/runs/*/outcome.json"))
    assert not of_the_trial(made) and not list((made / "scratch").iterdir())


@posix
@pytest.mark.skipif(sys.platform == "win32", reason="a parent's number stays")
def test_a_killed_trial_leaves_no_process(made):
    process = begun(made)
    assert of_the_trial(made), "none had begun"
    process.kill()
    process.communicate()
    end = time.monotonic() + 8.0  # it looks once a second, and has 5 s to end in order
    while of_the_trial(made) and time.monotonic() < end:
        time.sleep(0.1)
    assert not of_the_trial(made)


@posix
def test_a_diagnosis_whose_trial_was_gone_before_it_began_ends(made):
    """It asked who waits for it when nobody did any more, and went on to its end."""
    gone = subprocess.Popen(["true"])
    gone.wait()
    command = python("-m", "focgen.trials.worker", str(made / "t/cases/0001"), str(made / "out"))
    done = subprocess.run(command, env=environment(**{BEGUN_BY: str(gone.pid)}), timeout=60.0)
    assert done.returncode == ENDED and not (made / "out").exists()
