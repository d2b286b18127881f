"""How far apart candidate rigs are expected to be by an experiment that all have made.

The separation of A from B is the distance of what they made in units of the noise, as far as B cannot take it
up by moving its parameters. What is known of these depends on what the experiment is diagnosed with. On the
session's columns it joins the session, which has told about them. With a further signal it stands alone: the
session lacks that column. Then only what was known ahead of all logs counts, and what the session has ruled
out comes up again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.fitting.noise import whiten
from focgen.diagnosis.hypotheses.rivals import Rival
from focgen.present import present

if TYPE_CHECKING:
    from focgen.diagnosis.hypotheses.explain import Explanation
    from focgen.diagnosis.proposals.candidate_rigs import CandidateRig

_NOISIER = 3.0  # times the output's, by level: the noise of a signal that nobody has logged yet


@dataclass(frozen=True, eq=False)
class _View:
    """A signal by which two are told apart: the ``difference`` (n,) between them, and the ``slopes`` (n, k)
    of what the second made by its parameters, both as innovations."""

    difference: np.ndarray
    slopes: np.ndarray


def in_session(e: Explanation, made: Sequence[CandidateRig]) -> np.ndarray:
    """Of the first from each of the others (k,), by the output, beside what the session has told."""
    apart = [_separation(b, [_view(e, made[0], b, None)], b.rival.fit.information) for b in made[1:]]
    return np.array(apart)


def alone(e: Explanation, made: Sequence[CandidateRig], stage: str) -> np.ndarray:
    """Of the first from each of the others (k,), with what leaves ``stage`` logged, by themselves."""
    apart = [_separation(b, _views(e, made[0], b, stage), _beforehand(b.rival.fit)) for b in made[1:]]
    return np.array(apart)


def without(e: Explanation, like: Rival) -> Rival:
    """That nothing is there in the place of ``like``: a cause not seen is not told from its rivals either."""
    return Rival("", like.stage, 0.0, 0.0, e.nominal)


def _views(e: Explanation, a: CandidateRig, b: CandidateRig, stage: str) -> list[_View]:
    """What leaves ``stage``, and the output where one of the two acts behind that: what both do ahead of it
    is judged where it is logged first, and the output does not show it a second time."""
    ahead = e.segment.stages[: e.segment.stages.index(stage) + 1]
    behind = [] if {a.rival.stage, b.rival.stage} <= set(ahead) else [_view(e, a, b, None)]
    return [_view(e, a, b, stage), *behind]


def _view(e: Explanation, a: CandidateRig, b: CandidateRig, stage: str | None) -> _View:
    difference = _innovations(e, b, stage, a.left_by(stage) - b.left_by(stage))
    return _View(difference, _columns(e, b, stage, b.slopes(stage)))


def _columns(
    e: Explanation, rig: CandidateRig, stage: str | None, slopes: Sequence[np.ndarray]
) -> np.ndarray:
    return np.stack([_innovations(e, rig, stage, slope) for slope in slopes], axis=1)


def _innovations(e: Explanation, rig: CandidateRig, stage: str | None, made: np.ndarray) -> np.ndarray:
    """A signal (n,) as innovations at the rate of the session's readings, in shares of the level by which
    noise is."""
    level = e.segment.level_out
    if stage is not None:
        level = _NOISIER * max(float(np.max(np.abs(rig.left_by(stage)))), 1e-300)
    every = max(1, round(e.segment.run.h / present(rig.run).h))  # of a slow gauge: as seldom as it is read
    return whiten(np.repeat(made[::every], rig.coarse) / level, e.ar)


def _beforehand(fit: Fit) -> np.ndarray:
    """What is known of its parameters ahead of all logs, in the unit of its information."""
    return np.diag(fit.problem.known[1] * _variance(fit))


def _variance(fit: Fit) -> float:
    return max(fit.sse / len(fit.innovations), 1e-300)


def _separation(b: CandidateRig, views: Sequence[_View], known: np.ndarray) -> float:
    """Expected standard deviations from ``b`` by all ``views``, its parameters ``known`` so well; none where
    a rig runs away from the experiment: what it would do there is not foretold."""
    difference = np.concatenate([v.difference for v in views])
    jacobian = np.concatenate([v.slopes for v in views])
    if not (np.all(np.isfinite(difference)) and np.all(np.isfinite(jacobian))):
        return 0.0
    slope = jacobian.T @ difference
    taken = slope @ np.linalg.pinv(known + jacobian.T @ jacobian) @ slope
    # what tells them apart is not the size but its square over the spread of the likelihood ratio
    return float(np.sqrt(max(float(difference @ difference - taken), 0.0) / _variance(b.rival.fit)) / 2)
