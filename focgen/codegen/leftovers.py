"""Files of an earlier run of ``generate`` in the same folder, which the present one does not replace."""

from __future__ import annotations

import re
from collections.abc import Collection
from pathlib import Path

from focgen.codegen.manifest import sha256
from focgen.errors import InputError
from focgen.jsontext import read_json


def leftovers(folder: Path, name: str, files: Collection[str]) -> tuple[Path, ...]:
    """What the manifest in ``folder`` says was written for the controller ``name`` and is not among the new
    ``files``: a self-test, and headers of the runtime that are still as they were written.

    Files of a controller of another name stay, and so does whatever no manifest tells of.
    """
    manifest = _manifest(folder)
    if manifest.get("name") != name:
        return ()
    test = [f"{name}_selftest.{end}" for end in "hc"] if "selftest" in manifest else []
    inputs = manifest.get("inputs")
    written = inputs.items() if isinstance(inputs, dict) else ()
    runtime = [(file, digest) for file, digest in written if re.fullmatch(r"foc_\w+\.h", file)]
    headers = [file for file, digest in runtime if _is(folder / file, digest)]
    old = [folder / file for file in (*test, *headers) if file not in files]
    return tuple(path for path in old if path.is_file())


def _manifest(folder: Path) -> dict:
    try:
        found = read_json(folder / "manifest.json", "")
    except InputError:
        return {}
    return found if isinstance(found, dict) else {}


def _is(path: Path, digest: str) -> bool:
    return path.is_file() and sha256(path.read_bytes()) == digest
