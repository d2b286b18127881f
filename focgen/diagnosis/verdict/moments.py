"""Whether the rig became another at one moment, where a slow change of it, or of its reading, was found.

Nothing in the library changes at once. A path through the session's time follows a load that is hung on, a
zero that jumps or a mass that is added, and so does a trend, if badly; what either foretells is wrong. So
what moves with the session's clock is held against the same rig with nominal parameters of their own ahead
of a moment and behind it. They are free in every piece, so that a jump of any of them is seen, and need not
be named. The fit's derivatives are known at every sample, so a piece takes a linear equation (G. C. Chow,
Tests of equality between sets of coefficients in two linear regressions, Econometrica 28, 1960), and the best
moments are found among all by dynamic programming (R. Bellman, Communications of the ACM 4, 1961).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from focgen.diagnosis.belief.likelihood import Scale, log_likelihood, paid
from focgen.diagnosis.fitting.fit import FIXED, WHITE, Fit, Weighing, innovations, jacobian, square_by
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.hypotheses.rivals import left_out
from focgen.diagnosis.numbers import NUMBERS
from focgen.diagnosis.problem.problem import Problem
from focgen.diagnosis.problem.segments import Segment
from focgen.rig.effects import Form

_CELLS = 200  # of a session, between which a moment may lie
_MOST = 3  # moments
_SHORTEST = 4  # cells between two of them


@dataclass(frozen=True)
class Moment:
    """``at``: s on the session's clock; ``within``: s since its ``experiment`` began. What leaves the segment
    is another from there on, until the next moment: by ``mean``, and root mean square ``rms``, in its
    unit."""

    at: float
    experiment: str
    within: float
    mean: float
    rms: float


@dataclass(frozen=True)
class Changed:
    """The ``moments`` at which a segment became another, and the log ``odds`` of that over what was found."""

    moments: tuple[Moment, ...]
    odds: float

    @property
    def sure(self) -> float:
        """How likely it is, if it is that or what was found."""
        return float(1.0 / (1.0 + np.exp(-np.clip(self.odds, -50.0, 50.0))))


def is_timed(form: Form) -> bool:
    """Whether a form moves with the session's clock."""
    return any(p.clock == "session" for p in form.parameters)


@lru_cache(maxsize=16)
def changed_at_once(e: Explanation) -> Changed | None:
    """How likely the rig became another at up to three moments instead of what was found; None where that is
    something that does not move with the session's clock, and leaves nothing that inputs predict."""
    timed = [c for c in e.best.problem.candidates if is_timed(c.form)]
    if e.causes and not timed and e.predictability.share < NUMBERS.left:
        return None
    bases = [_Pieces.of(e.nominal, e)]
    if 0 < len(timed) < len(e.best.problem.candidates):
        bases.append(_Pieces.of(left_out(e.best, timed, Weighing(e.ar)), e))
    found = [_judged(e, base, cuts) for base in bases for cuts in base.best()]
    return max((c for c in found if c is not None), key=lambda c: c.odds, default=None)


def another(e: Explanation) -> Changed | None:
    """What changed at once, where that is likelier than what was found."""
    changed = changed_at_once(e)
    return changed if changed is not None and changed.odds > 0.0 else None


