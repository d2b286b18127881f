"""What a diagnosis of a foreign rig is worth, and the table of many."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focgen.diagnosis.diagnose import diagnose
from focgen.rig.replay import replay
from tests.foreign.cases import Case, case
from tests.foreign.forms import STAGE

SURE = 0.9


@dataclass(frozen=True)
class Judged:
    """``causes``: (family, confidence) of the candidates of each cause found; ``promised`` and ``achieved``:
    the shrink on the unseen logs, None where there is none to measure."""

    signals: str
    seed: int
    truth: str | None
    severity: float
    verdict: str
    causes: list[list[tuple[str, float]]]
    stage: str | None
    promised: float | None
    achieved: float | None
    notes: list[str]

    @property
    def first(self) -> tuple[str, float] | None:
        """The foremost candidate."""
        return self.causes[0][0] if self.causes else None

    @property
    def right(self) -> bool:
        """Whether that is what is true."""
        return self.first is not None and self.first[0] == self.truth

    @property
    def wrong_and_sure(self) -> bool:
        """Whether any family that is not true stands above 0.9."""
        return any(name != self.truth and sure > SURE for cause in self.causes for name, sure in cause)


def judged(seed: int, signals: str, truth: str | None, severity: float, exact: bool = False) -> Judged:
    """Make the case, diagnose it, and hold the promise against the unseen logs."""
    made = case(seed, signals, truth, severity, exact)
    with tempfile.TemporaryDirectory() as folder:
        found = diagnose(made.rig, made.logs, folder, pictures=False)
        achieved = _achieved(made, folder) if found.causes else None
    causes = [[(c.effect, round(c.confidence, 3)) for c in f.candidates] for f in found.causes]
    promised = None if achieved is None else found.shrink
    return Judged(
        signals, seed, truth, severity, found.verdict, causes, found.where.stage, promised, achieved,
        [n for n in found.notes if "refit" in n],
    )  # fmt: skip


def _achieved(made: Case, folder: str) -> float | None:
    """The part of the gap above the noise that closes; None where it is less than a tenth of the noise's."""
    before, after = (
        np.mean([one.rmse**2 for one in replay(f"{folder}/{name}.toml", made.unseen).logs.values()])
        for name in ("refitted", "augmented")
    )
    gap = before - made.floor**2
    return None if gap < 0.1 * made.floor**2 else float((before - after) / gap)


def table(found: Sequence[Judged]) -> str:
    """The scores by signal set, as a Markdown table."""
    sets = list(dict.fromkeys(j.signals for j in found))
    columns = [_scores([j for j in found if j.signals == s]) for s in sets]
    lines = [f"| score | {' | '.join(sets)} |", "|---" * (len(sets) + 1) + "|"]
    for name in columns[0]:
        lines.append(f"| {name} | " + " | ".join(c[name] for c in columns) + " |")
    return "\n".join(lines)


def _scores(found: Sequence[Judged]) -> dict[str, str]:
    singles, sound = [j for j in found if j.truth], [j for j in found if not j.truth]
    right = [j for j in singles if j.right]
    kept = [j for j in singles if j.promised is not None]
    return {
        "top-1 effect": _part(right, singles),
        "stage": _part([j for j in singles if j.stage == STAGE[j.truth]], singles),
        "`parameters` or `none`": _part([j for j in singles if j.verdict in ("parameters", "none")], singles),
        "`unknown`": _part([j for j in singles if j.verdict == "unknown"], singles),
        "wrong above 0.9": _part([j for j in found if j.wrong_and_sure], found),
        "right first names above 0.9": _part([j for j in right if j.first[1] > SURE], right),
        "causes too many": _part([c for j in singles for c in j.causes[1:]], singles),
        "false alarms": _part([j for j in sound if j.causes or j.verdict == "unknown"], sound),
        "promise within 0.10": _part([j for j in kept if abs(j.promised - j.achieved) <= 0.1], kept),
    }


def _part(some: Sequence, of: Sequence) -> str:
    return f"{len(some) / len(of):.2f} ({len(some)}/{len(of)})" if of else "–"
