"""What a page, a picture or a file of a result takes the place of: one of its own kind, and nothing else.

A name says little: ``notes.html`` may be somebody's notes, ``loops.png`` his photograph. So a file that
stands at a place is looked at, by what ours have in them. One of ours that was edited is still one.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from focgen.errors import InputError
from focgen.jsontext import read_json
from focgen.textfile import LARGEST_JSON, LARGEST_SETTING, read_regular
from focgen.tomlfile import has_keys

_PAGE = (b'<p class="maker">focgen report</p>', b"<footer>Made by focgen ")
_PNG, _DOTS = b"\x89PNG\r\n\x1a\n", struct.pack(">IIB", 5906, 5906, 1)  # 150 dots an inch, in metres
_RIG = ("sample_time", "signals")


def check_own(places: Iterable[str | Path]) -> None:
    """Raise InputError where a result would take the place of a file that is none of its kind. An empty file
    is nobody's."""
    for place in map(Path, places):
        _check(place, _OF_NAME.get(place.name, _OF_ENDING.get(place.suffix.lower(), _is_page)))


def check_page(place: str | Path) -> None:
    """The same where a page is written, under whatever name: a study of that name is no page."""
    _check(Path(place), _is_page)


def _check(place: Path, is_own: Callable[[Path], bool]) -> None:
    if place.is_file() and place.stat().st_size and not _holds(place, is_own):
        what = "is nothing that focgen has written there, and would be lost"
        raise InputError(str(place), what, "name another place, or move it away")


def _holds(path: Path, is_own: Callable[[Path], bool]) -> bool:
    with suppress(OSError, InputError):
        return is_own(path)
    return False  # what cannot be read is not ours to replace


def _is_page(path: Path) -> bool:
    text = read_regular(path, LARGEST_SETTING)
    return any(mark in text for mark in _PAGE)


def _is_picture(path: Path) -> bool:
    """Whether it is made as ours are: they have a resolution, and no text that says by what or when."""
    found = read_regular(path, LARGEST_SETTING)
    parts = list(_chunks(found)) if found.startswith(_PNG) else []
    kinds = [kind for kind, _ in parts]
    return set(kinds) == {b"IHDR", b"pHYs", b"IDAT", b"IEND"} and dict(parts)[b"pHYs"] == _DOTS


def _chunks(png: bytes) -> Iterable[tuple[bytes, bytes]]:
    """Yield the kind and the content of every part."""
    at = len(_PNG)
    while at + 8 <= len(png):
        size, kind = struct.unpack_from(">I4s", png, at)
        yield kind, png[at + 8 : at + 8 + size]
        at += size + 12


def _has(*keys: str) -> Callable[[Path], bool]:
    """Whether a file is JSON with these keys."""

    def is_own(path: Path) -> bool:
        found = read_json(path, "")
        return isinstance(found, dict) and found.keys() >= set(keys)

    return is_own


def _begins(text: bytes) -> Callable[[Path], bool]:
    return lambda path: read_regular(path, LARGEST_JSON).startswith(text)


_OF_ENDING: Mapping[str, Callable[[Path], bool]] = {".png": _is_picture}
_OF_NAME: Mapping[str, Callable[[Path], bool]] = {
    "diagnosis.json": _has("verdict", "causes", "gap"),
    "signals.json": _has("entry", "traces", "segments"),
    "refitted.toml": lambda path: has_keys(path, _RIG),
    "augmented.toml": lambda path: has_keys(path, _RIG),
    "next_experiment.csv": _begins(b"time_s,input\n"),
    "study.json": _has("subject", "rows", "pareto"),
    "curves.json": _has("controller", "rows", "ideal"),
    "scores.md": _begins(b"### Suite `"),
    "scores.json": _has("scores", "cases"),
}
