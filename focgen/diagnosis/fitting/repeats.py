"""What was done to the rig again, later in the session: there, and only there, time shows by itself.

Whatever an effect makes of the input, it makes again of the same input; what depends on the session's past as
well, as softening, is held against it there. A path through time with free values may follow anything that
differs from experiment to experiment. So it counts as a drift only if it explains how repeats differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import Fit
from focgen.diagnosis.problem.segments import Segment

_CELL = 0.25  # of the response: stretches over which means are taken,
_MOST = 800  # and how many of them at most
_PAST = (1, 3, 12, 48, 192, 768)  # ends, in cells back, of the pieces of the past that have to be alike, too:
# as far back as what creeps remembers, which is much longer than the rig itself
_ALIKE = 0.04  # of the input's range: what counts as the same
_LATER = 0.2  # of the session: what counts as later
_FEW = 8  # repeated cells: fewer tell nothing
_MOVED = 0.25  # of the most that a path makes anywhere: from there a repeat tells whether it is there
_SHOWN = 0.5  # of the mean square by which repeats differ: a path that is there explains as much,
_AS_WELL = 0.8  # and a family that explains this part of that
_CLOSES = 0.6  # and closes this part of the gap is as likely
_ONE_SENSE = 0.97  # of the gap that a path closes: a trend of one sense that closes as much goes before it


@dataclass(frozen=True, eq=False)
class Repeats:
    """Pairs of cells of a segment: ``again`` (m, k) takes from the mean of each repeat that of what it
    repeats, of cells' means (k,); ``count`` samples to a cell."""

    again: np.ndarray
    cells: tuple[tuple[int, int], ...]

    def changes(self, of: Fit) -> np.ndarray:
        """By how much more the residual of ``of`` is at every repeat (m,), as a share of the level."""
        made: np.ndarray = self.again @ _means(of.weighed, self.cells)
        return made


def without_hearsay(ground: Fit, tried: Sequence[Fit]) -> list[Fit]:
    """``tried`` without the paths through time that no repeat shows, and without those beside which another
    family explains as much."""
    if not any(_wanders(t) for t in tried):
        return list(tried)
    segment = ground.problem.segment
    repeats = repeats_of(segment, ground.problem.references.clocks["response"])
    return [t for t in tried if not _wanders(t) or _is_shown(repeats, ground, t, tried)]


def _wanders(of: Fit) -> bool:
    return of.problem.candidates[-1].form.wanders


def _is_shown(repeats: Repeats, ground: Fit, path: Fit, tried: Sequence[Fit]) -> bool:
    """Whether repeats differ as the path says, and nothing else says so as well."""
    before, after = repeats.changes(ground), repeats.changes(path)
    most = np.max(np.abs(_means(ground.weighed - path.weighed, repeats.cells)))
    moved = np.abs(before - after) > _MOVED * most
    if np.sum(moved) < _FEW:
        return False
    explained = _explained(before[moved], after[moved])

    def says_as_much(other: Fit) -> bool:
        closes = (ground.sse - other.sse) / (ground.sse - path.sse)
        if closes < (_ONE_SENSE if _family(other) == _family(path) else _CLOSES):
            return False
        return _explained(before[moved], repeats.changes(other)[moved]) > _AS_WELL * explained

    return explained > _SHOWN and not any(says_as_much(t) for t in tried if not _wanders(t))


def _family(of: Fit) -> str:
    return of.problem.candidates[-1].effect


def _explained(before: np.ndarray, after: np.ndarray) -> float:
    return 1.0 - float(np.sum(after**2)) / max(float(np.sum(before**2)), 1e-300)


@lru_cache(maxsize=4)
def repeats_of(segment: Segment, response: float) -> Repeats:
    """The repeats in a segment of a rig that responds in ``response`` s: cells whose input, and the input
    before it, was alike a good part of the session earlier. What precedes an experiment is its rest."""
    cells = _cells(segment, response)
    mean = _means(segment.asked, cells)
    past = _pasts(mean, segment, cells)
    middle = np.array([segment.run.clock[(a + b) // 2] for a, b in cells])
    apart = _LATER * float(np.ptp(segment.run.clock))
    earlier = middle[:, None] - middle[None] > apart
    for piece in past.T:
        earlier &= np.abs(piece[:, None] - piece[None]) < _ALIKE * max(float(np.ptp(mean)), 1e-12)
    repeated = np.flatnonzero(earlier.any(axis=1))
    again = np.eye(len(cells))[repeated] - earlier[repeated] / earlier[repeated].sum(axis=1, keepdims=True)
    return Repeats(again, cells)


def _cells(segment: Segment, response: float) -> tuple[tuple[int, int], ...]:
    """First sample and the one after the last of every cell; none spans two experiments."""
    count = max(int(_CELL * response / segment.run.h), len(segment.y) // _MOST, 1)
    starts = (a for first, last in segment.run.spans for a in range(first, last - count + 1, count))
    return tuple((a, a + count) for a in starts)


def _means(signal: np.ndarray, cells: Sequence[tuple[int, int]]) -> np.ndarray:
    total = np.r_[0.0, np.cumsum(signal)]
    return np.array([(total[b] - total[a]) / (b - a) for a, b in cells])


def _pasts(mean: np.ndarray, segment: Segment, cells: Sequence[tuple[int, int]]) -> np.ndarray:
    """The input's mean in each cell and in the pieces before it (k, 1 + pieces)."""
    ends = np.searchsorted([a for a, _ in cells], [last for _, last in segment.run.spans])
    rows, first = [], 0
    for end, (begin, _) in zip(ends, segment.run.spans):
        before = 0.0 if segment.run.rest[begin] == 1 else segment.asked[begin]
        padded = np.r_[np.full(_PAST[-1], before), mean[first:end]]
        total = np.r_[0.0, np.cumsum(padded)]
        here = np.arange(_PAST[-1], len(padded))
        pieces = [(total[here - a] - total[here - b]) / (b - a) for a, b in zip((0, *_PAST), _PAST)]
        rows.append(np.stack([mean[first:end], *pieces], axis=1))
        first = end
    return np.concatenate(rows)
