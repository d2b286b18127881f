"""``focgen trial make``: a folder of sealed cases.

DIR/trial.json                    what was made, and each case's commitment
DIR/begun.json                    what is being made, until trial.json is there
DIR/cases/0001/rig.toml           the nominal rig
DIR/cases/0001/logs/*.csv         one session of the real one
DIR/cases/0001/controller.toml    closed-loop suites only
DIR/cases/0001/commitment.txt     SHA-256 of salt and label
DIR/sealed/0001/label.json        salt and label
DIR/sealed/0001/unseen/*.csv      logs that score the promise
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

import focgen
from focgen.arrays import Array
from focgen.control.files import controller_text
from focgen.errors import InputError
from focgen.journal import alone
from focgen.jsontext import read_json
from focgen.output import check_within, write_file, write_files
from focgen.progress import track
from focgen.rig.files import rig_table
from focgen.trials.cases import Case, make_case
from focgen.trials.closed_cases import make_closed_case
from focgen.trials.disturbed import DISTURBED, disturbed
from focgen.trials.engine.cases import make_engine_case
from focgen.trials.engine.machine import engine
from focgen.trials.facts import SIGNALS, facts_of, finish_all
from focgen.trials.patterns import STREAMS, SUITES
from focgen.trials.plan import CLOSED_KINDS, KINDS, Assignment, assignments
from focgen.trials.plants_cases import make_plants_case
from focgen.trials.recording import as_csv
from focgen.trials.sealing import commitment, sealed

DEFAULT_KINDS = {
    "full": KINDS,
    "short": KINDS,
    **dict.fromkeys(("closed", "engine", "plants", "loops"), CLOSED_KINDS),
    **dict.fromkeys(DISTURBED, KINDS),
    "sound": ("none", "parameters"),
}


_BEGUN = "begun.json"
MOST_CASES = 1_000_000
_POSITIVE = f"give positive numbers, at most {MOST_CASES} cases"


@dataclass(frozen=True)
class Made:
    """What ``trial make`` wrote: the folder, how many cases, and the commitment of each by its number."""

    folder: str
    suite: str
    signals: str
    seed: int
    cases: int
    commitments: dict[str, str]


@dataclass(frozen=True)
class Drawing:
    """What the cases of a trial are drawn by: the same gives the same cases, again and again."""

    cases: int
    seed: int
    signals: str
    suite: str
    kinds: tuple[str, ...]

    @cached_property
    def plan(self) -> list[Assignment]:
        """What each case is to be."""
        root = np.random.default_rng(self._roots)
        return assignments(self.cases, self.kinds, self.signals, self.suite, root)

    @property
    def _roots(self) -> list[int]:
        return [self.seed, ord(self.signals), STREAMS[self.suite]]

    def case(self, index: int) -> tuple[Case, str]:
        """Case number ``index``, from 1, and the salt that its commitment has."""
        rng, assignment = np.random.default_rng([*self._roots, index]), self.plan[index - 1]
        return _made(assignment, self.signals, self.suite, rng), _salt(rng)


def make(
    folder: str | Path,
    *,
    cases: int = 200,
    seed: int = 0,
    signals: str = "C",
    suite: str = "full",
    kinds: tuple[str, ...] | None = None,
) -> Made:
    """Make sealed cases; the same arguments give the same bytes, those of the suite "engine" on one machine.
    What a kill has interrupted, the same arguments finish.

    Raises InputError for arguments that make no sense, for a folder that holds a trial or part of another
    one, and where the physics engine is asked for but not installed.
    """
    folder = Path(folder)
    _check(cases, seed, signals, suite)
    kinds = tuple(kinds or DEFAULT_KINDS[suite])
    drawn = Drawing(cases, seed, signals, suite, kinds)
    total, facts = len(drawn.plan), _facts(drawn)
    if finish_all(folder) and (stands := _finished(folder, drawn)):
        return stands
    _begin(folder, {**facts, "cases": cases})
    commitments = {}
    for index in track(range(1, total + 1), "trial make"):
        case, salt = drawn.case(index)
        commitments[f"{index:04d}"] = _write(folder, f"{index:04d}", case, salt)
    whole = json.dumps({**facts, "commitments": commitments}, indent=1) + "\n"
    write_files(folder, {"trial.json": whole}, old=lambda: [folder / _BEGUN])
    return Made(str(folder), suite, signals, seed, cases, commitments)


def _finished(folder: Path, drawn: Drawing) -> Made | None:
    """The trial as the killed command would have left it, where it is the one that is asked for."""
    path, facts = folder / "trial.json", _facts(drawn)
    if not path.is_file():
        return None
    there, found = facts_of(folder), read_json(path, "make the cases anew")
    same = {key: found.get(key) for key in facts} == facts
    if not same or len(there.commitments) != len(drawn.plan):
        return None
    return Made(str(folder), drawn.suite, drawn.signals, drawn.seed, drawn.cases, dict(there.commitments))


def _facts(drawn: Drawing) -> dict[str, Any]:
    """What a trial says of how it was drawn."""
    return {
        "focgen": focgen.__version__,
        "suite": drawn.suite,
        "signals": drawn.signals,
        "seed": drawn.seed,
        "kinds": list(drawn.kinds),
    }


def _begin(folder: Path, facts: dict[str, Any]) -> None:
    """Write down what is made, ahead of the first case: so nothing of another trial gets among the cases, of
    one that is being made at this moment neither. Raises InputError where there is some."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with alone(folder):
            _check_begun(folder, facts)
            write_file(folder / _BEGUN, json.dumps(facts, indent=1) + "\n")
    except OSError as reason:
        raise InputError(
            str(folder), f"cannot be written ({reason.strerror})", "choose another folder"
        ) from None


