"""Compilers and emulators end with the call that began them, with all that they have begun and written.

Red when an interrupt, a limit of time or a kill leaves a process, or a file in the temporary folder for good.
"""

import errno
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import pytest

import focgen
from focgen import programs, scratch
from focgen.children import environment, python
from focgen.codegen.generate import generate
from tests.controllers import seed_controller

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="the system has no groups of processes")

# As the driver of a compiler does: a file of its own in the temporary folder, and a further program.
# The times are of this worker alone: another may run these tests at the same time, and ends what it finds.
LIMITED, KILLED, EARLY = (f"{number}.{os.getpid()}" for number in (7117, 7227, 7447))
DRIVER = "#!/bin/sh\necho text > $TMPDIR/ccBETWEEN.s\nsleep {secs} &\ntouch {mark}\nwait\n"


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A temporary folder of the test's own."""
    (tmp_path / "temp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temp"))
    scratch._swept.clear()
    yield tmp_path / "temp"
    scratch._swept.clear()


def driver(folder: Path, seconds: str) -> Path:
    path = folder / "driver"
    path.write_text(DRIVER.format(mark=folder / "begun", secs=seconds))
    path.chmod(0o755)
    return path


def running(words: str) -> bool:
    said = subprocess.run(["ps", "-ewwo", "stat,args"], capture_output=True, text=True).stdout.splitlines()
    return any(words in line and not line.startswith("Z") for line in said)


def ended(words: str) -> bool:
    end = time.monotonic() + 5.0
    while running(words) and time.monotonic() < end:
        time.sleep(0.05)
    return not running(words)


def test_a_program_is_run_to_its_end_and_its_files_go(place, tmp_path):
    done = programs.ran(["sh", "-c", "echo said; echo $TMPDIR; touch $TMPDIR/x; exit 3"])
    said, own = done.stdout.split()
    assert (done.returncode, said) == (3, "said")
    assert Path(own).parent.parent == place and not list(place.iterdir())


def test_a_full_disk_is_no_fault_of_the_c(place):
    """GCC's words of it; it was said that the C does not compile."""
    with pytest.raises(OSError) as told:
        programs.ran(["sh", "-c", "echo 'k.c:9:1: fatal error: x.s: No space left on device' >&2; exit 1"])
    assert told.value.errno == errno.ENOSPC and told.value.filename == str(place)


def test_a_limit_of_time_ends_all_that_it_began(place, tmp_path):
    with pytest.raises(subprocess.TimeoutExpired):
        programs.ran([str(driver(tmp_path, LIMITED))], seconds=1.0)
    assert (tmp_path / "begun").exists(), "it had not begun"
    assert ended(f"sleep {LIMITED}") and not list(place.iterdir())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_as_a_program_begins_ends_it(place, monkeypatch, number):
    """It runs before Popen returns: an interrupt between left nobody who knew of it."""

    class Interrupted(subprocess.Popen):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            signal.raise_signal(number)

    def leave(number, _):
        raise KeyboardInterrupt

    before = signal.signal(number, leave)
    monkeypatch.setattr(subprocess, "Popen", Interrupted)
    try:
        with pytest.raises(KeyboardInterrupt):
            programs.ran(["sleep", EARLY])
        assert signal.getsignal(number) is leave
    finally:
        signal.signal(number, before)
    monkeypatch.undo()
    assert ended(f"sleep {EARLY}") and not list(place.iterdir())


