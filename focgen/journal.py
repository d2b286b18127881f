"""Many files take their places at once: what a kill interrupts, the next run that comes to the folder
finishes.

A folder ``.focgen-….whole`` beside the places holds the files that are still to be moved, and ``plan.json``
says what stood at each place when the moving began. The renaming that gives it this name is the moment from
which the new result counts. A place where something else stands by now, somebody's work of meanwhile, is left
alone.

A plan counts only in the folder that it was written in, and where that is the user's alone: a folder that
came out of an archive moves nothing. The folder is known by its number on the disk. After a restart the disk
may have another one; then a file in it is known by its own number and by when it was made, which no archive
can set: to the nanosecond, or to the second where the disk keeps no more.

Whoever asks a process to end while files move (an interrupt, a shutdown) is heard once they have moved.

Where a place cannot be written to, the files that have been moved by then go back: what stood there is kept
in ``before`` until all have their places, and the plan is exchanged for the way back.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from focgen.custody import sha256_of
from focgen.endings import undisturbed
from focgen.errors import InputError
from focgen.jsontext import fits, read_json
from focgen.scratch import as_before, lock, own, real, synced, unlock, waited_for

FILES, NEW, OLD = "files", "new", "old"
_BEFORE = "before"
_PLAN, _BACK = "plan.json", "back.json"
_LAST = "manifest.json"  # what tells of the others
_WHOLE = re.compile(r"\.focgen-[0-9a-f]{16}\.whole")
_DIGEST = (re.compile(r"[0-9a-f]{64}"), None)
_MARK = "mark"  # what a folder is known by
_ABOVE = 3  # folders in which a run may have begun what lies here: a demo's results lie as deep
_SECOND = 1_000_000_000  # ns
_SHAPE = {
    "folder": [int],
    "mark?": [int],
    "source?": re.compile(f"{FILES}|{_BEFORE}"),
    "files": dict,
    "old": dict,
    "replaced": (str, None),
}


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Only one process at a time moves files into a folder. What was left there is finished first."""
    held = waited_for(folder)
    try:
        _finish(folder)
        yield
    finally:
        unlock(held)


def finish(folder: Path) -> bool:
    """Finish what a killed run has begun in a folder, or in one of those above that may hold it with others,
    if it has; nothing happens where nobody may write. Returns whether there was something."""
    here = Path(os.path.abspath(folder))
    found = [one for one in (*reversed(here.parents[:_ABOVE]), here) if _begun(one)]
    for one in found:
        with alone(one):
            pass
    return bool(found)


def _begun(folder: Path) -> bool:
    """Whether a run of this user has left something here that it may finish."""
    with suppress(FileNotFoundError):  # of one that has just ended
        return folder.is_dir() and os.access(folder, os.W_OK) and any(map(own, _left(folder)))
    return False


def put(scratch: Path, target: Path, names: Sequence[Path], old: Iterable[Path] = ()) -> None:
    """Move ``scratch``/files/NAME to ``target``/NAME for each of ``names``, and remove ``old`` files of
    ``target``: all of it, at once or in the next run, or nothing.

    To be called ``alone``. Raises OSError where that cannot be.
    """
    made = [parent for name in names for parent in _new_folders((target / name).parent)]
    plan = {
        "source": FILES,
        "files": {name.as_posix(): _digest(target / name) for name in names},
        "old": {path.relative_to(target).as_posix(): _digest(path) for path in old},
        "replaced": None,
    }
    try:
        back = _way_back(scratch, target, plan)
        with undisturbed():
            _there_or_back(_committed(scratch, plan), plan, back, target)
    except OSError:
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()
        raise


def _there_or_back(whole: Path, plan: dict[str, Any], back: dict[str, Any], target: Path) -> None:
    try:
        _carry_out(whole, plan, target)
    except OSError:
        _write_plan(whole, back, _BACK)
        os.replace(whole / _BACK, whole / _PLAN)
        _carry_out(whole, back, target)
        raise


