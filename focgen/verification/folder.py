"""A generated folder read back: rendered anew from what it holds, and compared byte for byte."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from focgen.codegen.generate import folder_files
from focgen.codegen.kernels import PORTABLE, Kernels
from focgen.codegen.manifest import sha256
from focgen.codegen.neighbours import others
from focgen.codegen.packages.archive import DIGEST, compare_archive
from focgen.control.files import read_controller
from focgen.custody import followed, sha256_within
from focgen.errors import InputError
from focgen.journal import finish
from focgen.output import write_files
from focgen.plan.build import build_plan
from focgen.plan.plan import ErrorBound, Plan
from focgen.scratch import temporary_folder
from focgen.textfile import LARGEST_CODE, LARGEST_SETTING, holds, read_regular
from focgen.verification.recorded import AGAIN, Recorded, read_recorded
from focgen.verification.remembered import REMEMBERED, remembered

_EXAMPLES = ("example/", "examples/", "extras/")
_MOST = 8  # strangers that are named


@dataclass(frozen=True, eq=False)
class GeneratedFolder:
    """``plan`` from the folder's own controller.toml; ``bound`` as the manifest claims it; ``selftest``:
    whether it has NAME_selftest.c; ``kernels``: how it computes its sums.

    ``files``: name and content of every file, rendered anew from controller.toml and the manifest's options.
    ``differences``: what the folder has edited of them; ``notes``: what else is in it, or is not;
    ``digests``: SHA-256 of what stands there under the names that count, by name; "" of a file too large.
    """

    path: Path
    plan: Plan
    bound: ErrorBound
    differences: tuple[str, ...]
    selftest: bool = False
    kernels: Kernels = PORTABLE
    files: Mapping[str, str | bytes] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    digests: Mapping[str, str] = field(default_factory=dict)


def read_folder(path: str | Path) -> GeneratedFolder:
    """Read a generated folder. Raises InputError where it is none, lacks a file, or was made by another
    version of focgen. Nothing of it is compiled.
    """
    path = Path(path)
    finish(path)
    recorded = read_recorded(path)
    controller = read_controller(path / "controller.toml")
    memory = recorded.memory, recorded.tolerance, recorded.horizon, recorded.operator, recorded.band
    plan = build_plan(
        controller, recorded.arithmetic, recorded.length, recorded.name, *memory, recorded.tunable
    )
    given = _bytes(path / "controller.toml")
    files = folder_files(plan, given, recorded.selftest, recorded.kernels, recorded.floats, recorded.package)
    for name in files:
        if not beside(name) and not (path / name).is_file():
            raise InputError(str(path), f"lacks {name}", AGAIN)
    built = compare_archive(path / f"{plan.name}.fmu", plan.name, files, recorded.package.fmi)
    differences = (*_edited(path, files, recorded), *built.differences)
    notes = (*_notes(path, files, plan.name), *built.notes, *followed(path / "controller.toml", path))
    made = recorded.selftest, recorded.kernels, files
    return GeneratedFolder(path, plan, recorded.bound, differences, *made, notes, _digests(path, plan, files))


def _digests(path: Path, plan: Plan, files: Mapping[str, str | bytes]) -> dict[str, str]:
    """Of what was compared: C, headers, manifest and controller.toml, and an FMU where there is one."""
    names = [name for name in (*files, f"{plan.name}.fmu") if not beside(name) or name.endswith(".fmu")]
    return {
        name: sha256_within(path / name, LARGEST_CODE) or ""
        for name in sorted(names)
        if (path / name).is_file()
    }


def beside(name: str) -> bool:
    """Whether nothing of the controller is compiled from this file: a text, a build file, an example. These
    are the user's to change."""
    if name in ("manifest.json", "controller.toml"):
        return False
    return name.startswith(_EXAMPLES) or not name.endswith((".c", ".h"))


@contextmanager
def sources(read: GeneratedFolder) -> Iterator[Path]:
    """The folder to compile from: a new one that holds what was rendered and nothing else, so that no file
    laid beside it takes part; the folder itself where it has been edited.
    """
    if read.differences:
        yield read.path
        return
    with temporary_folder() as scratch:
        write_files(scratch, read.files)
        yield scratch


