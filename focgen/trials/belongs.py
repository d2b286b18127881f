"""Which case a kept result is of: a diagnosis is of the rig and the logs that it was given, and of no other.

``outcome.json`` of a run carries a hash of the case as it was copied, of what else the diagnosis was told,
and of what came out. So the result of another case, of one that was changed since, or one that was edited is
told from its own. It is a record, not a seal: whoever edits both may write what he likes. A result of an
earlier version carries none, and is taken for its place's.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from focgen.custody import sha256_within
from focgen.diagnosis.drawn import FILE
from focgen.diagnosis.write import PICTURES
from focgen.errors import InputError
from focgen.scratch import real
from focgen.textfile import LARGEST_JSON, LARGEST_LOG
from focgen.trials.facts import Facts, is_number, outcome_in

_JUDGED = ("diagnosis.json", "refitted.toml", "augmented.toml", "next_experiment.csv")
_KEPT = (*_JUDGED, FILE, *PICTURES, "outcome.json", "achieved.json")
_OF_SYSTEMS = (".DS_Store", "Thumbs.db", "desktop.ini", ".directory")  # left where somebody looks
_BEGINS = (".focgen-", "._", ".nfs", ".fuse_hidden")  # scratch of ours, forks of a Mac, files still open
_SEAL = "sha256"
_ALONE = ("commitment.txt", "controller.toml", "rig.toml")


def case_digest(case: Path, *told: str) -> str:
    """SHA-256 of a case's files and of what the diagnosis is ``told`` beside them. Raises InputError where
    one cannot be read: nothing can be said of its results then."""
    files = [(path.relative_to(case).as_posix(), _digest_of(path)) for path in files_of_case(case)]
    return _digest([sorted(files), told])


def _digest_of(path: Path) -> str:
    found = sha256_within(path, LARGEST_LOG)
    if found is None:
        what = "cannot be read as a file of a case"
        raise InputError(str(path), what, "check its rights, or make the cases anew")
    return found


def files_of_case(case: Path) -> list[Path]:
    """What a case consists of, and nothing else that lies in its folder: a system leaves its own things where
    somebody looks (``.DS_Store``), and people their notes. Raises InputError where its logs cannot be
    listed."""
    return [*(case / name for name in _ALONE if (case / name).exists()), *logs_of_case(case)]


def logs_of_case(case: Path) -> list[Path]:
    """The logs of a case, in the order of their names; none has a name that begins with a point. A case that
    is gone has none. Raises InputError where they cannot be listed."""
    if not (case / "logs").exists():
        return []
    try:
        return sorted(path for path in (case / "logs").iterdir() if not path.name.startswith("."))
    except OSError as reason:
        what = f"cannot be read ({reason.strerror})"
        raise InputError(str(case / "logs"), what, "check its rights, or make the cases anew") from None


def copy_case(case: Path, to: Path) -> None:
    """The files of a case in a new folder, without their rights: what is read only is written beside and
    removed there. Raises OSError where they cannot be copied."""
    for path in files_of_case(case):
        place = to / path.relative_to(case)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, place)


def check_listed(trial: Path, facts: Facts) -> None:
    """Raise InputError where a sealed case lies in a trial whose list does not name it: a table of the others
    would pass for one of the trial."""
    for path in sorted((trial / "sealed").glob("*/label.json")):
        number = path.parent.name
        if is_number(number) and number not in facts.commitments:
            what = "is of a case that trial.json does not name, and that no score would count"
            remedy = f"put trial.json back, or move cases/{number} and its seal away"
            raise InputError(str(path), what, remedy)


def check_made_for(trial: Path, number: str, label: Mapping[str, Any], facts: Facts) -> None:
    """Raise InputError where the label of a case says that it was made for another suite, or with other
    signals, than its trial does: each has rows and targets of its own."""
    for key, said in (("suite", facts.suite), ("signals", facts.signals)):
        if label.get(key, said) != said:
            what = f"says {key} {said!r}, and the label of case {number} says {str(label[key])[:20]!r}"
            raise InputError(str(trial / "trial.json"), what, "put back the one the cases were made with")


def check_only_results(trial: Path, kind: str, number: str, depth: int = 1) -> None:
    """Raise InputError where TRIAL/KIND/NUMBER, which a result takes the place of, holds what no run has
    written: it would go with the former result. What a system leaves there (``.DS_Store``) may; what somebody
    hid by a point may not.

    ``depth``: 1 of a folder of a run, 2 of a folder of such folders.
    """
    place = trial / kind / number
    outside = place.is_symlink() or not real(place.parent).is_relative_to(real(trial))
    if outside or not place.is_dir():  # told where it is replaced
        return
    for path in sorted(place.rglob("*")):
        parts = path.relative_to(place).parts
        own = path.name in _KEPT if len(parts) == depth else len(parts) < depth and path.is_dir()
        if not own and not any(part in _OF_SYSTEMS or part.startswith(_BEGINS) for part in parts):
            what = "is no part of a result, and would go with it where the case is diagnosed anew"
            raise InputError(str(path), what, "move it away")


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
