"""Which case a kept result is of: a diagnosis is of the rig and the logs that it was given, and of no other.

``outcome.json`` of a run carries a hash of the case as it was copied, of what else the diagnosis was told,
and of what came out. So the result of another case, of one that was changed since, or one that was edited is
told from its own. It is a record, not a seal: whoever edits both may write what he likes. A result of an
earlier version carries none, and is taken for its place's.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from focgen.custody import sha256_within
from focgen.textfile import LARGEST_JSON, LARGEST_LOG
from focgen.trials.facts import outcome_in

_JUDGED = ("diagnosis.json", "refitted.toml", "augmented.toml", "next_experiment.csv")
_SEAL = "sha256"


def case_digest(case: Path, *told: str) -> str:
    """SHA-256 of a case's files and of what the diagnosis is ``told`` beside them."""
    return _digest([[[name, sha256_within(case / name, LARGEST_LOG)] for name in _names(case)], told])


def _names(folder: Path) -> Iterator[str]:
    """Yield the files of a folder and of those in it, in one order everywhere."""
    found = (Path(at, name) for at, _, names in os.walk(folder) for name in names)
    yield from sorted(path.relative_to(folder).as_posix() for path in found)


def mark(run: Path, case: str) -> None:
    """Have a run that has just ended say of which ``case`` it is, a :func:`case_digest`."""
    found = outcome_in(run)
    if found is not None:
        text = json.dumps({**found, _SEAL: _seal(run, found, case)}) + "\n"
        (run / "outcome.json").write_text(text, encoding="utf-8")


def is_of(run: Path, case: str) -> bool:
    """Whether what lies in the folder of a run is of ``case`` and as it was kept."""
    found = outcome_in(run)
    return found is not None and found.get(_SEAL) in (None, _seal(run, found, case))


def result_digest(run: Path, *more: str) -> str:
    """SHA-256 of what came out of a run, and of ``more`` that something was reckoned from."""
    return _digest([[[name, sha256_within(run / name, LARGEST_JSON)] for name in _JUDGED], more])


def _seal(run: Path, outcome: dict[str, Any], case: str) -> str:
    said = [outcome[key] for key in ("status", "seconds", "fault")]
    return _digest([case, said, result_digest(run)])


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value).encode()).hexdigest()
