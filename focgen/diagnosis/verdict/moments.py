"""Whether the rig became another at one moment, instead of what was found.

Nothing in the library changes at once. A path through the session's time follows a load that is hung on, a
zero that jumps or a mass that is added, and so does a trend, if badly; what either foretells is wrong. With
few runs, a curve or a softening of many values follows a gain that was switched between two of them. So
whatever was found is held against the same rig with nominal parameters of their own ahead of a moment and
behind it. They are free in every piece, so that a jump of any of them is seen, and need not be named. Or one
of them alone becomes another, or the gain as a whole, which takes fewer numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from focgen.diagnosis.fitting.fit import Weighing
from focgen.diagnosis.hypotheses.explain import Explanation
from focgen.diagnosis.problem.segments import Segment
from focgen.diagnosis.verdict.instead import Instead, bases, gone, is_likelier, odds_over
from focgen.diagnosis.verdict.pieces import Pieces, pieces

_NO_MATTER = -5  # log odds: of what is promised less, nothing hangs on a simulation


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


@dataclass(frozen=True, eq=False)
class Changed(Instead):
    """How a segment became another, ``cut`` into pieces."""

    cut: Pieces

    @property
    def may_be(self) -> str:
        """As of :class:`Instead`."""
        where = (
            f"{m.within:.4g} s into {m.experiment} by {m.rms:.3g} (root mean square; on average "
            f"{m.mean:+.3g})"
            for m in self.moments
        )
        return (
            f"it may be ({self.sure:.0%}) that at once it becomes another: {', '.join(where)}; "
            "diagnose the parts by themselves"
        )

    @cached_property
    def moments(self) -> tuple[Moment, ...]:
        """What becomes another at each of the cuts."""
        segment = self.cut.of_fit.problem.segment
        changes = self.cut.changes()
        return tuple(_moment(segment, sample, by) for sample, by in changes)


@lru_cache(maxsize=16)
def changed_at_once(e: Explanation) -> Changed | None:
    """How likely the rig became another at up to three moments instead of what was found, or of one part of
    it. None where its session is too short for that, or where a rounding was found."""
    weighing = Weighing(e.ar)
    promised = [_judged(e, cut) for base in bases(e) for cut in pieces(base, weighing)]
    best: Changed | None = None
    for changed in sorted(promised, key=lambda c: -c.odds):
        if best is not None and changed.odds <= max(best.odds, _NO_MATTER):
            break
        kept = _judged(e, changed.cut.simulated(weighing)) if changed.odds > _NO_MATTER else changed
        best = max(kept, best or kept, key=lambda c: c.odds)
    return best


def another(e: Explanation) -> Changed | None:
    """What changed at once, where that is likelier than what was found."""
    changed = changed_at_once(e)
    return changed if is_likelier(changed) else None


def _judged(e: Explanation, cut: Pieces) -> Changed:
    """What is cut so, held against what was found."""
    base = cut.of_fit
    return Changed(gone(e, base), odds_over(e, base, cut.square, cut.free, cut.things), cut)


def _moment(segment: Segment, sample: int, by: np.ndarray) -> Moment:
    """The moment of a sample from which on the output differs ``by`` so much."""
    number, (first, _) = next((i, s) for i, s in enumerate(segment.run.spans) if sample < s[1])
    within = (sample - first) * segment.run.h
    rms = float(np.sqrt(np.mean(by**2)))
    return Moment(float(segment.run.clock[sample]), segment.names[number], within, float(np.mean(by)), rms)
