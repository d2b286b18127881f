"""A result whose files cannot all take their places: the earlier one stands again.

Red when a folder is left with files of two results, or when nothing is written and nobody says so.
"""

import errno
import os
import signal
from pathlib import Path

import pytest

from focgen import journal, output
from focgen.cli.faults import Ended, ending_in_order
from focgen.errors import InputError
from tests.trust.test_lost import AFTER, BEFORE, content


@pytest.mark.parametrize("links", (True, False))
@pytest.mark.parametrize("at", ("a", "b/c", "d", "manifest.json", "gone"))
def test_a_place_that_cannot_be_written_leaves_the_earlier_result(tmp_path, monkeypatch, at, links):
    """As in a folder of somebody else's: what has been moved by then goes back, and the place is named."""
    real = {name: getattr(os, name) for name in ("replace", "unlink", "link")}
    denied = str(tmp_path / at)

    def denying(name):
        def step(*arguments, **options):
            if denied in map(str, arguments) or (name == "link" and not links):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), *map(str, arguments[:1]))
            return real[name](*arguments, **options)

        return step

    for name, text in BEFORE.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(text)
    new = {name: text for name, text in AFTER.items() if name != "mine"} | {"sub/new": b"2"}
    with monkeypatch.context() as patched:
        for name in real:
            patched.setattr(os, name, denying(name))
        with pytest.raises(InputError, match="cannot be written"):
            output.write_files(tmp_path, new, old=lambda: [tmp_path / "gone"])
    assert content(tmp_path) == BEFORE and not (tmp_path / "sub").exists()


@pytest.mark.parametrize("links", (True, False))
def test_links_go_back_as_they_stood(tmp_path, monkeypatch, links):
    """Relative ones, one that leads nowhere today, and one to a file with rights of its own."""
    folder, notes, real = (
        tmp_path / "fw",
        tmp_path / "notes",
        {n: getattr(os, n) for n in ("replace", "link")},
    )
    for path in (folder, notes):
        path.mkdir()
    for name in ("a", "gone"):
        (notes / name).write_text("mine")
        os.chmod(notes / name, 0o640)
    stood = {"a": "../notes/a", "b": "../notes/none", "gone": str(notes / "gone")}
    for name, target in stood.items():
        (folder / name).symlink_to(target)

    def denying(name):
        def step(*arguments, **options):
            if str(folder / "d") in map(str, arguments) or (name == "link" and not links):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), *map(str, arguments[:1]))
            return real[name](*arguments, **options)

        return step

    with monkeypatch.context() as patched:
        for name in real:
            patched.setattr(os, name, denying(name))
        with pytest.raises(InputError, match="cannot be written"):
            output.write_files(folder, {"a": "2", "b": "2", "d": "2"}, old=lambda: [folder / "gone"])
    assert {path.name: os.readlink(path) for path in folder.iterdir()} == stood
    assert content(notes) == {"a": b"mine", "gone": b"mine"}
    assert {oct(path.stat().st_mode & 0o777) for path in notes.iterdir()} == {"0o640"}


def test_a_umask_that_takes_reading_away_is_said(tmp_path, monkeypatch):
    """What was made was not found then, and nothing was written at exit status 0. Rights are asked as they
    stand, since root has all of them."""
    monkeypatch.setattr(os, "access", lambda path, mode: os.stat(path).st_mode & 0o700 == 0o700)
    before = os.umask(0o444)
    try:
        with pytest.raises(InputError, match="umask"):
            output.write_files(tmp_path, {"a": "1", "b/c": "1"})
    finally:
        os.umask(before)
    assert not list(tmp_path.iterdir())


def test_a_plan_that_cannot_be_read_back_is_no_success(tmp_path, monkeypatch):
    """As where there are no more files to open: the moves are those that were planned."""
    monkeypatch.setattr(journal, "_plan", lambda whole: None)
    output.write_files(tmp_path, {"a": "1"})
    assert content(tmp_path) == {"a": b"1"}


HEARD = {"SIGINT": signal.default_int_handler, "SIGTERM": signal.SIG_DFL, "SIGHUP": signal.SIG_DFL}
ASKED = [getattr(signal, name) for name in HEARD if hasattr(signal, name)]


@pytest.fixture
def number(request):
    """A signal that is heard here as from a terminal. What runs under ``nohup`` ignores one."""
    before = signal.signal(request.param, HEARD[signal.Signals(request.param).name])
    yield request.param
    signal.signal(request.param, before)


def moves(folder: Path, number: int, kind: str, times: int = 1) -> Ended | KeyboardInterrupt | None:
    """Write a new result, and be asked to end as the first file has its place; what that ends with."""
    steps, real = [], getattr(os, kind)

    def asked(*arguments, **options):
        done = real(*arguments, **options)
        if str(arguments[-1]).endswith(("a", ".whole")) and ".part" not in str(arguments[-1]):
            steps.append(arguments)
            for _ in range(times if len(steps) == 1 else 0):
                signal.raise_signal(number)
        return done

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(os, kind, asked)
        try:
            with ending_in_order():
                output.write_files(folder, {n: t for n, t in AFTER.items() if n != "mine"})
        except (Ended, KeyboardInterrupt) as ended:
            return ended
    return None


@pytest.mark.parametrize("kind", ("rename", "replace"))
@pytest.mark.parametrize("number", ASKED, indirect=True)
def test_who_is_asked_to_end_as_files_move_ends_behind_that(tmp_path, number, kind):
    """An interrupt of the terminal, or a shutdown: the folder had files of two results, until a next run."""
    before = signal.getsignal(number)
    output.write_files(tmp_path, {n: t for n, t in BEFORE.items() if n != "mine"})
    assert moves(tmp_path, number, kind) is not None
    assert {n: t for n, t in content(tmp_path).items() if n in AFTER} == {
        n: t for n, t in AFTER.items() if n != "mine"
    }
    assert not list(tmp_path.glob(".focgen-*")) and signal.getsignal(number) == before


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no terminal hangs up here")
@pytest.mark.parametrize("number", [getattr(signal, "SIGHUP", None)], indirect=True)
def test_what_runs_without_its_terminal_goes_on(tmp_path, number):
    """Under ``nohup`` the terminal's end is ignored, and stays so."""
    signal.signal(number, signal.SIG_IGN)
    output.write_files(tmp_path, {"a": "1"})
    assert moves(tmp_path, number, "replace") is None
    assert signal.getsignal(number) == signal.SIG_IGN


@pytest.mark.parametrize("number", [signal.SIGINT], indirect=True)
def test_who_is_asked_twice_ends_at_once(tmp_path, number):
    """A disk may hang. The next run finishes what is left."""
    output.write_files(tmp_path, {n: t for n, t in BEFORE.items() if n != "mine"})
    assert moves(tmp_path, number, "replace", times=2) is not None
    assert list(tmp_path.glob(".focgen-*.whole"))
    journal.finish(tmp_path)
    assert not list(tmp_path.glob(".focgen-*"))