def _bytes(path: Path) -> bytes:
    try:
        return read_regular(path, LARGEST_SETTING)
    except OSError as reason:
        raise InputError(str(path), f"cannot be read ({reason.strerror})", AGAIN) from None


def _same_bytes(path: Path, content: str | bytes) -> bool:
    return holds(path, content if isinstance(content, bytes) else content.encode("utf-8"))


def _edited(path: Path, files: Mapping[str, str | bytes], recorded: Recorded) -> Iterator[str]:
    """Yield what is not as it is rendered, of the files that count."""
    digest = recorded.content["inputs"].get("controller.toml")
    if digest != sha256(files["controller.toml"]):
        yield "controller.toml: is not the one that the folder was made from"
    for name, content in files.items():
        if beside(name) or name in ("manifest.json", "controller.toml") or _same_bytes(path / name, content):
            continue
        yield f"{name}: is not what focgen writes for this controller.toml"
    if not _same_bytes(path / "manifest.json", files["manifest.json"]):
        found = tuple(_differences(json.loads(files["manifest.json"]), recorded.content, ""))
        yield from found or ("manifest.json: has other bytes than were written",)


def _notes(path: Path, files: Mapping[str, str | bytes], controller: str) -> Iterator[str]:
    """Yield what nothing is compiled from, where it is not as it was written, and what does not belong."""
    for name in filter(beside, files):
        if not (path / name).is_file():
            yield f"{name}: is missing"
        elif not _same_bytes(path / name, files[name]):
            yield f"{name}: has been edited"
    beside_it = dict(others(path, controller))
    folders = _folders([*files, *(name for own in beside_it.values() for name in own)])
    for other in sorted(beside_it):
        its = sorted(name for name in beside_it[other] - files.keys() if (path / name).is_file())
        what = f"stands here as well and was not looked at ({', '.join(its)})"
        yield f"{other}: {what}; to verify it, give it its own folder"
    known = {
        *files,
        *folders,
        *([] if remembered(path / REMEMBERED) is None else [REMEMBERED]),
        *(name for own in beside_it.values() for name in own),
        *(name for other, own in beside_it.items() if any(map(_of_fmu, own)) for name in _archive(other)),
        *(_archive(controller) if any(map(_of_fmu, files)) else ()),
    }
    found = [
        one for folder in sorted(folders) if (path / folder).is_dir() for one in (path / folder).iterdir()
    ]
    strangers = sorted(name for one in found if (name := one.relative_to(path).as_posix()) not in known)
    yield from (f"{_shown(name)}: does not belong to the folder" for name in strangers[:_MOST])
    if len(strangers) > _MOST:
        yield f"{len(strangers) - _MOST} more files do not belong to the folder"


def _folders(names: Iterable[str]) -> set[str]:
    """The folders that files lie in."""
    return {parent.as_posix() for name in names for parent in Path(name).parents}


def _archive(controller: str) -> tuple[str, str]:
    return f"{controller}.fmu", f"{controller}.fmu{DIGEST}"


def _of_fmu(name: str) -> bool:
    return name.startswith("fmu/")


def _differences(expected: Any, found: Any, place: str) -> Iterator[str]:
    """Yield every place where the manifest is not what the plan gives."""
    if isinstance(expected, dict) and isinstance(found, dict):
        for key in sorted(expected.keys() | found.keys()):
            where = f"{place}.{_shown(key)}" if place else _shown(key)
            if key not in found or key not in expected:
                yield f"manifest.json: {where} is {'missing' if key in expected else 'unknown'}"
            else:
                yield from _differences(expected[key], found[key], where)
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        for i, (one, other) in enumerate(zip(expected, found)):
            yield from _differences(one, other, f"{place}[{i}]")
    elif not _same(expected, found):
        yield f"manifest.json: {place} is {_short(found)}, the controller gives {_short(expected)}"


def _same(expected: Any, found: Any) -> bool:
    """Equal in every digit and in type: every machine finds the same."""
    return type(expected) is type(found) and expected == found


def _shown(name: str) -> str:
    """A name that somebody else has given, on one line."""
    return "".join(char if char.isprintable() else "?" for char in name)[:60]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