@dataclass(frozen=True, eq=False)
class _Pieces:
    """A fit whose parameters may be others in every piece of the session. By cell's end: ``normal``
    (cells + 1, k, k), ``slope`` (cells + 1, k) and ``square`` (cells + 1,), sums up to there of what its
    innovations and their derivatives make; ``ridge`` (k,): what is known of the nuisances beforehand;
    ``ends`` (cells + 1,) the cells' in samples."""

    of_fit: Fit
    free: np.ndarray
    ends: np.ndarray
    normal: np.ndarray
    slope: np.ndarray
    square: np.ndarray
    ridge: np.ndarray

    @classmethod
    def of(cls, fit: Fit, e: Explanation) -> _Pieces:
        problem, weighing = fit.problem, Weighing(e.ar)
        low, high = problem.bounds()
        now, free = innovations(problem, fit.vector, weighing), np.flatnonzero(high - low > FIXED)
        rows = jacobian(problem, fit.vector, now, weighing, low, high)[free]
        ends = np.linspace(0, len(now), min(_CELLS, len(now) // 10) + 1).astype(int)
        cells = [(rows[:, a:b], now[a:b]) for a, b in pairwise(ends)]
        normal = _summed([r @ r.T for r, _ in cells])
        ridge = _known(problem)[free] * float(now @ now) / len(now)
        ridge = ridge + 1e-9 * np.trace(normal[-1])
        slope, square = _summed([r @ x for r, x in cells]), _summed([np.array(x @ x) for _, x in cells])
        return cls(fit, free, ends, normal, slope, square, ridge)

    def solved(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of pieces from cells ``a`` to cells ``b`` (m,): what their parameters are less (m, k), and the sums
        of squares that they leave (m,)."""
        normal = self.normal[b] - self.normal[a] + np.diag(self.ridge)
        slope = self.slope[b] - self.slope[a]
        moved = np.linalg.solve(normal, slope[..., None])[..., 0]
        return moved, self.square[b] - self.square[a] - np.sum(moved * slope, axis=1)

    def best(self) -> list[tuple[float, tuple[int, ...]]]:
        """For one moment, two and three: the least sum of squares, and the cells at whose beginning they
        are."""
        count = len(self.ends) - 1
        a, b = np.triu_indices(count + 1, _SHORTEST)
        cost = np.full((count + 1, count + 1), np.inf)
        cost[a, b] = self.solved(a, b)[1]
        least, places = cost[0], [()] * (count + 1)
        found: list[tuple[float, tuple[int, ...]]] = []
        for _ in range(_MOST):
            ways = least[:, None] + cost
            last = np.argmin(ways, axis=0)
            least, places = np.min(ways, axis=0), [(*places[i], int(i)) for i in last]
            found.append((float(least[-1]), places[-1]))
        return found


def _known(problem: Problem) -> np.ndarray:
    """The inverse variances (k,) of what is known of the parameters: nothing of those of the rig, for what
    was known holds no more behind a moment."""
    known = problem.known[1].copy()
    known[: len(problem.nominal_start)] = 0.0
    return known


def _summed(parts: list[np.ndarray]) -> np.ndarray:
    """Sums of the parts ahead of each end."""
    made: np.ndarray = np.concatenate([np.zeros((1, *parts[0].shape)), np.cumsum(parts, axis=0)])
    return made


def _judged(e: Explanation, base: _Pieces, best: tuple[float, tuple[int, ...]]) -> Changed | None:
    """The odds of pieces cut so over what was found; None where they cannot be cut."""
    square, cuts = best
    if not np.isfinite(square):
        return None
    weighing = Weighing(e.ar)
    before, after = (square_by(f, weighing) for f in (e.nominal, e.best))
    floor = max(min(after * (1.0 - e.predictability.share), square), 1e-300)
    count = len(e.segment.y)
    families = len(e.best.problem.families)
    others = len(base.of_fit.problem.families)
    size = len(cuts) * (len(base.free) + 1) + base.of_fit.size
    found = _log_odds(before, after, floor, count, e.best.size, families)
    cut = _log_odds(before, square, floor, count, size, others + len(cuts))
    return Changed(_told(base, cuts), cut - found)


def _log_odds(before: float, left: float, floor: float, count: int, free: int, things: int) -> float:
    """Of ``things`` found, each as rare as any, that leave the sum of squares ``left`` of ``before``."""
    unit = 0.5 * count / floor
    misfit, gained = max(left - floor, 0.0) * unit, max(before - left, 0.0) * unit
    scale = Scale(0.5 * count * NUMBERS.other).of(gained)
    prior = things * float(np.log(NUMBERS.rare))
    return log_likelihood(misfit, scale) - paid(free, gained, misfit, scale) + prior


def _told(base: _Pieces, cuts: tuple[int, ...]) -> tuple[Moment, ...]:
    """What becomes another at each of the cuts."""
    problem, vector = base.of_fit.problem, base.of_fit.vector
    low, high = problem.bounds()
    rows = jacobian(problem, vector, innovations(problem, vector, WHITE), WHITE, low, high)[base.free]
    edges = [0, *cuts, len(base.ends) - 1]
    moved, _ = base.solved(np.array(edges[:-1]), np.array(edges[1:]))
    found = []
    for i, cut in enumerate(cuts):
        first, last = base.ends[[cut, edges[i + 2]]]
        by = problem.segment.level_out * ((moved[i + 1] - moved[i]) @ rows[:, first:last])
        found.append(_moment(problem.segment, int(first), by))
    return tuple(found)


def _moment(segment: Segment, sample: int, by: np.ndarray) -> Moment:
    """The moment of a sample from which on the output differs ``by`` so much."""
    number, (first, _) = next((i, s) for i, s in enumerate(segment.run.spans) if sample < s[1])
    within = (sample - first) * segment.run.h
    rms = float(np.sqrt(np.mean(by**2)))
    return Moment(float(segment.run.clock[sample]), segment.names[number], within, float(np.mean(by)), rms)
