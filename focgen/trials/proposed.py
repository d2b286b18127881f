"""What proposals are worth: the proposed experiment made by the true rig, and every other of the menu.

A case that ended in a set is remade from its trial's seed, its true rig makes the experiment after the
session, and the session with it is diagnosed as blind as before. An experiment for which a further signal is
to be logged is diagnosed by itself: what the session lacks it cannot be compared in. Results go to
DIR/asked/NNNN/WHICH; *resolved* is a case whose every true effect is then named, and nothing else.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from focgen.arrays import Array
from focgen.diagnosis.problem.segments import cuts
from focgen.diagnosis.proposals.limits import limits_of
from focgen.diagnosis.proposals.menu import menu
from focgen.errors import InputError
from focgen.jsontext import fits, read_json
from focgen.output import replace_folder
from focgen.present import present
from focgen.progress import track
from focgen.rig.files import read_rig, rig_table
from focgen.rig.replay import experiments
from focgen.rig.rig import Rig
from focgen.scratch import temporary_folder
from focgen.textfile import LARGEST_LOG, read_regular
from focgen.trials.belongs import (
    case_digest,
    check_only_results,
    copy_case,
    is_of,
    logs_of_case,
    mark,
    result_digest,
)
from focgen.trials.cases import Case
from focgen.trials.facts import Facts, diagnosis_in, outcome_in
from focgen.trials.judging import PROPOSED, judge
from focgen.trials.make import DEFAULT_KINDS, Drawing
from focgen.trials.recording import as_csv
from focgen.trials.run import blind_diagnosis, threads

_ANEW = "remove the case's folder in runs, and run the trial again"
_PROPOSAL = {"next_experiment": {"inputs": {"also_log": (str, None)}}}
_LIMIT = 900.0  # s for one diagnosis
_LAST = "zz_asked.csv"  # behind the session's logs, in the order of names


@dataclass(frozen=True, eq=False)
class _Asked:
    """An experiment to be made: its ``command`` (n,) at the rig's samples, and the role that is logged
    besides."""

    which: str
    command: Array
    also: str | None = None


def ask(folder: Path, facts: Facts, labels: dict[str, dict[str, Any]], jobs: int) -> None:
    """Have every case that ended in a set make its proposal and the menu, those not made yet. Raises
    InputError where a case is not what its seed gives."""
    waiting = [n for n in labels if _ends_in_set(folder, n) and not _answered(folder, n)]
    with threads(jobs) as pool:
        asked = [pool.submit(_ask_case, folder, facts, n, labels[n]) for n in waiting]
        for one in track(asked, "proposals"):
            one.result()


def resolved(folder: Path, number: str, label: dict[str, Any]) -> dict[str, bool]:
    """By experiment asked, whether it resolved the case; nothing where none was made."""
    found = {}
    for run in sorted((folder / "asked" / number).glob("*")):
        outcome = outcome_in(run)
        if outcome is not None and is_of(run, _asked_of(folder, number, run.name)):
            judged = judge(number, label, outcome, diagnosis_in(run))
            found[run.name] = judged.verdict == "named" and judged.found and not judged.wrongly_named
    return found


def _answered(folder: Path, number: str) -> bool:
    """Whether the experiments have been made for the case and its result as they are."""
    found = [run for run in (folder / "asked" / number).glob("*") if run.is_dir()]
    return bool(found) and all(is_of(run, _asked_of(folder, number, run.name)) for run in found)


def _asked_of(folder: Path, number: str, which: str) -> str:
    """What an experiment that was asked for is of: the case, what a run proposes for it, and its name."""
    return case_digest(folder / "cases" / number, result_digest(folder / "runs" / number), which)


def _ends_in_set(folder: Path, number: str) -> bool:
    said = diagnosis_in(folder / "runs" / number)
    return (
        bool(said) and present(said)["verdict"] == "set" and present(said).get("next_experiment") is not None
    )


def _ask_case(folder: Path, facts: Facts, number: str, label: dict[str, Any]) -> None:
    case = _remade(folder, facts, number, label)
    if case.bench is None:
        return
    check_only_results(folder, "asked", number, depth=2)
    rng = np.random.default_rng([facts.seed, int(number), 1])
    with temporary_folder("asked") as scratch:
        found = scratch / "found"
        for asked in _experiments(folder, number):
            columns = case.bench.further(asked.command, rng)
            blind = scratch / asked.which
            _lay_out(folder / "cases" / number, blind, case, asked, columns)
            blind_diagnosis(blind, found / asked.which, _LIMIT)
            mark(found / asked.which, _asked_of(folder, number, asked.which))
        replace_folder(found, folder / "asked" / number, folder)


def _remade(folder: Path, facts: Facts, number: str, label: dict[str, Any]) -> Case:
    kinds = facts.kinds or DEFAULT_KINDS[facts.suite]
    case, _ = Drawing(len(facts.commitments), facts.seed, facts.signals, facts.suite, kinds).case(int(number))
    sealed = {key: value for key, value in label.items() if key not in ("unseen", "given")}
    if json.loads(json.dumps(case.label)) != sealed:
        raise InputError(str(folder / "cases" / number), "is not what its seed gives", "make the cases anew")
    return case


def _experiments(folder: Path, number: str) -> Iterator[_Asked]:
    """What was proposed, and the menu for this rig and these logs."""
    case, run = folder / "cases" / number, folder / "runs" / number
    yield _proposed(run)
    rig = read_rig(case / "rig.toml")
    logs = experiments(rig, logs_of_case(case))
    for i, choice in enumerate(menu(limits_of(rig, logs, cuts(logs)[0]).faster)):
        yield _Asked(f"menu{i}", np.repeat(choice.input, choice.limits.coarse))


def _proposed(run: Path) -> _Asked:
    """What a run proposes. Raises InputError where its files are not as a diagnosis writes them."""
    told = read_json(run / "diagnosis.json", _ANEW)
    path = run / "next_experiment.csv"
    if not fits(told, _PROPOSAL):
        raise InputError(str(run / "diagnosis.json"), "proposes no experiment as it was written", _ANEW)
    try:
        lines = read_regular(path, LARGEST_LOG).decode("ascii").splitlines()
        table = np.loadtxt(lines, delimiter=",", skiprows=1, ndmin=2)
        command = table[:, 1]
    except (OSError, ValueError, IndexError):
        raise InputError(str(path), "is no table of time and command", _ANEW) from None
    if not np.isfinite(command).all():
        raise InputError(str(path), "has a command that is no number", _ANEW)
    return _Asked(PROPOSED, command, told["next_experiment"]["inputs"]["also_log"])


def _lay_out(given: Path, blind: Path, case: Case, asked: _Asked, columns: dict[str, Any]) -> None:
    """The case as it was, with the log of one more experiment; or that one alone, with a further column."""
    copy_case(given, blind)
    rig = read_rig(blind / "rig.toml")
    if asked.also:
        shutil.rmtree(blind / "logs")
        (blind / "logs").mkdir()
        rig = _logging(rig, asked.also)
        (blind / "rig.toml").write_text(tomlkit.dumps(rig_table(rig)), encoding="utf-8")
    text = as_csv([("asked", columns)], rig.signals, case.recorder.time_unit, rig.signals.run is not None)
    (blind / "logs" / _LAST).write_text(text, encoding="utf-8")


def _logging(rig: Rig, role: str) -> Rig:
    column: dict[str, Any] = {role: f"{role}_asked"}
    return replace(rig, signals=replace(rig.signals, **column))
