"""A result whose files cannot all take their places: the earlier one stands again.

Red when a folder is left with files of two results, or when nothing is written and nobody says so.
"""

import errno
import os

import pytest

from focgen import journal, output
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
