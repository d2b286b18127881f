"""A folder whose manifest or controller.toml was edited into what nothing can be rendered from."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from focgen.codegen.manifest import is_generated, read_manifest, sha256
from focgen.control.controller import ARITHMETICS
from focgen.errors import FocgenError, PlanError
from focgen.textfile import LARGEST_SETTING, read_regular
from focgen.verification.recorded import made_here

_MANIFEST, _CONTROLLER = "manifest.json", "controller.toml"


def edited_beyond(folder: Path, fault: FocgenError) -> str | None:
    """What was edited so that the folder met a ``fault`` as it was read; None where nothing was, or where no
    manifest of this version of focgen is left to tell by."""
    manifest = read_manifest(folder, _MANIFEST)
    if not (is_generated(manifest) and made_here(manifest["generator"])):
        return None
    if fault.where.startswith(str(folder / _MANIFEST)):
        return f"{_MANIFEST}: is not as it was written: {_told(fault, folder / _MANIFEST)}"
    if _is_another(folder / _CONTROLLER, manifest):
        what = "is not the one that the folder was made from, and cannot be rendered"
        return f"{_CONTROLLER}: {what}: {_told(fault, folder / _CONTROLLER)}"
    if isinstance(fault, PlanError):  # of a controller that had a plan, so by other options
        return f"{_MANIFEST}: is not as it was written: {fault.where}: {fault.what}"
    return None


def arithmetic_of(folder: Path) -> str:
    """As the manifest has it; "" where that is none."""
    found = read_manifest(folder, _MANIFEST).get("arithmetic")
    return found if isinstance(found, str) and found in ARITHMETICS else ""


def _told(fault: FocgenError, path: Path) -> str:
    """The fault without the file's path, which is said ahead of it."""
    return f"{fault.where.removeprefix(str(path))} {fault.what}".strip()


def _is_another(path: Path, manifest: dict[str, Any]) -> bool:
    inputs = manifest.get("inputs")
    try:
        found = sha256(read_regular(path, LARGEST_SETTING))
    except OSError:
        return False
    return not isinstance(inputs, dict) or inputs.get(_CONTROLLER) != found