def _check_begun(folder: Path, facts: dict[str, Any]) -> None:
    """Raise InputError where a folder holds cases, and not the first ones of this very trial."""
    if (folder / "trial.json").exists():
        raise InputError(str(folder), "already holds a trial", "choose another folder")
    begun, remedy = folder / _BEGUN, "choose another folder, or remove that one"
    holds = [name for name in ("cases", "sealed", "runs") if (folder / name).exists()]
    if begun.is_file() and read_json(begun, remedy) != facts:
        what = f"holds part of another trial, which {_BEGUN} tells of"
        raise InputError(str(folder), what, f"{remedy}; the same arguments as then finish it")
    if holds and not begun.is_file():
        what = f"holds {holds[0]}, and no {_BEGUN} says of which trial"
        raise InputError(str(folder), what, "choose another folder, or move it away")


def _made(assignment: Assignment, signals: str, suite: str, rng: np.random.Generator) -> Case:
    if suite in ("closed", "loops"):
        return make_closed_case(assignment, signals, rng, suite)
    if suite == "plants":
        return make_plants_case(assignment, signals, rng)
    if suite == "engine":
        return make_engine_case(assignment, signals, rng)
    case = make_case(assignment, signals, suite, rng)
    return disturbed(case, suite, rng) if suite in DISTURBED else case


def _check(cases: int, seed: int, signals: str, suite: str) -> None:
    if not 1 <= cases <= MOST_CASES or seed < 0:
        raise InputError("trial make", f"cannot make {cases} cases from seed {seed}", _POSITIVE)
    if signals not in SIGNALS:
        raise InputError("--signals", f"is {signals!r}", "choose C, B or A")
    if suite not in SUITES:
        raise InputError("--suite", f"is {suite!r}", f"choose one of {', '.join(SUITES)}")
    if suite == "engine":
        engine()


def _salt(rng: np.random.Generator) -> str:
    return hashlib.sha256(rng.bytes(32)).hexdigest()


def _write(folder: Path, number: str, case: Case, salt: str) -> str:
    logs, unseen = _files(case, case.logs), _files(case, case.unseen)
    given = {
        "rig.toml": tomlkit.dumps(rig_table(case.rig)),
        **{f"logs/{name}": text for name, text in logs.items()},
    }
    if case.controller:
        given["controller.toml"] = controller_text(case.controller)
    label = json.loads(json.dumps({**case.label, "unseen": _digests(unseen), "given": _digests(given)}))
    committed = commitment(salt, label)
    check_within(folder, [folder / part / number / "file" for part in ("cases", "sealed")])
    write_files(folder / "cases" / number, {**given, "commitment.txt": committed + "\n"})
    write_files(
        folder / "sealed" / number,
        {"label.json": sealed(salt, label), **{f"unseen/{name}": text for name, text in unseen.items()}},
    )
    return committed


def _digests(texts: Mapping[str, str]) -> dict[str, str]:
    return {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}


def _files(case: Case, experiments: list[tuple[str, dict[str, Array]]]) -> dict[str, str]:
    """File name → CSV; the names keep the order of the session."""
    signals, unit = case.rig.signals, case.recorder.time_unit
    if case.recorder.one_file:
        return {"session.csv": as_csv(experiments, signals, unit, True)}
    return {
        f"{i:02d}_{name}.csv": as_csv([(name, columns)], signals, unit, False)
        for i, (name, columns) in enumerate(experiments, start=1)
    }
