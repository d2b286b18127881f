"""Sealing a label: the case carries only the hash of it, committed to before any diagnosis."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from focgen.custody import sha256_within
from focgen.errors import InputError
from focgen.textfile import LARGEST_LOG
from focgen.trials.belongs import logs_of_case
from focgen.trials.facts import sealed_label


def canonical(label: dict[str, Any]) -> bytes:
    """The bytes a label is hashed as."""
    return json.dumps(label, sort_keys=True, separators=(",", ":"), ensure_ascii=True).encode("ascii")


def commitment(salt: str, label: dict[str, Any]) -> str:
    """SHA-256 of salt and label, hexadecimal."""
    return hashlib.sha256(salt.encode("ascii") + canonical(label)).hexdigest()


def sealed(salt: str, label: dict[str, Any]) -> str:
    """The text of a sealed label's file."""
    return json.dumps({"salt": salt, "label": label}, indent=1, sort_keys=True) + "\n"


def unseal(path: Path, committed: str, unseen: Path, case: Path) -> dict[str, Any]:
    """The label, if it, the unseen logs and what the ``case`` gives are what was committed to. Raises
    InputError where not."""
    salt, label = sealed_label(path)
    if commitment(salt, label) != committed:
        raise InputError(str(path), "is not the label that was committed to", "make the cases anew")
    _check_committed(unseen, label["unseen"])
    given = label.get("given")  # earlier versions committed to the label and the unseen logs alone
    if given is not None:
        _check_committed(case, given)
        _check_no_more(case, given)
    return label


def _check_committed(folder: Path, digests: Mapping[str, str]) -> None:
    for name, digest in digests.items():
        if file_hash(folder / name) != digest:
            raise InputError(
                str(folder / name), "is not the file that was committed to", "make the cases anew"
            )


def _check_no_more(case: Path, given: Mapping[str, str]) -> None:
    """Raise InputError where a case has a log or a controller that it was not made with."""
    there = [*logs_of_case(case), *case.glob("controller.toml")]
    for path in there:
        if path.relative_to(case).as_posix() not in given:
            raise InputError(str(path), "is no part of the case as it was made", "move it away")


def file_hash(path: Path) -> str:
    """SHA-256 of a file, hexadecimal. Raises InputError where it is no file that can be a log."""
    found = sha256_within(path, LARGEST_LOG)
    if found is None:
        raise InputError(str(path), "is no file that can be read as a log", "make the cases anew")
    return found
