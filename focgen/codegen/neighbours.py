"""Several controllers in one folder: the last one that was generated has ``manifest.json`` and
``controller.toml``; of each other one they stand beside, under its name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from focgen.codegen.manifest import read_manifest
from focgen.codegen.names import check_name
from focgen.codegen.packages.package import README, package_file
from focgen.errors import InputError
from focgen.resources import shipped
from focgen.textfile import LARGEST_CODE, holds, read_regular

MANIFEST = "manifest.json"
_OWN = (MANIFEST, "controller.toml")
_PLAIN = ("controller.toml", README, "example/main.c")
_SHARED = re.compile(r"foc_\w+\.h")


def kept(folder: Path, name: str) -> dict[str, bytes]:
    """What the controller that stands in a folder keeps when ``name`` is generated there: by its new names.

    Nothing where it is the same controller, or none.
    """
    other = _name_of(read_manifest(folder))
    if other in (None, name):
        return {}
    return {
        f"{other}.{file}": read_regular(folder / file, LARGEST_CODE)
        for file in _OWN
        if (folder / file).is_file()
    }


def check_told_apart(folder: Path, name: str) -> None:
    """Raise InputError where a controller stands in ``folder`` whose name is ``name`` but for capitals.

    Macros are in capitals, and some file systems make no difference either.
    """
    for other, _ in others(folder, name):
        if other.lower() == name.lower():
            what = f"holds the controller {other!r}, which shares its macros with {name!r}"
            raise InputError(str(folder), what, "give --name one that differs in more than capitals")


def taken_back(folder: Path, name: str) -> tuple[Path, ...]:
    """What stands beside for ``name``, which has its own place again."""
    beside = (folder / f"{name}.{file}" for file in _OWN)
    return tuple(path for path in beside if path.is_file()) if f"{name}.{MANIFEST}" in _beside(folder) else ()


def manifest_of_controller(folder: Path, name: str) -> dict[str, Any]:
    """The manifest of one of a folder's controllers; empty where there is none."""
    found = read_manifest(folder), read_manifest(folder, f"{name}.{MANIFEST}")
    return next((one for one in found if _name_of(one) == name), {})


def others(folder: Path, name: str) -> Iterator[tuple[str, frozenset[str]]]:
    """Yield each other controller of a folder, and the names of its files: those that its manifest lists and
    ``generate`` writes for a controller of that name."""
    for file in (MANIFEST, *_beside(folder)):
        manifest = read_manifest(folder, file)
        other = _name_of(manifest)
        if other is not None and other != name and file in (MANIFEST, f"{other}.{MANIFEST}"):
            files = manifest.get("files")
            own = {f"{other}.{part}" for part in _OWN} if file != MANIFEST else set()
            listed = files if isinstance(files, dict) else ()
            yield other, frozenset(one for one in listed if _writes(folder, one, other)) | own


def _writes(folder: Path, file: str, name: str) -> bool:
    """Whether a file is one that ``generate`` writes for the controller ``name``: a manifest may list any.

    One of the runtime counts as it is shipped.
    """
    if _SHARED.fullmatch(file):
        known = shipped("c_runtime") / file
        return known.is_file() and holds(folder / file, known.read_bytes())
    own = {f"{name}{part}.{end}" for part in ("", "_selftest") for end in "ch"}
    return file in {*own, *_PLAIN} or package_file(file, name)


def _beside(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob(f"*.{MANIFEST}") if path.is_file())


def _name_of(manifest: dict[str, Any]) -> str | None:
    """The name that a manifest gives, where it can be one."""
    name = manifest.get("name")
    try:
        return check_name(name, MANIFEST) if isinstance(name, str) else None
    except InputError:
        return None