@pytest.fixture
def begun(tmp_path):
    """``focgen verify`` as soon as its compiler has begun a program of its own."""
    generate(seed_controller(5), tmp_path / "fw", "q15")
    (tmp_path / "temp").mkdir()
    own = {"TMPDIR": str(tmp_path / "temp"), "CC": str(driver(tmp_path, KILLED))}
    words = python("-m", "focgen", "verify", str(tmp_path / "fw"))
    process = subprocess.Popen(
        words,
        env=environment(**own),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    end = time.monotonic() + 60.0
    while not running(f"sleep {KILLED}") and time.monotonic() < end:
        time.sleep(0.05)
    assert running(f"sleep {KILLED}"), "it had not begun"
    yield process
    process.kill()
    process.communicate()
    for line in subprocess.run(["ps", "-eo", "pid,args"], capture_output=True, text=True).stdout.splitlines():
        if line.split(None, 1)[1:] == [f"sleep {KILLED}"]:
            os.kill(int(line.split()[0]), signal.SIGKILL)


@pytest.mark.parametrize(
    ("number", "status"), [pytest.param(signal.SIGINT, 130, marks=pytest.mark.long), (signal.SIGTERM, 143)]
)
def test_an_interrupt_ends_a_compiler_and_what_it_began(begun, tmp_path, number, status):
    begun.send_signal(number)
    said = begun.communicate(timeout=20.0)[1]
    assert begun.returncode == status and said.count("\n") == 1, said
    assert ended(f"sleep {KILLED}") and not list((tmp_path / "temp").iterdir())


def test_what_a_kill_leaves_in_the_temporary_folder_the_next_run_clears(begun, tmp_path):
    begun.kill()
    begun.communicate()
    left = list((tmp_path / "temp").rglob("*"))
    assert any(path.name == "ccBETWEEN.s" for path in left), "nothing was left"
    again = python("-m", "focgen", "verify", str(tmp_path / "fw"), "--samples", "10")
    subprocess.run(again, env=environment(TMPDIR=str(tmp_path / "temp")), check=True, capture_output=True)
    assert not list((tmp_path / "temp").iterdir())


def test_what_lives_or_is_anothers_stays(place):
    """A folder that is in use, of a name that is not ours, that others can write to, or a link to one."""
    with scratch.temporary_folder("study") as lives:
        (place / f"focgen-{'0' * 16}" / "own").mkdir(parents=True, mode=0o700)
        (place / f"focgen-{'0' * 16}").chmod(0o700)
        for name in ("focgen-mine", f"focgen-{'1' * 15}", f"focgen-{'2' * 16}"):
            (place / name).mkdir()
        (place / f"focgen-{'2' * 16}").chmod(0o777)
        (place / f"focgen-{'3' * 16}").symlink_to(place / "focgen-mine")
        scratch._swept.clear()
        with scratch.temporary_folder():
            left = {path.name for path in place.iterdir()}
    assert f"focgen-{'0' * 16}" not in left
    assert {"focgen-mine", f"focgen-{'1' * 15}", f"focgen-{'2' * 16}", f"focgen-{'3' * 16}"} < left
    assert lives.parent.name in left
    assert not lives.exists()


ALONE = {
    "programs.py": "Popen",
    "run.py": "Popen",  # a diagnosis of a trial, in a session of its own
    "subprocess_reader.py": "run",  # Python, which keeps no files
}


def test_there_is_no_other_way_to_run_one_or_to_make_a_folder():
    for path in Path(focgen.__file__).resolve().parent.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for call in re.findall(r"subprocess\.(run|Popen|call|check_\w+)\(", text):
            assert ALONE.get(path.name) == call, path
        assert "TemporaryDirectory(" not in text and "mkdtemp(" not in text, path


@pytest.mark.skipif(shutil.which("gcc") is None, reason="other compilers have other lists of folders")
@pytest.mark.parametrize("name", ("CPATH", "C_INCLUDE_PATH"))
@pytest.mark.parametrize("value", (f"{os.pathsep}/opt/include", f"/opt/include{os.pathsep}", ".", "here"))
def test_a_list_of_folders_does_not_name_the_one_that_one_stands_in(tmp_path, monkeypatch, name, value):
    """As ``export CPATH=$CPATH:/opt/include`` does: a stranger's header was compiled, and run as verified."""
    (tmp_path / "here").mkdir()
    for folder in (tmp_path, tmp_path / "here"):
        (folder / "stdint.h").write_text("#error a stranger's\n")
    (tmp_path / "a.c").write_text("#include <stdint.h>\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(name, value)
    assert programs.ran(["gcc", "-c", str(tmp_path / "a.c"), "-o", str(tmp_path / "a.o")]).returncode == 0


def test_programs_of_the_folder_one_stands_in_take_no_part(tmp_path, monkeypatch):
    """What is named as a whole path stays."""
    parts = ("", "/opt/a", "b", "/opt/c")
    for name in programs._LISTS:
        monkeypatch.setenv(name, os.pathsep.join(parts))
    monkeypatch.setenv("COMPILER_PATH", ".")
    said = programs.ran([*python("-c", "import os; print(dict(os.environ))")]).stdout
    assert said.count(f"/opt/a{os.pathsep}/opt/c'") == len(programs._LISTS) - 1
    assert "COMPILER_PATH" not in said
