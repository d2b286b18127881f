"""Many files take their places at once: what a kill interrupts, the next run that comes to the folder
finishes.

A folder ``.focgen-….whole`` beside the places holds the files that are still to be moved, and ``plan.json``
says what stood at each place when the moving began. The renaming that gives it this name is the moment from
which the new result counts. A place where something else stands by now, somebody's work of meanwhile, is left
alone.

A plan counts only in the folder that it was written in, by its number on the disk, and where that is the
user's alone: a folder that came out of an archive moves nothing.
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
from focgen.errors import InputError
from focgen.jsontext import fits, read_json
from focgen.scratch import as_before, lock, own, synced, unlock, waited_for

FILES, NEW, OLD = "files", "new", "old"
_PLAN = "plan.json"
_LAST = "manifest.json"  # what tells of the others
_WHOLE = re.compile(r"\.focgen-[0-9a-f]{16}\.whole")
_DIGEST = (re.compile(r"[0-9a-f]{64}"), None)
_SHAPE = {"folder": [int], "files": dict, "old": dict, "replaced": (str, None)}


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Only one process at a time moves files into a folder. What was left there is finished first."""
    held = waited_for(folder)
    try:
        _finish(folder)
        yield
    finally:
        unlock(held)


def finish(folder: Path) -> None:
    """Finish what a killed run has begun in a folder, if it has; nothing happens where nobody may write."""
    if folder.is_dir() and os.access(folder, os.W_OK) and any(_left(folder)):
        with alone(folder):
            pass


def put(scratch: Path, target: Path, names: Sequence[Path], old: Iterable[Path] = ()) -> None:
    """Move ``scratch``/files/NAME to ``target``/NAME for each of ``names``, and remove ``old`` files of
    ``target``: all of it, at once or in the next run.

    To be called ``alone``. Raises OSError where that cannot be.
    """
    for name in names:
        (target / name).parent.mkdir(parents=True, exist_ok=True)
    plan = {
        "files": {name.as_posix(): _digest(target / name) for name in names},
        "old": {path.relative_to(target).as_posix(): _digest(path) for path in old},
        "replaced": None,
    }
    _carry_out(_committed(scratch, plan), target)


def put_folder(scratch: Path, target: Path) -> None:
    """Put the folder ``scratch``/new where ``target`` stands, which goes. To be called ``alone`` in its
    parent.

    Raises OSError where that cannot be.
    """
    plan = {"files": {}, "old": {}, "replaced": target.name}
    _carry_out(_committed(scratch, plan), target.parent)


def _committed(scratch: Path, plan: dict[str, Any]) -> Path:
    """The scratch under the name that makes it count."""
    number = os.stat(scratch)
    text = json.dumps({"folder": [number.st_dev, number.st_ino], **plan})
    (scratch / _PLAN).write_text(text, encoding="utf-8")
    synced(scratch / _PLAN)
    synced(scratch)
    whole = scratch.with_name(f"{scratch.name}.whole")
    os.rename(scratch, whole)
    synced(whole.parent)
    return whole


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
            if _counts(whole):
                _carry_out(whole, folder)
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


def _counts(whole: Path) -> bool:
    """Whether a plan was written here, by this user."""
    plan, found = _plan(whole), os.stat(whole)
    return plan is not None and plan["folder"] == [found.st_dev, found.st_ino] and own(whole)


def _carry_out(whole: Path, target: Path) -> None:
    plan = _plan(whole)
    if plan is None:
        return
    if plan["replaced"] is not None:
        _exchange(whole, target / plan["replaced"])
    for name in sorted(plan["files"], key=lambda name: (name == _LAST, name)):
        _move(whole / FILES / name, target / name, plan["files"][name], target)
    for name, digest in plan["old"].items():
        _remove(target / name, digest, target)
    for folder in {(target / name).parent for name in (*plan["files"], *plan["old"])} | {target}:
        synced(folder)
    shutil.rmtree(whole, ignore_errors=True)


def _move(source: Path, place: Path, stood: str | None, target: Path) -> None:
    """To its place, unless it has been moved or something else stands there by now."""
    if source.is_file() and _within(place, target) and _digest(place) in (stood, _digest(source)):
        place.parent.mkdir(parents=True, exist_ok=True)
        as_before(source, place)
        os.replace(source, place)


def _remove(path: Path, stood: str | None, target: Path) -> None:
    """Remove a file as it stood, and its folder where that is empty then."""
    if stood is not None and _within(path, target) and _digest(path) == stood:
        path.unlink()
        with suppress(OSError):
            path.parent.rmdir()


def _exchange(whole: Path, place: Path) -> None:
    if not (whole / NEW).is_dir():
        return
    if place.exists() and not (whole / OLD).exists():
        os.rename(place, whole / OLD)
    if not place.exists():
        os.rename(whole / NEW, place)


def _within(path: Path, folder: Path) -> bool:
    """Whether a path stays in a folder whatever links there are."""
    return path.parent.resolve().is_relative_to(folder.resolve()) and not path.is_dir()


def _digest(path: Path) -> str | None:
    """Of the bytes that stand at a place; None where there is no file."""
    return sha256_of(path) if path.is_file() else None
