"""Places where no file can be: devices, pipes, links to what is open; file systems without locks.

Red when one is replaced or waited for, or when writing does not end.
"""

import errno
import multiprocessing
import os
import stat
from pathlib import Path

import pytest

from focgen import scratch
from focgen.errors import InputError
from focgen.output import new_folder, write_file, write_files

fcntl = pytest.importorskip("fcntl")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("kind", ["a pipe", "a link to a pipe", "a link to what is open"])
def test_what_is_no_file_is_not_replaced_by_one(tmp_path, kind):
    place = tmp_path / "out.toml"
    if kind == "a link to what is open":
        place.symlink_to("/proc/self/fd/1")
        if not os.path.exists(place):
            pytest.skip("the system has no /proc")
    else:
        pipe = place if kind == "a pipe" else tmp_path / "pipe"
        os.mkfifo(pipe)
        if pipe != place:
            place.symlink_to(pipe)
    before = os.lstat(place)
    with pytest.raises(InputError, match="no regular file"):
        write_file(place, "text")
    with pytest.raises(InputError, match="no regular file"):
        write_files(tmp_path, {"out.toml": "text"})
    assert os.lstat(place) == before


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root makes devices")
def test_a_device_stays(tmp_path):
    try:
        os.mknod(tmp_path / "null", stat.S_IFCHR | 0o666, os.makedev(1, 3))
    except OSError:
        pytest.skip("no devices here")
    with pytest.raises(InputError, match="no regular file"):
        write_file(tmp_path / "null", "text")
    assert stat.S_ISCHR(os.stat(tmp_path / "null").st_mode)


def test_a_pipe_among_scratch_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / ".focgen-0123456789abcdef.part")
    process = multiprocessing.get_context("fork").Process(target=write_file, args=(tmp_path / "a", "text"))
    process.start()
    process.join(20.0)
    ended = process.exitcode
    process.kill()
    assert ended == 0 and (tmp_path / "a").read_text() == "text"


def test_a_file_system_without_locks_is_written_to(tmp_path, monkeypatch):
    def none(handle, how):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(scratch.fcntl, "flock", none)
    monkeypatch.setattr(scratch, "PATIENCE", 0.0)
    write_file(tmp_path / "one", "text")
    write_files(tmp_path / "folder", {"two": "text"})
    assert names(tmp_path) == ["folder", "one"]
    assert names(tmp_path / "folder") == ["two"]


def test_a_scratch_that_others_take_away_is_tried_a_few_times_only(tmp_path, monkeypatch):
    def busy(handle, how):
        raise OSError(errno.EWOULDBLOCK, "busy")

    monkeypatch.setattr(scratch.fcntl, "flock", busy)
    for write in (lambda: write_file(tmp_path / "one", "text"), lambda: write_files(tmp_path, {"a": "b"})):
        with pytest.raises(InputError, match="cannot be written"):
            write()
    assert not [name for name in names(tmp_path) if not name.endswith(".part")]


@pytest.mark.parametrize("step", ["chmod", "open"])
def test_a_new_scratch_that_another_process_clears_gets_a_further_one(tmp_path, monkeypatch, step):
    """Before it is locked it looks like one that was left. Two processes that began at once met there."""
    real, seen = getattr(os, step), []

    def cleared(path, *args, **kwargs):
        if not seen and Path(path).is_dir():
            seen.append(Path(path))
            Path(path).rmdir()
        return real(path, *args, **kwargs)

    monkeypatch.setattr(os, step, cleared)
    scratch.clear(tmp_path)
    with scratch.scratch_folder(tmp_path) as folder:
        assert seen and folder != seen[0] and names(tmp_path) == [folder.name]


def test_two_do_not_move_files_at_once_however_long_one_takes(tmp_path, monkeypatch):
    held = scratch.lock(tmp_path)
    monkeypatch.setattr(scratch, "PATIENCE", 0.1)
    with pytest.raises(InputError, match="another process"), new_folder(tmp_path) as folder:
        (folder / "a").write_text("text")
    assert not names(tmp_path)
    scratch.unlock(held)
    write_files(tmp_path, {"a": "text"})


def test_what_was_private_stays_private(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_text("before")
        (tmp_path / name).chmod(0o600)
    write_file(tmp_path / "a", "text")
    write_files(tmp_path, {"b": "text"})
    for name in ("a", "b"):
        assert stat.S_IMODE((tmp_path / name).stat().st_mode) == 0o600
        assert (tmp_path / name).read_text() == "text"


def test_a_name_without_characters_is_told_of(tmp_path):
    text = f"file = {os.fsdecode(bytes([108, 255]))!s}"
    for write in (lambda: write_file(tmp_path / "a", text), lambda: write_files(tmp_path, {"a": text})):
        with pytest.raises(InputError, match="no UTF-8"):
            write()
    assert not names(tmp_path)


@pytest.mark.parametrize("which", ["replaced", "removed"])
def test_a_terabyte_in_the_place_of_a_result_is_not_read(tmp_path, which):
    """What stands there is remembered by its digest, in case of a kill: that took hours of nothing."""
    with open(tmp_path / "study.json", "wb") as file:
        file.truncate(1 << 40)
    files = {"study.json": "new"} if which == "replaced" else {"other.json": "new"}
    with pytest.raises(InputError, match="which no result has"):
        write_files(tmp_path, files, old=lambda: [tmp_path / "study.json"])
    assert names(tmp_path) == ["study.json"] and (tmp_path / "study.json").stat().st_size == 1 << 40
