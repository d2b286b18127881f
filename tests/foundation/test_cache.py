"""The cache of compiled programs: used where it is this user's alone, else a private folder stands in.

Red when a program is run from a folder that another user can write.
"""

import os
import stat
import tempfile
from pathlib import Path

import pytest

from focgen import cache
from focgen.errors import BuildError
from focgen.targets import toolchains
from focgen.trials import build

pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="the system has no owners to ask for")


@pytest.fixture(autouse=True)
def anew(monkeypatch, tmp_path):
    """Every test asks anew, in a home of its own."""
    cache._folder.cache_clear()
    cache._temporary.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    yield tmp_path
    cache._folder.cache_clear()
    cache._temporary.cache_clear()


def unwritable(tmp_path: Path) -> None:
    """Where the cache should be there is a file."""
    (tmp_path / "home").write_text("no folder")


def open_to_all(tmp_path: Path) -> None:
    (tmp_path / "home" / "focgen").mkdir(parents=True)
    (tmp_path / "home" / "focgen").chmod(0o777)


def open_to_a_group(tmp_path: Path) -> None:
    (tmp_path / "home" / "focgen").mkdir(parents=True)
    (tmp_path / "home" / "focgen").chmod(0o770)


def replaceable(tmp_path: Path) -> None:
    """Who may write in its parent can put another folder in its place."""
    (tmp_path / "home" / "focgen").mkdir(parents=True, mode=0o700)
    (tmp_path / "home").chmod(0o777)


def linked_to_an_open_one(tmp_path: Path) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o777)
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "focgen").symlink_to(tmp_path / "shared")


@pytest.mark.parametrize(
    "spoil", (unwritable, open_to_all, open_to_a_group, replaceable, linked_to_an_open_one)
)
def test_a_folder_that_others_reach_is_not_used(anew, spoil):
    spoil(anew)
    folder = cache.cache_folder()
    assert not folder.resolve().is_relative_to(anew / "home")
    assert not folder.resolve().is_relative_to(anew / "shared")
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700 and folder.stat().st_uid == os.getuid()
    assert not list(folder.iterdir()), "it is new"


def test_a_folder_of_another_user_is_not_used(anew, monkeypatch):
    (anew / "home" / "focgen").mkdir(parents=True, mode=0o700)
    monkeypatch.setattr(os, "getuid", lambda: os.stat(anew).st_uid + 1)
    assert not cache.is_private(anew / "home" / "focgen")


def test_the_users_own_folder_is_used_and_made_private(anew):
    assert cache.cache_folder() == anew / "home" / "focgen"
    assert stat.S_IMODE((anew / "home" / "focgen").stat().st_mode) == 0o700


def test_a_relative_cache_is_void(anew, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "here")
    monkeypatch.setenv("HOME", str(anew / "me"))
    assert cache.cache_folder() == anew / "me" / ".cache" / "focgen"


def test_a_program_is_built_once_and_kept():
    built = []

    def build_it(path: Path) -> None:
        built.append(path)
        path.write_bytes(b"program")

    first, again = cache.kept("program", build_it), cache.kept("program", build_it)
    assert first == again and first.read_bytes() == b"program" and len(built) == 1


@pytest.mark.parametrize("how", ("writable", "link", "folder's own"))
def test_a_file_that_could_be_anothers_is_built_anew(anew, how):
    folder = cache.cache_folder()
    foreign = anew / "foreign"
    foreign.write_bytes(b"foreign")
    if how == "link":
        (folder / "program").symlink_to(foreign)
    else:
        (folder / "program").write_bytes(b"foreign")
        (folder / "program").chmod(0o666 if how == "writable" else 0o600)
    found = cache.kept("program", lambda path: path.write_bytes(b"mine"))
    assert found.read_bytes() == b"mine" and foreign.read_bytes() == b"foreign"


@pytest.mark.parametrize("spoiled", ("program", "program.sha256"))
@pytest.mark.parametrize("left", (b"", b"prog", b"another"))
def test_what_is_not_as_it_was_built_is_built_anew(spoiled, left):
    """A library that was cut ends the process that loads it, by SIGBUS, and would do so for ever."""
    built = []

    def build_it(path: Path) -> None:
        built.append(path)
        path.write_bytes(b"program")

    found = cache.kept("program", build_it)
    found.with_name(spoiled).write_bytes(left)
    assert cache.kept("program", build_it).read_bytes() == b"program" and len(built) == 2
    cache.kept("program", build_it)
    assert len(built) == 2


def test_what_is_kept_is_on_the_disk_before_it_has_its_place(monkeypatch):
    seen, real = [], os.replace
    monkeypatch.setattr(cache, "synced", lambda path: seen.append(path.name))
    monkeypatch.setattr(os, "replace", lambda a, b: (seen.append("place"), real(a, b))[1])
    cache.kept("program", lambda path: path.write_bytes(b"program"))
    assert seen == ["program", "place", "program.sha256", "place"]


@pytest.mark.parametrize("home", (".", "me"))
def test_a_relative_home_is_none(anew, monkeypatch, home):
    """In the folder one stands in, somebody else may have put what would be loaded."""
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", home)
    monkeypatch.chdir(anew)
    (anew / home / ".cache" / "focgen").mkdir(parents=True, mode=0o700)
    assert ".cache" not in cache.cache_folder().parts


def test_what_cannot_be_built_leaves_nothing():
    def fail(path: Path) -> None:
        path.write_bytes(b"half")
        raise BuildError("it", "fails", "mend it")

    with pytest.raises(BuildError):
        cache.kept("program", fail)
    assert not list(cache.cache_folder().iterdir())


def test_nothing_that_lies_in_the_temporary_folder_is_loaded(anew, monkeypatch):
    """A library of the expected name, where there is no cache, must not be found."""
    name = cache.kept("probe", lambda path: path.write_bytes(b"")).name
    assert name == "probe"
    cache._folder.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(anew / "blocked"))
    (anew / "blocked").write_text("no folder")
    built = []
    monkeypatch.setattr(build, "_compile", lambda path: built.append(path) or path.write_bytes(b"no library"))
    for planted in (anew, anew / f"focgen-{os.getuid()}"):
        planted.mkdir(exist_ok=True)
    loaded = []
    monkeypatch.setattr(build.cffi.FFI, "dlopen", lambda self, path: loaded.append(Path(path)))
    build.library.__wrapped__()
    (planted := anew / loaded[0].name).write_bytes(b"planted")
    build.library.__wrapped__()
    assert built and planted not in loaded
    assert all(stat.S_IMODE(path.parent.stat().st_mode) == 0o700 for path in loaded)
    zig = Path(toolchains._environment()["ZIG_GLOBAL_CACHE_DIR"])
    assert zig.parent == loaded[0].parent
