"""``focgen trial score``: unseal, verify, and score every row of the table beside its target.

Which cases a row counts, and what counts as right, is said by the row itself
(:data:`focgen.trials.rows.ROWS`) and by :mod:`focgen.trials.judging`. Intervals are 90 % intervals
over cases. A case without a diagnosis counts as a miss in every row; one not yet run may be left out.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from focgen.errors import FocgenError, InputError
from focgen.output import check_within, check_writable, write_file
from focgen.pools import pool
from focgen.progress import say, track
from focgen.replaced import check_own
from focgen.shown import Shown
from focgen.textfile import LARGEST_SETTING, read_regular
from focgen.trials import achieved, baselines
from focgen.trials.belongs import check_listed, check_made_for, result_digest
from focgen.trials.facts import Facts, achieved_in, diagnosis_in, facts_of, kept_achieved, outcome_in
from focgen.trials.judging import Judged, forgone, judge
from focgen.trials.proposed import ask, resolved
from focgen.trials.rows import Row, rows, stated_in
from focgen.trials.run import diagnose_case, is_its_own, outcome_of, processes, ran, threads
from focgen.trials.sealing import unseal
from focgen.trials.worker import oracle_possible


@dataclass(frozen=True)
class Scores:
    """The table of one trial: ``rows`` with figures, intervals and targets.

    ``cases`` were scored, ``failed`` of them without a diagnosis; ``waiting`` were left out.
    ``confusions`` truth → called → count (visible singles); ``stated``: (confidence, whether it is so) of the
    first candidate of every cause.
    """

    folder: str
    signals: str
    suite: str
    seed: int
    cases: int
    failed: int
    waiting: int
    rows: tuple[Row, ...]
    confusions: dict[str, dict[str, int]]
    stated: tuple[tuple[float, bool], ...]

    @property
    def reached(self) -> bool:
        """Whether every measured row with a target reaches it."""
        return all(row.reached is not False for row in self.rows)


@dataclass(frozen=True, repr=False)
class Summary(Shown):
    """The scores of several trials, in the order they were given."""

    sets: tuple[Scores, ...]

    @property
    def reached(self) -> bool:
        """Whether every set reaches all its targets."""
        return all(scores.reached for scores in self.sets)


def score(
    *folders: str | Path,
    oracle: bool = False,
    proposals: bool = False,
    baseline: bool = True,
    partial: bool = False,
    jobs: int | None = None,
) -> Summary:
    """Score trials that have been run.

    ``oracle``: also diagnose the singles and pairs knowing the effects; ``baseline``: also ask the residual
    correlation; ``proposals``: have the true rig of every case that ended in a set make the proposed
    experiment and those of the menu, and diagnose it again; ``partial``: leave cases out that have not been
    diagnosed yet, instead of counting them as misses; ``jobs``: processes at a time (default: the cores).

    Writes scores.json into each folder. Raises InputError where a label, a case or an unseen log is not what
    was committed to.
    """
    at_once = processes(jobs)
    asked = (oracle, proposals)
    return Summary(tuple(_scored(Path(folder), asked, baseline, partial, at_once) for folder in folders))


def _scored(folder: Path, asked: tuple[bool, bool], baseline: bool, partial: bool, jobs: int) -> Scores:
    facts = facts_of(folder)
    check_own([folder / "scores.json"])
    check_writable(folder / "scores.json")
    _check_results(folder, facts)
    check_listed(folder, facts)
    labels = {
        number: _unsealed(folder, number, facts)
        for number in facts.commitments
        if not partial or ran(folder / "runs" / number)
    }
    oracle, proposals = asked
    if oracle:
        _ask_oracle(folder, labels, jobs)
    if proposals:
        ask(folder, facts, labels, jobs)
    with pool(jobs) as called:
        waiting = [
            called.submit(_judged, folder, number, label, baseline) for number, label in labels.items()
        ]
        judged = [one.result() for one in track(waiting, "trial score")]
    scores = Scores(
        str(folder),
        facts.signals,
        facts.suite,
        facts.seed,
        len(judged),
        sum(j.verdict == "failed" for j in judged),
        len(facts.commitments) - len(judged),
        rows(judged, facts.signals),
        confusions(judged),
        tuple(stated_in(judged)),
    )
    content = {"scores": asdict(scores), "cases": [asdict(j) for j in judged]}
    write_file(folder / "scores.json", json.dumps(content, indent=1) + "\n")
    return scores


def _check_results(folder: Path, facts: Facts) -> None:
    """Raise InputError where a result is another case's, or of this one before it was changed, or was edited:
    it would be scored as if this case had it; and where links lead out of the trial."""
    for number in facts.commitments:
        run = folder / "runs" / number
        check_within(folder, [run / "outcome.json"])
        if not ran(run):
            continue
        _check_readable(run)
        if outcome_in(run) is None:
            say(f"trial score: {run} is damaged, so it counts as a miss; `focgen trial run` makes it anew")
        elif not is_its_own(folder, "runs", number):
            what = f"is not the result of case {number} as it is, or was edited"
            raise InputError(str(run), what, f"run `focgen trial run {folder}` again")


def _check_readable(run: Path) -> None:
    """Raise InputError where a result is there and its file cannot be opened: that is no miss of its case."""
    for path in (run / "outcome.json", run / "diagnosis.json"):
        if path.exists() and not os.access(path, os.R_OK):
            raise InputError(str(path), "cannot be read (Permission denied)", "check its rights")


def _unsealed(folder: Path, number: str, facts: Facts) -> dict[str, Any]:
    committed = facts.commitments[number]
    if _carried(folder / "cases" / number / "commitment.txt") != committed:
        raise InputError(
            str(folder / "cases" / number), "carries another commitment than the trial", "make the cases anew"
        )
    sealed = folder / "sealed" / number
    label = unseal(sealed / "label.json", committed, sealed / "unseen", folder / "cases" / number)
    check_made_for(folder, number, label, facts)
    return label


def _carried(path: Path) -> str:
    """The commitment that a case carries. Raises InputError where it carries none."""
    try:
        return read_regular(path, LARGEST_SETTING).decode("utf-8").strip()
    except (OSError, UnicodeDecodeError, InputError):
        raise InputError(str(path), "cannot be read", "make the cases anew") from None


def _ask_oracle(folder: Path, labels: dict[str, dict[str, Any]], jobs: int) -> None:
    if not oracle_possible():
        say("trial score: the diagnosis cannot be told the effect; no oracle")
        return
    wanted = [
        n
        for n, label in labels.items()
        if label["kind"] in ("single", "pair", "linear")
        and label["truth"]
        and not is_its_own(folder, "oracle", n, *_effects(label))
    ]
    with threads(jobs) as pool:
        asked = [
            pool.submit(
                diagnose_case,
                folder,
                "oracle",
                n,
                900.0,
                _effects(labels[n]),
            )
            for n in wanted
        ]
        for one in track(asked, "oracle"):
            one.result()


def _effects(label: dict[str, Any]) -> tuple[str, ...]:
    return tuple(t["effect"] for t in label["truth"])


def _judged(folder: Path, number: str, label: dict[str, Any], baseline: bool) -> Judged:
    run, told = folder / "runs" / number, folder / "oracle" / number
    outcome, diagnosis = outcome_of(run), _diagnosis_of(run)
    known = is_its_own(folder, "oracle", number, *_effects(label))
    single = label["kind"] == "single" and label["suite"] not in ("closed", "loops")
    return judge(
        number,
        label,
        outcome,
        diagnosis,
        achieved=_kept(folder, run, number, label)
        if diagnosis and diagnosis.get("shrink") is not None
        else None,
        oracle=_kept(folder, told, number, label) if known else None,
        resolved=resolved(folder, number, label),
        forgone=forgone(diagnosis, _diagnosis_of(told) if known else None),
        baseline=baselines.guess(folder / "cases" / number) if baseline and single else None,
        best_fit=_best_fit(diagnosis),
    )


def _diagnosis_of(run: Path) -> dict[str, Any] | None:
    return diagnosis_in(run) if outcome_of(run)["status"] == "done" else None


def _kept(folder: Path, run: Path, number: str, label: dict[str, Any]) -> float | None:
    """The achieved shrink of a run, replayed once and kept beside it; None where there is none to measure."""
    if not (run / "augmented.toml").exists():
        return None
    unseen = label["unseen"]
    of = result_digest(run, *unseen.values(), repr(label["floor"]))
    kept = achieved_in(run, of)
    if kept is not None:
        return kept[0]
    try:
        # what was committed to, and nothing that somebody has laid beside it
        logs = [folder / "sealed" / number / "unseen" / name for name in sorted(unseen)]
        value = achieved.shrink(run, logs, label["floor"])
    except FocgenError:
        return None
    check_within(folder, [run / "achieved.json"])
    write_file(run / "achieved.json", json.dumps(kept_achieved(value, of)))
    return value


def _best_fit(diagnosis: dict[str, Any] | None) -> str | None:
    """The effect of the lowest error on the given logs, where the diagnosis tells: ``fits`` [{effect,
    error}].
    """
    fits = (diagnosis or {}).get("fits") or ()
    return str(min(fits, key=lambda fit: fit["error"])["effect"]) if fits else None


def confusions(judged: list[Judged]) -> dict[str, dict[str, int]]:
    """What each effect of a visible single was called, most often first."""
    counts: dict[str, dict[str, int]] = {}
    for j in judged:
        if j.kind == "single" and j.visible:
            row = counts.setdefault(j.effects[0], {})
            called = j.top or j.verdict
            row[called] = row.get(called, 0) + 1
    return {k: dict(sorted(v.items(), key=lambda item: -item[1])) for k, v in sorted(counts.items())}