def _new_folders(folder: Path) -> list[Path]:
    """Make a folder; it and those above it that there were not, the uppermost first."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]


def _way_back(scratch: Path, target: Path, plan: dict[str, Any]) -> dict[str, Any]:
    """The plan that undoes ``plan``; what stands in the places is kept for it."""
    there = {**plan["files"], **plan["old"]}
    stood = [name for name in there if there[name] is not None or (target / name).is_symlink()]
    for name in stood:
        kept = scratch / _BEFORE / name
        kept.parent.mkdir(parents=True, exist_ok=True)
        _kept(target / name, kept)
    made = {name: _digest(scratch / FILES / name) for name in plan["files"]}
    back = {name: made.get(name) for name in stood}
    gone = {name: digest for name, digest in made.items() if name not in stood}
    return {"source": _BEFORE, "files": back, "old": gone, "replaced": None}


def _kept(path: Path, place: Path) -> None:
    """One more name of a file, or a copy where the file system has one name a file; of a link the same link,
    which leads nowhere from here."""
    if path.is_symlink():
        place.symlink_to(os.readlink(path))
        return
    try:
        os.link(path, place)
    except OSError:
        shutil.copy2(path, place)


def put_folder(scratch: Path, target: Path) -> None:
    """Put the folder ``scratch``/new where ``target`` stands, which goes. To be called ``alone`` in its
    parent.

    Raises OSError where that cannot be; then what stood there stands there.
    """
    plan = {"source": FILES, "files": {}, "old": {}, "replaced": target.name}
    with undisturbed():
        whole = _committed(scratch, plan)
        try:
            _carry_out(whole, plan, target.parent)
        except OSError:
            if (whole / OLD).exists() and not target.exists():
                os.rename(whole / OLD, target)
            shutil.rmtree(whole, ignore_errors=True)
            raise


def _committed(scratch: Path, plan: dict[str, Any]) -> Path:
    """The scratch under the name that makes it count."""
    _write_plan(scratch, plan)
    whole = scratch.with_name(f"{scratch.name}.whole")
    os.rename(scratch, whole)
    synced(whole.parent)
    return whole


def _write_plan(folder: Path, plan: dict[str, Any], name: str = _PLAN) -> None:
    if not (folder / _MARK).exists():  # touched again, it would be another
        (folder / _MARK).touch()
    text = json.dumps({"folder": _number(folder), "mark": _made(folder), **plan})
    (folder / name).write_text(text, encoding="utf-8")
    synced(folder / name)
    synced(folder)


def _number(folder: Path) -> list[int]:
    """Which folder it is, for as long as the disk is not mounted anew."""
    found = os.stat(folder)
    return [found.st_dev, found.st_ino]


def _made(folder: Path) -> list[int]:
    """Which folder it is by its mark: number, and when it was made (ns); nothing where it has none."""
    try:
        found = os.lstat(folder / _MARK)
    except OSError:
        return []
    return [found.st_ino, found.st_ctime_ns]


def _left(folder: Path) -> Iterator[Path]:
    """Yield what looks like the folder of an interrupted run."""
    with suppress(OSError):
        for entry in os.scandir(folder):
            if _WHOLE.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False):
                yield Path(entry.path)


def _finish(folder: Path) -> None:
    for whole in sorted(_left(folder)):
        held = lock(whole)
        if held is None:  # its process lives
            continue
        try:
            if (plan := _counting(whole)) is not None:
                _carry_out(whole, plan, folder)
        except OSError as reason:
            what = f"holds a result that is not whole, and cannot be finished ({reason.strerror})"
            raise InputError(str(folder), what, "make room, or let it be written to") from None
        finally:
            unlock(held)


def _plan(whole: Path) -> dict[str, Any] | None:
    try:
        found = read_json(whole / _PLAN, "")
    except InputError:
        return None
    if not fits(found, _SHAPE):
        return None
    digests = [*found["files"].values(), *found["old"].values()]
    names = [*found["files"], *found["old"], *filter(None, [found["replaced"]])]
    return found if all(fits(one, _DIGEST) for one in digests) and all(map(_inside, names)) else None


def _inside(name: str) -> bool:
    path = Path(name)
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts and "\0" not in name


def _counting(whole: Path) -> dict[str, Any] | None:
    """A plan that was written here, by this user; None of any other."""
    plan = _plan(whole)
    if plan is None or not own(whole):
        return None
    here = plan["folder"] == _number(whole) or _same(plan.get("mark", []), _made(whole))
    return plan if here else None


def _same(mark: list[int], found: list[int]) -> bool:
    """Whether a mark is the one that was made, for all that the disk has kept of it."""
    if len(mark) != 2 or len(found) != 2:
        return False
    (number, when), (found_number, kept) = mark, found
    return number == found_number and kept in (when, when - when % _SECOND)


def _carry_out(whole: Path, plan: dict[str, Any], target: Path) -> None:
    if plan["replaced"] is not None:
        _exchange(whole, target / plan["replaced"])
    for name in sorted(plan["files"], key=lambda name: (name == _LAST, name)):
        _move(whole / plan.get("source", FILES) / name, target / name, plan["files"][name], target)
    for name, digest in plan["old"].items():
        _remove(target / name, digest, target)
    for folder in {(target / name).parent for name in (*plan["files"], *plan["old"])} | {target}:
        synced(folder)
    done = whole.with_suffix("")  # a kill from here on leaves what is cleared away, and no plan
    os.rename(whole, done)
    shutil.rmtree(done, ignore_errors=True)


def _move(source: Path, place: Path, stood: str | None, target: Path) -> None:
    """To its place, unless it has been moved or something else stands there by now."""
    link = source.is_symlink()  # one that stood here and goes back
    if not (link or source.is_file()) or not _within(place, target):
        return
    found, ours = _digest(place), _digest(source)
    if found not in (stood, ours):
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    if not link:
        as_before(source, place)
    try:
        os.replace(source, place)
    except OSError:
        if found != ours:  # else nothing is missing there
            raise


def _remove(path: Path, stood: str | None, target: Path) -> None:
    """Remove a file as it stood, and the folders in ``target`` that are empty then."""
    if stood is not None and _within(path, target) and _digest(path) == stood:
        path.unlink()
        inside = path.relative_to(target).parents
        with suppress(OSError):  # the first that holds something ends it
            for folder in list(inside)[:-1]:
                (target / folder).rmdir()


def _exchange(whole: Path, place: Path) -> None:
    if not (whole / NEW).is_dir():
        return
    if place.exists() and not (whole / OLD).exists():
        os.rename(place, whole / OLD)
    if not place.exists():
        os.rename(whole / NEW, place)


def _within(path: Path, folder: Path) -> bool:
    """Whether a path stays in a folder whatever links there are."""
    return real(path.parent).is_relative_to(real(folder)) and not path.is_dir()


def _digest(path: Path) -> str | None:
    """Of the bytes that stand at a place; None where there is no file."""
    return sha256_of(path) if path.is_file() else None
