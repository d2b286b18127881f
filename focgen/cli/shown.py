"""``--report``: one page where a file of HTML is named, else a folder of pictures."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from focgen.errors import InputError
from focgen.output import check_apart, check_writable, new_folder, write_file, write_files
from focgen.replaced import check_own, check_page
from focgen.report.interactive import library
from focgen.report.page import Page
from focgen.scratch import real


def add_report(parser: ArgumentParser) -> None:
    """Declare the option."""
    help_text = "write one self-contained page to this file, or pictures to a folder of another name"
    parser.add_argument("--report", metavar="FILE.html", help=help_text)


def is_page(path: str | None) -> bool:
    """Whether a page is asked for, not a folder of pictures."""
    return path is not None and Path(path).suffix.lower() in (".html", ".htm")


def check_report(path: str | None, inputs: Iterable[Any], out: str | None = None) -> None:
    """Raise before work begins that cannot be shown: MissingExtra without the library that draws on pages,
    InputError where the page would replace an input, ``out`` or somebody else's file, or cannot be
    written."""
    if path is None:
        return
    if out is not None and real(path) == real(out):
        raise InputError(path, "is --out as well, and one would be lost", "give --report another name")
    if is_page(path):
        library()
        check_apart([path], inputs)
        check_page(path)
    check_writable(Path(path), folder=not is_page(path))


def drawn(
    path: str | None, page: Callable[[], Page], pictures: Callable[[], Mapping[str, bytes]]
) -> str | Mapping[str, bytes] | None:
    """What is to be written: the page's text, or pictures by name; None where nothing is asked for."""
    if path is None:
        return None
    return page().self_contained() if is_page(path) else pictures()


def write_report(path: str | None, what: str | Mapping[str, bytes] | None, inputs: Iterable[Any]) -> str:
    """Write what :func:`drawn` gave, and say where it is."""
    if path is None or not what:
        return ""
    if isinstance(what, str):
        write_file(path, what, inputs)
        return f"page in {path}\n"
    _check_pictures(Path(path), what, inputs)
    write_files(path, what, inputs)
    return f"pictures in {path}\n"


def write_with_report(
    out: str, text: str, path: str | None, what: str | Mapping[str, bytes] | None, inputs: Sequence[Any]
) -> str:
    """Write the file ``out`` and what :func:`drawn` gave, both or neither but for a page, which may be
    without it; say where the latter is. Raises InputError where one would be lost to the other, or to an
    input."""
    check_writable(Path(out))
    if path is None or isinstance(what, str) or not what:
        told = write_report(path, what, inputs)
        write_file(out, text, inputs)
        return told
    _check_pictures(Path(path), what, inputs)
    if real(out) in {real(Path(path) / name) for name in what}:
        raise InputError(out, "is a picture's name as well, and one would be lost", "give it another name")
    with new_folder(path, inputs) as folder:
        for name, picture in what.items():
            (folder / name).write_bytes(picture)
        write_file(out, text, inputs)
    return f"pictures in {path}\n"


def _check_pictures(folder: Path, names: Iterable[str], inputs: Iterable[Any]) -> None:
    """Raise InputError where a picture would take the place of an input or of somebody else's file."""
    places = [folder / name for name in names]
    check_apart(places, inputs)
    check_own(places)
