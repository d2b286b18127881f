"""``cost.json``: the file beside a controller's C that remembers what it cost; no part of what was
generated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from focgen.errors import InputError
from focgen.jsontext import ANY, fits, read_json, shape_of
from focgen.targets.cost import Cost

REMEMBERED = "cost.json"
COMPILERS = ("zig", "gcc")
_NEEDED = ("instructions_per_step", "cycles_per_step", "stack_path")
_ENTRY = {
    name.rstrip("?") if name.rstrip("?") in _NEEDED else name: kind for name, kind in shape_of(Cost).items()
}
_PART = {"made_from": str, "targets": {ANY: _ENTRY}, "previous": {ANY: _ENTRY}}
_KEYS = {name.rstrip("?") for name in _ENTRY}


def remembered(path: Path) -> dict[str, Any] | None:
    """What a folder remembers, by compiler; None where there is nothing, or something else."""
    found = _content(path)
    return found if found is not None and all(map(_is_part, found.values())) else None


def _is_part(part: Any) -> bool:
    if not fits(part, _PART):
        return False
    return all(entry.keys() <= _KEYS for key in ("targets", "previous") for entry in part[key].values())


def is_own(path: Path) -> bool:
    """Whether a new memory may stand here: nothing does, or a memory, or what a damaged one has become."""
    return not path.exists() or _content(path) is not None


def _content(path: Path) -> dict[str, Any] | None:
    try:
        found = read_json(path, "")
    except InputError:
        return None
    return found if isinstance(found, dict) and found.keys() <= set(COMPILERS) else None
