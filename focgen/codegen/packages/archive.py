"""``NAME.fmu``: the zip of an FMU's description, its C, and what this computer's compiler makes of that.

Everything in it but the binary is rendered, and the dates are fixed: the same input and the same compiler
give the same bytes.
"""

from __future__ import annotations

import hashlib
import io
import os
import platform
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from focgen.compiler import compile_shared
from focgen.custody import sha256_within
from focgen.errors import InputError
from focgen.present import present
from focgen.scratch import temporary_folder
from focgen.textfile import LARGEST_CODE, holds, read_regular

_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can tell
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden")
_SYSTEMS = {"Linux": ("linux", "so"), "Darwin": ("darwin", "dylib"), "Windows": ("windows", "dll")}
_MACHINES = {"AMD64": "x86_64", "arm64": "aarch64", "ARM64": "aarch64"}
_OLD = {"x86_64-linux": "linux64", "x86_64-darwin": "darwin64", "x86_64-windows": "win64"}  # of FMI 2.0
_BINARIES = "binaries/"
_LOCAL, _LISTED, _END = 30, 46, 22  # bytes of a zip's headers
DIGEST = ".sha256"
"""Ends the name of the file beside an archive that holds its SHA-256, as ``sha256sum -c`` reads it."""


@dataclass(frozen=True)
class Compared:
    """How a ``NAME.fmu`` differs from what its folder gives, and what is to be said of it besides."""

    differences: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def archived(name: str, files: Mapping[str, str | bytes], fmi: int | None) -> dict[str, bytes]:
    """The archive by its name in the folder, from the folder's other ``files``; none where ``fmi`` is None.

    Raises BuildError where there is no C compiler, or it refuses the C.
    """
    if fmi is None:
        return {}
    inside = _members(name, files, fmi)
    system, ending = _SYSTEMS.get(platform.system(), ("linux", "so"))
    machine = f"{_MACHINES.get(platform.machine(), platform.machine())}-{system}"
    place = f"{_BINARIES}{machine if fmi == 3 else _OLD.get(machine, machine)}/{name}.{ending}"
    whole = _zip({**inside, place: _binary(name, inside, fmi)})
    return {f"{name}.fmu": whole, f"{name}.fmu{DIGEST}": f"{_sha256(whole)}  {name}.fmu\n".encode("ascii")}


def _sha256(whole: bytes) -> str:
    return hashlib.sha256(whole).hexdigest()


def _members(name: str, files: Mapping[str, str | bytes], fmi: int) -> dict[str, bytes]:
    """What the archive has beside its binary, by its name there."""
    found = {"modelDescription.xml": files["fmu/modelDescription.xml"]}
    found |= {f"sources/{file.removeprefix('fmu/')}": files[file] for file in files if _is_source(file, name)}
    if fmi == 3:
        found["sources/buildDescription.xml"] = files["fmu/buildDescription.xml"]
    found["documentation/licenses/license.txt"] = files["LICENSE"]
    return {file: text if isinstance(text, bytes) else text.encode("utf-8") for file, text in found.items()}


def _is_source(file: str, name: str) -> bool:
    """Of what the binary is compiled: the controller, the runtime's headers, the interface."""
    runtime = file.startswith("foc_") and file.endswith(".h")
    return runtime or file in (f"{name}.c", f"{name}.h", f"fmu/{name}_fmi2.c", f"fmu/{name}_fmi3.c")


def _binary(name: str, inside: Mapping[str, bytes], fmi: int) -> bytes:
    with temporary_folder() as scratch:
        for file in inside:
            if file.startswith("sources/"):
                (scratch / Path(file).name).write_bytes(inside[file])
        sources = [scratch / f"{name}_fmi{fmi}.c", scratch / f"{name}.c"]
        target = scratch / f"{name}.library"
        compile_shared(sources, target, _FLAGS, [scratch])
        return target.read_bytes()


def _zip(members: Mapping[str, bytes]) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(members, key=lambda file: (file != "modelDescription.xml", file)):
            entry = zipfile.ZipInfo(file, _DATE)
            entry.compress_type, entry.create_system = zipfile.ZIP_DEFLATED, 3
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, members[file])
    return made.getvalue()


def compare_archive(path: Path, name: str, files: Mapping[str, str | bytes], fmi: int | None) -> Compared:
    """Compare an archive with what is rendered; the binary, which no rule renders, is told of and not run."""
    if fmi is None:
        return Compared()
    if not path.is_file():
        return Compared(notes=(f"{path.name}: is missing",))
    try:
        with zipfile.ZipFile(path) as archive:
            faults = tuple(_faults(archive, _members(name, files, fmi), name))
        if not faults and not is_recorded(path):
            faults = (f"is not what was built, by {path.name}{DIGEST}",)
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, NotImplementedError, RuntimeError, EOFError):
        return Compared((f"{path.name}: is no zip that can be read",))
    return Compared(
        tuple(f"{path.name}: {fault}" for fault in faults),
        (f"{path.name}: its binary was not compared, only the C that it is made from",),
    )


def is_recorded(path: Path) -> bool:
    """Whether what stands beside an archive is its digest."""
    found = sha256_within(path, LARGEST_CODE)
    return holds(path.with_name(path.name + DIGEST), f"{found}  {path.name}\n".encode("ascii"))


def is_digest(path: Path) -> bool:
    """Whether a file holds what stands beside an archive, of whatever archive of that name."""
    line = re.compile(rf"[0-9a-f]{{64}}  {re.escape(path.name.removesuffix(DIGEST))}\n".encode())
    try:
        return line.fullmatch(read_regular(path, LARGEST_CODE)) is not None
    except (OSError, InputError):
        return False


def _faults(archive: zipfile.ZipFile, expected: Mapping[str, bytes], name: str) -> Iterator[str]:
    found = {entry.filename: entry for entry in archive.infolist()}
    for file, content in expected.items():
        if file not in found:
            yield f"lacks {file}"
        elif not _is(archive, found[file], content):
            yield f"{file} is not what focgen writes for this controller.toml"
    if any(file not in expected and not _is_binary(file, name) for file in found):
        yield "has files that do not belong to it"
    if len(found) < len(archive.infolist()):
        yield "has files of the same name"  # which of them is taken is the reader's choice
    if not _is_dense(archive):
        yield "has bytes that are no part of its files"


def _is(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, content: bytes) -> bool:
    """Whether a member holds these bytes; it is packed as :func:`_zip` does it, or taken to be another."""
    usual = entry.compress_type == zipfile.ZIP_DEFLATED and entry.file_size == len(content)
    return usual and archive.read(entry) == content


def _is_dense(archive: zipfile.ZipFile) -> bool:
    """Whether the members, their headers and the list of them are all that there is, as :func:`_zip` writes
    it."""
    at = 0
    for entry in sorted(archive.infolist(), key=lambda entry: entry.header_offset):
        if entry.header_offset != at or entry.extra or entry.comment:
            return False
        at += _LOCAL + len(entry.orig_filename) + entry.compress_size
    listed = sum(_LISTED + len(entry.orig_filename) for entry in archive.infolist())
    whole = present(archive.fp).seek(0, os.SEEK_END)
    return archive.start_dir == at and whole == at + listed + _END


def _is_binary(file: str, name: str) -> bool:
    """Whether a member is what one system's compiler has made of the C, in the place for that."""
    return re.fullmatch(rf"{_BINARIES}[0-9a-z_-]+/{re.escape(name)}\.(so|dylib|dll)", file) is not None
