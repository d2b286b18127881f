"""What stands in a folder and was not written by ``generate``: somebody's work, which is not replaced."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from focgen.codegen.manifest import is_generated, read_manifest, sha256
from focgen.codegen.neighbours import MANIFEST
from focgen.codegen.packages.archive import DIGEST, is_digest, is_recorded
from focgen.custody import sha256_within
from focgen.errors import InputError
from focgen.textfile import LARGEST_CODE

_NAMED = 3


def check_unedited(folder: Path, files: Mapping[str, str | bytes], old: Iterable[Path] = ()) -> None:
    """Raise InputError, naming them, where new ``files`` or the removal of ``old`` ones would lose work.

    Lost would be a file whose bytes are neither those that the folder's manifest recorded when it was written
    nor those that take its place. A manifest is ``generate``'s own where it says so.
    """
    written = _written(folder)
    bytes_of = {name: text.encode("utf-8") if isinstance(text, str) else text for name, text in files.items()}
    names = [*bytes_of, *(path.relative_to(folder).as_posix() for path in old)]
    found = [
        name for name in dict.fromkeys(names) if _lost(folder / name, bytes_of.get(name), written.get(name))
    ]
    if found:
        more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        what = f"{', '.join(found[:_NAMED])}{more} would be replaced, but {_not_as(len(found))}"
        raise InputError(str(folder), what, "choose another --out, or give --force to lose what was edited")


def _not_as(count: int) -> str:
    return "is not as generate wrote it" if count == 1 else "are not as generate wrote them"


def _lost(path: Path, new: bytes | None, written: Any) -> bool:
    if not path.is_file() or _own(path):
        return False
    found = sha256_within(path, LARGEST_CODE)
    return found is None or found not in (written, None if new is None else sha256(new))


def _own(path: Path) -> bool:
    """Whether a file that no manifest records is ``generate``'s all the same: a manifest, by what made it; an
    archive, which a compiler builds, by the digest beside it; such a digest, by its form."""
    if path.name.endswith(MANIFEST):
        return is_generated(read_manifest(path.parent, path.name))
    if path.suffix == ".fmu":
        return is_recorded(path)
    return path.name.endswith(f".fmu{DIGEST}") and is_digest(path)


def _written(folder: Path) -> dict[str, Any]:
    """Name → SHA-256 of what earlier runs have written, for whichever controller."""
    found: dict[str, Any] = {}
    for path in sorted(folder.glob(f"*.{MANIFEST}")):
        files = _files(folder, path.name)
        found |= files | {path.name.replace(MANIFEST, "controller.toml"): files.get("controller.toml")}
    return found | _files(folder, MANIFEST)  # of what several have, the last that was generated


def _files(folder: Path, manifest: str) -> dict[str, Any]:
    files = read_manifest(folder, manifest).get("files")
    return files if isinstance(files, dict) else {}
