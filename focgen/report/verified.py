"""What ``focgen verify --json`` printed, read back: whether its verdict follows from its numbers, and which
of a page's folders it speaks of.

It is a record, not a seal: whoever writes another one may write what he likes. What it guards against is a
verification that is older than the C beside it, or of another folder.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from focgen.custody import sha256_within
from focgen.errors import InputError
from focgen.jsontext import ANY, fits, read_json
from focgen.textfile import LARGEST_CODE

_ERROR = ({"operator": float}, None)
_RAN = {
    "samples": int,
    "mismatches": int,
    "max_error": _ERROR,
    "error_bound": _ERROR,
    "within?": bool,
    "header?": list,
    "illegal?": list,
    "selftest?": (int, None),
}
_VERIFIED = {
    "name": str,
    "arithmetic": str,
    "targets": {ANY: ({"skipped": str}, _RAN)},
    "differences": [str],
    "notes": [str],
    "files?": {ANY: re.compile("[0-9a-f]{64}|")},
    "holds": bool,
}
_REMEDY = "name what `focgen verify DIR --json` printed"
_MANIFEST = "manifest.json"


def read_verified(path: Path) -> dict[str, Any]:
    """A verification. Raises InputError where it is none, and where it holds against its own numbers."""
    found: dict[str, Any] = read_json(path, _REMEDY)
    if not fits(found, _VERIFIED):
        raise InputError(str(path), "is no verification", _REMEDY)
    if found["holds"] and not _agrees(found):
        raise InputError(str(path), "says that it holds, and its numbers do not", _REMEDY)
    return found


def _agrees(found: Mapping[str, Any]) -> bool:
    """Whether something ran, all that did agrees within its bounds, and nothing was edited."""
    ran = [one for one in found["targets"].values() if one.get("skipped") is None]
    return bool(ran) and not found["differences"] and all(map(_sound, ran))


def _sound(one: Mapping[str, Any]) -> bool:
    faults = one["mismatches"] or any(one.get(key) for key in ("header", "illegal", "selftest"))
    error, bound = (one[key] or {} for key in ("max_error", "error_bound"))
    within = not error or not bound or error["operator"] <= bound["operator"]
    return one["samples"] > 0 and within and one.get("within", True) and not faults


def folder_of(path: Path, found: Mapping[str, Any], folders: Sequence[Path]) -> Path | None:
    """Which of a page's generated folders a verification speaks of; None where the page has none.

    Raises InputError where it speaks of another one, or of files as they stood before.
    """
    differing = {folder: tuple(_other(found.get("files", {}), folder)) for folder in folders}
    same = next((folder for folder, others in differing.items() if not others), None)
    if same is None and folders:
        nearest = min(differing, key=lambda folder: len(differing[folder]))
        what = f"is not of {nearest} as it stands: {differing[nearest][0]}"
        raise InputError(str(path), what, f"run `focgen verify {nearest} --json` again, and take that")
    return same


def _other(files: Mapping[str, str], folder: Path) -> Iterator[str]:
    """Yield what of a folder was not verified as it stands."""
    if _MANIFEST not in files:
        yield "it does not say which files were compared"
        return
    for name, digest in sorted(files.items(), key=lambda item: (item[0] == _MANIFEST, item)):
        parts = PurePosixPath(name).parts
        inside = parts and not name.startswith("/") and ".." not in parts and "\0" not in name
        if not inside or sha256_within(folder / name, LARGEST_CODE) != digest:
            yield f"{name} is another"
