"""What a trial's JSON files say, checked where it is read: their names become paths, their figures scores."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import focgen
from focgen.diagnosis.model import VERDICT
from focgen.errors import InputError
from focgen.journal import finish
from focgen.jsontext import fits, read_json
from focgen.trials.patterns import SUITES

SIGNALS = ("C", "B", "A")
_NUMBER = re.compile(r"[0-9]{4,9}")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_LOG = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")  # a file's name, never a path
_GIVEN = re.compile(rf"rig\.toml|controller\.toml|logs/{_LOG.pattern}")
_VERSION = re.compile(r"([0-9]{1,9})\.([0-9]{1,9})\.([0-9]{1,9})(?![0-9])")
_FIRST = (0, 1, 0)  # no trial is of an earlier version
_WORD = re.compile(r"\w+")
_ANEW = "make the cases anew"

_FACTS = {"suite": str, "signals": str, "seed": int, "commitments": dict}
_KINDS = {"kinds?": [str]}
_TRUTH = {"effect": _WORD, "stage": str, "visible": bool, "severity": str, "form": str}
_LABEL = {"kind": str, "suite": str, "truth": [_TRUTH], "floor": float, "unseen": dict, "given?": dict}
_DESIGN = {"tied?": [str], "resolves?": [str]}
_ACHIEVED = {"achieved": (float, None), "sha256": str}
_OUTCOME = {
    "status": re.compile("done|failed"),
    "seconds": (float, None),
    "fault": (str, None),
    "sha256?": str,
}
_DIAGNOSIS = {
    "verdict": VERDICT,
    "where?": ({"stage?": (str, None)}, None),
    "causes?": ([{"candidates": [{"effect": str, "confidence": float}]}], None),
    "next_experiment?": ({"what?": str, "why?": str}, None),
    "shrink?": (float, None),
    "shrink_interval?": ([float], None),
    "fits?": ([{"effect": str, "error": float}], None),
    "gap": {"refitted": float, "explained": float, "floor": float},
}

_RESULTS = ("runs", "oracle", "asked")  # where cases' results are exchanged


@dataclass(frozen=True)
class Facts:
    """A trial: ``suite``, ``signals`` and ``seed`` as it was made with, and each case's commitment by its
    number ("0001"); ``kinds``: of its cases, none where an earlier version made it.
    """

    suite: str
    signals: str
    seed: int
    commitments: dict[str, str]
    kinds: tuple[str, ...] = ()


def facts_of(folder: Path) -> Facts:
    """The content of trial.json, once what a kill has left in the trial is finished. Raises InputError where
    the folder holds no trial, or one whose trial.json is not as it was written.
    """
    path = folder / "trial.json"
    finish_all(folder)
    if not path.is_file():
        raise InputError(str(folder), "holds no trial", "make one by `focgen trial make`")
    found = read_json(path, _ANEW)
    if not fits(found, _FACTS | _KINDS):
        raise InputError(str(path), f"is no trial: it needs {', '.join(_FACTS)}", _ANEW)
    _check_version(path, found.get("focgen", focgen.__version__))
    facts = Facts(**{key: found[key] for key in _FACTS}, kinds=tuple(found.get("kinds", ())))
    if facts.suite not in SUITES or facts.signals not in SIGNALS or facts.seed < 0:
        what = f"suite {facts.suite!r}, signals {facts.signals!r}, seed {facts.seed} are none of a trial's"
        raise InputError(str(path), what, _ANEW)
    for number, digest in facts.commitments.items():
        if not fits(number, _NUMBER):
            raise InputError(str(path), f"calls a case {number!r}, which is no number such as 0001", _ANEW)
        if not fits(digest, _DIGEST):
            raise InputError(str(path), f"has no SHA-256 for case {number}", _ANEW)
    return facts


def _check_version(path: Path, said: object) -> None:
    """Raise InputError for a trial that says it is of a version that there was not, or of a later one: who
    makes, runs and scores cases in another way has other figures."""
    known = isinstance(said, str) and _FIRST <= _release(said) <= _release(focgen.__version__)
    if said != focgen.__version__ and not known:
        what = f"says that focgen {str(said)[:20]!r} made it, and this is {focgen.__version__}"
        raise InputError(
            str(path), what.replace(";", ","), f"put back the one the cases were made with, or {_ANEW}"
        )


def _release(version: str) -> tuple[int, ...]:
    """The three numbers of a version; none of what is no version."""
    found = _VERSION.match(version)
    return tuple(map(int, found.groups())) if found else ()


def finish_all(folder: Path) -> bool:
    """Finish what killed commands have begun in a trial; whether there was something."""
    finished = [finish(part) for part in (folder, *(folder / name for name in _RESULTS))]
    return any(finished)


def is_number(name: str) -> bool:
    """Whether a case may be called so."""
    return fits(name, _NUMBER)


def sealed_label(path: Path) -> tuple[str, dict[str, Any]]:
    """Salt and label of a sealed case. Raises InputError where the file holds none."""
    found = read_json(path, _ANEW)
    if not fits(found, {"salt": str, "label": _LABEL}) or not found["salt"].isascii():
        raise InputError(str(path), "holds no label", _ANEW)
    label = found["label"]
    if not fits(label.get("design") or {}, _DESIGN):
        raise InputError(str(path), "has a design that is none", _ANEW)
    for name, digest in label["unseen"].items():
        if not fits(name, _LOG) or not fits(digest, _DIGEST):
            raise InputError(str(path), f"names {name!r}, which is no unseen log of the case", _ANEW)
    for name, digest in label.get("given", {}).items():
        if not fits(name, _GIVEN) or not fits(digest, _DIGEST):
            raise InputError(str(path), f"names {name!r}, which is no file of the case", _ANEW)
    return found["salt"], label


def outcome_in(run: Path) -> dict[str, Any] | None:
    """What happened in a run; None where it left no word."""
    made: dict[str, Any] | None = _found(run / "outcome.json", _OUTCOME)
    return made


def diagnosis_in(run: Path) -> dict[str, Any] | None:
    """The diagnosis of a run; None where there is none, or none that can be judged."""
    found = _found(run / "diagnosis.json", _DIAGNOSIS)
    interval = (found or {}).get("shrink_interval")
    stated = [c["confidence"] for one in (found or {}).get("causes") or () for c in one["candidates"]]
    sound = (interval is None or len(interval) == 2) and all(0.0 <= one <= 1.0 for one in stated)
    return found if sound else None


def _found(path: Path, shape: Any) -> Any:
    try:
        found = read_json(path, _ANEW)
    except InputError:
        return None
    return found if fits(found, shape) else None


def achieved_in(run: Path, of: str) -> tuple[float | None] | None:
    """The achieved shrink that was kept beside a run, which may be None; no tuple where none was kept that is
    ``of`` this result and these logs, as it was kept."""
    found = _found(run / "achieved.json", _ACHIEVED)
    value = None if found is None else found["achieved"]
    return (value,) if found is not None and found == kept_achieved(value, of) else None


def kept_achieved(value: float | None, of: str) -> dict[str, Any]:
    """What is kept beside a run of the shrink that it achieved."""
    seal = hashlib.sha256(f"{of}\n{json.dumps(value)}".encode()).hexdigest()
    return {"achieved": value, "sha256": seal}
