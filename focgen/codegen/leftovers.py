"""Files of an earlier run of ``generate`` in the same folder, which the present one does not replace."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from focgen.codegen.manifest import sha256
from focgen.codegen.neighbours import manifest_of_controller, others
from focgen.codegen.packages.archive import DIGEST
from focgen.codegen.packages.package import moved, package_file
from focgen.custody import sha256_within
from focgen.textfile import LARGEST_CODE


def leftovers(folder: Path, name: str, files: Mapping[str, str | bytes]) -> tuple[Path, ...]:
    """What the manifest in ``folder`` says was written for the controller ``name`` and is not among the new
    ``files``: a self-test, an FMU, and whatever of the runtime and of a package is still as it was written.

    Files of a controller of another name stay, and so does whatever no manifest tells of.
    """
    manifest = manifest_of_controller(folder, name)
    if not manifest:
        return ()
    test = [f"{name}_selftest.{end}" for end in "hc"] if "selftest" in manifest else []
    inputs = manifest.get("inputs")
    written = inputs.items() if isinstance(inputs, dict) else ()
    runtime = [(file, digest) for file, digest in written if re.fullmatch(r"foc_\w+\.h", file)]
    headers = [file for file, digest in runtime if _is(folder / file, digest)]
    package = [file for file, digest in _packaged(manifest, name) if _is(folder / file, digest)]
    archive = [f"{name}.fmu", f"{name}.fmu{DIGEST}"] if _of(manifest.get("package"), "for") == "fmu" else []
    elsewhere = [
        other
        for file, text in files.items()
        for other in moved(file)
        if _is(folder / other, sha256(text)) or _is(folder / other, _of(manifest.get("files"), other))
    ]
    old = [folder / file for file in (*test, *headers, *package, *archive, *elsewhere) if file not in files]
    needed = {folder / file for _, own in others(folder, name) for file in own}
    return tuple(path for path in dict.fromkeys(old) if path.is_file() and path not in needed)


def _packaged(manifest: dict[str, Any], name: str) -> Iterator[tuple[str, str]]:
    """Yield file and digest of what a package added, known by its own names: a manifest from elsewhere
    leads to no other file."""
    listed = manifest.get("files")
    for file, digest in listed.items() if isinstance(listed, dict) else ():
        if package_file(file, name) and isinstance(digest, str):
            yield file, digest


def _of(entry: Any, key: str) -> Any:
    """What an object has under a key; None where it is no object."""
    return entry.get(key) if isinstance(entry, dict) else None


def _is(path: Path, digest: Any) -> bool:
    return isinstance(digest, str) and sha256_within(path, LARGEST_CODE) == digest
